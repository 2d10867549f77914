//! Standard errors of the numbers of a fit, as they are reported.

use nalgebra::DMatrix;

use super::Laboratory;
use crate::block_errors;
use crate::fitted::Fitted;
use crate::lack_of_fit::LackOfFit;
use crate::noise_floor::Floor;
use crate::score_test::Noise;
use plumb_calibration::fit::{Fit, FreeParameter, ResidualModel};

/// A fit, and the covariance that is reported of it.
pub(crate) struct StandardErrors<'a> {
    pub(crate) problem: &'a ResidualModel<'a>,
    pub(crate) fit: &'a Fit,
    /// Of the free parameters, internal units.
    pub(crate) covariance: DMatrix<f64>,
}

impl<'a> StandardErrors<'a> {
    /// Where nothing but noise is left those of the fit, which takes what is left for independent noise. Where more is left, or nobody knows the noise, at least what blocks
    /// of rows have.
    pub(crate) fn of(problem: &'a ResidualModel<'a>, fit: &'a Fit, floor: &Floor) -> Self {
        let lack = LackOfFit::beside(Noise::of(problem, fit), floor);
        let covariance = match lack.is_some_and(|lack| !lack.is_significant()) {
            true => fit.covariance.clone(),
            false => block_errors::at_least(&fit.covariance, &block_errors::errors(problem, fit)),
        };
        Self { problem, fit, covariance }
    }

    /// As the fit has them, which takes what is left for independent noise.
    pub(crate) fn of_the_fit(problem: &'a ResidualModel<'a>, fit: &'a Fit) -> Self {
        Self { problem, fit, covariance: fit.covariance.clone() }
    }

    /// Where a free parameter is among those of the fit; nothing where it is held, for the rows cannot determine it.
    pub(crate) fn index_of(&self, free_parameter: FreeParameter) -> Option<usize> {
        let index = self.problem.free_parameters().iter().position(|known| *known == free_parameter)?;
        (!self.fit.factor.dependent.contains(&index)).then_some(index)
    }

    /// One standard error of a free parameter, internal unit; nothing where it is not fitted, or held.
    pub(crate) fn error_of(&self, free_parameter: FreeParameter) -> Option<f64> {
        let index = self.index_of(free_parameter)?;
        Some(self.covariance.get((index, index))?.max(0.0).sqrt())
    }

    /// The covariance of some of the free parameters, by their indices.
    pub(crate) fn covariance_of(&self, indices: &[usize]) -> DMatrix<f64> {
        self.covariance.select_rows(indices).select_columns(indices)
    }
}

impl Laboratory {
    /// The standard errors that are reported of a fit.
    pub(crate) fn standard_errors<'f>(&self, fitted: &'f Fitted<'_>) -> StandardErrors<'f> {
        let Fitted { problem, fit } = fitted;
        StandardErrors::of(problem, fit, &Floor::of(problem, fit, &self.context()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links_with;
    use plumb_estimation::Progress;

    #[test]
    fn what_blocks_of_rows_say_counts_where_more_than_noise_is_left_or_nobody_knows_the_noise() {
        let wave = |q: [f64; 2]| [0.0, 0.004 * (2.0 * q[1] + 0.4).sin()];
        let declared = "free: [joint_gain(elbow)]\nnoise: {p1_mm: 0.05}";
        let wider = |lab: &Laboratory| {
            let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
            let errors = lab.standard_errors(&fitted);
            let gain = fitted.problem.free_parameters()[0];
            let wider = errors.error_of(gain).unwrap() / fitted.fit.covariance[(0, 0)].sqrt();
            let blocks = block_errors::errors(&fitted.problem, &fitted.fit)[0].powi(2);
            assert!(
                (errors.covariance_of(&[0])[(0, 0)] - blocks.max(fitted.fit.covariance[(0, 0)])).abs()
                    < 1e-15
                    || wider == 1.0
            );
            wider
        };
        assert_eq!(wider(&two_links_with(declared, 200, 0.05, 3, |_| [0.0; 2])), 1.0);
        assert!(wider(&two_links_with(declared, 200, 0.05, 3, wave)) > 2.0);
        assert!(
            wider(&two_links_with("free: [joint_gain(elbow)]", 200, 0.05, 3, wave)) > 2.0,
            "no noise is declared"
        );
    }
}
