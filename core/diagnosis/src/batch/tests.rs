//! A family of harmonics taken in at one go, and a table without one.

use super::*;
use crate::testing::two_links;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::Site;

/// Joint (from 0), periods a turn, amplitude in rad.
const WAVES: [(usize, f64, f64); 4] = [(0, 9.0, 8e-4), (0, 20.0, 5e-4), (1, 7.0, 1e-3), (1, 12.0, 7e-4)];

fn waves(q: [f64; 2]) -> [f64; 2] {
    let mut off = [0.0; 2];
    for (joint, order, amplitude) in WAVES {
        off[joint] += amplitude * (order * q[joint] + 0.4).sin();
    }
    off
}

#[test]
fn every_wave_of_a_family_is_found_with_its_size_and_the_error_falls_from_one_to_the_next() {
    let lab = two_links(BATCH_ROWS + 40, "joint_zero(*)", 0.02, 41, waves);
    let batch = lab.batch(false, 0, &Progress::unwatched()).unwrap().unwrap();
    for (joint, order, amplitude) in WAVES {
        let site = ["shoulder", "elbow"][joint];
        let own = batch
            .steps
            .iter()
            .find(|step| step.added.effect.site == site && step.added.effect.n == Some(order));
        let own = own.unwrap_or_else(|| panic!("{site} {order}: {:?}", batch.steps));
        assert!(
            (own.added.size.to_radians() - amplitude).abs() < 4.0 * own.added.se.to_radians(),
            "{:?}",
            own.added
        );
    }
    assert!(batch.steps.len() <= WAVES.len() + 1, "{:?}", batch.steps);
    let fits: Vec<f64> = batch.steps.iter().map(|step| step.rms_mm.fit).collect();
    assert!(fits.windows(2).all(|pair| pair[1] < pair[0]), "{fits:?}");
    let last = batch.steps.last().unwrap();
    // Three readings of 0.02 mm make a point.
    assert!(
        (0.03..0.04).contains(&last.rms_mm.fit) && last.rms_mm.cv.unwrap() >= last.rms_mm.fit,
        "{last:?}"
    );
    let left_out: Vec<f64> = batch.steps.iter().filter_map(|step| step.rms_mm.cv).collect();
    assert_eq!(left_out.len(), batch.steps.len());
    assert!(left_out.windows(2).all(|pair| pair[1] < pair[0]), "{left_out:?}");
    assert!(
        last.model.is_some() && batch.steps[..batch.steps.len() - 1].iter().all(|step| step.model.is_none())
    );
    assert_eq!(batch.laboratory.model().effects.len(), batch.steps.len());
    assert!(batch.laboratory.batch(true, 0, &Progress::unwatched()).unwrap().is_none(), "nothing is left");
}

/// Claims of the elbow's waves of an order in a batch with corrections, of an arm of which three rows in ten are held out.
fn claims_of(order: f64, off: impl Fn([f64; 2]) -> [f64; 2]) -> Vec<Claim> {
    let lab = two_links(BATCH_ROWS + 200, "joint_zero(*)", 0.02, 49, off);
    let holdout = crate::split::Holdout::Random { fraction: 0.3, seed: 4 };
    let options = crate::laboratory::Options { holdout, ..lab.options().clone() };
    let lab = Laboratory::new(lab.model().clone(), lab.table().clone(), options).unwrap();
    let batch = lab.batch(false, 12, &Progress::unwatched()).unwrap().unwrap();
    let own = batch
        .steps
        .iter()
        .filter(|step| step.added.effect.site == "elbow" && step.added.effect.n == Some(order));
    let claims: Vec<Claim> = own.map(|step| step.claim).collect();
    let corrections = batch.steps.iter().filter(|step| step.claim == Claim::Correction).count();
    assert_eq!(batch.laboratory.model().corrections.len(), corrections);
    assert_eq!(batch.opened, u32::from(corrections > 0), "{:?}", batch.steps);
    let waves = batch.steps.iter().filter(|step| step.added.effect.n.is_some()).count();
    assert_eq!(batch.laboratory.model().priors.len(), waves, "every wave has a prior, and nothing else has");
    claims
}

