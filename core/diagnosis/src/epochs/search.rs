//! Several change points of one number: where along the rows it was re-set, how often, and how sure that is.
//!
//! Change points are added one by one, each where it explains most beyond everything fitted and the change points so far,
//! and moved to better rows when another has come in (Bai, Estimating multiple breaks one at a time, Econometric Theory 13,
//! 1997; Bai and Perron, Econometrica 66, 1998). How many there are is decided by Schwarz's criterion, in which the row of
//! each costs as much as two parameters (Yao 1988; Killick, Fearnhead and Eckley 2012 on penalties), and by an F test of each
//! against all the rest, after Bonferroni for the rows and numbers tried, with the variance of neighbours that err alike
//! (Newey and West 1987).

use nalgebra::{DMatrix, DVector};

use super::columns::Columns;
use crate::thresholds::{CURVE_LEVEL, CURVE_ROWS, JUMP_LEVEL, JUMP_ROWS, MOST_JUMPS};
use plumb_estimation::{RankRevealingCholesky, bic, f_tail};

/// Share of a step's squares that must be left beyond what is fitted for it to be seen at all.
const LEAST_BEYOND: f64 = 1e-6;

/// Rounds of moving change points to better rows.
const ROUNDS: usize = 2;

/// Change points that may show only together: what is left of the others makes each of them look like chance.
const AT_ONCE: usize = 3;

/// Change points of one number.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Changes {
    /// The first row of each new epoch, as indices among the rows looked at, in order.
    pub(super) starts: Vec<usize>,
    /// Schwarz's criterion with them in, searching charged.
    pub(super) bic: f64,
    /// Greatest probability of one of them by chance, after Bonferroni.
    pub(super) p: f64,
}

/// One number's search: sums over the rows from a row on, of everything an F test needs.
pub(super) struct Search<'c> {
    columns: &'c Columns,
    /// Which number.
    number: usize,
    /// How many numbers are searched.
    numbers: usize,
    /// Sums of products with the fitted derivatives from each row on: fitted numbers by rows.
    with_fitted: DMatrix<f64>,
    /// Sums of its own squares, and of its products with the residuals, from each row on.
    own: Vec<f64>,
    with_residuals: Vec<f64>,
    /// Normal equations of what is fitted.
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
}

/// What is known with some change points in.
struct StepFit {
    /// Fall of the sum of squares by what is fitted and the change points.
    explained: f64,
    rank: f64,
    factor: RankRevealingCholesky,
    gradient: DVector<f64>,
}

impl<'c> Search<'c> {
    /// Prepares the search for one number.
    pub(super) fn new(columns: &'c Columns, number: usize) -> Self {
        let step = columns.steps.row(number);
        let rows = columns.rows.len();
        let size = columns.fitted.nrows();
        let mut with_fitted = DMatrix::zeros(size, rows + 1);
        let (mut own, mut with_residuals) = (vec![0.0; rows + 1], vec![0.0; rows + 1]);
        // From the last row backwards: a step acts in every row from its row on, so that every row needs a sum to the end.
        for (index, range) in columns.ranges.iter().enumerate().rev() {
            let mut sum = with_fitted.column(index + 1).into_owned();
            let (mut squares, mut product) = (own[index + 1], with_residuals[index + 1]);
            for equation in range.clone() {
                let value = step[equation];
                sum.axpy(value, &columns.fitted.column(equation), 1.0);
                squares += value * value;
                product += value * columns.residuals[equation];
            }
            with_fitted.set_column(index, &sum);
            (own[index], with_residuals[index]) = (squares, product);
        }
        let residuals = DVector::from_column_slice(&columns.residuals);
        Self {
            columns,
            number,
            numbers: columns.steps.nrows(),
            with_fitted,
            own,
            with_residuals,
            normal: &columns.fitted * columns.fitted.transpose(),
            gradient: &columns.fitted * &residuals,
            squares: residuals.norm_squared(),
        }
    }

