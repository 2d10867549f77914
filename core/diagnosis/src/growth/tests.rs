//! Growing, step by step.

use super::*;
use crate::testing::two_links;

#[test]
fn a_model_grows_by_what_is_named_until_nothing_is() {
    let both = |q: [f64; 2]| [0.002 * (5.0 * q[0]).sin(), 0.0015 * (12.0 * q[1]).sin()];
    let lab = two_links(150, "joint_zero(*)", 0.05, 3, both);
    let grown = lab.grow(&Progress::unwatched()).unwrap();
    let added: Vec<(&str, Option<f64>)> =
        grown.steps.iter().map(|step| (step.added.effect.site.as_str(), step.added.effect.n)).collect();
    assert_eq!(added, [("shoulder", Some(5.0)), ("elbow", Some(12.0))]);
    assert!(grown.steps.iter().all(|step| step.claim == Claim::Mechanism));
    assert_eq!(grown.model.effects.len(), 2);
    assert_eq!(grown.mechanisms_alone, None, "no correction was added");
    // The size a step shows is that of the model it made: the first wave's, with nothing else in yet.
    let first = grown.steps[0].model.as_ref().unwrap();
    let amplitude = first.effects[0].values[0].hypot(first.effects[0].values[1]).to_degrees();
    assert!((grown.steps[0].added.size - amplitude).abs() < 1e-9, "{:?} {amplitude}", grown.steps[0].added);
    // Noise of three coordinates is left.
    let left = grown.steps[1].rms_mm.fit;
    assert!((left / (0.05 * 3.0_f64.sqrt()) - 1.0).abs() < 0.15 && grown.start.fit > 3.0 * left, "{left}");
}

/// The same with three rows in ten held out.
fn with_rows_held_out(lab: &Laboratory) -> Laboratory {
    let holdout = crate::split::Holdout::Random { fraction: 0.3, seed: 4 };
    let options = crate::laboratory::Options { holdout, ..lab.options().clone() };
    Laboratory::new(lab.model().clone(), lab.table().clone(), options).unwrap()
}

#[test]
fn what_was_reset_is_added_before_batches_of_a_large_table() {
    let reset = |rows: usize, by: f64| {
        let lab = crate::testing::by_wire(rows, 0.05, 8, |row| if row < rows / 2 { 0.0 } else { by });
        with_rows_held_out(&lab).with_what_was_reset(0, &Progress::unwatched()).unwrap()
    };
    let AfterReset { laboratory, steps, diagnosed, opened } = reset(BATCH_ROWS, 0.3);
    assert_eq!(steps.len(), 1, "{steps:?}");
    assert_eq!(steps[0].added.effect.effect, "reading_reset");
    assert_eq!((laboratory.model().effects.len(), opened), (1, 1), "one look at the held-out rows");
    // It is diagnosed as it is now, and need not be once more.
    let left = laboratory.compare(&Progress::unwatched()).unwrap().rms_mm.fit;
    assert!((diagnosed.unwrap().0.rms_mm.fit - left).abs() < 1e-9);
    for (rows, by, why) in
        [(BATCH_ROWS - 1, 0.3, "a small table is grown one by one"), (BATCH_ROWS, 0.0, "nothing jumps")]
    {
        let none = reset(rows, by);
        assert!(none.steps.is_empty() && none.diagnosed.is_none() && none.opened == 0, "{why}");
    }
}

#[test]
fn the_mechanisms_alone_are_the_model_without_its_corrections() {
    let lab = two_links(60, "joint_zero(*)", 0.05, 9, |q| [0.001 * (3.0 * q[0]).sin(), 0.004 * q[1]]);
    let added = |text: &str| {
        let id = plumb_calibration::effect::parse(text, lab.model()).unwrap();
        let values =
            vec![0.0; plumb_calibration::effect::build(&id, lab.model()).unwrap().parameters().len()];
        AddedEffect { id, values }
    };
    let (gain, wave) = (added("joint_gain(elbow)"), added("joint_harmonic(shoulder, 3)"));
    let with = |effects: &[AddedEffect], corrections: &[AddedEffect]| {
        let ids = corrections.iter().map(|one| one.id.clone());
        let corrections = ids.map(|id| Correction { id, may_be: Vec::new() }).collect();
        lab.with_model(Model { effects: effects.to_vec(), corrections, ..lab.model().clone() })
    };
    let watch = Progress::unwatched();
    let alone =
        with(&[gain.clone(), wave.clone()], std::slice::from_ref(&wave)).mechanisms_alone(&watch).unwrap();
    let expected = with(&[gain], &[]).compare(&watch).unwrap().rms_mm;
    assert!((alone.fit - expected.fit).abs() < 1e-9 && alone.fit > 0.15, "{alone:?}");
}

