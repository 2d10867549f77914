//! What is left when nothing can be named: what of everything recorded it goes with, and in what shape.

use plumb_diagnosis::Verdict;
use plumb_diagnosis::laboratory::Options;
use plumb_estimation::Progress;
use plumb_report::{alike_in_words, diagnosis_sentence, rest_in_words};

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

/// Positions of the column arm whose point is pushed aside by something that depends on the hall's humidity.
fn table(push: &dyn Fn(f64) -> f64, seed: u64) -> String {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm,humidity,door\n".to_owned();
    for q in column_poses(120, seed) {
        let (humidity, door) = (rng.between(20.0, 60.0), rng.unit().round());
        let [x, y, z] = column_tip(q).map(|part| part + rng.noise(0.02));
        let y = y + push(humidity);
        text.push_str(&format!("{},{},{},{x},{y},{z},{humidity},{door}\n", q[0], q[1], q[2]));
    }
    text
}

fn model() -> String {
    format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: 0.02}}\n")
}

#[test]
fn what_a_column_of_the_users_own_goes_with_is_reported_with_its_shape() {
    for seed in 41..44 {
        let steady = table(&|humidity| 0.004 * (humidity - 40.0), seed);
        let diagnosis =
            laboratory(&model(), &steady, Options::default()).diagnose(&Progress::unwatched()).unwrap();
        let remaining = &diagnosis.remaining;
        assert!(
            matches!(diagnosis.verdict, Verdict::Unknown | Verdict::Located),
            "{}",
            diagnosis_sentence(&diagnosis)
        );
        assert_eq!(remaining.covariates, ["humidity"], "seed {seed}: {remaining:?}");
        let shape = rest_in_words(remaining);
        assert!(shape.contains("along y it changes steadily with humidity"), "{shape}");
        let jump = table(&|humidity| if humidity > 42.0 { 0.12 } else { 0.0 }, seed);
        let diagnosis =
            laboratory(&model(), &jump, Options::default()).diagnose(&Progress::unwatched()).unwrap();
        let shape = rest_in_words(&diagnosis.remaining);
        assert!(shape.contains("along y it jumps by 0.1") && shape.contains("at humidity 4"), "{shape}");
    }
}

#[test]
fn effects_that_move_the_readings_alike_are_reported_with_how_much_alike() {
    let mut rng = Xorshift::seeded(51);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for _ in 0..100 {
        // The elbow hardly moves: what a wrong gain does there, a longer link before it does as well.
        let q = [rng.between(-150.0, 150.0), rng.between(-20.0, 100.0), rng.between(-70.0, -45.0)];
        let [x, y, z] = column_tip([q[0], q[1], q[2] * 1.005]).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{},{},{},{x},{y},{z}\n", q[0], q[1], q[2]));
    }
    let diagnosis = laboratory(&model(), &text, Options::default()).diagnose(&Progress::unwatched()).unwrap();
    let mut alike = diagnosis.alike.iter().map(alike_in_words);
    let message = alike.find(|alike| alike.contains("joint_gain(elbow)"));
    let message =
        message.unwrap_or_else(|| panic!("{:?}: {}", diagnosis.alike, diagnosis_sentence(&diagnosis)));
    assert!(
        message.contains("link_length(shoulder)") && message.contains("canonical correlation 0.9"),
        "{message}"
    );
}

#[test]
fn a_column_of_words_is_reported_by_its_words_and_no_level_is_left_out() {
    let mut rng = Xorshift::seeded(61);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm,fixture\n".to_owned();
    for (row, q) in column_poses(150, 61).into_iter().enumerate() {
        let (fixture, shift) = [("left", 0.0), ("right", 0.6), ("rear", -0.6)][row % 3];
        let [x, y, z] = column_tip(q).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{},{},{},{},{y},{z},{fixture}\n", q[0], q[1], q[2], x + shift));
    }
    let diagnosis = laboratory(&model(), &text, Options::default()).diagnose(&Progress::unwatched()).unwrap();
    let remaining = &diagnosis.remaining;
    assert_eq!(remaining.covariates.first().map(String::as_str), Some("fixture"), "{remaining:?}");
    let shape = rest_in_words(remaining);
    assert!(shape.contains("between fixture right and rear"), "{shape}");
    assert!(shape.contains("left ") && shape.contains("right 0.") && shape.contains("rear -0."), "{shape}");
}