    /// Normal equations with change points at these rows, and what they explain.
    fn step_fit(&self, starts: &[usize]) -> StepFit {
        let known = self.normal.nrows();
        let size = known + starts.len();
        let mut matrix = self.normal.clone().resize(size, size, 0.0);
        let mut gradient = self.gradient.clone().resize_vertically(size, 0.0);
        for (index, start) in starts.iter().enumerate() {
            for row in 0..known {
                matrix[(row, known + index)] = self.with_fitted[(row, *start)];
                matrix[(known + index, row)] = self.with_fitted[(row, *start)];
            }
            for (other, second) in starts.iter().enumerate() {
                // Two steps overlap from the later one on.
                matrix[(known + index, known + other)] = self.own[*start.max(second)];
            }
            gradient[known + index] = self.with_residuals[*start];
        }
        let factor = RankRevealingCholesky::new(&matrix);
        let explained = gradient.dot(&factor.solve(&gradient)).max(0.0);
        StepFit { explained, rank: factor.rank() as f64, factor, gradient }
    }

    /// The row at which one more change point explains most beyond these, and how much.
    fn best_beyond(&self, starts: &[usize]) -> Option<(usize, f64)> {
        let step_fit = self.step_fit(starts);
        let known = self.normal.nrows();
        let size = known + starts.len();
        let rows: Vec<usize> = (JUMP_ROWS..(self.columns.rows.len() + 1).saturating_sub(JUMP_ROWS))
            .filter(|row| starts.iter().all(|start| row.abs_diff(*start) >= JUMP_ROWS))
            .collect();
        let mut products = DMatrix::zeros(size, rows.len());
        for (index, row) in rows.iter().enumerate() {
            products.view_mut((0, index), (known, 1)).copy_from(&self.with_fitted.column(*row));
            for (other, start) in starts.iter().enumerate() {
                products[(known + other, index)] = self.own[*start.max(row)];
            }
        }
        // A score test at every row at once: what one more step adds beyond everything that is in.
        let white = step_fit.factor.whiten(&products);
        let left = step_fit.factor.whiten(&DMatrix::from_column_slice(size, 1, step_fit.gradient.as_slice()));
        let gains = rows.iter().enumerate().filter_map(|(index, row)| {
            let column = white.column(index);
            let beyond = self.own[*row] - column.norm_squared();
            let score = self.with_residuals[*row] - column.dot(&left.column(0));
            (beyond > LEAST_BEYOND * self.own[*row]).then(|| (*row, score * score / beyond))
        });
        gains.max_by(|one, other| one.1.total_cmp(&other.1))
    }

    /// All change points that remain.
    pub(super) fn changes(&self) -> Changes {
        let none = self.judged(Vec::new());
        let mut best = none;
        let mut starts: Vec<usize> = Vec::new();
        while starts.len() < MOST_JUMPS {
            let Some((row, _)) = self.best_beyond(&starts) else { break };
            starts.push(row);
            self.move_to_better_rows(&mut starts);
            let judged = self.judged(starts.clone());
            // A later one may make earlier ones sure: as long as some more are allowed to come, an unsure set is kept growing.
            if judged.p < JUMP_LEVEL && judged.bic < best.bic {
                best = judged;
            } else if starts.len() > best.starts.len() + AT_ONCE || self.is_hopeless(&starts) {
                break;
            }
        }
        best
    }

    /// Those of some change points that a smooth drift between their neighbours would not explain as well, judged without the
    /// others; nothing where none is left, or those that are left do not pay for their rows.
    pub(super) fn abrupt(&self, changes: Changes) -> Option<Changes> {
        let mut starts = changes.starts;
        loop {
            let abrupt: Vec<usize> =
                (0..starts.len()).filter_map(|index| self.is_abrupt(&starts, index)).collect();
            if abrupt.is_empty() {
                return None;
            }
            if abrupt.len() == starts.len() {
                break;
            }
            // They stay where they were found beside the others: alone, each would move to where it follows the drift best.
            starts = abrupt;
        }
        // That they are not chance was shown with the others in; without those the drift they followed counts as noise.
        let (kept, none) = (self.judged(starts), self.judged(Vec::new()));
        (kept.bic < none.bic).then_some(kept)
    }