/// What grows from an arm whose elbow has a wave of this amplitude, three rows in ten of which are locked away.
fn growing(amplitude: f64) -> Growing {
    let lab = two_links(80, "joint_zero(*)", 0.05, 12, |q| [0.0, amplitude * (3.0 * q[1]).sin()]);
    let laboratory = with_rows_held_out(&lab);
    let (diagnosis, found) = laboratory.diagnose_for(&Progress::unwatched()).unwrap();
    Growing { laboratory, diagnosis, found, steps: Vec::new(), opened: 0 }
}

/// An effect of that arm, at nothing.
fn effect_of(laboratory: &Laboratory, text: &str) -> AddedEffect {
    let id = plumb_calibration::effect::parse(text, laboratory.model()).unwrap();
    let built = plumb_calibration::effect::build(&id, laboratory.model()).unwrap();
    AddedEffect { id, values: vec![0.0; built.parameters().len()] }
}

fn candidate(laboratory: &Laboratory, text: &str) -> CorrectionCandidate {
    CorrectionCandidate {
        effect: effect_of(laboratory, text),
        site: crate::testing::effect_at(text, "elbow"),
        may_be: vec![text.to_owned(), "dirt".to_owned()],
    }
}

#[test]
fn the_first_correction_that_locked_rows_bear_out_is_added_with_its_region() {
    let watch = Progress::unwatched();
    let mut growing = growing(0.002);
    let lab = growing.laboratory.clone();
    let candidate = |text: &str| candidate(&lab, text);
    let (nothing, wave) = (candidate("joint_gain(shoulder)"), candidate("joint_harmonic(elbow, 3)"));
    let (id, may_be) = (wave.effect.id.clone(), wave.may_be.clone());
    let with = |corrections: Vec<CorrectionCandidate>| Found { corrections, ..Found::default() };
    growing.found = with(vec![candidate("joint_harmonic(elbow, 3)")]);
    assert!(!growing.add_reset(true, &watch).unwrap(), "a wave is nothing that was re-set");
    assert_eq!((growing.found.corrections.len(), growing.opened), (1, 0), "it may be added later");
    growing.found = with(vec![nothing, wave]);
    assert!(growing.add_correction(&watch).unwrap());
    assert_eq!((growing.opened, growing.steps.len()), (2, 1), "two looks at the locked rows");
    assert_eq!(count_of_corrections(growing.steps.iter()), 1);
    let (step, model) = (&growing.steps[0], growing.laboratory.model());
    assert_eq!((step.claim, &step.may_be), (Claim::Correction, &may_be));
    assert_eq!(model.corrections, [Correction { id, may_be }]);
    assert!(model.measured_region.is_some() && model.effects.len() == 1);
    growing.found.corrections.clear();
    assert!(!growing.add_correction(&watch).unwrap() && growing.opened == 2);
}

#[test]
fn effects_found_together_are_added_together_where_held_out_rows_bear_all_of_them_out() {
    let watch = Progress::unwatched();
    let growing = || growing(0.002);
    let found = |growing: &Growing, texts: &[&str]| Found {
        together: texts.iter().map(|text| candidate(&growing.laboratory, text)).collect(),
        ..Found::default()
    };
    let wave = "joint_harmonic(elbow, 3)";
    let mut both = growing();
    both.found = found(&both, &[wave, "joint_gain(elbow)"]);
    let labels = [wave, "joint_gain(elbow)"];
    assert_eq!(both.add_together(2, &watch).unwrap(), 2);
    assert_eq!(
        (both.opened, count_of_corrections(both.steps.iter())),
        (1, 2),
        "one look at the held-out rows"
    );
    assert_eq!(both.steps.iter().map(|step| step.label.as_str()).collect::<Vec<_>>(), labels);
    let model = both.laboratory.model();
    assert_eq!((model.effects.len(), model.corrections.len()), (2, 2));
    assert!(model.measured_region.is_some());
    // The first step has the error with the wave alone, and only the last a model.
    let alone = growing().laboratory.add(wave, &watch).unwrap().rms_mm;
    assert!((both.steps[0].rms_mm.fit - alone.fit).abs() < 1e-9 && both.steps[0].model.is_none());
    assert!(both.steps[1].model.is_some() && both.steps[1].rms_mm.fit <= alone.fit);
    let amplitude = model.effects[0].values[0].hypot(model.effects[0].values[1]).to_degrees();
    assert!((both.steps[0].added.size - amplitude).abs() < 1e-9, "{:?} {amplitude}", both.steps[0].added);

    for (texts, most, opened, why) in [
        (&[wave, "joint_gain(elbow)"][..], 1, 0, "more than may be added"),
        (&[wave][..], 12, 0, "one effect is no set"),
        (
            &["joint_gain(shoulder)", "joint_harmonic(shoulder, 7)"][..],
            12,
            1,
            "held-out rows do not bear them out",
        ),
    ] {
        let mut none = growing();
        none.found = found(&none, texts);
        assert_eq!((none.add_together(most, &watch).unwrap(), none.opened), (0, opened), "{why}");
        assert!(none.steps.is_empty() && none.laboratory.model().effects.is_empty(), "{why}");
    }
}

