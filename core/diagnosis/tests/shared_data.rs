//! The laboratory on measurements kept outside the repository; skipped, with a word, where they are absent.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::path::PathBuf;

use plumb_diagnosis::laboratory::{Comparison, Laboratory, Options};
use plumb_diagnosis::split::Holdout;
use plumb_diagnosis::{Diagnosis, Verdict};
use plumb_estimation::Progress;
use plumb_report::{diagnosis_sentence, note_in_words};

fn shared(part: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(part);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

fn compare(model: &str, table: &str, holdout: Holdout, free: &[&str]) -> Option<Comparison> {
    let free = Some(free.iter().map(|pattern| (*pattern).to_owned()).collect());
    let options = Options { free, holdout, ..Options::default() };
    let laboratory = Laboratory::open(&shared(model)?, &shared(table)?, options).unwrap();
    Some(laboratory.compare(&Progress::unwatched()).unwrap())
}

fn diagnose(case: &str) -> Option<Diagnosis> {
    let folder = shared("blind")?.join(format!("case-{case}"));
    let laboratory =
        Laboratory::open(&folder.join("model.yaml"), &folder.join("table.csv"), Options::default()).unwrap();
    Some(laboratory.diagnose(&Progress::unwatched()).unwrap())
}

#[test]
fn the_ur5s_error_on_rows_not_fitted_falls_as_zeros_and_geometry_are_freed() {
    let mut means = [0.0; 3];
    for seed in 1..=3 {
        let holdout = Holdout::Random { fraction: 0.3, seed };
        let ladder: [&[&str]; 3] = [&[], &["joint_zero(*)"], &["joint_zero(*)", "geometry(*)"]];
        for (mean, free) in means.iter_mut().zip(ladder) {
            let Some(found) = compare("real/ur5.yaml", "real/ur5-grid.csv", holdout, free) else { return };
            // That its wrist is hardly determined by one reflector on the flange is true, and reported.
            let is_expected =
                |message: String| message.contains("hardly determine") && message.contains("wrist2");
            assert!(found.warnings.iter().map(note_in_words).all(is_expected), "{:?}", found.warnings);
            *mean += found.rms_mm.check.unwrap() / 3.0;
        }
    }
    assert!((0.66..0.75).contains(&means[0]), "{means:?}");
    assert!((0.52..0.61).contains(&means[1]), "{means:?}");
    assert!(means[2] < 0.115, "{means:?}");
}

#[test]
fn one_split_of_the_ur5_falls_to_the_published_figures() {
    let holdout = Holdout::Random { fraction: 0.3, seed: 1 };
    let ladder: [(&[&str], f64); 3] =
        [(&[], 0.679), (&["joint_zero(*)"], 0.546), (&["joint_zero(*)", "geometry(*)"], 0.112)];
    for (free, expected) in ladder {
        let Some(found) = compare("real/ur5.yaml", "real/ur5-grid.csv", holdout, free) else { return };
        let check = found.rms_mm.check.unwrap();
        assert!((check - expected).abs() < 0.001, "{free:?}: {check}");
    }
}

#[test]
fn freedoms_of_the_ur5_that_no_tracker_can_see_are_named() {
    let holdout = Holdout::Random { fraction: 0.3, seed: 1 };
    let Some(found) = compare("real/ur5.yaml", "real/ur5-grid.csv", holdout, &["joint_zero(*)"]) else {
        return;
    };
    let gauge =
        found.gauges.iter().find(|gauge| gauge.held == "joint_zero(pan)").expect("pan's zero turns the base");
    assert!(gauge.same_as.contains(&"base rotation about z".to_owned()), "{gauge:?}");
}

#[test]
fn sockets_alone_bring_a_panda_true_without_an_instrument() {
    let geometry = ["joint_zero(*)", "geometry(*)"];
    let files = ("real/panda_1-sockets.yaml", "real/panda_1-sockets.csv");
    let Some(nominal) = compare(files.0, files.1, Holdout::Session, &[]) else { return };
    let Some(fitted) = compare(files.0, files.1, Holdout::Session, &geometry) else { return };
    assert!(nominal.rms_mm.check.unwrap() > 7.0, "{:?}", nominal.rms_mm);
    assert!(fitted.rms_mm.check.unwrap() < 0.90, "{:?}", fitted.rms_mm);
}

fn named(case: &str, effect: &str, site: &str) {
    let Some(diagnosis) = diagnose(case) else { return };
    assert_eq!(diagnosis.verdict, Verdict::Named, "case {case}: {}", diagnosis_sentence(&diagnosis));
    let named = diagnosis.named.unwrap().effect;
    assert_eq!((named.effect.as_str(), named.site.as_str()), (effect, site), "case {case}");
}

#[test]
fn a_hidden_backlash_is_named() {
    named("a", "joint_backlash", "elbow");
    named("i", "joint_backlash", "elbow");
}

#[test]
fn a_hidden_compliance_is_named_outliers_or_not() {
    named("c", "joint_compliance", "shoulder");
    named("g", "joint_compliance", "shoulder");
}

#[test]
fn a_wheel_out_of_true_is_named() {
    named("f", "joint_harmonic", "waist");
}

#[test]
fn an_axis_that_leans_is_named() {
    named("j", "axis_skew", "elbow");
}

#[test]
fn nothing_is_named_where_nothing_is_hidden() {
    let Some(diagnosis) = diagnose("b") else { return };
    assert_eq!(diagnosis.verdict, Verdict::AtFloor, "{}", diagnosis_sentence(&diagnosis));
    assert!(diagnosis.named.is_none() && diagnosis.tied.is_empty());
}

#[test]
fn returns_that_split_in_two_for_no_recorded_reason_are_the_hardwares_fault() {
    let Some(diagnosis) = diagnose("h") else { return };
    assert_eq!(diagnosis.verdict, Verdict::NotRepeatable, "{}", diagnosis_sentence(&diagnosis));
}

#[test]
fn a_link_that_warms_up_is_named() {
    named("d", "warm_up", "wrist_roll");
}

#[test]
fn two_effects_at_once_are_found_one_after_the_other() {
    let Some(folder) = shared("blind/case-e") else { return };
    let laboratory =
        Laboratory::open(&folder.join("model.yaml"), &folder.join("table.csv"), Options::default()).unwrap();
    let growth = laboratory.grow(&Progress::unwatched()).unwrap();
    let mut added: Vec<(&str, &str)> = growth
        .steps
        .iter()
        .map(|step| (step.added.effect.effect.as_str(), step.added.effect.site.as_str()))
        .collect();
    added.sort_unstable();
    assert_eq!(added, [("joint_backlash", "elbow"), ("joint_compliance", "shoulder")]);
    assert_eq!(growth.diagnosis.verdict, Verdict::AtFloor, "{}", diagnosis_sentence(&growth.diagnosis));
}

#[test]
fn the_pandas_fit_does_not_run_away_with_whole_regions_held_out() {
    let free = ["joint_zero(*)", "geometry(*)"];
    let Some(found) =
        compare("real/panda_1-sockets.yaml", "real/panda_1-sockets.csv", Holdout::Regions, &free)
    else {
        return;
    };
    assert!(found.rms_mm.fit < 1.0, "{:?}", found.rms_mm);
    assert!(found.effects.iter().all(|effect| effect.plausible), "{:?}", found.effects);
    let mut message = found.warnings.iter().map(note_in_words);
    assert!(message.any(|message| message.contains("these rows hardly determine")), "{:?}", found.warnings);
}
