//! Solving normal equations that may be singular: a sequential, scaled Cholesky factor that leaves out each column that is a
//! linear combination of the columns before it (Golub and Van Loan, Matrix Computations, 4th ed., sections 4.2 and 5.5).

use nalgebra::{DMatrix, DVector};

/// Share of a column (squared) that must be left after projection on the columns before it, or it counts as dependent.
pub const INDISTINCT: f64 = 1e-9;

/// Square of a column, as a fraction of the largest one's, below which it moves nothing: twelve digits below, in lengths, is what
/// sums of products in double precision leave of a column of zeros.
const NO_COLUMN: f64 = 1e-24;

/// The factor of a symmetric matrix, restricted to the columns that are independent of those before them.
#[derive(Debug, Clone)]
pub struct RankRevealingCholesky {
    /// Lower triangle over the independent columns of the scaled matrix.
    lower: DMatrix<f64>,
    /// Independent columns, ascending.
    pub independent: Vec<usize>,
    /// Columns that depend on others before them.
    pub dependent: Vec<usize>,
    scales: DVector<f64>,
    size: usize,
}

impl RankRevealingCholesky {
    /// Factors `matrix` (symmetric, positive semi-definite).
    pub fn new(matrix: &DMatrix<f64>) -> Self {
        Self::leaving_out(matrix, INDISTINCT)
    }

