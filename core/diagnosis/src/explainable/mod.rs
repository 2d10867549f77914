//! How much of what a model leaves could be explained at all: a flexible regression of the residual on what is known of a row (pose, last move, order or time,
//! conditions, sessions, further columns), judged on rows it has not seen. No mechanism is assumed but that the arm carries what is wrong at a joint.
//!
//! The regression is a Gaussian process approximated by features (Rahimi & Recht 2007, Random features for large-scale kernel machines; Solin & Särkkä 2020), with
//! one variance for each component (see `regression.rs`), and everything that is fitted beside it without penalty: the parameters are refitted in every fold. All
//! variances come from the training rows alone. A group of columns counts only if unseen rows are predicted better with it, so nothing is ever made worse than
//! by predicting zero.

mod evidence;
mod features;
mod functions;
mod known;
mod outcome;
mod regression;
mod residual_map;
mod symmetric;

#[cfg(test)]
mod tests;

pub(crate) use evidence::{LeftOutRows, Mixed, MixedFit};
pub(crate) use features::Features;
pub use outcome::{BlockedExplainable, Explainable, ExplainableGroup};
pub(crate) use residual_map::{FittedMap, residual_map};

use nalgebra::DMatrix;

use crate::cross_validation::{pose_groups, region_blocks};
use crate::laboratory::{ErrorSummary, point_squares};
use crate::predictive_gain::Gain;
use crate::thresholds::{EXPLAINABLE_ERRORS, EXPLAINABLE_ROWS, FEW_POSES, VALIDATION_BLOCKS};
use features::Group;
use plumb_calibration::fit::{Fit, ResidualModel};
use plumb_estimation::{Cancelled, Progress, Random, for_each};
use regression::{Products, Reduced};

/// Fewest poses of which anything is said.
const FEWEST_POSES: usize = FEW_POSES;

/// Ratio of the noise's variance to a coefficient's at which the search begins, for each column of the component: the component then makes up a quarter of the noise.
const FIRST_RATIO: f64 = 4.0;

/// One way of leaving rows out, ready to be fitted without each fold.
struct Folds<'a> {
    problem: &'a ResidualModel<'a>,
    fit: &'a Fit,
    features: &'a Features,
    folds: Vec<Fold>,
}

/// A fold: its rows, their equations by columns, and the products of all other rows.
struct Fold {
    rows: Vec<usize>,
    design: DMatrix<f64>,
    rest: Reduced,
}

/// How unseen rows are predicted: squared errors of the points of each row of the table, mm2.
#[derive(Clone)]
struct Prediction {
    squares: Vec<Vec<f64>>,
    /// By fold and component: see [`Reduced::fit`].
    ratios: Vec<Vec<f64>>,
}

impl Prediction {
    fn rms(&self) -> f64 {
        ErrorSummary::or_zero(ErrorSummary::of(self.squares.iter().flatten().copied())).rms
    }

    fn points(&self) -> usize {
        self.squares.iter().map(Vec::len).sum()
    }

    /// The fall of the squared error from `before` to this, over poses.
    fn reduction_from(&self, before: &Self, poses: &[Vec<usize>]) -> Option<Gain> {
        let sum = |squares: &[Vec<f64>], row: &usize| squares.get(*row).map_or(0.0, |own| own.iter().sum());
        let reduction = |rows: &Vec<usize>| -> f64 {
            rows.iter().map(|row| -> f64 { sum(&before.squares, row) - sum(&self.squares, row) }).sum()
        };
        Gain::over(&poses.iter().map(reduction).collect::<Vec<f64>>())
    }
}