    /// The change point of this index, where the number jumps at it beside a smooth curve between its neighbours.
    fn is_abrupt(&self, starts: &[usize], index: usize) -> Option<usize> {
        let start = *starts.get(index)?;
        let before = index.checked_sub(1).and_then(|before| starts.get(before)).copied().unwrap_or(0);
        let after = starts.get(index + 1).copied().unwrap_or(self.columns.rows.len());
        let span = (before.max(start.saturating_sub(CURVE_ROWS)), after.min(start + CURVE_ROWS));
        (step_beside_a_curve(self.columns, self.number, start, span) < CURVE_LEVEL).then_some(start)
    }

    /// Whether one change point, the first, explains no more than the best of so many rows does by chance.
    fn is_hopeless(&self, starts: &[usize]) -> bool {
        let [_] = starts else { return false };
        let (none, one) = (self.step_fit(&[]), self.step_fit(starts));
        let freedom = (self.columns.residuals.len() as f64 - one.rank).max(1.0);
        let left = (self.squares - one.explained).max(self.squares * 1e-12) / freedom;
        let p = f_tail((one.explained - none.explained).max(0.0) / left, 1.0, freedom);
        p * self.columns.rows.len() as f64 > 1.0
    }

    /// Each change point in turn is taken out and put where it explains most beside the others, until none moves.
    fn move_to_better_rows(&self, starts: &mut [usize]) {
        for _ in 0..ROUNDS {
            let mut moved = false;
            for index in 0..starts.len() {
                let others: Vec<usize> = starts
                    .iter()
                    .enumerate()
                    .filter(|(other, _)| *other != index)
                    .map(|(_, at)| *at)
                    .collect();
                if let (Some((row, _)), Some(start)) = (self.best_beyond(&others), starts.get_mut(index)) {
                    moved |= row != *start;
                    *start = row;
                }
            }
            if !moved {
                return;
            }
        }
    }

    /// What these change points come to.
    fn judged(&self, mut starts: Vec<usize>) -> Changes {
        starts.sort_unstable();
        let equations = self.columns.residuals.len() as f64;
        let full = self.step_fit(&starts);
        let left = (self.squares - full.explained).max(self.squares * 1e-12);
        let cost = 2.0 * starts.len() as f64 * equations.ln();
        let freedom = (equations - full.rank).max(1.0);
        // Neighbours that err alike make a step look surer than it is: F and its degrees of freedom are divided by how much.
        let inflation = self.inflation(&starts, &full);
        let tried = (self.columns.rows.len() * self.numbers) as f64;
        let p = (0..starts.len())
            .map(|index| {
                let mut others = starts.clone();
                others.remove(index);
                let gain = full.explained - self.step_fit(&others).explained;
                let p = f_tail(gain.max(0.0) / (left / freedom) / inflation, 1.0, freedom / inflation);
                (p * tried).min(1.0)
            })
            .fold(0.0, f64::max);
        Changes { bic: bic(left, equations, full.rank, cost), p, starts }
    }

    /// By how much the variance of a sum over rows in a row exceeds what rows would give that err independently: at least 1.
    fn inflation(&self, starts: &[usize], step_fit: &StepFit) -> f64 {
        let solution = step_fit.factor.solve(&step_fit.gradient);
        let known = self.normal.nrows();
        let mut products = Vec::with_capacity(self.columns.rows.len());
        for (row, range) in self.columns.ranges.iter().enumerate() {
            let mut sum = 0.0;
            for equation in range.clone() {
                let step = self.columns.steps[(self.number, equation)];
                let mut left = self.columns.residuals[equation]
                    - solution.rows(0, known).dot(&self.columns.fitted.column(equation));
                for (index, start) in starts.iter().enumerate() {
                    left -= if row >= *start { solution[known + index] * step } else { 0.0 };
                }
                sum += step * left;
            }
            products.push(sum);
        }
        long_run_variance_ratio(&products)
    }
}

/// Variance of the sum of a series over that of independent numbers: Bartlett's window of the root of their number (Newey
/// and West 1987), at least 1.
pub(super) fn long_run_variance_ratio(series: &[f64]) -> f64 {
    let own: f64 = series.iter().map(|value| value * value).sum();
    if own <= 0.0 {
        return 1.0;
    }
    // The window grows with the series, for a drift makes far rows err alike too, but more slowly: of far lags there are few products, and each is mostly chance.
    let width = (series.len() as f64).sqrt() as usize;
    let mut ratio = 1.0;
    for lag in 1..=width {
        let product: f64 = series.iter().zip(series.iter().skip(lag)).map(|(one, other)| one * other).sum();
        ratio += 2.0 * (1.0 - lag as f64 / (width as f64 + 1.0)) * product / own;
    }
    f64::max(ratio, 1.0)
}

