//! Symmetric matrices of some hundred columns: inverses by blocks, so that most of the work is products of matrices, and parts.

use std::ops::Range;

use nalgebra::DMatrix;

/// Size below which a matrix is inverted by Cholesky's method and not by blocks.
const BLOCK: usize = 48;

/// The inverse of a symmetric positive definite matrix and the logarithm of its determinant; nothing if it is none.
pub(super) fn symmetric_inverse(matrix: &DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    let size = matrix.nrows();
    if size <= BLOCK {
        let factor = matrix.clone().cholesky()?;
        let logarithm = 2.0 * factor.l_dirty().diagonal().iter().map(|one| one.ln()).sum::<f64>();
        return Some((factor.inverse(), logarithm));
    }
    // The inverse of a partitioned matrix by the Schur complement of its first half (Horn & Johnson 2013, Matrix Analysis, section 0.7.3).
    let half = size / 2;
    let rest = size - half;
    let across = block(matrix, half..size, 0..half);
    let (mut first, before) = symmetric_inverse(&block(matrix, 0..half, 0..half))?;
    let through = &across * &first;
    let mut beyond = block(matrix, half..size, half..size);
    beyond.gemm(-1.0, &through, &across.transpose(), 1.0);
    let (second, behind) = symmetric_inverse(&beyond)?;
    let lower = -(&second * &through);
    let upper = lower.transpose();
    first.gemm(-1.0, &upper, &through, 1.0);
    let mut inverse = DMatrix::zeros(size, size);
    copy(&first, (0, 0), &mut inverse, (0, 0), (half, half));
    copy(&lower, (0, 0), &mut inverse, (half, 0), (rest, half));
    copy(&upper, (0, 0), &mut inverse, (0, half), (half, rest));
    copy(&second, (0, 0), &mut inverse, (half, half), (rest, rest));
    Some((inverse, before + behind))
}

/// A part of a matrix.
fn block(matrix: &DMatrix<f64>, rows: Range<usize>, columns: Range<usize>) -> DMatrix<f64> {
    let mut block = DMatrix::zeros(rows.len(), columns.len());
    let size = block.shape();
    copy(matrix, (rows.start, columns.start), &mut block, (0, 0), size);
    block
}

/// The rows and columns of some ranges of a symmetric matrix, one after the other.
pub(super) fn submatrix(matrix: &DMatrix<f64>, ranges: &[Range<usize>]) -> DMatrix<f64> {
    let size = ranges.iter().map(Range::len).sum();
    let mut all = DMatrix::zeros(size, size);
    let mut column = 0;
    for columns in ranges {
        let mut row = 0;
        for rows in ranges {
            let size = (rows.len(), columns.len());
            copy(matrix, (rows.start, columns.start), &mut all, (row, column), size);
            row += rows.len();
        }
        column += columns.len();
    }
    all
}

/// Copies a block of `size` (rows, columns) from one matrix into another, column by column.
fn copy(
    from: &DMatrix<f64>,
    (from_row, from_column): (usize, usize),
    into: &mut DMatrix<f64>,
    (into_row, into_column): (usize, usize),
    (rows, columns): (usize, usize),
) {
    let (from_rows, into_rows) = (from.nrows(), into.nrows());
    for column in 0..columns {
        let source = (from_column + column) * from_rows + from_row;
        let target = (into_column + column) * into_rows + into_row;
        let source = from.as_slice().get(source..source + rows);
        let target = into.as_mut_slice().get_mut(target..target + rows);
        if let (Some(source), Some(target)) = (source, target) {
            target.copy_from_slice(source);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_estimation::Random;

    fn random(rows: usize, columns: usize, seed: u64) -> DMatrix<f64> {
        let mut random = Random::seeded(seed);
        DMatrix::from_fn(rows, columns, |_, _| random.normal())
    }

    #[test]
    fn the_inverse_by_blocks_is_the_inverse() {
        for size in [7, BLOCK, BLOCK + 1, 170, 401] {
            let columns = random(2 * size, size, 1);
            let matrix = columns.transpose() * &columns;
            let (inverse, logarithm) = symmetric_inverse(&matrix).unwrap();
            assert!((&inverse * &matrix - DMatrix::identity(size, size)).amax() < 1e-9, "{size}");
            assert_eq!(inverse.shape(), (size, size));
            let exact: f64 = matrix.symmetric_eigenvalues().iter().map(|one| one.ln()).sum();
            assert!((logarithm - exact).abs() < 1e-7 * exact.abs(), "{size}: {logarithm} {exact}");
        }
        assert!(symmetric_inverse(&-DMatrix::<f64>::identity(100, 100)).is_none());
    }

    #[test]
    fn a_submatrix_has_the_rows_and_columns_of_its_ranges_in_their_order() {
        let matrix = DMatrix::from_fn(6, 6, |row, column| (10 * row + column) as f64);
        let found = submatrix(&matrix, &[4..6, 1..2]);
        assert_eq!(
            found,
            DMatrix::from_row_slice(3, 3, &[44.0, 45.0, 41.0, 54.0, 55.0, 51.0, 14.0, 15.0, 11.0])
        );
        assert!(submatrix(&matrix, &[]).is_empty());
        assert_eq!(block(&matrix, 1..3, 0..1), DMatrix::from_column_slice(2, 1, &[10.0, 20.0]));
    }
}
