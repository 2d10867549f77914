//! Residual maps: what no effect predicts but a flexible regression does commands the arm where it was measured, and explains nothing.

use plumb_calibration::arm_model::Model;
use plumb_calibration::file::model_text;
use plumb_calibration::prediction::{Pose, points};
use plumb_diagnosis::Note;
use plumb_diagnosis::laboratory::{Laboratory, Options, without};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_report::{growth_sentence, map_in_words};

use super::made_up::{COLUMN_ARM, Xorshift, column_poses, column_tip, laboratory};

const MODEL: &str = "targets: {p1: {}}\nfree: [joint_zero(*)]\nnoise: {p1_mm: 0.02}\n";

/// What the arm is off by in a pose, deg: no effect of the library.
fn off(q: [f64; 3]) -> [f64; 3] {
    let [waist, shoulder, elbow] = q.map(f64::to_radians);
    [0.0, 0.05 * (2.0 * waist + 1.0).sin() * (2.0 * elbow).cos(), 0.06 * (2.0 * waist).cos() * shoulder.sin()]
}

fn table(rows: usize, seed: u64, off: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let mut rng = Xorshift::seeded(seed);
    let mut text = "q1_deg,q2_deg,q3_deg,p1_x_mm,p1_y_mm,p1_z_mm\n".to_owned();
    for q in column_poses(rows, seed) {
        let [x, y, z] = tip(q, &off).map(|part| part + rng.noise(0.02));
        text.push_str(&format!("{},{},{},{x},{y},{z}\n", q[0], q[1], q[2]));
    }
    text
}

fn tip(q: [f64; 3], off: impl Fn([f64; 3]) -> [f64; 3]) -> [f64; 3] {
    let wrong = off(q);
    column_tip([q[0] + wrong[0], q[1] + wrong[1], q[2] + wrong[2]])
}

fn random() -> Options {
    Options { holdout: Holdout::Random { fraction: 0.3, seed: 1 }, ..Options::default() }
}

fn lab(model: &str, options: Options) -> Laboratory {
    laboratory(model, &table(380, 5, off), options)
}

#[test]
fn what_no_effect_predicts_is_mapped_and_the_map_commands_the_arm_where_was_measured() {
    let watch = Progress::unwatched();
    let laboratory = lab(&format!("{COLUMN_ARM}{MODEL}"), random());
    let effects = laboratory.grow_with_corrections(&watch).unwrap();
    let growth = laboratory.grow_with_map(&watch).unwrap();
    let map = growth.residual_map.as_ref().expect("a map");
    let (before, after) = (effects.diagnosis.rms_mm.check.unwrap(), growth.diagnosis.rms_mm.check.unwrap());
    assert!(after < 0.7 * before, "{after} after {before}");
    assert!(map.not_understood > 0.4 && map.goes_by == ["pose"] && !map.between_unknown, "{map:?}");
    assert!(growth_sentence(&growth).contains("not understood"), "{}", growth_sentence(&growth));
    assert_eq!(growth.steps.len(), effects.steps.len(), "the map is no effect");
    assert!(growth.diagnosis.check_opened > effects.diagnosis.check_opened);

    // What was written commands the arm: poses that nobody measured come out better.
    let model = Model::parse("model.yaml", &model_text(&growth.model)).unwrap();
    let miss = |model: &Model| -> f64 {
        let inside =
            column_poses(120, 77).into_iter().filter(|q| model.holds_at(&q.map(f64::to_radians)).is_ok());
        let squares = inside.map(|q| {
            let pose = Pose { q: q.map(f64::to_radians).to_vec(), ..Pose::default() };
            let there = points(model, None, &[pose]).unwrap()[0];
            (there - nalgebra::Vector3::from(tip(q, off))).norm_squared()
        });
        squares.sum::<f64>().sqrt()
    };
    assert!(miss(&model) < 0.6 * miss(&effects.model), "{} {}", miss(&model), miss(&effects.model));
    // Outside it is refused, with what would help.
    let message = model.holds_at(&[0.0, 2.6, -1.0]).unwrap_err();
    assert!(
        message.contains("shoulder would be at 148.9") && message.contains("the residual map"),
        "{message}"
    );
    assert!(message.contains("measure there and `grow` again"), "{message}");
}

