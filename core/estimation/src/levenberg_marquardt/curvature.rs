//! What the residuals' own curvature adds to `J'J`, learnt from the gradients met on the way.
//!
//! Where the residuals at the minimum are large and a direction is hardly determined, `J'J` alone expects the wrong step along it, and a descent creeps along
//! a curved valley (Nocedal and Wright 2006, Numerical Optimization, section 10.3, "large-residual problems"). The second-order part of the Hessian is
//! approximated by a sized secant update, and counts only while it predicts gains better than `J'J` does (NL2SOL: Dennis, Gay and Welsch 1981, ACM TOMS 7,
//! 348-368). The change of the gradient is taken as it is, since past Jacobians are not kept (Al-Baali and Fletcher 1985, J. Optim. Theory Appl. 48, 359-377).

use nalgebra::{DMatrix, DVector};

use crate::NormalEquations;

/// How many times nearer the gain reached the other model's prediction must lie for it to take over (Dennis, Gay and Welsch 1981, section 5).
const CLEARLY_BETTER: f64 = 1.5;

/// Least cosine between a step and the change of the gradient along it from which an update is made: below it the update divides by next to nothing.
const LEAST_COSINE: f64 = 1e-8;

/// The second-order part of the Hessian of half the sum of squares.
pub(super) struct Curvature {
    matrix: DMatrix<f64>,
    /// Whether it is to be added to `J'J`.
    counts: bool,
}

impl Curvature {
    /// Nothing known yet of `size` parameters.
    pub(super) fn unknown(size: usize) -> Self {
        Self { matrix: DMatrix::zeros(size, size), counts: false }
    }

    /// What is to be added to `J'J`; nothing while `J'J` alone predicts as well.
    pub(super) fn added(&self) -> Option<&DMatrix<f64>> {
        self.counts.then_some(&self.matrix)
    }

    /// Goes back to `J'J` alone.
    pub(super) fn set_aside(&mut self) {
        self.counts = false;
    }

    /// Which of the two models is to be used from here on, after a step from `normal` whose sum of squares fell by `gain`.
    pub(super) fn choose(&mut self, normal: &NormalEquations, step: &DVector<f64>, gain: f64) {
        let plain = 2.0 * step.dot(&normal.gradient) - step.dot(&(&normal.matrix * step));
        let augmented = plain - step.dot(&(&self.matrix * step));
        let [off, off_augmented] = [plain, augmented].map(|predicted| (gain - predicted).abs());
        // Written so that a gain that is not a number changes nothing.
        if self.counts && CLEARLY_BETTER * off < off_augmented {
            self.counts = false;
        } else if !self.counts && CLEARLY_BETTER * off_augmented < off {
            self.counts = true;
        }
    }

    /// Learns from a step that was taken from one place to another. Parameters in `held` did not move and have no curvature.
    pub(super) fn learn(
        &mut self,
        (from, to): (&NormalEquations, &NormalEquations),
        step: &DVector<f64>,
        held: &[usize],
    ) {
        // Gradients of half the sum of squares are `-J'r`.
        let mut change = &from.gradient - &to.gradient;
        let mut beyond = &change - &to.matrix * step;
        for parameter in held {
            change[*parameter] = 0.0;
            beyond[*parameter] = 0.0;
        }
        let along = change.dot(step);
        if !along.is_finite() || along <= LEAST_COSINE * change.norm() * step.norm() {
            return;
        }
        // Sized first: what was learnt far off is too large near the minimum, where the residuals are smaller.
        let known = step.dot(&(&self.matrix * step)).abs();
        if known > 0.0 {
            self.matrix *= (step.dot(&beyond).abs() / known).min(1.0);
        }
        let missing = beyond - &self.matrix * step;
        let fraction = step.dot(&missing) / (along * along);
        self.matrix.ger(1.0 / along, &missing, &change, 1.0);
        self.matrix.ger(1.0 / along, &change, &missing, 1.0);
        self.matrix.ger(-fraction, &change, &change, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal equations with this matrix and gradient.
    fn normal(matrix: &[f64], gradient: &[f64]) -> NormalEquations {
        let size = gradient.len();
        NormalEquations {
            matrix: DMatrix::from_row_slice(size, size, matrix),
            gradient: DVector::from_column_slice(gradient),
            ..NormalEquations::zeros(size)
        }
    }

    #[test]
    fn an_update_meets_the_secant_condition_and_stays_symmetric() {
        let mut curvature = Curvature::unknown(2);
        let (from, to) =
            (normal(&[2.0, 0.5, 0.5, 1.0], &[3.0, 1.0]), normal(&[2.0, 0.0, 0.0, 1.5], &[0.5, 0.2]));
        let step = DVector::from_vec(vec![0.7, 0.4]);
        curvature.learn((&from, &to), &step, &[]);
        // (J'J + S) h is the change of the gradient.
        let met = (&to.matrix + &curvature.matrix) * &step;
        assert!((met - (&from.gradient - &to.gradient)).norm() < 1e-12);
        assert!((&curvature.matrix - curvature.matrix.transpose()).norm() < 1e-12);
        // A second step meets its own, whatever was learnt before.
        let next = normal(&[2.0, 0.1, 0.1, 1.2], &[0.1, -0.1]);
        let step = DVector::from_vec(vec![0.1, 0.2]);
        curvature.learn((&to, &next), &step, &[]);
        let met = (&next.matrix + &curvature.matrix) * &step;
        assert!((met - (&to.gradient - &next.gradient)).norm() < 1e-12);
    }

    #[test]
    fn held_parameters_have_no_curvature() {
        let mut curvature = Curvature::unknown(2);
        let (from, to) =
            (normal(&[2.0, 0.5, 0.5, 1.0], &[3.0, 1.0]), normal(&[2.0, 0.5, 0.5, 1.5], &[0.5, 0.2]));
        curvature.learn((&from, &to), &DVector::from_vec(vec![0.7, 0.0]), &[1]);
        assert!(curvature.matrix[(0, 0)] > 1.0);
        assert_eq!(curvature.matrix.column(1).norm() + curvature.matrix.row(1).norm(), 0.0);
    }

    #[test]
    fn nothing_is_learnt_from_a_step_along_which_the_gradient_does_not_rise() {
        let mut curvature = Curvature::unknown(1);
        let (from, to) = (normal(&[2.0], &[1.0]), normal(&[2.0], &[1.5]));
        curvature.learn((&from, &to), &DVector::from_vec(vec![0.5]), &[]);
        assert_eq!(curvature.matrix[(0, 0)], 0.0);
    }

    #[test]
    fn it_counts_from_where_it_predicts_clearly_better_until_it_predicts_clearly_worse() {
        let here = normal(&[2.0], &[1.0]);
        let step = DVector::from_vec(vec![0.5]);
        // J'J alone predicts 2 h g - h N h = 0.5, with a curvature of one 0.25.
        let mut curvature = Curvature { matrix: DMatrix::from_element(1, 1, 1.0), counts: false };
        for (gain, counts) in [(0.41, false), (0.34, true), (0.36, true), (0.41, false), (f64::NAN, false)] {
            curvature.choose(&here, &step, gain);
            assert_eq!(curvature.added().is_some(), counts, "{gain}");
        }
    }
}
