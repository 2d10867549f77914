//! What is identified among structure that nothing explains, on a small made-up arm.

use super::*;
use crate::Verdict;
use crate::laboratory::Laboratory;
use crate::testing::{two_links, with_table};
use plumb_estimation::Progress;

/// An error of the shoulder that no effect of the library describes: it goes with both joints at once.
fn dirt(q: [f64; 2]) -> f64 {
    0.0004 * (2.3 * q[0] + 1.7 * q[1]).sin()
}

/// Amplitude of a wave of twelve periods a turn at the elbow, rad.
const WAVE: f64 = 0.0015;

pub(super) fn wave(q: f64) -> f64 {
    WAVE * (12.0 * q).sin()
}

#[test]
fn an_effect_is_named_among_dirt_with_its_size_and_what_is_left() {
    let lab = two_links(150, "joint_zero(*)", 0.05, 3, |q| [dirt(q), wave(q[1])]);
    let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
    let named = diagnosis.named.as_ref().unwrap_or_else(|| panic!("{diagnosis:#?}"));
    assert_eq!((named.effect.effect.as_str(), named.effect.site.as_str()), ("joint_harmonic", "elbow"));
    assert_eq!(named.effect.n, Some(12.0));
    assert!((named.size.to_radians() - WAVE).abs() < 4.0 * named.se.to_radians(), "{named:?}");
    // Dirt of 0.28 mrad RMS on 300 mm, and noise, which nobody knows here.
    let left = diagnosis.left_unexplained_mm.unwrap();
    assert!((0.08..0.16).contains(&left), "{left}");
    assert!(diagnosis.probability.unwrap() > 0.95, "{:?}", diagnosis.probability);
}

#[test]
fn of_two_effects_in_dirt_the_larger_is_named_first() {
    let both = |q: [f64; 2]| [dirt(q) + 0.0005 * (7.0 * q[0]).sin(), wave(q[1])];
    let diagnosis = two_links(150, "joint_zero(*)", 0.05, 11, both).diagnose(&Progress::unwatched()).unwrap();
    let named = diagnosis.named.as_ref().unwrap_or_else(|| panic!("{diagnosis:#?}"));
    assert_eq!((named.effect.site.as_str(), named.effect.n), ("elbow", Some(12.0)), "{diagnosis:#?}");
}

/// The side from which a pose is approached: either, with no order in it.
fn side(q: [f64; 2]) -> f64 {
    if (1e5 * (q[0] + 0.7 * q[1])).sin() > 0.0 { 1.0 } else { -1.0 }
}

/// The arm among dirt, approached from either side at random: so much of play (rad) at the elbow, as a function of its coordinate.
fn with_play(seed: u64, play: impl Fn(f64) -> f64) -> Laboratory {
    let lab = two_links(150, "joint_zero(*)", 0.05, seed, |q| [dirt(q), -0.5 * side(q) * play(q[1])]);
    with_table(&lab, |table| {
        let sides = (0..150).flat_map(|row| [0, side([table.q_of(row)[0], table.q_of(row)[1]]) as i8]);
        table.approach = Some(sides.collect());
    })
}

#[test]
fn play_is_named_although_a_smooth_function_of_the_side_of_approach_does_as_well() {
    for seed in 0..4 {
        let diagnosis = with_play(seed, |_| 0.002).diagnose(&Progress::unwatched()).unwrap();
        let named = diagnosis.named.as_ref().unwrap_or_else(|| panic!("{seed}: {diagnosis:#?}"));
        assert_eq!((named.effect.effect.as_str(), named.effect.site.as_str()), ("joint_backlash", "elbow"));
        assert!((named.size.to_radians() - 0.002).abs() < 4.0 * named.se.to_radians(), "{named:?}");
    }
}

