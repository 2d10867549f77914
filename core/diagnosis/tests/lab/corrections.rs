//! Corrections: effects that predict rows they have not seen while their mechanism is not identified.

use plumb_calibration::arm_model::Model;
use plumb_diagnosis::laboratory::Options;
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{Claim, Note, Verdict};
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

const MODEL: &str = "targets: {p1: {}}\nfree: [joint_zero(*)]\nnoise: {p1_mm: 0.02}\n";

/// Positions of the column arm, whose joints are off by `off` (deg) of the pose.
fn table(rows: usize, seed: u64, off: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for q in column_poses(rows, seed) {
        let wrong = off(q);
        let [x, y, z] = column_tip([q[0] + wrong[0], q[1] + wrong[1], q[2] + wrong[2]])
            .map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{},{},{},{x},{y},{z}\n", q[0], q[1], q[2]));
    }
    text
}

/// A stiction that lets the elbow go at every tenth of its way: no effect of the library.
fn stick(q: f64) -> f64 {
    let phase = (q / 13.0).rem_euclid(1.0);
    0.15 * (phase - 0.5)
}

#[test]
fn where_nothing_can_be_named_an_effect_that_predicts_unseen_rows_is_a_correction() {
    let text = table(160, 71, |q| [0.0, 0.0, 0.008 * q[2] + stick(q[2])]);
    let laboratory = laboratory(&format!("{COLUMN_ARM}{MODEL}"), &text, Options::default());
    let watch = Progress::unwatched();
    let alone = laboratory.grow(&watch).unwrap();
    let both = laboratory.grow_with_corrections(&watch).unwrap();
    let corrections: Vec<_> = both.steps.iter().filter(|step| step.claim == Claim::Correction).collect();
    assert!(alone.steps.iter().all(|step| step.claim == Claim::Mechanism));
    assert!(!corrections.is_empty(), "{}", diagnosis_sentence(&both.diagnosis));
    let first = corrections[0];
    assert!(first.may_be.contains(&first.label) && first.may_be.len() > 1, "{:?}", first.may_be);
    let mechanisms = both.mechanisms_alone.unwrap();
    let start = laboratory.compare(&watch).unwrap().rms_mm;
    assert!((mechanisms.fit - alone.diagnosis.rms_mm.fit).abs() < 1e-6);
    assert!(both.diagnosis.rms_mm.check.unwrap() < 0.8 * start.check.unwrap(), "{:?}", both.diagnosis.rms_mm);
    assert!(both.diagnosis.check_opened > alone.diagnosis.check_opened);
    // The model says so, and a comparison of it does.
    let written = plumb_calibration::file::model_text(&both.model);
    assert!(written.contains("claim: correction, may_be: [\""), "{written}");
    let read = Model::parse("model.yaml", &written).unwrap();
    assert_eq!(read.corrections, both.model.corrections);
    let effects = laboratory_of(&written, &text).compare(&watch).unwrap().effects;
    let marked = effects.iter().filter(|effect| effect.claim == Claim::Correction).count();
    assert_eq!(marked, corrections.len());
    assert!(effects.iter().filter(|effect| !effect.added).all(|effect| effect.claim == Claim::Mechanism));
}

fn laboratory_of(model: &str, table: &str) -> plumb_diagnosis::laboratory::Laboratory {
    laboratory(model, table, Options::default())
}

#[test]
fn of_noise_no_correction_is_made() {
    for seed in 0..12 {
        let text = table(60, 500 + seed, |_| [0.0; 3]);
        let laboratory = laboratory(&format!("{COLUMN_ARM}{MODEL}"), &text, Options::default());
        let growth = laboratory.grow_with_corrections(&Progress::unwatched()).unwrap();
        assert!(growth.steps.is_empty(), "seed {seed}: {:?}", growth.steps);
        assert!(growth.mechanisms_alone.is_none());
    }
}

#[test]
fn what_is_identified_is_named_and_no_correction() {
    let text = table(100, 73, |q| [0.0, 0.0, 0.008 * q[2]]);
    let laboratory = laboratory(&format!("{COLUMN_ARM}{MODEL}"), &text, Options::default());
    let growth = laboratory.grow_with_corrections(&Progress::unwatched()).unwrap();
    assert_eq!(growth.steps.len(), 1, "{}", diagnosis_sentence(&growth.diagnosis));
    assert_eq!(
        (growth.steps[0].label.as_str(), growth.steps[0].claim),
        ("joint_gain(elbow)", Claim::Mechanism)
    );
    assert_eq!(growth.diagnosis.verdict, Verdict::AtFloor);
}

#[test]
fn without_locked_rows_no_correction_is_made() {
    let text = table(160, 71, |q| [0.0, 0.0, 0.008 * q[2] + stick(q[2])]);
    let holdout = plumb_diagnosis::split::Holdout::None;
    let laboratory =
        laboratory(&format!("{COLUMN_ARM}{MODEL}"), &text, Options { holdout, ..Options::default() });
    let growth = laboratory.grow_with_corrections(&Progress::unwatched()).unwrap();
    assert!(growth.steps.iter().all(|step| step.claim == Claim::Mechanism));
}

