//! The gain of an effect on rows it has not seen: of one that is there, and of one that only fits.

use super::*;
use crate::laboratory::Laboratory;
use crate::testing::two_links;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::Site;
use plumb_estimation::Progress;

#[test]
fn a_gain_has_the_standard_error_of_a_sum() {
    // Deviations -2, 0, 2, 0 from the mean of 3: variance 8 / 3, and of the sum of four 4 times that.
    let reductions = [1.0, 3.0, 5.0, 3.0];
    let gain = Gain::over(&reductions).unwrap();
    let error = (4.0 * (4.0 + 0.0 + 4.0 + 0.0) / 3.0_f64).sqrt();
    assert!((gain.total - 12.0).abs() < 1e-12 && (gain.error - error).abs() < 1e-12);
    assert!(Gain::over(&reductions[..2]).is_none(), "two poses have no scatter to speak of");
}

#[test]
fn a_gain_counts_above_its_standard_error_only() {
    let counts = |total: f64| Gain { total, error: 2.0 }.counts();
    assert!(counts(2.0 * 1.01 * GAIN_ERRORS) && !counts(2.0 * 0.99 * GAIN_ERRORS));
    assert!(!counts(0.0) && !counts(-1.0) && !counts(-5.0), "a loss is no gain, however small");
}

/// The fall in sample (squared sigmas) and the gains out of sample of an effect's two waves at the elbow.
fn waves(amplitude: f64, seed: u64) -> (f64, Vec<Gain>) {
    let lab = two_links(24, "joint_zero(*)", 0.5, seed, |q| [0.0, amplitude * (2.0 * q[1]).sin()]);
    let id = EffectId { order: Some(2.0), ..EffectId::at("joint_harmonic", Site::Joint(1)) };
    let count = plumb_calibration::effect::build(&id, lab.model()).unwrap().parameters().len();
    let before = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
    let more = [AddedEffect { id: id.clone(), values: vec![0.0; count] }];
    let after = lab.fit_with(&more, Some(&before), &Progress::unwatched()).unwrap();
    let reduction = before.fit.normal.squares - after.fit.normal.squares;
    (
        reduction,
        Judge::of(&before, Holdout::Regions, std::iter::once(&id))
            .gains(&after.fit, &Derivatives::of(&after.problem, &after.fit), &id)
            .0,
    )
}

#[test]
fn what_is_promised_is_what_is_left_in_points_not_the_root_of_what_goes() {
    // Points 3 and 5 mm off, 1 mm each with the effect: the root mean square falls from 4.12 to 1, not by the root of the fall of the squares (4).
    let row = |squares: Vec<f64>| Some(LeftOut { distance: (1.0, squares.len()), squares });
    let before = [row(vec![9.0]), None, row(vec![25.0])];
    let after = [row(vec![1.0]), row(vec![100.0]), row(vec![1.0])];
    let promise = Promise::of(&before, &after).unwrap();
    assert!((promise.before_mm - 17.0_f64.sqrt()).abs() < 1e-12 && (promise.after_mm - 1.0).abs() < 1e-12);
    assert_eq!(Promise::of(&before[..1], &after[1..2]), Promise::of(&[row(vec![9.0])], &[row(vec![100.0])]));
    assert!(Promise::of(&[None], &after[..1]).is_none(), "no row is predicted both ways");
}

#[test]
fn an_effect_that_is_there_predicts_rows_it_has_not_seen() {
    for seed in 0..5 {
        let (reduction, gains) = waves(0.02, seed);
        assert!(reduction > 0.0 && gains.len() == 2, "by regions and by ranges of its joint");
        assert!(gains.iter().all(Gain::counts), "seed {seed}: {gains:?}");
    }
}

#[test]
fn an_effect_that_is_not_there_fits_but_does_not_predict() {
    let (mut reductions, mut gains) = (0.0, 0.0);
    for seed in 0..12 {
        let (reduction, ways) = waves(0.0, 100 + seed);
        reductions += reduction;
        gains += ways.iter().map(|gain| gain.total).sum::<f64>() / ways.len() as f64;
        assert!(!ways.iter().all(Gain::counts), "seed {seed}: {ways:?}");
    }
    assert!(reductions > 0.0, "in sample two more parameters always explain something");
    assert!(gains < 0.0, "out of sample they do harm: {gains}");
}

#[test]
fn a_gain_counts_above_one_standard_error_and_nothing_at_all_is_no_gain() {
    let counts = |total: f64| Gain { total, error: 2.0 }.counts();
    assert!(counts(2.02 * GAIN_ERRORS) && !counts(2.0 * GAIN_ERRORS) && !counts(-9.0));
    assert!(!Gain { total: 0.0, error: 0.0 }.counts());
}