impl<'a> Folds<'a> {
    /// Of these blocks of rows; nothing where what is left without one does not determine what is fitted.
    fn new(
        problem: &'a ResidualModel<'a>,
        fit: &'a Fit,
        (features, rows): (&'a Features, &[usize]),
        blocks: Vec<Vec<usize>>,
    ) -> Option<Self> {
        let mut by_row = vec![None; problem.table.len()];
        for (index, row) in rows.iter().enumerate() {
            if let Some(slot) = by_row.get_mut(*row) {
                *slot = features.equations.get(index).cloned();
            }
        }
        let of = |rows: &Vec<usize>| -> Vec<usize> {
            rows.iter().filter_map(|row| by_row.get(*row)?.clone()).flatten().collect()
        };
        let equations: Vec<Vec<usize>> = blocks.iter().map(of).collect();
        let parts = for_each(&equations, |equations| {
            let design = features.design.select_rows(equations);
            (Products::of(&design), design)
        });
        let mut all = features.knowledge.clone();
        parts.iter().for_each(|(own, _)| all.add(own));
        let mut folds = Vec::new();
        for (rows, (own, design)) in blocks.into_iter().zip(parts) {
            // Sums without a fold are the sums of all less its own: one pass over the rows for all folds.
            let rest = Reduced::of(&all.without(&own), features.fixed)?;
            folds.push(Fold { rows, design, rest });
        }
        (folds.len() > 1).then_some(Self { problem, fit, features, folds })
    }

    /// Predicts every fold from the others, with these components; `near` are ratios to start from.
    fn predict(&self, components: &[usize], near: Option<&Prediction>) -> Prediction {
        let start: Vec<f64> =
            self.features.components.iter().map(|columns| FIRST_RATIO * columns.len() as f64).collect();
        let indices: Vec<usize> = (0..self.folds.len()).collect();
        let predicted = for_each(&indices, |index| {
            let known = near.and_then(|near| near.ratios.get(*index));
            let mut ratios = start.clone();
            for (ratio, known) in ratios.iter_mut().zip(known.into_iter().flatten()) {
                // A component that another fold gave up may be wanted here.
                if known.is_finite() {
                    *ratio = *known;
                }
            }
            let residuals = self.folds.get(*index).map(|fold| self.residuals(fold, components, &mut ratios));
            (residuals.unwrap_or_default(), ratios)
        });
        let mut squares = vec![Vec::new(); self.problem.table.len()];
        let mut ratios = Vec::new();
        for (fold, (residuals, own)) in self.folds.iter().zip(predicted) {
            for row in &fold.rows {
                if let Some(slot) = squares.get_mut(*row) {
                    *slot = point_squares(self.problem, &residuals, *row);
                }
            }
            ratios.push(own);
        }
        Prediction { squares, ratios }
    }

    /// What is left of a fold's rows, mm and rad, by equation of the table (0 elsewhere).
    fn residuals(&self, fold: &Fold, components: &[usize], ratios: &mut [f64]) -> Vec<f64> {
        let flexible = fold.rest.fit(&self.features.components, components, ratios);
        let coefficients = fold.rest.coefficients(&flexible);
        let mut left = fold.design.column(fold.design.ncols() - 1).into_owned();
        // Those of components that are not asked are zero, which are most.
        let asked =
            fold.design.column_iter().zip(&coefficients).filter(|(_, coefficient)| **coefficient != 0.0);
        for (column, coefficient) in asked {
            left.axpy(-coefficient, &column, 1.0);
        }
        let mut all = vec![0.0; self.problem.observations.equations.len()];
        let mut next = left.iter();
        for row in &fold.rows {
            let weight = self.fit.weights.get(*row).copied().unwrap_or(1.0).sqrt().max(1e-9);
            let range = self.problem.observations.range(*row);
            for ((index, equation), left) in range.zip(self.problem.observations.of_row(*row)).zip(&mut next)
            {
                if let Some(slot) = all.get_mut(index) {
                    *slot = left * equation.sigma / weight;
                }
            }
        }
        all
    }
}

/// Rows that are looked at: all that were fitted, of more than `most` a random part, whole poses.
pub(crate) fn chosen_rows(problem: &ResidualModel<'_>, fit: &Fit, most: usize) -> Vec<usize> {
    if fit.rows.len() <= most {
        return fit.rows.clone();
    }
    let mut poses = pose_groups(problem.table, &fit.rows);
    // By chance, so that no order of the table comes through; the same chance every time.
    Random::seeded(17).shuffle(&mut poses);
    let mut rows = Vec::new();
    for pose in poses {
        if rows.len() + pose.len() > most {
            break;
        }
        rows.extend(pose);
    }
    rows.sort_unstable();
    rows
}

/// Poses dealt at random into folds.
fn random_folds(poses: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..poses.len()).collect();
    Random::seeded(19).shuffle(&mut order);
    let mut folds = vec![Vec::new(); VALIDATION_BLOCKS];
    for (index, pose) in order.into_iter().enumerate() {
        if let (Some(fold), Some(rows)) = (folds.get_mut(index % VALIDATION_BLOCKS), poses.get(pose)) {
            fold.extend(rows.iter().copied());
        }
    }
    folds
}

