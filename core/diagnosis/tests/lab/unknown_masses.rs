//! An arm whose maker publishes no masses sags all the same: simulated with masses that the model never sees.

use plumb_diagnosis::Verdict;
use plumb_diagnosis::laboratory::Options;
use plumb_estimation::Progress;
use plumb_report::{diagnosis_sentence, note_in_words, why_held_in_words};

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

const NOISE: f64 = 0.02;

/// Sag of the shoulder, deg: a soft gear under the weights of two links (N m by hand: 9 kg at 120 mm of the upper arm, 5 kg at 90 mm of the lower one).
fn sag(q: [f64; 3]) -> f64 {
    let (upper, lower) = (q[1].to_radians(), (q[1] + q[2]).to_radians());
    let moment = 9.80665 * (9.0 * 0.120 * upper.cos() + 5.0 * (0.200 * upper.cos() + 0.090 * lower.cos()));
    (-8.0e-5 * moment).to_degrees()
}

fn table(rows: usize, seed: u64) -> String {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for q in column_poses(rows, seed) {
        let [x, y, z] = column_tip([q[0], q[1] + sag(q), q[2]]).map(|part| part + rng.noise(NOISE));
        text.push_str(&format!("{},{},{},{x},{y},{z}\n", q[0], q[1], q[2]));
    }
    text
}

#[test]
fn a_joint_that_sags_under_unknown_masses_is_named_and_the_error_falls_to_the_noise() {
    let model =
        format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: {NOISE}}}\n");
    for seed in [1, 2, 3] {
        let lab = laboratory(&model, &table(120, seed), Options::default());
        let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
        assert_eq!(diagnosis.verdict, Verdict::Named, "{}", diagnosis_sentence(&diagnosis));
        let named = diagnosis.named.unwrap().effect;
        assert_eq!((named.effect.as_str(), named.site.as_str()), ("gravity_flexure", "shoulder"));
        let grown = lab.add("gravity_flexure(shoulder)", &Progress::unwatched()).unwrap();
        assert!(grown.rms_mm.check.unwrap() < 1.25 * NOISE * 3.0_f64.sqrt(), "{:?}", grown.rms_mm);
    }
}

#[test]
fn an_effect_of_gravity_that_is_held_says_that_no_masses_are_declared_and_what_to_do() {
    let model =
        format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*), joint_compliance(shoulder)]\n");
    let lab = laboratory(&model, &table(60, 5), Options::default());
    let compared = lab.compare(&Progress::unwatched()).unwrap();
    let held = compared.effects.iter().find(|effect| effect.label == "joint_compliance(shoulder)").unwrap();
    assert!(held.held);
    assert_eq!(
        held.held_because.as_ref().map(why_held_in_words).as_deref(),
        Some(
            "no masses are declared, so gravity moves nothing: declare `links:` or a payload, or add gravity_flexure(j)"
        )
    );
}

#[test]
fn gravity_that_points_up_and_masses_that_are_all_alike_are_reported() {
    let links = "links:\n  - {after: shoulder, mass_kg: 5, centre_mm: [-80, 0, 0]}\n  - {after: elbow, mass_kg: 5, centre_mm: [-60, 0, 0]}\n  - {after: waist, mass_kg: 5, centre_mm: [0, 0, 0]}\n";
    let model = format!(
        "{COLUMN_ARM}{links}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: {NOISE}}}\ngravity: [0, 0, 1]\n"
    );
    let lab = laboratory(&model, &table(120, 6), Options::default());
    let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
    let says = |what: &str| diagnosis.warnings.iter().any(|note| note_in_words(note).contains(what));
    assert!(says("look like placeholders: all are 5 kg"), "{:?}", diagnosis.warnings);
    assert!(says("gravity seems to point the other way"), "{:?}", diagnosis.warnings);
}
