//! Ridge regression with one variance per component of columns beside columns that are not penalised: a linear mixed model. The variances are those under which
//! the training rows are likeliest (evidence approximation: MacKay 1992, Neural Computation 4, 415, equations 4.9 and 4.10; Rasmussen & Williams 2006,
//! section 5.4.1). A component that the rows do not ask for shrinks to nothing.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::symmetric::{submatrix, symmetric_inverse};
use crate::thresholds::EXPLAINABLE_FREEDOM;

/// Rounds of estimating the variances at most.
const ROUNDS: usize = 14;

/// Change of the effective degrees of freedom, relative, below which the rounds end.
const SETTLED: f64 = 0.01;

/// Ridge on the columns that are not penalised, relative to their diagonal: holds what the rows left over hardly see.
const DAMPING: f64 = 1e-6;

/// Least ratio of the noise's variance to a component's, relative to the number of equations: keeps the matrix invertible.
pub(super) const LEAST_RATIO: f64 = 1e-9;

/// Products of the columns of some equations with each other and with the readings.
#[derive(Debug, Clone)]
pub(crate) struct Products {
    /// Columns by columns; the last column is the readings'.
    matrix: DMatrix<f64>,
    equations: f64,
}

impl Products {
    /// Of equations by columns, the last column being the readings.
    pub(super) fn of(design: &DMatrix<f64>) -> Self {
        Self { matrix: design.transpose() * design, equations: design.nrows() as f64 }
    }

    fn zeros(columns: usize) -> Self {
        Self { matrix: DMatrix::zeros(columns, columns), equations: 0.0 }
    }

    /// What is known of the first columns besides the equations: their products, and those with what is left of it.
    pub(super) fn of_knowledge(own: &DMatrix<f64>, readings: &DVector<f64>, columns: usize) -> Self {
        let mut all = Self::zeros(columns);
        let size = own.nrows();
        all.matrix.view_mut((0, 0), (size, size)).copy_from(own);
        all.matrix.view_mut((0, columns - 1), (size, 1)).copy_from(readings);
        all.matrix.view_mut((columns - 1, 0), (1, size)).copy_from(&readings.transpose());
        all
    }

    /// The same with so many columns of which nothing is known before the last.
    pub(super) fn widened(&self, count: usize) -> Self {
        let last = self.matrix.nrows() - 1;
        let matrix = self.matrix.clone().insert_rows(last, count, 0.0).insert_columns(last, count, 0.0);
        Self { matrix, equations: self.equations }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.matrix += &other.matrix;
        self.equations += other.equations;
    }

    /// Without some of the equations.
    pub(super) fn without(&self, other: &Self) -> Self {
        Self { matrix: &self.matrix - &other.matrix, equations: self.equations - other.equations }
    }
}

/// The same after the columns that are not penalised were taken out of the others (Frisch & Waugh 1933).
pub(super) struct Reduced {
    pub(super) matrix: DMatrix<f64>,
    pub(super) right: DVector<f64>,
    pub(super) squares: f64,
    pub(super) freedom: f64,
    /// Of the columns that are not penalised: their triangular factor, and what is left of the others and of the readings behind it.
    lower: DMatrix<f64>,
    behind: DMatrix<f64>,
    behind_readings: DVector<f64>,
}

impl Reduced {
    /// The first `fixed` columns are not penalised; nothing where the equations do not determine them.
    pub(super) fn of(products: &Products, fixed: usize) -> Option<Self> {
        let flexible = products.matrix.nrows() - fixed - 1;
        let all = &products.matrix;
        let mut own = all.view((0, 0), (fixed, fixed)).into_owned();
        let largest = own.diagonal().iter().copied().fold(0.0, f64::max);
        for index in 0..fixed {
            // A column that is zero in these equations gets the least of the others' damping, or no factor would exist.
            own[(index, index)] += DAMPING * own[(index, index)].max(DAMPING * largest);
        }
        let lower = match fixed {
            0 => own,
            _ => own.cholesky()?.l(),
        };
        let behind = lower.solve_lower_triangular(&all.view((0, fixed), (fixed, flexible)))?;
        let readings = lower.solve_lower_triangular(&all.view((0, fixed + flexible), (fixed, 1)))?;
        let behind_readings: DVector<f64> = readings.column(0).into_owned();
        let across = behind.transpose();
        let matrix = all.view((fixed, fixed), (flexible, flexible)) - &across * &behind;
        let right = all.view((fixed, fixed + flexible), (flexible, 1)).column(0) - &across * &behind_readings;
        let last = fixed + flexible;
        let squares = (products.matrix[(last, last)] - behind_readings.norm_squared()).max(0.0);
        let freedom = products.equations - fixed as f64;
        (freedom >= 1.0).then_some(Self { matrix, right, squares, freedom, lower, behind, behind_readings })
    }

