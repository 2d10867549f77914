//! The Bayesian information criterion (Schwarz 1978, Estimating the Dimension of a Model, Annals of Statistics 6).

/// Least sum of squares the logarithm is taken of.
const LEAST: f64 = 1e-300;

/// Schwarz's criterion of a Gaussian model of unknown variance: `n ln(squares / n) + k ln n`, plus `search_cost` for what was
/// searched for and not fitted (Chen and Chen 2008: `2 ln` of the number of models of that size). The smaller the better;
/// differences are in units of twice the logarithm of a likelihood.
pub fn bic(squares: f64, equations: f64, parameters: f64, search_cost: f64) -> f64 {
    equations * (squares.max(LEAST) / equations).ln() + parameters * equations.ln() + search_cost
}

/// The same where the variance of one equation is known to be no less than `least`: the likelihood is then that of the variance that is likeliest among those.
pub fn bic_above(least: f64, squares: f64, equations: f64, parameters: f64, search_cost: f64) -> f64 {
    let variance = (squares / equations).max(least);
    // With a known variance the likelihood holds the squares themselves, not their logarithm.
    let surplus = if variance > 0.0 { squares / variance - equations } else { 0.0 };
    bic(variance * equations, equations, parameters, search_cost) + surplus
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_costs_the_logarithm_of_the_number_of_equations() {
        let (without, with) = (bic(50.0, 100.0, 3.0, 0.0), bic(50.0, 100.0, 4.0, 0.0));
        assert!((with - without - 100.0_f64.ln()).abs() < 1e-12);
    }

    #[test]
    fn a_parameter_pays_when_it_takes_away_more_than_its_price() {
        // Of n = 100 equations one parameter must take away the fraction 1 - n^(-1/n) = 4.5 % of the squares.
        let least = 1.0 - 100.0_f64.powf(-0.01);
        assert!(change_when_less(least + 1e-3) < 0.0 && change_when_less(least - 1e-3) > 0.0);
    }

    /// How the criterion changes when a fourth parameter takes away this share of the squares.
    fn change_when_less(fraction: f64) -> f64 {
        bic(50.0 * (1.0 - fraction), 100.0, 4.0, 0.0) - bic(50.0, 100.0, 3.0, 0.0)
    }

    #[test]
    fn below_the_known_variance_squares_count_as_chi_squared_and_above_it_as_ever() {
        let [many, some, few] = [150.0, 60.0, 40.0].map(|squares| bic_above(1.0, squares, 100.0, 3.0, 0.0));
        assert!((many - bic(150.0, 100.0, 3.0, 0.0)).abs() < 1e-12);
        assert!((some - few - 20.0).abs() < 1e-9);
        assert!((bic_above(0.0, 60.0, 100.0, 3.0, 0.0) - bic(60.0, 100.0, 3.0, 0.0)).abs() < 1e-12);
    }

    #[test]
    fn a_search_is_paid_for_and_nothing_left_is_no_infinity() {
        assert_eq!(bic(1.0, 10.0, 1.0, 7.0) - bic(1.0, 10.0, 1.0, 0.0), 7.0);
        assert!(bic(0.0, 10.0, 1.0, 0.0).is_finite());
    }

    #[test]
    fn nothing_left_and_nothing_known_is_no_infinity() {
        assert!(bic_above(0.0, 0.0, 10.0, 1.0, 0.0).is_finite());
    }
}
