//! Normal equations, gathered block by block and never holding all derivatives at once.

use nalgebra::{DMatrix, DVector};

/// `J'WJ`, `J'Wr` and `r'Wr` over some rows.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    /// `J'WJ`, one row and column a parameter.
    pub matrix: DMatrix<f64>,
    /// `J'Wr`.
    pub gradient: DVector<f64>,
    /// `r'Wr`.
    pub squares: f64,
    /// Number of equations summed.
    pub equations: usize,
}

impl NormalEquations {
    /// No equations yet, for `size` parameters.
    pub fn zeros(size: usize) -> Self {
        Self {
            matrix: DMatrix::zeros(size, size),
            gradient: DVector::zeros(size),
            squares: 0.0,
            equations: 0,
        }
    }

    /// Adds the equations of `other`, over the same parameters.
    pub fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.gradient += &other.gradient;
        self.squares += other.squares;
        self.equations += other.equations;
    }

    /// Takes the equations of `other` out again.
    pub fn subtract(&mut self, other: &Self) {
        self.matrix -= &other.matrix;
        self.gradient -= &other.gradient;
        self.squares -= other.squares;
        self.equations -= other.equations;
    }

    /// Adds equations whose residuals and Jacobian (one column an equation) are given, both divided by the sigmas.
    pub fn take(&mut self, residuals: &[f64], jacobian: &DMatrix<f64>) {
        // A product with the transposed copy runs along columns, in blocks: several times as fast as row by row.
        let transposed = jacobian.transpose();
        self.matrix.gemm(1.0, jacobian, &transposed, 1.0);
        self.gradient.gemv(1.0, jacobian, &DVector::from_column_slice(residuals), 1.0);
        self.squares += residuals.iter().map(|residual| residual * residual).sum::<f64>();
        self.equations += residuals.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_taken_in_parts_are_those_taken_at_once_and_may_be_taken_out() {
        let jacobian = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 3.0, 0.5, -1.0, 4.0]);
        let residuals = [0.1, -0.2, 0.3];
        let mut all = NormalEquations::zeros(2);
        all.take(&residuals, &jacobian);
        assert_eq!(all.matrix, &jacobian * jacobian.transpose());
        assert!((all.gradient[0] - (0.1 - 0.4 + 0.9)).abs() < 1e-12 && (all.squares - 0.14).abs() < 1e-12);
        let mut parts = NormalEquations::zeros(2);
        let mut last = NormalEquations::zeros(2);
        parts.take(&residuals[..2], &jacobian.columns(0, 2).into_owned());
        last.take(&residuals[2..], &jacobian.columns(2, 1).into_owned());
        parts.add(&last);
        assert!((&parts.matrix - &all.matrix).norm() < 1e-12 && parts.equations == 3);
        all.subtract(&last);
        parts.subtract(&last);
        assert!((all.matrix - parts.matrix).norm() < 1e-12 && all.equations == 2);
    }

    #[test]
    fn every_part_is_added_and_taken_out() {
        let of = |residual: f64| {
            let mut normal = NormalEquations::zeros(1);
            normal.take(&[residual], &DMatrix::from_element(1, 1, 2.0));
            normal
        };
        let mut sum = of(3.0);
        sum.add(&of(5.0));
        // 2 * 2 twice; 2 * 3 + 2 * 5; 9 + 25.
        assert_eq!((sum.matrix[(0, 0)], sum.gradient[0], sum.squares, sum.equations), (8.0, 16.0, 34.0, 2));
        sum.subtract(&of(3.0));
        assert_eq!((sum.matrix[(0, 0)], sum.gradient[0], sum.squares, sum.equations), (4.0, 10.0, 25.0, 1));
    }
}