#[test]
fn a_map_explains_nothing_and_a_change_of_the_effects_takes_it_out() {
    let watch = Progress::unwatched();
    let plain = lab(&format!("{COLUMN_ARM}{MODEL}"), random());
    let growth = plain.grow_with_map(&watch).unwrap();
    let mapped = lab(&model_text(&growth.model), random());
    let alone = lab(&model_text(&without(&growth.model, "residual_map").unwrap()), random());

    let (with, before) = (mapped.compare_in_full(&watch).unwrap(), alone.compare_in_full(&watch).unwrap());
    assert!(with.rms_mm.check.unwrap() < before.rms_mm.check.unwrap());
    // With whole regions left out the map is silent: never worse than the model before.
    let (left_out, plain_left_out) = (with.rms_mm.cv.unwrap(), before.rms_mm.cv.unwrap());
    assert!((left_out / plain_left_out - 1.0).abs() < 0.02, "{left_out} {plain_left_out}");
    let note = with.residual_map.unwrap();
    assert!(
        map_in_words(&note).contains("not understood") && note.rows == 380 && note.rows_inside > 300,
        "{note:?}"
    );
    assert!(before.residual_map.is_none());
    let explainable = |comparison: &plumb_diagnosis::laboratory::Comparison| {
        comparison.explainable.clone().unwrap().left_mm
    };
    assert!(
        (explainable(&with) / explainable(&before) - 1.0).abs() < 0.02,
        "what is mapped is still to be explained"
    );

    let (asked, same) = (mapped.diagnose(&watch).unwrap(), alone.diagnose(&watch).unwrap());
    assert_eq!(asked.verdict, same.verdict);
    assert!(asked.warnings.contains(&Note::MapLeftOut), "{:?}", asked.warnings);
    let added = mapped.add("joint_gain(elbow)", &watch).unwrap();
    assert!(added.model.residual_map.is_none() && added.model.measured_region.is_none());
    let refused = without(&added.model, "residual_map").unwrap_err().to_string();
    assert!(refused.contains("has no residual map"), "{refused}");
}

#[test]
fn of_noise_there_is_no_map() {
    for seed in 0..8 {
        let text = table(90, 300 + seed, |_| [0.0; 3]);
        let growth = laboratory(&format!("{COLUMN_ARM}{MODEL}"), &text, random())
            .grow_with_map(&Progress::unwatched())
            .unwrap();
        assert!(growth.residual_map.is_none(), "seed {seed}: {:?}", growth.residual_map);
    }
}

#[test]
fn where_nothing_is_locked_away_there_is_no_map() {
    let options = Options { holdout: Holdout::None, ..Options::default() };
    let growth = lab(&format!("{COLUMN_ARM}{MODEL}"), options).grow_with_map(&Progress::unwatched()).unwrap();
    assert!(growth.residual_map.is_none());
}

#[test]
fn a_correction_says_where_it_was_measured() {
    let stick = |q: [f64; 3]| [0.0, 0.0, 0.008 * q[2] + 0.15 * ((q[2] / 13.0).rem_euclid(1.0) - 0.5)];
    let text = table(160, 71, stick);
    let laboratory = laboratory(&format!("{COLUMN_ARM}{MODEL}"), &text, Options::default());
    let growth = laboratory.grow_with_corrections(&Progress::unwatched()).unwrap();
    assert!(!growth.model.corrections.is_empty());
    let model = Model::parse("model.yaml", &model_text(&growth.model)).unwrap();
    let message = model.holds_at(&[0.0, 0.5, 1.0]).unwrap_err();
    assert!(
        message.contains("elbow would be at 57.296 deg") && message.contains("the correction"),
        "{message}"
    );
}
