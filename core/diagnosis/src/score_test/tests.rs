//! Scores of small linear problems whose answers are known in closed form.

use super::*;
use plumb_calibration::effect::{Contribution, Parameter, Sample, Unit};

/// An effect with these plausible ranges; what it does to an arm plays no part here.
#[derive(Debug)]
struct Ranged(Vec<Parameter>);

impl Effect for Ranged {
    fn parameters(&self) -> &[Parameter] {
        &self.0
    }

    fn contribute(&self, _: &Sample<'_>, _: &mut Vec<Contribution>) {}
}

fn probe(ranges: &[(f64, f64)]) -> Probe {
    let parameters = ranges.iter().map(|range| Parameter::new("a", Unit::RATIO, *range)).collect();
    Probe {
        id: EffectId::at("joint_zero", plumb_calibration::effect::Site::Base),
        effect: Arc::new(Ranged(parameters)),
        search: Search::Nothing,
        family: 1,
        weight: 1.0,
        search_cost: 0.0,
    }
}

/// The score of columns none of which is absorbed.
fn scored(probe: &Probe, columns: &DMatrix<f64>, residuals: &DVector<f64>, noise: Noise) -> Score {
    let own = columns.tr_mul(columns);
    score_one(probe, &own, &own, &columns.tr_mul(residuals), noise)
}

#[test]
fn one_column_gives_the_slope_the_gain_and_the_f_test_of_regression() {
    // y = 2 x + e through the origin: slope x'y / x'x, gain (x'y)^2 / x'x.
    let x = DMatrix::from_column_slice(4, 1, &[1.0, 2.0, 3.0, 4.0]);
    let y = DVector::from_vec(vec![2.1, 3.9, 6.2, 7.8]);
    let noise = Noise { variance: y.norm_squared() / 4.0, freedom: 4.0 };
    let score = scored(&probe(&[(-10.0, 10.0)]), &x, &y, noise);
    let (products, squares) = (59.7, 30.0);
    assert!((score.values[0] - products / squares).abs() < 1e-12);
    assert!((score.gain - products * products / squares).abs() < 1e-9);
    assert_eq!((score.freedom, score.left.1), (1, 3.0));
    let left: f64 = f64::max(y.norm_squared() - score.gain, 0.01 * y.norm_squared());
    assert!((score.left.0 - left).abs() < 1e-9);
    assert!((score.p - f_tail(score.gain / (left / 3.0), 1.0, 3.0)).abs() < 1e-15);
    assert!((score.covariance[(0, 0)] - left / 3.0 / squares).abs() < 1e-12);
}

#[test]
fn directions_that_are_absorbed_add_no_parameter() {
    let columns = DMatrix::from_row_slice(3, 2, &[1.0, 2.0, 1.0, 2.0, 0.0, 0.0]);
    let noise = Noise { variance: 1.0, freedom: 20.0 };
    let score = scored(&probe(&[(-9.0, 9.0); 2]), &columns, &DVector::from_vec(vec![3.0, 3.0, 0.0]), noise);
    assert_eq!(score.freedom, 1, "two collinear columns are one parameter");
    let own = DMatrix::from_row_slice(1, 1, &[4.0]);
    let nothing = DMatrix::from_row_slice(1, 1, &[0.5 * 4.0 * ABSORBED_REST]);
    assert_eq!(information_inverse(&nothing, &units(&own)).1, 0);
    let little = DMatrix::from_row_slice(1, 1, &[2.0 * 4.0 * ABSORBED_REST]);
    assert_eq!(information_inverse(&little, &units(&own)).1, 1);
    assert!((absorbed(&own, &DMatrix::from_row_slice(1, 1, &[1.0]), &units(&own)) - 0.75).abs() < 1e-12);
}

#[test]
fn an_effect_that_could_not_be_seen_at_its_greatest_size_is_no_candidate() {
    // A range of +-1 and squares S: visible from S >= VISIBLE_VARIANCES on, for a variance of one.
    let at = |squares: f64| {
        let column = DMatrix::from_column_slice(1, 1, &[squares.sqrt()]);
        let noise = Noise { variance: 1.0, freedom: 30.0 };
        scored(&probe(&[(-1.0, 1.0)]), &column, &DVector::from_vec(vec![5.0]), noise)
    };
    assert_eq!((at(1.1 * VISIBLE_VARIANCES).freedom, at(0.9 * VISIBLE_VARIANCES).freedom), (1, 0));
    assert_eq!(at(0.9 * VISIBLE_VARIANCES).p, 1.0);
}

#[test]
fn a_value_outside_its_range_by_more_than_two_standard_errors_is_implausible() {
    let probe = probe(&[(0.0, 1.0)]);
    let covariance = DMatrix::from_element(1, 1, 0.01);
    let plausible = |value: f64| is_plausible(probe.effect.as_ref(), &[value], &covariance);
    assert!(plausible(1.19) && !plausible(1.21) && plausible(-0.19) && !plausible(-0.21));
}

#[test]
fn a_searched_parameter_makes_the_same_gain_less_improbable() {
    let x = DMatrix::from_column_slice(4, 1, &[1.0, 2.0, 3.0, 4.0]);
    let noise = Noise { variance: 1.0, freedom: 40.0 };
    let mut score = scored(&probe(&[(-10.0, 10.0)]), &x, &DVector::from_vec(vec![1.0, 1.0, 1.0, 1.0]), noise);
    let before = score.p;
    score.charge_parameter();
    let (left, below) = score.left;
    assert!(score.p > before);
    assert!((score.p - f_tail(score.gain / 2.0 / (left / (below - 1.0)), 2.0, below - 1.0)).abs() < 1e-15);
}

#[test]
fn information_drops_what_is_rounding_and_keeps_the_rest() {
    let own = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 9.0]);
    let beyond = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.1 * 9.0 * ABSORBED_REST]);
    let clean = information(&own, &beyond);
    assert!((clean - DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0])).norm() < 1e-12);
}