#[test]
fn a_wave_of_low_order_that_is_there_is_a_mechanism_and_one_that_imitates_a_correction() {
    let there = |q: [f64; 2]| [waves(q)[0], waves(q)[1] + 0.002 * (3.0 * q[1]).sin()];
    assert_eq!(claims_of(3.0, there), [Claim::Mechanism]);
    // A cable that comes tight, which no wave and nothing else in the library is.
    let tight = |q: [f64; 2]| [waves(q)[0], waves(q)[1] + 0.004 * (q[1] - 0.4).max(0.0)];
    let claims: Vec<Claim> =
        [1.0, 2.0, 3.0, 4.0].into_iter().flat_map(|order| claims_of(order, tight)).collect();
    assert!(!claims.is_empty() && claims.iter().all(|claim| *claim == Claim::Correction), "{claims:?}");
    assert_eq!(claims_of(7.0, tight), [Claim::Mechanism], "its family is judged as a whole");
}

#[test]
fn an_effect_with_a_name_of_its_own_comes_in_beside_the_family() {
    let with_gain = |q: [f64; 2]| {
        let off = waves(q);
        [off[0], off[1] + 0.003 * q[1]]
    };
    let lab = two_links(BATCH_ROWS + 40, "joint_zero(*)", 0.02, 44, with_gain);
    let batch = lab.batch(false, 0, &Progress::unwatched()).unwrap().unwrap();
    let gain = batch.steps.iter().find(|step| step.label == "joint_gain(elbow)");
    let gain = gain.unwrap_or_else(|| panic!("{:?}", batch.steps));
    assert!((gain.added.size - 0.003).abs() < 4.0 * gain.added.se, "{:?}", gain.added);
}

#[test]
fn a_pick_is_rivalled_where_another_does_as_well_with_the_others_in() {
    let lab = two_links(60, "joint_zero(*)", 0.02, 45, |q| [0.0, 0.01 * q[1]]);
    let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
    let pool = pool::Pool::gather(&lab, &fitted, &Progress::unwatched()).unwrap();
    let gain_of = |joint: usize| {
        let own =
            pool.probes.iter().position(|probe| probe.id == EffectId::at("joint_gain", Site::Joint(joint)));
        pool::Pick { probe: own.unwrap() }
    };
    let (shoulder, elbow) = (gain_of(0), gain_of(1));
    assert_eq!(pool.rivals(&[elbow], 0), Some(Vec::new()), "nothing does what the elbow's gain does");
    assert_eq!(pool.rivals(&[shoulder, elbow], 1), Some(Vec::new()), "beside another as well");
    assert_ne!(
        pool.rivals(&[elbow, shoulder], 1),
        Some(Vec::new()),
        "the shoulder's gain is nothing, and so is all else"
    );
    assert_eq!(pool.rivals(&[elbow], 7), None, "there is no such pick");
    assert!(!pool.is_high_order(&elbow));
    let waves: Vec<bool> = [4.0, 5.0]
        .map(|order| {
            let own = pool.probes.iter().position(|probe| probe.id.order == Some(order));
            own.is_some_and(|probe| pool.is_high_order(&pool::Pick { probe }))
        })
        .to_vec();
    assert_eq!(waves, [false, true]);
}