/// Probability that a step at a row is chance, where the number also follows a smooth curve of the rows between `from` and `to`: a drift is no jump, nor is what
/// an error does along a path on which the arm was measured in order. The curve is a polynomial of the degree that explains the rows best beside the step
/// (Schwarz 1978); a jump must also do better than a curve of any degree without it. Neighbours that err alike count as fewer (Newey and West 1987).
pub(super) fn step_beside_a_curve(columns: &Columns, number: usize, at: usize, span: (usize, usize)) -> f64 {
    let rows = Span::of(columns, number, at, span);
    let most = CURVE_DEGREES.1.min((span.1.saturating_sub(span.0) / ROWS_A_DEGREE).max(CURVE_DEGREES.0));
    let fits = (CURVE_DEGREES.0..=most).filter_map(|degree| rows.fitted(degree));
    let Some(best) = fits.min_by(|one, other| one.with.bic.total_cmp(&other.with.bic)) else { return 1.0 };
    let without = (CURVE_DEGREES.0..=most).map(|degree| rows.curve(degree + 1).bic);
    if best.with.bic >= without.fold(f64::INFINITY, f64::min) {
        return 1.0;
    }
    let inflation = rows.inflation(&best);
    let freedom = rows.equations - best.with.rank;
    let left = (rows.squares - best.with.explained).max(rows.squares * 1e-12) / freedom;
    let gain = (best.with.explained - best.without.explained).max(0.0);
    f_tail(gain / left / inflation, 1.0, freedom / inflation)
}

/// Degrees of the polynomials that are tried as a smooth curve: a cubic at least, and of a wave one and a half turns at most.
const CURVE_DEGREES: (usize, usize) = (3, 9);

/// Rows for each degree at least: a curve with as many bends as rows would be a jump itself.
const ROWS_A_DEGREE: usize = 5;

/// The terms of a row, and its equations: derivative by the number, residual.
type SpanRow = (DVector<f64>, Vec<(f64, f64)>);

/// The rows about a row that may be a jump, as equations of a curve and a step.
struct Span {
    /// Sums of products of the curve's terms and the step, the step last.
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    squares: f64,
    equations: f64,
    rows: Vec<SpanRow>,
}

/// A least-squares fit of some of the terms.
struct Part {
    terms: Vec<usize>,
    solution: DVector<f64>,
    explained: f64,
    rank: f64,
    bic: f64,
}

/// A curve of one degree, with the step and without.
struct Pair {
    with: Part,
    without: Part,
}

impl Span {
    fn of(columns: &Columns, number: usize, at: usize, (from, to): (usize, usize)) -> Self {
        let terms = CURVE_DEGREES.1 + 2;
        // By the rows' own positions: over rows that are held out a smooth curve goes on.
        let position = |index: usize| columns.positions.get(index).copied().unwrap_or(index as f64);
        let (first, last) = (position(from), position(to.saturating_sub(1)));
        let (middle, half) = ((first + last) / 2.0, ((last - first) / 2.0).max(1.0));
        let mut span = Self {
            normal: DMatrix::zeros(terms, terms),
            gradient: DVector::zeros(terms),
            squares: 0.0,
            equations: 0.0,
            rows: Vec::new(),
        };
        for index in from..to {
            let Some(range) = columns.ranges.get(index) else { break };
            let shape = chebyshev((position(index) - middle) / half, f64::from(u8::from(index >= at)));
            let equations: Vec<(f64, f64)> =
                range.clone().map(|one| (columns.steps[(number, one)], columns.residuals[one])).collect();
            for (step, residual) in &equations {
                span.normal.ger(step * step, &shape, &shape, 1.0);
                span.gradient.axpy(step * residual, &shape, 1.0);
                span.squares += residual * residual;
                span.equations += 1.0;
            }
            span.rows.push((shape, equations));
        }
        span
    }

    /// The first so many terms.
    fn curve(&self, terms: usize) -> Part {
        self.part((0..terms).collect())
    }