/// Components of some groups.
fn components_of(groups: &[&Group]) -> Vec<usize> {
    groups.iter().flat_map(|group| group.components.clone()).collect()
}

/// Whether a fall is more than chance.
fn counts(gain: Option<Gain>) -> bool {
    gain.is_some_and(|gain| gain.total > EXPLAINABLE_ERRORS * gain.error)
}

/// One standard error of the fall of a root mean square, mm, from that of the sum of squares.
fn rms_error(gain: Option<Gain>, rms: f64, points: usize) -> f64 {
    // d(rms) = d(mean square) / (2 rms).
    gain.map_or(0.0, |gain| gain.error / (2.0 * rms.max(1e-12) * points.max(1) as f64))
}

/// The groups that predict unseen rows, in their order, each judged beside those before it.
struct Ladder<'f> {
    taken: Vec<&'f Group>,
    steps: Vec<ExplainableGroup>,
    best: Prediction,
}

/// Asks these groups in turn: each counts if it predicts unseen rows better beside those before it that count.
fn climb<'f>(
    folds: &Folds<'f>,
    start: &Prediction,
    asked: &[&'f Group],
    poses: &[Vec<usize>],
    progress: &Progress,
) -> Result<Ladder<'f>, Cancelled> {
    let mut ladder = Ladder { taken: Vec::new(), steps: Vec::new(), best: start.clone() };
    for group in asked {
        progress.check()?;
        let mut tried = ladder.taken.clone();
        tried.push(group);
        // From the variances before: the others move little when a group comes in.
        let prediction = folds.predict(&components_of(&tried), Some(&ladder.best));
        let gain = prediction.reduction_from(&ladder.best, poses);
        let explains = counts(gain);
        let scatter_mm = rms_error(gain, ladder.best.rms(), ladder.best.points());
        if explains {
            ladder.taken = tried;
            ladder.best = prediction;
        }
        ladder.steps.push(ExplainableGroup {
            group: group.name.clone(),
            explains,
            left_mm: ladder.best.rms(),
            beyond_others_mm: 0.0,
            scatter_mm,
        });
    }
    Ok(ladder)
}

/// What each group that was taken explains beyond all the others; the index of the one that explains least, if chance would do as much.
fn beyond_others(
    folds: &Folds<'_>,
    ladder: &mut Ladder<'_>,
    start: &Prediction,
    poses: &[Vec<usize>],
) -> Option<usize> {
    let mut least: Option<(f64, usize)> = None;
    for index in 0..ladder.taken.len() {
        let mut others = ladder.taken.clone();
        let group = others.remove(index);
        let without = match others.is_empty() {
            true => start.clone(),
            false => folds.predict(&components_of(&others), Some(&ladder.best)),
        };
        let rise = without.rms() - ladder.best.rms();
        // By chance of the poses a group may look needed before a later one has come in that explains both.
        let needless = !counts(ladder.best.reduction_from(&without, poses));
        if needless && least.is_none_or(|(known, _)| rise < known) {
            least = Some((rise, index));
        }
        if let Some(step) = ladder.steps.iter_mut().find(|step| step.group == group.name) {
            step.beyond_others_mm = rise.max(0.0);
        }
    }
    least.map(|(_, index)| index)
}