#[test]
fn an_effect_that_is_there_predicts_what_is_left_out_in_every_way_that_is_asked() {
    let lab = two_links(60, "joint_zero(*)", 0.02, 46, |q| [0.0, 0.01 * q[1]]);
    let at = |joint: usize| EffectId::at("joint_gain", Site::Joint(joint));
    let added = [at(0), at(1)].map(|id| AddedEffect { id, values: vec![0.0] });
    let fitted = lab.fit_with(&added, None, &Progress::unwatched()).unwrap();
    let (problem, fit) = (&fitted.problem, &fitted.fit);
    let [weights, quarter] = [1.0, 0.25].map(|weight| vec![weight; lab.table().len()]);
    let joints = std::collections::BTreeSet::from([1]);
    let progress = Progress::unwatched();
    let weighed = |weights| {
        let rows = (fit.rows.as_slice(), weights);
        left_out::LeftOutPredictions::of(problem, &fit.state, rows, &joints, &progress).unwrap()
    };
    let predictions = weighed(weights.as_slice());
    // Effects that the model frees come first, in the order of the problem's parts.
    let index = |joint: usize| problem.parts.iter().position(|part| part.id == at(joint)).unwrap();
    let (nothing, real) = (predictions.gains(index(0)), predictions.gains(index(1)));
    // The shoulder was not asked for: by regions alone; the elbow by regions and by ranges of its own.
    assert_eq!((nothing.len(), real.len()), (1, 2));
    assert!(real.iter().all(|gain| gain.counts() && gain.total > 0.0), "{real:?}");
    assert!(!nothing[0].counts(), "{nothing:?}");
    let noise = predictions.noise();
    assert!((noise.variance.sqrt() / 0.02 - 1.0).abs() < 0.15, "{noise:?}");
    // Three readings a row, less two zeros and two gains.
    assert_eq!(noise.freedom, 176.0);
    // Where every row counts a quarter the metric sees a quarter of the variance.
    let predictions = weighed(quarter.as_slice());
    assert!((predictions.noise().variance / noise.variance - 0.25).abs() < 1e-6, "{:?}", predictions.noise());
    // A gain is that of rows, whatever they count.
    let same = predictions.gains(index(1));
    assert!(
        same.iter().zip(&real).all(|(one, other)| (one.total / other.total - 1.0).abs() < 1e-6),
        "{same:?}"
    );
}

#[test]
fn small_tables_and_those_without_a_family_are_left_to_the_search_one_by_one() {
    let small = two_links(BATCH_ROWS - 1, "joint_zero(*)", 0.02, 42, waves);
    assert!(small.batch(false, 0, &Progress::unwatched()).unwrap().is_none());
    let plain = two_links(BATCH_ROWS, "joint_zero(*)", 0.02, 43, |q| [0.0, 0.002 * q[1]]);
    assert!(plain.batch(false, 0, &Progress::unwatched()).unwrap().is_none());
}

/// Which gains that are taken in are no mechanisms, of an arm whose elbow has a gain that is wrong and turns by so much of its range: those that are doubted, and corrections.
fn not_claimed(range: f64, gains: &[usize]) -> [Vec<usize>; 2] {
    let lab = two_links(90, "joint_zero(*)", 0.02, 45, |q| [0.0, (1.01 * range - 1.0) * q[1]]);
    let lab = crate::testing::with_table(&lab, |table| {
        table.q.iter_mut().skip(1).step_by(2).for_each(|elbow| *elbow *= range);
    });
    let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
    let floor =
        Floor { sigma_mm: Some(0.02), dof: 90, scale: Some(0.02), ..Floor::among(&fitted.problem, None) };
    let pool = pool::Pool::gather(&lab, &fitted, &Progress::unwatched()).unwrap();
    let of = |joint: usize| {
        let gain = EffectId::at("joint_gain", Site::Joint(joint));
        pool.probes.iter().position(|probe| probe.id == gain).unwrap()
    };
    let picks: Vec<Pick> = gains.iter().map(|joint| Pick { probe: of(*joint) }).collect();
    let found = lab
        .judged(&pool, &picks, |probe| pool.has_own_name(probe), (&fitted, &floor), &Progress::unwatched())
        .unwrap();
    let corrections: Vec<usize> = found.in_place.iter().map(|one| one.probe).collect();
    [found.doubtful, corrections].map(|found| {
        let gains = gains.iter().copied();
        gains.filter(|joint| found.contains(&of(*joint))).collect()
    })
}

#[test]
fn a_name_in_a_batch_is_doubted_where_it_does_not_predict_and_a_correction_where_another_does_as_well() {
    let none: Vec<usize> = Vec::new();
    assert_eq!(not_claimed(1.0, &[1]), [none.clone(), none.clone()]);
    assert_eq!(not_claimed(1.0, &[0, 1]), [vec![0], none.clone()], "the shoulder has no gain");
    let short = not_claimed(0.1, &[1]);
    assert_eq!(short, [none, vec![1]], "over a tenth of the range a wave does what the gain does");
}