#[test]
fn a_claim_that_is_none_is_refused_with_its_place() {
    let model = |claim: &str, heading: &str| {
        let text = format!(
            "{COLUMN_ARM}targets: {{p1: {{}}}}\n{heading}:\n  - {{effect: joint_gain, where: elbow, values: {{}}, claim: {claim}}}\n"
        );
        Model::parse("model.yaml", &text)
    };
    assert!(model("correction", "effects").unwrap().corrections.len() == 1);
    assert!(model("mechanism", "effects").unwrap().corrections.is_empty());
    let unknown = model("guess", "effects").unwrap_err().to_string();
    assert!(unknown.contains("guess") && unknown.contains("correction"), "{unknown}");
    let misplaced = model("correction", "fitted").unwrap_err().to_string();
    assert!(misplaced.contains("under `effects:`"), "{misplaced}");
}

#[test]
fn what_is_known_of_values_beforehand_is_written_read_and_refused_with_its_place() {
    let model = |rest: &str, heading: &str| {
        let text = format!(
            "{COLUMN_ARM}targets: {{p1: {{}}}}\n{heading}:\n  - {{effect: joint_harmonic, where: elbow, n: 9, values: {{sine_deg: 0.01, cosine_deg: 0}}, prior_sd: {rest}}}\n"
        );
        Model::parse("model.yaml", &text)
    };
    let read = model("{sine_deg: 0.02, cosine_deg: 0.03}", "effects").unwrap();
    let known: Vec<f64> = read.priors[0].sd.iter().map(|sd| sd.unwrap().to_degrees()).collect();
    assert!((known[0] - 0.02).abs() < 1e-12 && (known[1] - 0.03).abs() < 1e-12, "{known:?}");
    let written = plumb_calibration::file::model_text(&read);
    assert!(
        written.contains(
            "values: {sine_deg: 0.01, cosine_deg: 0}, prior_sd: {sine_deg: 0.02, cosine_deg: 0.03}}"
        ),
        "{written}"
    );
    assert_eq!(Model::parse("model.yaml", &written).unwrap().priors, read.priors);
    assert_eq!(model("{cosine_deg: 0.03}", "effects").unwrap().priors[0].sd[0], None);
    assert!(model("{}", "effects").unwrap().priors.is_empty());
    let refused = |rest: &str, heading: &str| model(rest, heading).unwrap_err().to_string();
    let zero = refused("{sine_deg: 0}", "effects");
    assert!(
        zero.contains("standard deviation of `sine_deg` must be greater than zero") && zero.contains(":10"),
        "{zero}"
    );
    assert!(refused("{sine_deg: -0.1}", "effects").contains("greater than zero"));
    let unknown = refused("{sine: 0.1}", "effects");
    assert!(unknown.contains("`joint_harmonic` has no value `sine`"), "{unknown}");
    let misplaced = refused("{sine_deg: 0.1}", "fitted");
    assert!(misplaced.contains("`prior_sd` belongs to effects that were added"), "{misplaced}");
}

#[test]
fn a_name_that_the_locked_rows_contradict_is_given_and_not_added() {
    // In the last session, which is held out, the elbow's gain is the other way round, as after a repair.
    let mut text = String::from("session,q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n");
    let mut rng = Xorshift::seeded(5);
    for (number, q) in column_poses(160, 5).into_iter().enumerate() {
        let (session, gain) = if number < 110 { ("before", 0.004) } else { ("after", -0.004) };
        let [x, y, z] = column_tip([q[0], q[1], q[2] * (1.0 + gain)]).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{session},{:.5},{:.5},{:.5},{x:.5},{y:.5},{z:.5}\n", q[0], q[1], q[2]));
    }
    let options = |holdout| Options { holdout, ..Options::default() };
    let model = format!("{COLUMN_ARM}targets: {{p1: {{}}}}\nfree: [joint_zero(*)]\nnoise: {{p1_mm: 0.02}}\n");
    let watch = Progress::unwatched();
    let growth = laboratory(&model, &text, options(Holdout::Session)).grow(&watch).unwrap();
    let named = growth.diagnosis.named.as_ref().map(|named| named.effect.effect.as_str());
    assert_eq!(
        (named, growth.steps.len()),
        (Some("joint_gain"), 0),
        "{}",
        diagnosis_sentence(&growth.diagnosis)
    );
    let notes = &growth.diagnosis.warnings;
    assert!(notes.iter().any(|note| matches!(note, Note::WorseHeldOut(_))), "{notes:?}");
    // Of the first session alone it is added.
    let first: String =
        text.lines().filter(|line| !line.starts_with("after")).map(|line| format!("{line}\n")).collect();
    let growth =
        laboratory(&model, &first, options(Holdout::Random { fraction: 0.2, seed: 1 })).grow(&watch).unwrap();
    assert_eq!(growth.steps.len(), 1, "{}", diagnosis_sentence(&growth.diagnosis));
}
