//! A known effect among structure that no effect of the library describes: it is named, and how much of the rest is not explained is said.

use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{Diagnosis, Verdict};
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

/// Degrees by which shoulder and elbow are off for reasons that no effect describes: the angles of waist and elbow at once, in waves of no whole number a turn.
fn unknown(q: [f64; 3]) -> [f64; 2] {
    let [first, _, third] = q.map(f64::to_radians);
    [0.025 * (2.3 * first + 1.7 * third).sin(), 0.03 * (1.4 * third - 2.1 * first).cos()]
}

/// The column arm measured with unknown structure, and with whatever is `hidden`: what each joint is off by, degrees, from its row, pose and last move.
fn diagnosis(seed: u64, hidden: impl Fn(usize, [f64; 3], [f64; 3]) -> [f64; 3]) -> Diagnosis {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    let mut before = None;
    for (row, q) in column_poses(160, seed).into_iter().enumerate() {
        let moved =
            before.map_or([0.0; 3], |last: [f64; 3]| [q[0] - last[0], q[1] - last[1], q[2] - last[2]]);
        let (structure, off) = (unknown(q), hidden(row, q, moved));
        let really = [q[0] + off[0], q[1] + off[1] + structure[0], q[2] + off[2] + structure[1]];
        let [x, y, z] = column_tip(really).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{},{},{},{x},{y},{z}\n", q[0], q[1], q[2]));
        before = Some(q);
    }
    let model = format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: 0.02}}\n");
    let options = Options { holdout: Holdout::None, ..Options::default() };
    laboratory(&model, &text, options).diagnose(&Progress::unwatched()).unwrap()
}

fn named(diagnosis: &Diagnosis) -> (&str, &str) {
    let named = diagnosis.named.as_ref().unwrap_or_else(|| panic!("{}", diagnosis_sentence(diagnosis)));
    (named.effect.effect.as_str(), named.effect.site.as_str())
}

#[test]
fn play_is_named_from_the_way_of_each_row_where_no_sides_are_logged() {
    let diagnosis = diagnosis(5, |_, _, moved| [0.0, 0.0, -0.05 * moved[2].signum()]);
    assert_eq!(named(&diagnosis), ("joint_backlash", "elbow"));
    let size = diagnosis.named.as_ref().unwrap().size;
    assert!((size - 0.1).abs() < 0.02, "{size}");
    assert!(diagnosis.left_unexplained_mm.unwrap() > 0.04, "{}", diagnosis_sentence(&diagnosis));
}

#[test]
fn a_coupling_is_named_beside_a_jump_of_another_joint_and_unknown_structure() {
    let diagnosis = diagnosis(7, |row, q, _| [0.002 * q[1], if row < 70 { 0.0 } else { 0.03 }, 0.0]);
    assert_eq!(named(&diagnosis), ("joint_coupling", "waist"));
    assert!(
        diagnosis_sentence(&diagnosis).contains("of the rest is not explained yet"),
        "{}",
        diagnosis_sentence(&diagnosis)
    );
}

#[test]
fn structure_alone_gets_no_name() {
    for seed in 0..4 {
        let diagnosis = diagnosis(seed, |_, _, _| [0.0; 3]);
        assert_ne!(diagnosis.verdict, Verdict::Named, "{}", diagnosis_sentence(&diagnosis));
    }
}