    /// The coefficients of all columns when these penalised ones take these values.
    pub(super) fn coefficients(&self, flexible: &DVector<f64>) -> DVector<f64> {
        let rest = &self.behind_readings - &self.behind * flexible;
        let fixed = self.lower.tr_solve_lower_triangular(&rest).unwrap_or(rest);
        DVector::from_iterator(fixed.len() + flexible.len(), fixed.iter().chain(flexible.iter()).copied())
    }

    /// Coefficients of the penalised columns, zero for those of components that were not `chosen`. `ratios` (one a component: the noise's variance over that of
    /// a coefficient) are where the search starts and where it ended.
    pub(super) fn fit(
        &self,
        components: &[Range<usize>],
        chosen: &[usize],
        ratios: &mut [f64],
    ) -> DVector<f64> {
        let mut active: Vec<usize> = chosen.to_vec();
        let mut found = DVector::zeros(self.matrix.nrows());
        let mut known = f64::INFINITY;
        for _ in 0..ROUNDS {
            let Some(round) = self.round(components, &active, ratios) else { return found };
            found.fill(0.0);
            for (column, value) in round.columns.iter().zip(round.values.iter()) {
                found[*column] = *value;
            }
            // A component once given up stays out: its likelihood falls on along the way to an infinite ratio.
            active.retain(|component| ratios[*component].is_finite());
            let freedom = round.freedom;
            if active.is_empty() || (freedom - known).abs() <= SETTLED * freedom {
                break;
            }
            known = freedom;
        }
        found
    }

    /// One round: the coefficients at these ratios, then better ratios. A component of hardly any effective degrees of freedom is given up: its ratio becomes
    /// infinite.
    fn round(&self, components: &[Range<usize>], active: &[usize], ratios: &mut [f64]) -> Option<Round> {
        let ranges: Vec<Range<usize>> =
            active.iter().filter_map(|component| components.get(*component).cloned()).collect();
        let columns: Vec<usize> = ranges.iter().cloned().flatten().collect();
        if columns.is_empty() {
            return None;
        }
        let ratio_of: Vec<f64> = active
            .iter()
            .filter_map(|component| Some((components.get(*component)?.len(), *ratios.get(*component)?)))
            .flat_map(|(count, ratio)| std::iter::repeat_n(ratio, count))
            .collect();
        let mut matrix = submatrix(&self.matrix, &ranges);
        for (index, ratio) in ratio_of.iter().enumerate() {
            matrix[(index, index)] += ratio;
        }
        let right = self.right.select_rows(&columns);
        let (inverse, _) = symmetric_inverse(&matrix)?;
        let values = &inverse * &right;
        let penalty: f64 = values.iter().zip(&ratio_of).map(|(value, ratio)| ratio * value * value).sum();
        let squares = (self.squares - values.dot(&right) - penalty).max(1e-12 * self.squares);
        let (mut effective, mut first) = (Vec::new(), 0);
        for component in active {
            let own = first..first + components.get(*component).map_or(0, Range::len);
            first = own.end;
            // Effective degrees of freedom: the coefficients less what the penalty alone holds (MacKay 1992, equation 4.9).
            let trace: f64 = own.clone().map(|index| inverse[(index, index)] * ratio_of[index]).sum();
            effective.push((own.len() as f64 - trace, values.rows(own.start, own.len()).norm_squared()));
        }
        let freedom: f64 = effective.iter().map(|(freedom, _)| freedom).sum();
        // MacKay 1992, equation 4.10, for the noise; the columns that are not penalised are in `self.freedom` already.
        let noise = squares / (self.freedom - freedom).max(1.0);
        for (component, (own, length)) in active.iter().zip(effective) {
            if let Some(ratio) = ratios.get_mut(*component) {
                *ratio = match own < EXPLAINABLE_FREEDOM || length <= 0.0 {
                    true => f64::INFINITY,
                    false => (noise * own / length).max(LEAST_RATIO * self.freedom),
                };
            }
        }
        Some(Round { columns, values, freedom })
    }
}

/// What a round found.
struct Round {
    columns: Vec<usize>,
    values: DVector<f64>,
    freedom: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_estimation::Random;

    fn random(rows: usize, columns: usize, seed: u64) -> DMatrix<f64> {
        let mut random = Random::seeded(seed);
        DMatrix::from_fn(rows, columns, |_, _| random.normal())
    }

