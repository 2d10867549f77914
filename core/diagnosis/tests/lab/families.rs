//! Families of harmonics are taken in at one go, and what would not hold elsewhere is said.

use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

/// Joint (from 0), periods a turn, amplitude in degrees.
const WHEELS: [(usize, f64, f64); 4] = [(0, 9.0, 0.03), (1, 12.0, 0.025), (2, 7.0, 0.04), (0, 20.0, 0.015)];

fn table(rows: usize) -> String {
    table_with(rows, |_| 0.0)
}

/// The same, where the elbow is besides off by so much (deg) at an angle (deg).
fn table_with(rows: usize, elbow: impl Fn(f64) -> f64) -> String {
    let mut rng = Xorshift::seeded(31);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for q in column_poses(rows, 31) {
        let mut really = q;
        for (joint, order, amplitude) in WHEELS {
            really[joint] += amplitude * (order * q[joint].to_radians() + 0.4).sin();
        }
        really[2] += elbow(q[2]);
        let [x, y, z] = column_tip(really).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{:.5},{:.5},{:.5},{x:.5},{y:.5},{z:.5}\n", q[0], q[1], q[2]));
    }
    text
}

#[test]
fn what_a_batch_takes_in_does_no_harm_where_nothing_was_measured() {
    let model = format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: 0.02}}\n");
    // A cable that comes tight: no wave, but waves of low order follow it inside the rows.
    let tight = |q: f64| 0.002 * (q + 60.0).max(0.0);
    let holdout = Holdout::Random { fraction: 0.3, seed: 1 };
    let laboratory = laboratory(&model, &table_with(640, tight), Options { holdout, ..Options::default() });
    let growth = laboratory.grow(&Progress::unwatched()).unwrap();
    let high =
        growth.steps.iter().filter(|step| step.added.effect.n.is_some_and(|order| order > 4.0)).count();
    assert!(high >= WHEELS.len(), "{:?}", growth.steps);
    assert_eq!(growth.extrapolation.len(), 8);
    for way in &growth.extrapolation {
        assert!(!way.harmful(), "{way:?} of {:?}", growth.extrapolation);
    }
    assert!(growth.diagnosis.warnings.is_empty(), "{:?}", growth.diagnosis.warnings);
}

#[test]
fn a_family_of_harmonics_is_found_at_one_go_and_holds_on_rows_not_fitted() {
    let model = format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: 0.02}}\n");
    let holdout = Holdout::Random { fraction: 0.3, seed: 1 };
    let laboratory = laboratory(&model, &table(640), Options { holdout, ..Options::default() });
    let growth = laboratory.grow(&Progress::unwatched()).unwrap();
    let names = ["waist", "shoulder", "elbow"];
    for (joint, order, amplitude) in WHEELS {
        let found = growth
            .steps
            .iter()
            .find(|step| step.added.effect.site == names[joint] && step.added.effect.n == Some(order));
        let found =
            found.unwrap_or_else(|| panic!("{} n = {order} is not among {:?}", names[joint], growth.steps));
        assert!((found.added.size - amplitude).abs() < 0.003, "{:?} for {amplitude}", found.added);
    }
    assert!(growth.steps.len() <= WHEELS.len() + 1, "{:?}", growth.steps);
    let held_out = growth.diagnosis.rms_mm.check.unwrap();
    assert!(held_out < 0.042, "{held_out}");
    assert!(growth.start.fit > 0.1, "{:?}", growth.start);
    // The error falls from step to step, and what was left out is reported beside.
    let reductions: Vec<f64> = growth.steps.iter().map(|step| step.rms_mm.fit).collect();
    assert!(reductions.windows(2).all(|pair| pair[1] < pair[0]), "{reductions:?}");
    let ways: Vec<&str> = growth.extrapolation.iter().map(|way| way.left_out.as_str()).collect();
    assert_eq!(&ways[..2], ["regions", "time:0.3"]);
    assert!(growth.steps.last().unwrap().model.is_some());
}

#[test]
fn a_machine_without_a_family_is_not_given_one() {
    let model = format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: 0.02}}\n");
    let mut rng = Xorshift::seeded(32);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for q in column_poses(600, 32) {
        let [x, y, z] = column_tip(q).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{:.5},{:.5},{:.5},{x:.5},{y:.5},{z:.5}\n", q[0], q[1], q[2]));
    }
    let growth = laboratory(&model, &text, Options::default()).grow(&Progress::unwatched()).unwrap();
    assert!(growth.steps.is_empty(), "{:?}", growth.steps);
    assert!(growth.diagnosis.warnings.is_empty(), "{:?}", growth.diagnosis.warnings);
}