#[test]
fn what_an_effect_promises_is_the_same_whichever_way_it_is_asked() {
    let lab = two_links(24, "joint_zero(*)", 0.05, 6, |q| [0.0, 0.02 * q[1]]);
    let id = EffectId::at("joint_gain", Site::Joint(1));
    let before = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
    let more = [AddedEffect { id: id.clone(), values: vec![0.0] }];
    let after = lab.fit_with(&more, Some(&before), &Progress::unwatched()).unwrap();
    let promise = Judge::of(&before, Holdout::Regions, std::iter::empty()).promise(&after).unwrap();
    assert_eq!(
        Judge::of(&before, Holdout::Regions, std::iter::once(&id))
            .gains(&after.fit, &Derivatives::of(&after.problem, &after.fit), &id)
            .1,
        Some(promise)
    );
    // Three coordinates of 0.05 mm are left.
    assert!((0.06..0.13).contains(&promise.after_mm) && promise.before_mm > 1.0, "{promise:?}");
}

#[test]
fn what_an_effect_promises_is_foretold_as_the_held_out_rows_are_chosen() {
    // The elbow's wave is not known where a region is left out, and between poses it is.
    let lab = two_links(80, "joint_zero(*), geometry(*)", 0.05, 6, |q| [0.0, 0.01 * (2.0 * q[1]).sin()]);
    let id = EffectId { order: Some(2.0), ..EffectId::at("joint_harmonic", Site::Joint(1)) };
    let before = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
    let more = [AddedEffect { id: id.clone(), values: vec![0.0; 2] }];
    let after = lab.fit_with(&more, Some(&before), &Progress::unwatched()).unwrap();
    let promised = |holdout: Holdout| {
        let promise = Judge::of(&before, holdout, std::iter::empty()).promise(&after).unwrap();
        let asked = Judge::of(&before, holdout, std::iter::once(&id)).gains(
            &after.fit,
            &Derivatives::of(&after.problem, &after.fit),
            &id,
        );
        assert_eq!(asked.1, Some(promise), "{holdout}: as it is judged");
        assert_eq!(asked.0.len(), 2, "{holdout}: and judged by regions and ranges of the joint all the same");
        promise.before_mm
    };
    let [regions, none, random, time] = [
        Holdout::Regions,
        Holdout::None,
        Holdout::Random { fraction: 0.3, seed: 4 },
        Holdout::Time { fraction: 0.3 },
    ]
    .map(promised);
    assert_eq!(regions, none);
    // Points are drawn at random, so that stretches of the order are random parts, too.
    assert!(regions > 1.05 * random && (random / time - 1.0).abs() < 0.2, "{regions} {random} {time}");
    // What held-out rows show of the same model.
    let held_out = Laboratory::new(
        lab.model().clone(),
        lab.table().clone(),
        crate::laboratory::Options {
            holdout: Holdout::Random { fraction: 0.3, seed: 4 },
            ..lab.options().clone()
        },
    );
    let shown = held_out.unwrap().compare(&Progress::unwatched()).unwrap().rms_mm.check.unwrap();
    assert!((random / shown - 1.0).abs() < 0.2, "{random} promised of {shown}");
}

#[test]
fn rows_are_left_out_by_days_unless_each_has_numbers_of_its_own_and_by_ranges_of_the_joints_asked() {
    let lab = two_links(24, "joint_zero(*)", 0.05, 6, |_| [0.0; 2]);
    let lab = crate::testing::with_table(&lab, |table| {
        table.session.names = vec!["monday".to_owned(), "tuesday".to_owned()];
        table.session.of_row = (0..24).map(|row| Some(row / 12)).collect();
    });
    let judge = |lab: &Laboratory| {
        let before = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
        let judge = Judge::of(
            &before,
            Holdout::Regions,
            std::iter::once(&EffectId::at("joint_gain", Site::Joint(1))),
        );
        let blocks: Vec<usize> = judge.joints.iter().map(|way| way.blocks.len()).collect();
        (judge.sessions.map(|days| days.blocks), blocks)
    };
    let halves: Vec<Vec<usize>> = vec![(0..12).collect(), (12..24).collect()];
    let (days, of_joints) = judge(&lab);
    assert_eq!(days, Some(halves));
    assert!(of_joints[0] == 0 && of_joints[1] > 1, "{of_joints:?}");
    let mut model = lab.model().clone();
    model.epochs = Some(Epochs::Sessions(vec!["monday".to_owned(), "tuesday".to_owned()]));
    assert_eq!(judge(&lab.with_model(model)).0, None, "what one day has of its own another does not show");
}