#[test]
fn play_that_changes_along_its_joint_is_not_the_same_everywhere_and_gets_no_name() {
    // Smooth functions of the side do as well as play that is the same everywhere, and more than it.
    let uneven: fn(f64) -> f64 = |q| 0.0015 * (1.0 + 0.8 * (4.0 * q).sin());
    // Where teeth are worn a mechanism without a name describes it well enough.
    let worn: fn(f64) -> f64 = |q| 0.008 * (-0.5 * ((q + 0.3) / 0.7).powi(2)).exp();
    for (play, seed) in [(uneven, 1), (uneven, 2), (worn, 0), (worn, 1)] {
        let diagnosis = with_play(seed, play).diagnose(&Progress::unwatched()).unwrap();
        let named = diagnosis.named.as_ref();
        assert_eq!((diagnosis.verdict, named), (Verdict::Located, None), "{seed}: {diagnosis:#?}");
    }
}

#[test]
fn a_sawtooth_is_no_wave() {
    // Twelve teeth a turn: the first wave of it accounts for six tenths of its squares.
    let teeth = |q: f64| 2.0 * WAVE * ((12.0 * q / std::f64::consts::TAU).rem_euclid(1.0) - 0.5);
    for seed in 0..3 {
        let lab = two_links(150, "joint_zero(*)", 0.05, seed, |q| [dirt(q), teeth(q[1])]);
        let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
        assert_ne!(diagnosis.verdict, Verdict::Named, "{diagnosis:#?}");
    }
}

#[test]
fn dirt_alone_gets_no_name() {
    for seed in 0..6 {
        let lab = two_links(150, "joint_zero(*)", 0.05, seed, |q| [dirt(q), 0.0]);
        let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
        assert_ne!(diagnosis.verdict, Verdict::Named, "{diagnosis:#?}");
    }
}

#[test]
fn probabilities_follow_marginal_likelihoods() {
    // Criteria are twice the negative logarithm: 2 ln 3 apart is three to one.
    let likely = posterior(&[10.0, 10.0 + 2.0 * 3.0_f64.ln(), 1e4]);
    assert!((likely[0] - 0.75).abs() < 1e-12 && (likely[1] - 0.25).abs() < 1e-12 && likely[2] < 1e-12);
}

#[test]
fn what_a_row_leaves_is_parted_along_its_motion_and_across_it_for_each_direction() {
    let parts = |way: &[f64], own: &[f64]| {
        let [way, own] = [way, own].map(DVector::from_row_slice);
        along_and_across(way.rows(0, way.len()), own.rows(0, own.len()))
    };
    // (6, 8, 5) along (3, 4, 0): 10, and 5 across, of two directions.
    assert_eq!(parts(&[3.0, 4.0, 0.0], &[6.0, 8.0, 5.0]), Some((100.0, 12.5)));
    assert_eq!(parts(&[1.0, 0.0], &[2.0, 3.0]), Some((4.0, 9.0)));
    assert_eq!(parts(&[1.0], &[2.0]), None, "one reading has no direction across");
    assert_eq!(parts(&[0.9 * LEAST_MOTION, 0.0], &[2.0, 3.0]), None, "it does not move");
    assert!(parts(&[1.1 * LEAST_MOTION, 0.0], &[2.0, 3.0]).is_some());
}

#[test]
fn waves_imitate_anything_and_play_does_not() {
    let at = |name: &str| EffectId::at(name, Site::Joint(0));
    assert!(
        imitates(&at("joint_harmonic")) && !imitates(&at("joint_backlash")) && !imitates(&at("no_effect"))
    );
    assert!(
        is_of_a_joint(&at("joint_gain"))
            && !is_of_a_joint(&at("link_length"))
            && !is_of_a_joint(&at("no_effect"))
    );
}

/// A stage of an arm whose links are longer than its model has them by so much (mm), and whose elbow has a wave of this amplitude.
fn with_left_out_geometry(longer: [f64; 2], amplitude: f64, found: &[&str]) -> bool {
    let lab = two_links(120, "joint_zero(*)", 0.05, 21, |q| [0.0, amplitude * (12.0 * q[1]).sin()]);
    let mut model = lab.model().clone();
    model.chain.joints[0].a -= longer[0];
    model.chain.joints[1].a -= longer[1];
    let lab = lab.with_model(model);
    let listed = crate::candidates::probes(&lab);
    let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
    let base = lab.stage(Vec::new(), None, &none, &Progress::unwatched()).unwrap();
    let found: Vec<EffectId> =
        found.iter().map(|text| plumb_calibration::effect::parse(text, lab.model()).unwrap()).collect();
    assert!(
        !explains_as_well(&base, &listed, &found, &[]),
        "rows that are outliers with it in are not asked"
    );
    explains_as_well(&base, &listed, &found, &base.fitted.fit.rows)
}

