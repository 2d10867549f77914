//! How much of what a model leaves could be explained: asked of every kind of measurement, of columns of the user's own, and of noise.

use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{Explainable, Verdict};
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

const Q: &str = "q1_deg,q2_deg,q3_deg";
const KNOWN: &str =
    "base: {free: false}\ntargets: {p1: {free: false}}\nmeasured_from: world\nfree: [joint_zero(elbow)]\n";

/// Asks a table whose rows are made of a pose and of how far the elbow is off there, deg.
fn ask(
    rest: &str,
    columns: &str,
    bend: f64,
    read: impl Fn([f64; 3], &mut Xorshift) -> String,
) -> Explainable {
    let mut rng = Xorshift::seeded(31);
    let mut table = format!("{Q},{columns}\n");
    for q in column_poses(150, 31) {
        let truth = [q[0], q[1], q[2] + bend * (3.0 * q[2].to_radians()).sin()];
        table.push_str(&format!("{},{},{},{}\n", q[0], q[1], q[2], read(truth, &mut rng)));
    }
    let options = Options { holdout: Holdout::None, ..Options::default() };
    let laboratory = laboratory(&format!("{COLUMN_ARM}{KNOWN}{rest}"), &table, options);
    laboratory.explainable(&Progress::unwatched()).unwrap().unwrap()
}

fn holds(read: impl Fn([f64; 3], &mut Xorshift) -> String + Copy, rest: &str, columns: &str, noise: f64) {
    let bent = ask(rest, columns, 0.3, read);
    assert_eq!(bent.kinds(), ["pose"], "{columns}: {bent:?}");
    assert!(bent.left_mm > 2.0 * noise && bent.not_predictable_mm < 1.4 * noise, "{columns}: {bent:?}");
    let sound = ask(rest, columns, 0.0, read);
    assert!(!sound.is_structured(), "{columns}: {sound:?}");
    assert!((0.85..1.2).contains(&(sound.left_mm / noise)), "{columns}: {sound:?}");
}

#[test]
fn a_bend_is_predictable_whatever_measures_it_and_noise_is_not() {
    let point = |q: [f64; 3], rng: &mut Xorshift| {
        column_tip(q).map(|part| format!("{:.6}", part + rng.noise(0.05))).join(",")
    };
    holds(point, "", "p1_x_mm,p1_y_mm,p1_z_mm", 0.05 * 3.0_f64.sqrt());
    let tilt = |q: [f64; 3], rng: &mut Xorshift| format!("{:.6}", -(q[1] + q[2]) + rng.noise(0.02));
    holds(tilt, "level: {after: elbow, rpy_deg: [-90, 0, 0]}\n", "tilt_y_deg", 0.02);
    let height = |q: [f64; 3], rng: &mut Xorshift| format!("{:.6},table", column_tip(q)[2] + rng.noise(0.05));
    holds(height, "surfaces: {table: {plane: {normal: [0, 0, 1], offset_mm: 0}}}\n", "height_mm,on", 0.05);
}

#[test]
fn a_column_of_words_is_a_group_of_its_own_and_diagnose_reports_it_where_nothing_is_named() {
    let mut rng = Xorshift::seeded(61);
    let mut text = format!("{Q},p1_x_mm,p1_y_mm,p1_z_mm,fixture\n");
    for (row, q) in column_poses(150, 61).into_iter().enumerate() {
        let (fixture, shift) = [("left", 0.0), ("right", 0.6), ("rear", -0.6)][(row * row + row / 3) % 3];
        let [x, y, z] = column_tip(q).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{},{},{},{},{y},{z},{fixture}\n", q[0], q[1], q[2], x + shift));
    }
    let model = format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: 0.02}}\n");
    let laboratory = laboratory(&model, &text, Options::default());
    let diagnosis = laboratory.diagnose_in_full(&Progress::unwatched()).unwrap();
    assert!(
        matches!(diagnosis.verdict, Verdict::Unknown | Verdict::Located),
        "{}",
        diagnosis_sentence(&diagnosis)
    );
    let explainable = diagnosis.explainable.unwrap();
    assert_eq!(explainable.kinds(), ["`fixture`"], "{explainable:?}");
    assert!(explainable.not_predictable_mm < 0.045, "{explainable:?}");
    let json = serde_json::to_value(&explainable).unwrap();
    let fixture =
        json["groups"].as_array().unwrap().iter().find(|group| group["group"] == "`fixture`").unwrap();
    assert!(fixture["beyond_others_mm"].as_f64().unwrap() > 0.3, "{json}");
}
