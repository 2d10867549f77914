//! Solving normal equations that may be singular: an ordered, scaled Cholesky factor that leaves out what cannot be
//! told from what came before.

use nalgebra::{DMatrix, DVector};

/// Share of a column (squared) that must be left after projection on the columns before it, or it counts as dependent.
pub(crate) const DEPENDENT: f64 = 1e-9;

/// The factor of a symmetric matrix, restricted to the columns that are independent of those before them.
#[derive(Debug, Clone)]
pub(crate) struct Factor {
    /// Lower triangle over the independent columns of the scaled matrix.
    lower: DMatrix<f64>,
    /// Independent columns, ascending.
    pub(crate) independent: Vec<usize>,
    /// Columns that depend on others before them.
    pub(crate) dependent: Vec<usize>,
    scales: DVector<f64>,
    size: usize,
}

impl Factor {
    /// Factors `matrix` (symmetric, positive semi-definite).
    pub(crate) fn new(matrix: &DMatrix<f64>) -> Self {
        let size = matrix.nrows();
        let largest = matrix.diagonal().iter().copied().fold(0.0, f64::max);
        let scale = |value: f64| if value > largest * 1e-24 && value > 0.0 { value.sqrt() } else { 0.0 };
        let scales = DVector::from_iterator(size, matrix.diagonal().iter().map(|value| scale(*value)));
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(size);
        let (mut independent, mut dependent) = (Vec::new(), Vec::new());
        for column in 0..size {
            let own = scales[column];
            if own == 0.0 {
                dependent.push(column);
                continue;
            }
            let mut row: Vec<f64> = Vec::with_capacity(independent.len() + 1);
            let mut left = 1.0;
            for (index, other) in independent.iter().enumerate() {
                let earlier: &Vec<f64> = &rows[index];
                let inner: f64 = row.iter().zip(earlier).map(|(a, b)| a * b).sum();
                let entry = (matrix[(column, *other)] / (own * scales[*other]) - inner) / earlier[index];
                left -= entry * entry;
                row.push(entry);
            }
            if left > DEPENDENT {
                row.push(left.sqrt());
                rows.push(row);
                independent.push(column);
            } else {
                dependent.push(column);
            }
        }
        let rank = independent.len();
        let mut lower = DMatrix::zeros(rank, rank);
        for (index, row) in rows.iter().enumerate() {
            for (column, value) in row.iter().enumerate() {
                lower[(index, column)] = *value;
            }
        }
        Self { lower, independent, dependent, scales, size }
    }

    /// Number of independent columns.
    pub(crate) fn rank(&self) -> usize {
        self.independent.len()
    }

    /// `L^-1 D^-1 right`: the independent columns made orthonormal, applied to any number of right-hand sides (one a
    /// column; as many rows as the matrix has).
    pub(crate) fn whiten(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
        let mut picked = DMatrix::zeros(self.rank(), right.ncols());
        for (index, column) in self.independent.iter().enumerate() {
            let scale = self.scales[*column];
            for side in 0..right.ncols() {
                picked[(index, side)] = right[(*column, side)] / scale;
            }
        }
        self.lower.solve_lower_triangular_mut(&mut picked);
        picked
    }

    /// The solution with dependent unknowns left at zero.
    pub(crate) fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let right = DMatrix::from_column_slice(right.len(), 1, right.as_slice());
        self.back(self.whiten(&right).column(0).into_owned())
    }

    /// The solution whose right-hand side, made white, is `white`; dependent unknowns stay at zero.
    pub(crate) fn back(&self, mut white: DVector<f64>) -> DVector<f64> {
        self.lower.tr_solve_lower_triangular_mut(&mut white);
        let mut solution = DVector::zeros(self.size);
        for (index, column) in self.independent.iter().enumerate() {
            solution[*column] = white[index] / self.scales[*column];
        }
        solution
    }

    /// The inverse over the independent columns; zero elsewhere.
    pub(crate) fn inverse(&self) -> DMatrix<f64> {
        let rank = self.rank();
        let mut inverse_lower = DMatrix::identity(rank, rank);
        self.lower.solve_lower_triangular_mut(&mut inverse_lower);
        let product = inverse_lower.tr_mul(&inverse_lower);
        let mut inverse = DMatrix::zeros(self.size, self.size);
        for (row, first) in self.independent.iter().enumerate() {
            for (column, second) in self.independent.iter().enumerate() {
                inverse[(*first, *second)] =
                    product[(row, column)] / (self.scales[*first] * self.scales[*second]);
            }
        }
        inverse
    }

    /// How a dependent column is made of the independent ones: how far each must move to do what one unit of it does.
    pub(crate) fn weights_of(&self, matrix: &DMatrix<f64>, column: usize) -> Vec<(usize, f64)> {
        if self.scales[column] == 0.0 {
            return Vec::new();
        }
        let right = DVector::from_iterator(self.size, matrix.column(column).iter().copied());
        let solution = self.solve(&right);
        self.independent.iter().map(|other| (*other, solution[*other])).collect()
    }

    /// The same in units where every column has length one.
    pub(crate) fn combination(&self, matrix: &DMatrix<f64>, column: usize) -> Vec<(usize, f64)> {
        let scale = self.scales[column];
        let share = |(other, weight): (usize, f64)| (other, weight * self.scales[other] / scale);
        self.weights_of(matrix, column).into_iter().map(share).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gram() -> DMatrix<f64> {
        // Third column is the sum of the first two; scales differ widely.
        let j = DMatrix::from_row_slice(
            4,
            4,
            &[1.0, 0.0, 1.0, 1e-4, 2.0, 1e3, 1002.0, 3e-4, 0.0, 2e3, 2000.0, -1e-4, 1.0, 0.0, 1.0, 5e-4],
        );
        j.tr_mul(&j)
    }

    #[test]
    fn dependent_columns_are_found_and_left_out() {
        let factor = Factor::new(&gram());
        assert_eq!((factor.independent.clone(), factor.dependent.clone()), (vec![0, 1, 3], vec![2]));
        let combination = factor.combination(&gram(), 2);
        assert!(
            combination[0].1 > 0.0 && combination[1].1 > 0.9 && combination[2].1.abs() < 1e-6,
            "{combination:?}"
        );
    }

    #[test]
    fn solutions_satisfy_the_equations() {
        let matrix = gram();
        let truth = DVector::from_vec(vec![0.3, -2.0, 0.0, 7.0]);
        let solution = Factor::new(&matrix).solve(&(&matrix * &truth));
        assert!((solution - truth).norm() < 1e-6);
    }

    #[test]
    fn the_inverse_holds_over_the_independent_columns() {
        let matrix = gram();
        let factor = Factor::new(&matrix);
        let product = &matrix * factor.inverse() * &matrix;
        assert!((product - &matrix).norm() < 1e-6 * matrix.norm());
    }
}