#[test]
fn geometry_that_is_not_free_is_a_rival_of_what_imitates_it_and_of_nothing_else() {
    let wave = "joint_harmonic(elbow, 12)";
    assert!(!with_left_out_geometry([0.0; 2], WAVE, &[wave]), "the links are right");
    assert!(with_left_out_geometry([0.6, -0.5], 0.0, &["joint_gain(elbow)"]), "the links are wrong");
    // Where both are wrong the wave explains what no link does.
    assert!(!with_left_out_geometry([0.6, -0.5], WAVE, &[wave]));
    assert!(!with_left_out_geometry([0.6, -0.5], 0.0, &[]), "nothing was found");
    // Two waves of orders that the arm does not have explain no more than the links.
    let waves = ["joint_harmonic(shoulder, 1)", "joint_harmonic(elbow, 1)"];
    assert!(with_left_out_geometry([0.6, -0.5], 0.0, &waves));
}

#[test]
fn effects_pay_for_being_chosen_from_the_second_on() {
    // 2 ln of (k - i) / (i + 1) each: of ten families 9 / 2 and 8 / 3.
    assert_eq!(
        (left_out_geometry::cost_of_choice(10.0, 0), left_out_geometry::cost_of_choice(10.0, 1)),
        (0.0, 0.0)
    );
    assert!((left_out_geometry::cost_of_choice(10.0, 2) - 2.0 * 4.5_f64.ln()).abs() < 1e-12);
    assert!(
        (left_out_geometry::cost_of_choice(10.0, 3) - 2.0 * (4.5_f64.ln() + (8.0_f64 / 3.0).ln())).abs()
            < 1e-12
    );
    assert!(
        (left_out_geometry::cost_of_choice(1.0, 2) - 2.0 * 0.5_f64.ln()).abs() < 1e-12,
        "never of fewer than one"
    );
}