#[test]
fn a_column_of_nothing_has_no_unit() {
    let own = DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 0.0, 1.0, 0.25, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(units(&own), DVector::from_vec(vec![0.5, 2.0, 0.0]));
    let expected = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(in_units(&own, &units(&own)), expected);
}

#[test]
fn a_number_that_could_not_be_seen_is_left_out_of_its_row_and_its_column() {
    let beyond = DMatrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 9.0]);
    let without =
        |shown: [f64; 2], variance: f64| without_unseen(&beyond, &shown, Noise { variance, freedom: 9.0 });
    assert_eq!(without([0.11, 5.0], 1.0), (beyond.clone(), false));
    let second = DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 0.0, 9.0]);
    assert_eq!(without([0.09, 5.0], 1.0), (second.clone(), true), "less than a tenth of the variance");
    assert_eq!(without([0.19, 5.0], 2.0), (second, true), "of twice the variance");
    assert_eq!(without([5.0, 0.09], 1.0).0, DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 0.0]));
    // At the farther end of its range a number shows most.
    let ranged = probe(&[(-3.0, 2.0), (0.0, 0.5)]);
    assert_eq!(shown_at_most(ranged.effect.as_ref(), &beyond), [36.0, 2.25]);
}

#[test]
fn an_unseen_number_keeps_no_value_and_the_others_are_as_without_it() {
    // The second column is 30 times as weak as its range allows to see.
    let columns = DMatrix::from_row_slice(3, 2, &[1.0, 0.0, 2.0, 0.0, 2.0, 0.01]);
    let residuals = DVector::from_vec(vec![1.0, 2.0, 2.0]);
    let noise = Noise { variance: 1.0, freedom: 30.0 };
    let score = scored(&probe(&[(-9.0, 9.0), (-1.0, 1.0)]), &columns, &residuals, noise);
    assert!(score.has_unseen && score.values[1] == 0.0, "{:?}", score.values);
    // 9 / 9 by the first alone, with the variance that is left over nine squares.
    assert!((score.values[0] - 1.0).abs() < 1e-12);
    assert!((score.covariance[(0, 0)] - score.left.0 / score.left.1 / 9.0).abs() < 1e-12);
    assert_eq!(score.covariance[(1, 1)], 0.0);
    // Squares of 9 and 0.0001, two parameters.
    assert!((score.strength - (9.0001_f64 / 2.0).sqrt()).abs() < 1e-12);
    let seen = scored(&probe(&[(-9.0, 9.0), (-900.0, 900.0)]), &columns, &residuals, noise);
    assert!(!seen.has_unseen);
}