    /// Two fixed columns, ten that the readings follow with coefficients of variance 4, ten that they do not follow; noise of variance 0.25.
    fn design(seed: u64) -> DMatrix<f64> {
        let mut design = random(400, 23, seed);
        let mut random = Random::seeded(seed + 100);
        let truth: Vec<f64> = (0..10).map(|_| 2.0 * random.normal()).collect();
        for row in 0..400 {
            let flexible: f64 =
                truth.iter().enumerate().map(|(index, one)| one * design[(row, 2 + index)]).sum();
            design[(row, 22)] = 3.0 * design[(row, 0)] - design[(row, 1)] + flexible + 0.5 * random.normal();
        }
        design
    }

    #[test]
    fn a_component_that_is_not_asked_for_shrinks_and_the_others_are_found() {
        let products = Products::of(&design(3));
        let reduced = Reduced::of(&products, 2).unwrap();
        let components = [0..10, 10..20];
        let mut ratios = [40.0, 40.0];
        let flexible = reduced.fit(&components, &[0, 1], &mut ratios);
        let all = reduced.coefficients(&flexible);
        assert!((all[0] - 3.0).abs() < 0.1 && (all[1] + 1.0).abs() < 0.1, "{all}");
        // Noise over coefficients: 0.25 / 4, known to a factor of two from ten coefficients.
        assert!((0.02..0.2).contains(&ratios[0]), "{ratios:?}");
        assert!(ratios[1] > 10.0, "{ratios:?}");
        assert!(flexible.rows(10, 10).norm() < 0.12, "{flexible}");
    }

    /// Three orthogonal columns of length root 8 in eight equations, and readings of 2, -1 and 1/2 of them and one of a fourth.
    fn orthogonal() -> Reduced {
        let sign = |bit: usize, row: usize| if row >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let design = DMatrix::from_fn(8, 4, |row, column| match column {
            3 => {
                let known = 2.0 * sign(0, row) - sign(1, row) + 0.5 * sign(2, row);
                known + sign(0, row) * sign(1, row)
            }
            bit => sign(bit, row),
        });
        Reduced::of(&Products::of(&design), 0).unwrap()
    }

    #[test]
    fn of_orthogonal_columns_a_round_is_what_one_works_out_by_hand() {
        let mut ratios = [4.0, 8.0];
        let round = orthogonal().round(&[0..2, 2..3], &[0, 1], &mut ratios).unwrap();
        // Each coefficient shrinks by 8 / (8 + ratio): 2 and -1 by two thirds, 1/2 by a half.
        for (value, expected) in round.values.iter().zip([4.0 / 3.0, -2.0 / 3.0, 0.25]) {
            assert!((value - expected).abs() < 1e-12, "{}", round.values);
        }
        // Effective degrees of freedom 2 * 2/3 and 1/2. Squares left, and what the penalty costs: 8 (4/9 + 1/9 + 1/16 + 1).
        assert!((round.freedom - 11.0 / 6.0).abs() < 1e-12, "{}", round.freedom);
        let noise = 8.0 * (4.0 / 9.0 + 1.0 / 9.0 + 1.0 / 16.0 + 1.0) / (8.0 - 11.0 / 6.0);
        // Penalties weigh in besides: 4 (16/9 + 4/9) + 8 / 16 of them stand in neither.
        assert!((ratios[0] - noise * (4.0 / 3.0) / (20.0 / 9.0)).abs() < 1e-12, "{ratios:?}");
        assert!((ratios[1] - noise * 0.5 / (1.0 / 16.0)).abs() < 1e-12, "{ratios:?}");
    }

    #[test]
    fn a_component_of_hardly_any_freedom_is_given_up() {
        // One column of length root 8 has 8 / (8 + ratio) degrees of freedom.
        let at = |freedom: f64| 8.0 / freedom - 8.0;
        let given_up = |freedom: f64| {
            let mut ratios = [at(freedom)];
            orthogonal().round(std::slice::from_ref(&(0..1)), &[0], &mut ratios).unwrap();
            ratios[0].is_infinite()
        };
        assert!(given_up(0.99 * EXPLAINABLE_FREEDOM) && !given_up(1.01 * EXPLAINABLE_FREEDOM));
    }

    #[test]
    fn what_was_not_chosen_stays_zero_and_products_add_up() {
        let design = design(4);
        let (first, second) = (design.rows(0, 150).into_owned(), design.rows(150, 250).into_owned());
        let mut sum = Products::of(&first);
        sum.add(&Products::of(&second));
        let alone = sum.without(&Products::of(&second));
        assert!((&alone.matrix - Products::of(&first).matrix).amax() < 1e-9);
        let reduced = Reduced::of(&sum, 2).unwrap();
        let flexible = reduced.fit(&[0..10, 10..20], &[1], &mut [40.0, 40.0]);
        assert_eq!(flexible.rows(0, 10).norm(), 0.0);
        assert!(
            Reduced::of(&Products::of(&design.rows(0, 2).into_owned()), 2).is_none(),
            "no equation is left over"
        );
    }
}