#[test]
fn a_name_that_makes_locked_rows_worse_is_not_added() {
    let watch = Progress::unwatched();
    let mut growing = growing(0.0);
    let reduction = |growing: &Growing, effect: &AddedEffect| {
        growing.laboratory.held_out_reduction(std::slice::from_ref(effect), &watch).unwrap().unwrap().total
    };
    let waves: Vec<AddedEffect> = (1..9)
        .map(|order| effect_of(&growing.laboratory, &format!("joint_harmonic(elbow, {order})")))
        .collect();
    let worse = waves.into_iter().find(|wave| reduction(&growing, wave) < 0.0).unwrap();
    let site = crate::testing::effect_at("joint_harmonic", "elbow");
    growing.diagnosis.named = Some(Named { effect: site, size: 0.1, unit: "deg".to_owned(), se: 0.01 });
    growing.found.named = Some(worse.clone());
    assert!(!growing.add_named(&watch).unwrap(), "the verdict is not that it is named");
    assert_eq!(growing.opened, 0);
    growing.diagnosis.verdict = Verdict::Named;
    growing.found.named = Some(worse.clone());
    assert!(!growing.add_named(&watch).unwrap());
    let label = growing.laboratory.model().label(&worse.id);
    assert_eq!(growing.diagnosis.warnings.last(), Some(&Note::WorseHeldOut(label)));
    assert_eq!((growing.opened, growing.steps.len()), (1, 0));
}

#[test]
fn what_was_found_at_once_replaces_what_was_added_one_by_one_where_held_out_rows_are_predicted_better() {
    let watch = Progress::unwatched();
    let (wave, gain) = ("joint_harmonic(elbow, 3)", "joint_gain(elbow)");
    let ended = |added: Option<&str>, verdict: Verdict| {
        let mut ended = growing(0.002);
        let before = ended.laboratory.clone();
        if let Some(added) = added {
            let model = before.add(added, &watch).unwrap().model;
            ended.laboratory =
                Laboratory::new(model, before.table().clone(), before.options().clone()).unwrap();
        }
        ended.diagnosis.verdict = verdict;
        let together = vec![candidate(&before, wave), candidate(&before, gain)];
        ended.or_together((before, Vec::new()), together, 2, &watch).unwrap();
        (ended.steps.len(), ended.opened)
    };
    // Two looks: whether it is better, and whether it is borne out.
    assert_eq!(ended(None, Verdict::Unknown), (2, 2), "nothing was added one by one");
    assert_eq!(
        ended(Some("joint_gain(shoulder)"), Verdict::Unknown),
        (2, 2),
        "something that is not there was"
    );
    assert_eq!(ended(Some(wave), Verdict::Unknown), (0, 1), "what is there was added already");
    assert_eq!(ended(None, Verdict::AtFloor), (0, 0), "nothing is left to explain");
}

#[test]
fn a_correction_that_is_named_with_all_else_in_the_model_is_a_mechanism() {
    let watch = Progress::unwatched();
    let wave = "joint_harmonic(elbow, 3)";
    let asked = |added: &[&str]| {
        let mut growing = growing(0.002);
        let corrections: Vec<CorrectionCandidate> =
            added.iter().map(|text| candidate(&growing.laboratory, text)).collect();
        let steps = corrections.iter().map(|one| growing.step_of(one)).collect();
        growing.add_corrections(corrections, steps, &watch).unwrap();
        growing.name_corrections(&watch).unwrap();
        let claims: Vec<Claim> = growing.steps.iter().map(|step| step.claim).collect();
        (claims, growing)
    };
    let (claims, growing) = asked(&[wave, "joint_gain(shoulder)"]);
    assert_eq!(claims, [Claim::Mechanism, Claim::Correction], "the gain is not there");
    assert!(growing.steps[0].may_be.is_empty() && !growing.steps[1].may_be.is_empty());
    let model = growing.laboratory.model();
    assert_eq!((model.effects.len(), model.corrections.len()), (2, 1));
    assert!(model.measured_region.is_some(), "a correction is left");
    let written = growing.steps[1].model.as_ref().unwrap();
    assert_eq!((&written.corrections, written.effects.len()), (&model.corrections, 2), "as it is written");
    let (claims, growing) = asked(&[wave]);
    assert_eq!(claims, [Claim::Mechanism]);
    let model = growing.laboratory.model();
    assert!(model.effects.len() == 1 && model.corrections.is_empty() && model.measured_region.is_none());
    let written = growing.steps[0].model.as_ref().unwrap();
    assert!(written.corrections.is_empty() && written.measured_region.is_none(), "as it is written");
    let (claims, _) = asked(&[wave, "joint_gain(elbow)"]);
    assert_eq!(claims, [Claim::Correction; 2], "both go with the pose of one joint");
    let (claims, _) = asked(&[wave, "joint_settling(elbow)"]);
    assert_eq!(
        claims,
        [Claim::Mechanism, Claim::Correction],
        "one goes with the pose, the other with the last move"
    );
}