#[test]
fn a_gain_is_tested_against_what_it_leaves_on_the_degrees_it_leaves() {
    let noise = Noise { variance: 2.0, freedom: 10.0 };
    // 20 squares; P(F with 2 and 8 degrees > f) = (1 + f / 4)^-4, and f is 10 / 2 over 10 / 8.
    let (left, p) = f_test(10.0, 2, noise);
    assert_eq!(left, (10.0, 8.0));
    assert!((p - 2.0_f64.powi(-4)).abs() < 1e-9, "{p}");
    assert_eq!(f_test(3.0, 0, noise), ((17.0, 10.0), 1.0), "without a number there is no gain to test");
    assert_eq!(f_test(30.0, 2, noise).0, (0.01 * 20.0, 8.0), "one percent is left whatever is promised");
    assert_eq!(f_test(10.0, 12, noise).0, (10.0, 1.0), "one degree at least");
}

#[test]
fn what_the_fitted_numbers_take_of_a_candidate_is_a_share_from_nought_to_one() {
    let own = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 9.0]);
    let fraction = |first: f64, second: f64| {
        absorbed(&own, &DMatrix::from_row_slice(2, 2, &[first, 0.0, 0.0, second]), &units(&own))
    };
    // A quarter and a ninth are left of two wholes.
    assert!((fraction(1.0, 1.0) - (1.0 - (0.25 + 1.0 / 9.0) / 2.0)).abs() < 1e-12);
    assert_eq!((fraction(4.0, 9.0), fraction(0.0, 0.0), fraction(5.0, 9.0)), (0.0, 1.0, 0.0));
    let nothing = DMatrix::zeros(2, 2);
    assert_eq!(absorbed(&nothing, &nothing, &units(&nothing)), 1.0, "what does nothing is absorbed whole");
}

#[test]
fn fitted_parameters_step_back_as_far_as_the_candidate_takes_over() {
    // The elbow's zero is free and its wave is not in: the step of both at once is that of the fit with both in.
    let watch = plumb_estimation::Progress::unwatched();
    let off = |q: [f64; 2]| [0.0, 1e-6 + 2e-6 * q[1].sin() + 1e-6 * q[1].cos()];
    let lab = crate::testing::two_links(60, "joint_zero(elbow)", 1e-6, 5, off);
    let fitted = lab.fit_with(&[], None, &watch).unwrap();
    let mut wave = crate::candidates::probes(&lab);
    wave.retain(|probe| lab.model().label(&probe.id) == "joint_harmonic(elbow, 1)");
    let scores = score(&fitted.problem, &fitted.fit, &wave);
    let added = plumb_calibration::arm_model::AddedEffect { id: wave[0].id.clone(), values: vec![0.0; 2] };
    let both = lab.fit_with(&[added], None, &watch).unwrap();
    let zero = |state: &plumb_calibration::fit::State| state.effects[0][0];
    let moved = zero(&both.fit.state) - zero(&fitted.fit.state);
    assert!(moved.abs() > 1e-7, "the wave takes part of the zero: {moved}");
    assert!((scores[0].beside[0] / moved - 1.0).abs() < 0.05, "{} for {moved}", scores[0].beside[0]);
}
