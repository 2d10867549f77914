//! Huber's M-estimator of location for vectors: where weights begin to fall, and the variance that is left.

use std::sync::OnceLock;

use crate::chi_squared_quantile;

/// Tuning constant of Huber's loss (Huber 1981): the distance, in sigmas, beyond which a pose of so many equations is weighed down. Nine in ten lie within.
pub fn huber_constant(equations: usize) -> f64 {
    // A fit asks for the constant of every row at every step; a quantile takes longer than all else that is done with a row.
    static KNOWN: OnceLock<Vec<f64>> = OnceLock::new();
    let known = KNOWN.get_or_init(|| (0..TABULATED).map(computed_constant).collect());
    known.get(equations).copied().unwrap_or_else(|| computed_constant(equations))
}

/// Constants that are computed once: rows of up to ten targets have no more equations.
const TABULATED: usize = 32;

/// Share of sound poses that keep their full weight. With one equation the constant is 1.645 sigmas, and the estimate keeps 98 % of the
/// efficiency of least squares on normal residuals (Huber 1981, section 4.5).
const FULL_WEIGHT: f64 = 0.9;

fn computed_constant(equations: usize) -> f64 {
    chi_squared_quantile(FULL_WEIGHT, equations.max(1) as f64).sqrt()
}

/// Variance of one equation in the weighted metric: far poses count as if at the constant, and the weight they lost is made
/// good (Huber 1981, section 7.6). Of each equation: its weight, and its residual in declared sigmas.
pub fn huber_variance(equations_of: impl Iterator<Item = (f64, f64)>, rank: usize) -> f64 {
    let (mut drawn_in, mut weight_sum, mut equations) = (0.0, 0.0, 0.0);
    for (weight, residual) in equations_of {
        drawn_in += (weight * residual).powi(2);
        weight_sum += weight;
        equations += 1.0;
    }
    // With no equation to spare the variance is unknown; one degree of freedom keeps it finite and large.
    let freedom = f64::max(equations - rank as f64, 1.0);
    drawn_in / freedom * equations / f64::max(weight_sum, 1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Random, normal_quantile};

    #[test]
    fn the_corner_of_one_equation_is_the_normals_and_grows_with_the_root_of_their_number() {
        // Two-sided 90 % of a normal: 1.645; chi with 2 degrees: sqrt(-2 ln 0.1) = 2.146; with 3: sqrt(6.251) = 2.500.
        assert!((huber_constant(1) - normal_quantile(0.95)).abs() < 1e-9);
        assert!((huber_constant(2) - (-2.0 * 0.1_f64.ln()).sqrt()).abs() < 1e-9);
        assert!((huber_constant(3) - 6.251_389_f64.sqrt()).abs() < 1e-6);
        assert!(
            (huber_constant(400) / 400.0_f64.sqrt() - 1.0).abs() < 0.05,
            "beyond the table it is computed"
        );
        assert_eq!(huber_constant(0), huber_constant(1));
    }

    #[test]
    fn the_corner_keeps_at_least_95_percent_of_the_efficiency_on_normal_residuals() {
        // Huber 1981, section 4.5: efficiency (E psi')^2 / E psi^2, 95 % at 1.345; here the constant of one equation is 1.645.
        let constant = huber_constant(1);
        let (mut inside, mut squares, count) = (0.0, 0.0, 400_000);
        for step in 0..count {
            let residual = normal_quantile((f64::from(step) + 0.5) / f64::from(count));
            inside += f64::from(u8::from(residual.abs() < constant));
            squares += residual.clamp(-constant, constant).powi(2);
        }
        let efficiency = (inside / f64::from(count)).powi(2) / (squares / f64::from(count));
        assert!(constant > 1.345 && (0.97..0.99).contains(&efficiency), "{efficiency}");
    }

    #[test]
    fn with_all_weights_one_the_variance_is_the_mean_square_over_its_degrees_of_freedom() {
        let residuals = [1.0, -2.0, 3.0, 0.0];
        let variance = huber_variance(residuals.iter().map(|residual| (1.0, *residual)), 2);
        assert!((variance - 14.0 / 2.0).abs() < 1e-12);
        assert!((huber_variance(residuals.iter().map(|one| (1.0, *one)), 9) - 14.0).abs() < 1e-12);
    }

    #[test]
    fn an_outlier_counts_as_if_it_lay_at_the_corner() {
        let mut random = Random::seeded(1);
        let sound: Vec<f64> = (0..2_000).map(|_| random.normal()).collect();
        let constant = huber_constant(1);
        let plain = huber_variance(sound.iter().map(|residual| weighed(*residual, constant)), 0);
        let spoilt: Vec<f64> = sound.iter().copied().chain([1e6]).collect();
        let with_outlier = huber_variance(spoilt.iter().map(|residual| weighed(*residual, constant)), 0);
        assert!((with_outlier - plain).abs() < 2.0 * constant * constant / 2_000.0, "{plain} {with_outlier}");
    }

    fn weighed(residual: f64, constant: f64) -> (f64, f64) {
        (f64::min(1.0, constant / residual.abs()), residual)
    }

    #[test]
    fn parameters_that_were_fitted_are_paid_for_by_equations() {
        // Ten residuals of one sigma and four parameters: 10 / (10 - 4); with none to spare one degree of freedom is left.
        let variance = |rank: usize| huber_variance([(1.0, 1.0); 10].into_iter(), rank);
        assert!((variance(4) - 10.0 / 6.0).abs() < 1e-12 && (variance(0) - 1.0).abs() < 1e-12);
        assert!((variance(10) - 10.0).abs() < 1e-12 && (variance(99) - 10.0).abs() < 1e-12);
    }
}