/// What is asked of the wave of twelve periods at the elbow, beside effects that are in as well, of an arm whose joints are off so.
pub(super) fn with_wave_in<T>(
    beside: &[&str],
    off: impl Fn([f64; 2]) -> [f64; 2],
    ask: impl Fn(&Bench<'_>, &Set) -> T,
) -> T {
    let lab = two_links(120, "joint_zero(*)", 0.05, 21, off);
    let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
    let mut stage = lab.stage(Vec::new(), None, &none, &Progress::unwatched()).unwrap();
    let expected: Vec<EffectId> = std::iter::once("joint_harmonic(elbow, 12)")
        .chain(beside.iter().copied())
        .map(|text| plumb_calibration::effect::parse(text, lab.model()).unwrap())
        .collect();
    stage.fitted_candidates = expected
        .iter()
        .map(|id| FittedCandidate { id: id.clone(), ..crate::testing::fitted_candidate("", 0, 0.0) })
        .collect();
    let (problem, fit) = (&stage.fitted.problem, &stage.fitted.fit);
    let rows = fit.rows.clone();
    let mut features = Features::plain(problem, fit, &rows);
    features.carriers = Features::of(problem, fit, &rows).carriers;
    let Asked { candidates, overtones, columns } = candidates(&stage, &Linearization::Stage, &[], &rows);
    let mixed = Mixed::new(&features, &columns).unwrap();
    let (nothing, equations) = (mixed.fit(&[], None).unwrap(), columns.nrows() as f64);
    let bench = Bench { stage: &stage, candidates, overtones, rows, features, mixed, nothing, equations };
    let members: Vec<usize> = (0..expected.len()).collect();
    let set = bench.fitted(&members, &bench.nothing.ratios, 9).unwrap();
    ask(&bench, &set)
}

/// What is said of other things at the joint of that wave.
fn company_of_the_wave(beside: &[&str], off: impl Fn([f64; 2]) -> [f64; 2]) -> Option<Doubt> {
    with_wave_in(beside, off, |bench, set| bench.company(&bench.in_set(0, set), true))
}

#[test]
fn what_is_left_along_a_joints_motion_is_summed_over_the_rows_and_held_against_what_is_across() {
    let parts = |gain: f64| {
        let off = move |q: [f64; 2]| [0.0, wave(q[1]) + gain * q[1]];
        with_wave_in(&[], off, |bench, set| {
            let one = |joint: usize| bench.along_and_across(joint, set);
            (one(1), one(7), bench.equations)
        })
    };
    // Some 120 rows of noise of 0.05 mm a direction; a gain of a hundredth is 1.5 mm along the motion.
    let ((along, across), nowhere, equations) = parts(0.0);
    let expected = equations / 3.0 * 0.0025;
    assert!(
        (along / expected - 1.0).abs() < 0.3 && (across / expected - 1.0).abs() < 0.3,
        "{along} {across}"
    );
    assert_eq!(nowhere, (0.0, 0.0), "there is no such joint");
    let ((along, across), ..) = parts(0.01);
    assert!(along > 50.0 * across, "{along} {across}");
}

#[test]
fn a_wave_has_company_in_strong_overtones_and_in_what_else_moves_its_joint_as_much() {
    let with = |overtone: f64| move |q: [f64; 2]| [0.0, wave(q[1]) + overtone * WAVE * (36.0 * q[1]).sin()];
    assert_eq!(company_of_the_wave(&[], with(0.0)), None);
    // A quarter of the squares is half of the amplitude.
    assert_eq!(company_of_the_wave(&[], with(0.4)), None);
    assert_eq!(company_of_the_wave(&[], with(0.6)), Some(Doubt::Unlisted(Site::Joint(1))));
    let gain = |elbow: f64, shoulder: f64| move |q: [f64; 2]| [shoulder * q[0], wave(q[1]) + elbow * q[1]];
    assert_eq!(company_of_the_wave(&["joint_gain(elbow)"], gain(0.01, 0.0)), Some(Doubt::MoreAtItsJoint));
    assert_eq!(company_of_the_wave(&["joint_gain(elbow)"], gain(0.0001, 0.0)), None, "it does little");
    assert_eq!(company_of_the_wave(&["joint_gain(shoulder)"], gain(0.0, 0.01)), None, "at another joint");
}

#[test]
fn a_place_is_known_unless_something_else_does_as_well() {
    let with = |doubt: Option<Doubt>| {
        let mechanism = Mechanism::made(vec![0], doubt);
        (mechanism.knows_its_site(), mechanism.is_reported())
    };
    assert_eq!(with(None), (false, true), "it has a name");
    for doubt in [Doubt::MoreAtItsJoint, Doubt::NotPredicted, Doubt::Size] {
        assert_eq!(with(Some(doubt)), (true, true));
    }
    for doubt in [Doubt::Smooth, Doubt::NotPassed, Doubt::Unlisted(Site::Base)] {
        assert_eq!(with(Some(doubt)), (false, false));
    }
}

#[test]
fn values_beside_the_flexible_part_have_the_errors_that_blocks_of_rows_show() {
    // Standard errors of both parts of the wave: as the fit has them, and by blocks.
    let errors = |elsewhere: f64| {
        let off = move |q: [f64; 2]| [elsewhere * (40.0 * q[0] * q[1]).sin(), wave(q[1])];
        with_wave_in(&[], off, |bench, set| {
            let own = bench.values(set, 0).1.diagonal().map(f64::sqrt);
            let blocks = errors_by_blocks(bench, &bench.in_set(0, set)).unwrap();
            assert_eq!((own.len(), blocks.len()), (2, 2));
            (own.norm(), blocks[0].hypot(blocks[1]))
        })
    };
    let (own, blocks) = errors(0.0);
    // Four errors of nine degrees of freedom each: between a half and twice the true one.
    assert!((0.5..2.0).contains(&(blocks / own)), "{blocks} {own}");
    let (_, more) = errors(0.004);
    assert!(more > 2.0 * blocks, "what nobody knows moves the wave from block to block: {more} {blocks}");
}