/// The groups that predict unseen rows, none of which the others could do without: what goes with one may go with another by chance of the poses.
fn ladder<'f>(
    folds: &Folds<'f>,
    start: &Prediction,
    poses: &[Vec<usize>],
    progress: &Progress,
) -> Result<Ladder<'f>, Cancelled> {
    let mut asked: Vec<&Group> = folds.features.groups.iter().collect();
    let mut ladder = climb(folds, start, &asked, poses, progress)?;
    let mut silent: Vec<ExplainableGroup> = Vec::new();
    while let Some(needless) = beyond_others(folds, &mut ladder, start, poses) {
        progress.check()?;
        let name = ladder.taken.get(needless).map(|group| group.name.clone()).unwrap_or_default();
        silent.extend(ladder.steps.into_iter().filter(|step| !step.explains || step.group == name));
        asked = ladder.taken.iter().filter(|group| group.name != name).copied().collect();
        ladder = climb(folds, start, &asked, poses, progress)?;
    }
    let left_mm = ladder.best.rms();
    for step in silent {
        let nothing = ExplainableGroup { explains: false, left_mm, beyond_others_mm: 0.0, ..step };
        if ladder.steps.iter().all(|known| known.group != nothing.group) {
            ladder.steps.push(nothing);
        }
    }
    Ok(ladder)
}

/// How much of what a fit leaves is predictable; nothing where the poses are too few to ask.
///
/// # Errors
/// Cancellation.
pub(crate) fn explainable(
    problem: &ResidualModel<'_>,
    fit: &Fit,
    progress: &Progress,
) -> Result<Option<Explainable>, Cancelled> {
    let rows = chosen_rows(problem, fit, EXPLAINABLE_ROWS);
    let poses = pose_groups(problem.table, &rows);
    if poses.len() < FEWEST_POSES {
        return Ok(None);
    }
    progress.report(0.9, "asking how much could be explained")?;
    let features = Features::of(problem, fit, &rows);
    let Some(folds) = Folds::new(problem, fit, (&features, &rows), random_folds(&poses)) else {
        return Ok(None);
    };
    let start = folds.predict(&[], None);
    let ladder = ladder(&folds, &start, &poses, progress)?;
    let blocked = blocked(problem, fit, (&features, &rows), &ladder, &poses);
    let gain = ladder.best.reduction_from(&start, &poses);
    let (left_mm, not_predictable_mm) = (start.rms(), ladder.best.rms());
    // Where nothing is predictable, as much as any of the groups left open, but no more than there is.
    let open = ladder.steps.iter().map(|step| step.scatter_mm).fold(0.0, f64::max).min(left_mm);
    let scatter_mm = match ladder.taken.is_empty() {
        true => open,
        false => rms_error(gain, left_mm, start.points()),
    };
    Ok(Some(Explainable {
        unit: problem.observations.unit(),
        left_mm,
        not_predictable_mm,
        to_name_mm: left_mm - not_predictable_mm,
        scatter_mm,
        groups: ladder.steps,
        blocked,
        rows: rows.len(),
        points: start.points(),
    }))
}

/// The same groups where whole regions of pose space are left out.
fn blocked(
    problem: &ResidualModel<'_>,
    fit: &Fit,
    (features, rows): (&Features, &[usize]),
    ladder: &Ladder<'_>,
    poses: &[Vec<usize>],
) -> Option<BlockedExplainable> {
    let folds = Folds::new(problem, fit, (features, rows), region_blocks(problem.table, rows))?;
    let start = folds.predict(&[], None);
    let left_mm = start.rms();
    if ladder.taken.is_empty() {
        return Some(BlockedExplainable { left_mm, not_predictable_mm: left_mm });
    }
    let best = folds.predict(&components_of(&ladder.taken), None);
    // Regions left out are predicted from afar: what helps between neighbours may do harm there, and then the regression is not used.
    let explains = counts(best.reduction_from(&start, poses));
    let not_predictable_mm = if explains { best.rms() } else { left_mm };
    Some(BlockedExplainable { left_mm, not_predictable_mm })
}