    /// The same, where a column counts as dependent if no more than this share of it (squared) is left after projection on the columns before it.
    pub fn leaving_out(matrix: &DMatrix<f64>, fraction: f64) -> Self {
        let size = matrix.nrows();
        let largest = matrix.diagonal().iter().copied().fold(0.0, f64::max);
        // Columns of length one: degrees, millimetres and metres per newton are then compared alike.
        let scales = matrix.diagonal().map(|square| length_of(square, largest));
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
            // `left` is the squared sine of the angle between the column and the span of those kept so far.
            if left > fraction {
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

    /// Number of independent columns: the numerical rank.
    pub fn rank(&self) -> usize {
        self.independent.len()
    }

    /// `L^-1 D^-1 right`: the independent columns made orthonormal, applied to any number of right-hand sides (one a
    /// column; as many rows as the matrix has).
    pub fn whiten(&self, right: &DMatrix<f64>) -> DMatrix<f64> {
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
    pub fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let right = DMatrix::from_column_slice(right.len(), 1, right.as_slice());
        self.back(self.whiten(&right).column(0).into_owned())
    }

    /// The solution whose right-hand side, multiplied by [`whiten`](Self::whiten), is `white`; dependent unknowns stay at zero.
    pub fn back(&self, mut white: DVector<f64>) -> DVector<f64> {
        self.lower.tr_solve_lower_triangular_mut(&mut white);
        let mut solution = DVector::zeros(self.size);
        for (index, column) in self.independent.iter().enumerate() {
            solution[*column] = white[index] / self.scales[*column];
        }
        solution
    }

    /// The inverse over the independent columns; zero elsewhere.
    pub fn inverse(&self) -> DMatrix<f64> {
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
    pub fn weights_of(&self, matrix: &DMatrix<f64>, column: usize) -> Vec<(usize, f64)> {
        if self.scales[column] == 0.0 {
            return Vec::new();
        }
        let right = DVector::from_iterator(self.size, matrix.column(column).iter().copied());
        let solution = self.solve(&right);
        self.independent.iter().map(|other| (*other, solution[*other])).collect()
    }

    /// The same in units where every column has length one.
    pub fn combination(&self, matrix: &DMatrix<f64>, column: usize) -> Vec<(usize, f64)> {
        let scale = self.scales[column];
        let mut weights = self.weights_of(matrix, column);
        for (other, weight) in &mut weights {
            *weight *= self.scales[*other] / scale;
        }
        weights
    }
}

/// Length of a column by its square; zero where it moves nothing beside the largest.
fn length_of(square: f64, largest: f64) -> f64 {
    if square > largest * NO_COLUMN && square > 0.0 { square.sqrt() } else { 0.0 }
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
        let factor = RankRevealingCholesky::new(&gram());
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
        let solution = RankRevealingCholesky::new(&matrix).solve(&(&matrix * &truth));
        assert!((solution - truth).norm() < 1e-6);
    }

    #[test]
    fn the_inverse_holds_over_the_independent_columns() {
        let matrix = gram();
        let factor = RankRevealingCholesky::new(&matrix);
        let product = &matrix * factor.inverse() * &matrix;
        assert!((product - &matrix).norm() < 1e-6 * matrix.norm());
    }

    /// Hilbert's matrix: positive definite, and singular to working precision from about twelve rows on.
    fn hilbert(size: usize) -> DMatrix<f64> {
        DMatrix::from_fn(size, size, |row, column| 1.0 / (row + column + 1) as f64)
    }

    #[test]
    fn hilberts_matrix_is_solved_where_it_is_regular_and_its_dependent_columns_are_left_out() {
        let ones = DVector::from_element(4, 1.0);
        let small = RankRevealingCholesky::new(&hilbert(4));
        assert_eq!(small.rank(), 4);
        assert!((small.solve(&(hilbert(4) * &ones)) - ones).norm() < 1e-8);
        let large = RankRevealingCholesky::new(&hilbert(12));
        // Each left-out column makes room for the next, so that the kept ones need not be the first.
        assert!((6..12).contains(&large.rank()), "rank {}", large.rank());
        assert!(large.independent.starts_with(&[0, 1, 2, 3, 4]), "{:?}", large.independent);
        // What is left out is determined by the others: the equations hold all the same.
        let right = hilbert(12) * DVector::from_element(12, 1.0);
        let solution = large.solve(&right);
        assert!((hilbert(12) * &solution - &right).norm() < 1e-4 * right.norm());
        assert!(large.dependent.iter().all(|column| solution[*column] == 0.0));
    }

    #[test]
    fn a_matrix_of_nothing_has_rank_zero_and_the_unit_matrix_full_rank() {
        let nothing = RankRevealingCholesky::new(&DMatrix::zeros(3, 3));
        assert_eq!((nothing.rank(), nothing.dependent.len()), (0, 3));
        assert_eq!(nothing.solve(&DVector::from_element(3, 1.0)), DVector::zeros(3));
        let unit = RankRevealingCholesky::new(&DMatrix::identity(3, 3));
        assert_eq!(unit.rank(), 3);
        assert!((unit.inverse() - DMatrix::identity(3, 3)).norm() < 1e-15);
    }

    #[test]
    fn a_dependent_column_is_made_of_the_others_by_its_weights_in_either_unit() {
        // The third column is twice the first and three times the second, whose lengths are 1 and 10.
        let j = DMatrix::from_columns(&[
            DVector::from_vec(vec![1.0, 0.0]),
            DVector::from_vec(vec![0.0, 10.0]),
            DVector::from_vec(vec![2.0, 30.0]),
        ]);
        let matrix = j.tr_mul(&j);
        let factor = RankRevealingCholesky::new(&matrix);
        assert_eq!(factor.dependent, [2]);
        let weights = factor.weights_of(&matrix, 2);
        assert!((weights[0].1 - 2.0).abs() < 1e-9 && (weights[1].1 - 3.0).abs() < 1e-9, "{weights:?}");
        // With every column of length one: 2 / |c| and 3 * 10 / |c|, where |c| is sqrt(904).
        let combination = factor.combination(&matrix, 2);
        let length = 904_f64.sqrt();
        assert!((combination[0].1 - 2.0 / length).abs() < 1e-9, "{combination:?}");
        assert!((combination[1].1 - 30.0 / length).abs() < 1e-9, "{combination:?}");
        assert_eq!((combination[0].0, combination[1].0), (0, 1));
    }

    #[test]
    fn a_column_that_moves_nothing_beside_the_largest_has_no_length() {
        assert_eq!(
            (length_of(9.0, 9.0), length_of(0.0, 0.0), length_of(0.0, 9.0), length_of(-4.0, 1.0)),
            (3.0, 0.0, 0.0, 0.0)
        );
        assert_eq!(length_of(0.5 * NO_COLUMN, 1.0), 0.0);
        assert!(length_of(2.0 * NO_COLUMN, 1.0) > 0.0);
        // A square below zero is rounding, though the largest may be below it too.
        assert_eq!(length_of(-1.0, -4.0 / NO_COLUMN), 0.0);
    }
}
