//! Tails and quantiles of the normal, chi squared and F distributions.
//!
//! The numbers come from `cdflib`, a port of Brown, Lovato & Russell's CDFLIB (algorithms 708 and 654 of the ACM's
//! Transactions on Mathematical Software, by DiDonato & Morris). Here is what the lab needs beyond it: an answer for
//! arguments that no distribution has. Such an argument is no evidence, so that its tail is 1.

use cdflib::traits::{Continuous, ContinuousCdf};
use cdflib::{ChiSquared, FisherSnedecor, Normal};

/// P(chi squared with `freedom` degrees > `value`); 1 where one of them is no number or `freedom` is not above 0.
pub fn chi_squared_tail(value: f64, freedom: f64) -> f64 {
    match ChiSquared::try_new(freedom) {
        Ok(distribution) if !value.is_nan() => distribution.ccdf(value),
        _ => 1.0,
    }
}

/// The value below which chi squared with `freedom` degrees lies with `probability`; 0 where `probability` or `freedom` is
/// not above 0.
pub fn chi_squared_quantile(probability: f64, freedom: f64) -> f64 {
    let Ok(distribution) = ChiSquared::try_new(freedom) else { return 0.0 };
    let Ok(found) = distribution.inverse_cdf(probability.clamp(0.0, 1.0)) else { return 0.0 };
    // CDFLIB's root finder stops at 1e-8 of the value; one Newton step brings it to rounding.
    let step = (distribution.cdf(found) - probability) / distribution.pdf(found);
    if step.is_finite() { found - step } else { found }
}

/// P(F with `above` and `below` degrees of freedom > `value`); 1 where one of them is no number or a freedom is not above
/// 0.
pub fn f_tail(value: f64, above: f64, below: f64) -> f64 {
    match FisherSnedecor::try_new(above, below) {
        Ok(distribution) if !value.is_nan() => distribution.ccdf(value),
        _ => 1.0,
    }
}

/// P(standard normal > `value`).
pub fn normal_tail(value: f64) -> f64 {
    Normal::new(0.0, 1.0).ccdf(value)
}

/// The value below which a standard normal lies with `probability`; infinite at 0 and 1 and beyond.
pub fn normal_quantile(probability: f64) -> f64 {
    if !(probability > 0.0 && probability < 1.0) {
        return if probability >= 1.0 { f64::INFINITY } else { f64::NEG_INFINITY };
    }
    // Every probability between 0 and 1 has a quantile.
    Normal::new(0.0, 1.0).inverse_cdf(probability).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(value: f64, expected: f64) {
        assert!((value / expected - 1.0).abs() < 1e-8, "{value} against {expected}");
    }

    #[test]
    fn tails_match_published_tables() {
        // R: pchisq(3.841458820694124, 1, lower = FALSE), pchisq(100, 80, lower = FALSE), pf(4, 3, 20, lower = FALSE),
        // pf(1.5, 60, 200, lower = FALSE), pnorm(5, lower = FALSE).
        close(chi_squared_tail(3.841_458_820_694_124, 1.0), 0.05);
        close(normal_tail(5.0), 2.866_515_718_791_94e-7);
        close(f_tail(4.351_243_503_329_29, 1.0, 20.0), 0.05);
        close(f_tail(3.098_391_212_418_07, 3.0, 20.0), 0.05);
    }

    #[test]
    fn quantiles_undo_tails() {
        for (probability, freedom) in [(0.5, 3.0), (0.9, 1.0), (0.99, 40.0), (0.5, 4000.0)] {
            close(1.0 - chi_squared_tail(chi_squared_quantile(probability, freedom), freedom), probability);
        }
        close(normal_quantile(0.975), 1.959_963_984_540_054);
    }

    #[test]
    fn far_tails_do_not_vanish_early() {
        assert!(f_tail(80.0, 2.0, 300.0) > 1e-30 && f_tail(80.0, 2.0, 300.0) < 1e-25);
    }

    #[test]
    fn tails_agree_by_closed_forms() {
        for value in [0.01, 0.7, 3.0, 12.0, 60.0] {
            // Chi squared with 2 and 4 degrees; F with 2 above; F with 1 and 1 is Cauchy's distribution squared.
            close(chi_squared_tail(value, 2.0), (-0.5 * value).exp());
            close(chi_squared_tail(value, 4.0), (-0.5 * value).exp() * (1.0 + 0.5 * value));
            close(f_tail(value, 2.0, 7.0), (1.0 + 2.0 * value / 7.0).powf(-3.5));
            close(f_tail(value, 1.0, 1.0), 1.0 - 2.0 / std::f64::consts::PI * value.sqrt().atan());
        }
        close(chi_squared_quantile(0.9, 2.0), -2.0 * 0.1_f64.ln());
    }

    #[test]
    fn f_with_many_degrees_below_is_chi_squared() {
        let many = 1e7;
        for (value, above) in [(1.0, 3.0), (2.5, 10.0)] {
            assert!((f_tail(value, above, many) / chi_squared_tail(value * above, above) - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn what_is_no_number_is_no_evidence() {
        assert_eq!((f_tail(f64::NAN, 1.0, 5.0), chi_squared_tail(f64::NAN, 2.0)), (1.0, 1.0));
        assert_eq!((f_tail(f64::INFINITY, 1.0, 5.0), chi_squared_tail(f64::INFINITY, 2.0)), (0.0, 0.0));
        assert_eq!(
            (f_tail(-1.0, 1.0, 5.0), f_tail(3.0, 1.0, 0.0), chi_squared_tail(3.0, 0.0)),
            (1.0, 1.0, 1.0)
        );
        assert_eq!((normal_quantile(0.0), normal_quantile(1.0)), (f64::NEG_INFINITY, f64::INFINITY));
        assert_eq!(chi_squared_quantile(0.0, 3.0), 0.0);
    }

    #[test]
    fn quantiles_are_good_to_rounding() {
        // Chi squared with two degrees has the closed form -2 ln(1 - p); a median of one degree is the square of the normal's 0.75 quantile.
        for probability in [0.01, 0.2, 0.5, 0.9, 0.999] {
            let expected = -2.0 * (1.0_f64 - probability).ln();
            let found = chi_squared_quantile(probability, 2.0);
            assert!(
                (found / expected - 1.0).abs() < 2e-15 / probability.min(1.0 - probability),
                "{probability}: {found} {expected}"
            );
        }
        let root = normal_quantile(0.75);
        assert!((chi_squared_quantile(0.5, 1.0) / (root * root) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn probabilities_that_are_none_have_the_quantile_of_the_nearest() {
        assert_eq!((normal_quantile(1.5), normal_quantile(-0.5)), (f64::INFINITY, f64::NEG_INFINITY));
        assert_eq!(chi_squared_quantile(0.5, -1.0), 0.0);
    }
}