    /// A curve of a degree with the step and without; nothing where the rows do not distinguish the step from the curve.
    fn fitted(&self, degree: usize) -> Option<Pair> {
        let step = self.normal.nrows() - 1;
        let (with, without) = (self.part((0..=degree).chain([step]).collect()), self.curve(degree + 1));
        (with.rank > without.rank && self.equations - with.rank >= 1.0).then_some(Pair { with, without })
    }

    fn part(&self, terms: Vec<usize>) -> Part {
        let matrix = self.normal.select_rows(&terms).select_columns(&terms);
        let right = self.gradient.select_rows(&terms);
        let factor = RankRevealingCholesky::new(&matrix);
        let solution = factor.solve(&right);
        let (explained, rank) = (right.dot(&solution), factor.rank() as f64);
        let left = (self.squares - explained).max(self.squares * 1e-12);
        Part { bic: bic(left, self.equations, rank, 0.0), terms, solution, explained, rank }
    }

    /// By how much neighbours that err alike make the step look surer than it is.
    fn inflation(&self, pair: &Pair) -> f64 {
        let products = self.rows.iter().map(|(shape, equations)| {
            let curve: f64 = pair
                .with
                .terms
                .iter()
                .zip(pair.with.solution.iter())
                .map(|(term, value)| shape[*term] * value)
                .sum();
            equations.iter().map(|(step, residual)| step * (residual - step * curve)).sum::<f64>()
        });
        long_run_variance_ratio(&products.collect::<Vec<_>>())
    }
}

/// Chebyshev polynomials of an `x` between -1 and 1, to the greatest degree, and the step: nearly orthogonal, so that normal equations of high degrees stay sound.
fn chebyshev(x: f64, step: f64) -> DVector<f64> {
    let mut shape = DVector::from_element(CURVE_DEGREES.1 + 2, 1.0);
    shape[1] = x;
    for degree in 2..=CURVE_DEGREES.1 {
        shape[degree] = 2.0 * x * shape[degree - 1] - shape[degree - 2];
    }
    shape[CURVE_DEGREES.1 + 1] = step;
    shape
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_err_alike_by_what_curve_and_step_leave_of_each_row() {
        // A constant of 2 and a step of 3 after the second of four rows; each number moves a reading by 2 and by 1 in turn. `left` is what is left times that.
        let inflation = |left: [f64; 4]| {
            let rows = left.into_iter().enumerate().map(|(index, left)| {
                let shape = chebyshev(index as f64 / 3.0, if index >= 2 { 1.0 } else { 0.0 });
                let curve = if index >= 2 { 5.0 } else { 2.0 };
                let step = if index % 2 == 0 { 2.0 } else { 1.0 };
                (shape, vec![(step, step * curve + left / step), (0.0, 7.0)])
            });
            let terms = vec![0, CURVE_DEGREES.1 + 1];
            let part = |solution: Vec<f64>| Part {
                terms: terms.clone(),
                solution: DVector::from_vec(solution),
                explained: 0.0,
                rank: 2.0,
                bic: 0.0,
            };
            let span = Span {
                normal: DMatrix::zeros(11, 11),
                gradient: DVector::zeros(11),
                squares: 0.0,
                equations: 8.0,
                rows: rows.collect(),
            };
            span.inflation(&Pair { with: part(vec![2.0, 3.0]), without: part(vec![9.0, 9.0]) })
        };
        assert!((inflation([0.1; 4]) - 7.0 / 3.0).abs() < 1e-9, "all alike, as in the series of ones");
        assert_eq!(inflation([0.1, -0.1, 0.1, -0.1]), 1.0);
    }

    /// One reading a row, of a level that is fitted and may be re-set, with noise of a tenth about these levels.
    fn columns(rows: usize, level: impl Fn(usize) -> f64) -> Columns {
        let mut random = plumb_estimation::Random::seeded(19);
        Columns {
            rows: (0..rows).collect(),
            positions: (0..rows).map(|row| row as f64).collect(),
            ranges: (0..rows).map(|row| row..row + 1).collect(),
            residuals: (0..rows).map(|row| level(row) + 0.1 * random.normal()).collect(),
            fitted: DMatrix::from_element(1, rows, 1.0),
            steps: DMatrix::from_element(1, rows, 1.0),
            ids: vec![plumb_calibration::effect::EffectId::at(
                "reading_reset",
                plumb_calibration::effect::Site::Base,
            )],
        }
    }

    #[test]
    fn change_points_move_to_where_they_explain_most_beside_the_others() {
        let columns = columns(80, |row| [0.0, 2.0, -1.0][usize::from(row >= 20) + usize::from(row >= 55)]);
        let search = Search::new(&columns, 0);
        let mut starts = [31, 44];
        search.move_to_better_rows(&mut starts);
        starts.sort_unstable();
        assert_eq!(starts, [20, 55]);
        assert_eq!(search.best_beyond(&[55]).map(|(row, _)| row), Some(20));
        assert_eq!(search.best_beyond(&[20]).map(|(row, _)| row), Some(55));
        let changes = search.changes();
        assert!(changes.starts == [20, 55] && changes.p < JUMP_LEVEL, "{changes:?}");
        // Epochs have so many rows at least.
        let mut edge = [3];
        search.move_to_better_rows(&mut edge);
        assert_eq!(edge, [55], "three down are more than two up");
    }

    #[test]
    fn a_change_that_is_taken_back_is_found_though_either_half_alone_is_hardly_seen() {
        let columns = columns(90, |row| if (40..50).contains(&row) { 0.4 } else { 0.0 });
        let search = Search::new(&columns, 0);
        assert_eq!(search.changes().starts, [40, 50]);
        let steady = self::columns(90, |_| 0.0);
        assert!(Search::new(&steady, 0).changes().starts.is_empty());
    }

    /// Readings one off in turn about a level that is fitted, which steps by so much at the 30th of 60 rows.
    fn stepped(by: f64) -> Columns {
        let residuals =
            (0..60).map(|row| if row % 2 == 0 { 1.0 } else { -1.0 } + if row < 30 { 0.0 } else { by });
        Columns { residuals: residuals.collect(), ..columns(60, |_| 0.0) }
    }

    #[test]
    fn change_points_are_judged_by_the_weakest_of_them_and_charged_their_rows() {
        let columns = stepped(1.0);
        let search = Search::new(&columns, 0);
        // Two means leave 60 squares on 58 degrees, one mean 15 more: chance of F, 60 rows being tried.
        let judged = search.judged(vec![30]);
        let p = f_tail(15.0 / (60.0 / 58.0), 1.0, 58.0);
        assert!((judged.p - 60.0 * p).abs() < 1e-9 && judged.p < 0.05, "{} {p}", judged.p);
        // Two numbers, and a row that costs two.
        assert!((judged.bic - (2.0 + 2.0) * 60.0_f64.ln()).abs() < 1e-9, "{}", judged.bic);
        let none = search.judged(Vec::new());
        assert!((none.bic - 60.0 * (75.0_f64 / 60.0).ln() - 60.0_f64.ln()).abs() < 1e-9 && none.p == 0.0);
        assert_eq!(search.judged(vec![44, 30]).p, 1.0, "another that explains next to nothing");
        assert_eq!(search.judged(vec![44, 30]).starts, [30, 44]);
    }

    #[test]
    fn a_first_change_point_is_hopeless_where_the_best_of_so_many_places_explains_as_much_by_chance() {
        // The chance is one of sixty where F is 6.06 (R: qf(1 / 60, 1, 58, lower.tail = FALSE)): 15 squares of the step over 60 / 58.
        let edge = |f: f64| (f * 60.0 / 58.0 / 15.0).sqrt();
        let hopeless = |by: f64| {
            let columns = stepped(by);
            Search::new(&columns, 0).is_hopeless(&[30])
        };
        let f = (50..80)
            .map(|tenths| f64::from(tenths) / 10.0)
            .find(|f| 60.0 * f_tail(*f, 1.0, 58.0) < 1.0)
            .unwrap();
        assert!((6.0..6.2).contains(&f), "{f}");
        assert!(hopeless(edge(f - 0.2)) && !hopeless(edge(f + 0.1)));
        let columns = stepped(0.1);
        assert!(!Search::new(&columns, 0).is_hopeless(&[30, 44]), "several are not asked");
    }
}
