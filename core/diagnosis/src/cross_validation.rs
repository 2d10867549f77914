//! Blocked cross-validation: whole regions are left out in turn, and predicted by what is fitted to the rest.

use nalgebra::DMatrix;

use crate::laboratory::{ErrorSummary, point_squares};
use crate::split::{Holdout, Poses};
use crate::thresholds::{SURFACE_UNKNOWN, VALIDATION_BLOCKS};
use plumb_calibration::fit::{Distances, Fit, FreeParameter, ResidualModel, State};
use plumb_calibration::table::Table;
use plumb_estimation::{NormalEquations, Random, RankRevealingCholesky};

/// Damping of the step to a fit without some rows, relative to the diagonal.
const DAMPING: f64 = 1e-6;

/// Errors of the points of all fitted rows, each predicted without its own region, mm; nothing if there are too few poses.
pub(crate) fn blocked_errors(problem: &ResidualModel<'_>, fit: &Fit) -> Option<ErrorSummary> {
    let blocks = region_blocks(problem.table, &fit.rows);
    let rows = left_out(problem, fit, &blocks)?;
    ErrorSummary::of(rows.into_iter().flatten().flat_map(|row| row.squares))
}

/// Poses that were fitted, and the fitted rows of each.
fn fitted_poses(table: &Table, rows: &[usize]) -> (Poses, Vec<usize>, Vec<bool>) {
    let mut fitted = vec![false; table.len()];
    for row in rows {
        if let Some(flag) = fitted.get_mut(*row) {
            *flag = true;
        }
    }
    let poses = Poses::of(table);
    let with_rows = poses.rows.iter().enumerate();
    let chosen = with_rows.filter(|(_, rows)| rows.iter().any(|row| fitted.get(*row) == Some(&true)));
    let chosen: Vec<usize> = chosen.map(|(pose, _)| pose).collect();
    (poses, chosen, fitted)
}

fn rows_of(poses: &Poses, list: &[usize], fitted: &[bool]) -> Vec<usize> {
    poses.rows_of(list).into_iter().filter(|row| fitted.get(*row).copied().unwrap_or(false)).collect()
}

/// The fitted rows, cut into regions of pose space. A few poses far from all others are in none: without them nothing could foretell
/// them, and it is they that distinguish candidates which are alike where the others lie.
pub(crate) fn region_blocks(table: &Table, rows: &[usize]) -> Vec<Vec<usize>> {
    regions(table, rows, VALIDATION_BLOCKS)
}

/// The same, cut into so many regions.
pub(crate) fn regions(table: &Table, rows: &[usize], count: usize) -> Vec<Vec<usize>> {
    let (poses, mut chosen, fitted) = fitted_poses(table, rows);
    poses.drop_lonely(&mut chosen);
    poses.regions(&chosen, count).iter().map(|region| rows_of(&poses, region, &fitted)).collect()
}

/// The same, cut into ranges of one joint.
pub(crate) fn joint_blocks(table: &Table, rows: &[usize], joint: usize) -> Vec<Vec<usize>> {
    let (poses, mut chosen, fitted) = fitted_poses(table, rows);
    poses.drop_lonely(&mut chosen);
    chosen.sort_by(|left, right| {
        let [left, right] =
            [left, right].map(|pose| poses.positions.get(*pose).and_then(|position| position.get(joint)));
        left.unwrap_or(&0.0).total_cmp(right.unwrap_or(&0.0))
    });
    // Ranges of as many poses each, not of as many degrees: each must leave enough to fit.
    let fraction = chosen.len().div_ceil(VALIDATION_BLOCKS).max(1);
    chosen.chunks(fraction).map(|part| rows_of(&poses, part, &fitted)).collect()
}

/// The fitted rows by session; nothing if there is but one.
pub(crate) fn session_blocks(table: &Table, rows: &[usize]) -> Option<Vec<Vec<usize>>> {
    let sessions = table.session.names.len();
    if sessions < 2 {
        return None;
    }
    let mut blocks = vec![Vec::new(); sessions];
    for row in rows {
        let session = table.session.of_row.get(*row).copied().flatten();
        if let Some(block) = session.and_then(|session| blocks.get_mut(session as usize)) {
            block.push(*row);
        }
    }
    blocks.retain(|block| !block.is_empty());
    (blocks.len() > 1).then_some(blocks)
}

/// The fitted rows, cut in the way in which rows are held out, so that what is left out in turn foretells what the held-out rows will show: poses drawn at random, stretches of
/// the order of time, sessions, or regions.
pub(crate) fn holdout_blocks(table: &Table, rows: &[usize], holdout: Holdout) -> Vec<Vec<usize>> {
    let order = match holdout {
        Holdout::Regions | Holdout::None => return region_blocks(table, rows),
        Holdout::Session => {
            return session_blocks(table, rows).unwrap_or_else(|| region_blocks(table, rows));
        }
        Holdout::Random { seed, .. } => {
            let mut groups = pose_groups(table, rows);
            Random::seeded(seed).shuffle(&mut groups);
            groups
        }
        Holdout::Time { .. } => return stretches(table, rows, VALIDATION_BLOCKS),
    };
    let fraction = order.len().div_ceil(VALIDATION_BLOCKS).max(1);
    order.chunks(fraction).map(<[Vec<usize>]>::concat).collect()
}

/// The fitted rows, cut into so many stretches of the order in which they were measured.
pub(crate) fn stretches(table: &Table, rows: &[usize], count: usize) -> Vec<Vec<usize>> {
    let fitted: std::collections::HashSet<usize> = rows.iter().copied().collect();
    let order: Vec<usize> = table.order().into_iter().filter(|row| fitted.contains(row)).collect();
    let fraction = order.len().div_ceil(count).max(1);
    order.chunks(fraction).map(<[usize]>::to_vec).collect()
}

/// Fitted rows in groups that fraction a pose.
pub(crate) fn pose_groups(table: &Table, rows: &[usize]) -> Vec<Vec<usize>> {
    let (poses, chosen, fitted) = fitted_poses(table, rows);
    chosen.iter().map(|pose| rows_of(&poses, &[*pose], &fitted)).collect()
}

/// How a row is predicted by a fit without its own block.
#[derive(Debug, Clone)]
pub(crate) struct LeftOut {
    /// Squared errors of its measured points, mm2 (deg2 for tilts alone).
    pub(crate) squares: Vec<f64>,
    /// Norm of the residuals in declared sigmas, and the number of equations.
    pub(crate) distance: (f64, usize),
}

/// Per row of the table: how it is predicted by a fit without its own block; nothing for rows in no block. Nothing at
/// all if a block's absence leaves too little to fit.
pub(crate) fn left_out(
    problem: &ResidualModel<'_>,
    fit: &Fit,
    blocks: &[Vec<usize>],
) -> Option<Vec<Option<LeftOut>>> {
    left_out_by(problem, fit, blocks, |rows| problem.normal_of_rows(&fit.state, rows, &fit.weights))
}

/// Residuals and derivatives of some rows at a state: what is asked of several ways of leaving rows out is worked out once.
pub(crate) struct Derivatives<'a> {
    problem: &'a ResidualModel<'a>,
    /// In declared sigmas, times the root of the row's weight.
    pub(crate) residuals: Vec<f64>,
    /// Slots by equations, in the same units.
    pub(crate) jacobian: DMatrix<f64>,
    /// Per row of the table: its first equation among those gathered.
    first: Vec<Option<usize>>,
}

impl<'a> Derivatives<'a> {
    /// Of all fitted rows at a fit.
    pub(crate) fn of(problem: &'a ResidualModel<'a>, fit: &Fit) -> Self {
        Self::at(problem, &fit.state, &fit.rows, &fit.weights)
    }

    /// Of these rows at this state.
    pub(crate) fn at(problem: &'a ResidualModel<'a>, state: &State, rows: &[usize], weights: &[f64]) -> Self {
        let block = problem.block(state, rows, weights, &[]);
        let mut first = vec![None; problem.table.len()];
        let mut next = 0;
        for row in rows {
            if let Some(entry) = first.get_mut(*row) {
                *entry = Some(next);
            }
            next += problem.observations.range(*row).len();
        }
        Self { problem, residuals: block.residuals, jacobian: block.jacobian, first }
    }

    /// Where a row's equations are among those gathered.
    pub(crate) fn equations_of(&self, row: usize) -> std::ops::Range<usize> {
        let first = self.first.get(row).copied().flatten();
        first.map_or(0..0, |first| first..first + self.problem.observations.range(row).len())
    }

    /// What these rows say of the free parameters.
    pub(crate) fn normal(&self, rows: &[usize]) -> NormalEquations {
        let columns: Vec<usize> = rows.iter().flat_map(|row| self.equations_of(*row)).collect();
        let residuals: Vec<f64> =
            columns.iter().filter_map(|column| self.residuals.get(*column)).copied().collect();
        let mut total = NormalEquations::zeros(self.jacobian.nrows());
        total.take(&residuals, &self.jacobian.select_columns(&columns));
        total
    }

    /// [`left_out`].
    pub(crate) fn left_out(&self, fit: &Fit, blocks: &[Vec<usize>]) -> Option<Vec<Option<LeftOut>>> {
        left_out_by(self.problem, fit, blocks, |rows| self.normal(rows))
    }
}

fn left_out_by(
    problem: &ResidualModel<'_>,
    fit: &Fit,
    blocks: &[Vec<usize>],
    normal_of: impl Fn(&[usize]) -> NormalEquations,
) -> Option<Vec<Option<LeftOut>>> {
    if blocks.len() < 2 {
        return None;
    }
    let mut all = vec![None; problem.table.len()];
    for block in blocks.iter().filter(|block| !block.is_empty()) {
        let without = Without::of(&fit.normal, fit.rank(), &normal_of(block))?;
        // The residuals are those of the model at that state, not their linear forecast: what is far left out is not linear.
        let state = fit.state.stepped(problem.free_parameters(), &without.step);
        let residuals = problem.residuals_apart(&state, block, &[]);
        // In sigmas for the gain, in mm for what is reported: a table may hold readings of several instruments.
        let distances = Distances::of(problem, &residuals);
        let undetermined = without
            .undetermined(problem, block, || problem.block(&fit.state, block, &fit.weights, &[]).jacobian);
        for row in block.iter().filter(|row| !undetermined.contains(row)) {
            let squares = point_squares(problem, &residuals, *row);
            if let (Some(entry), false, Some(distance)) =
                (all.get_mut(*row), squares.is_empty(), distances.rows.get(*row))
            {
                *entry = Some(LeftOut { squares, distance: *distance });
            }
        }
    }
    Some(all)
}

/// The fit without some rows.
pub(crate) struct Without {
    /// The step to it from where the normal equations are of, by one step of Newton's method.
    pub(crate) step: Vec<f64>,
    pub(crate) factor: RankRevealingCholesky,
    /// The normal matrix of the rows that are left, damped.
    information: DMatrix<f64>,
}

impl Without {
    /// `own` is what the rows left out add to the normal equations of `all`, which are of this rank; nothing if too little is
    /// left to fit.
    pub(crate) fn of(all: &NormalEquations, rank: usize, own: &NormalEquations) -> Option<Self> {
        let mut rest: NormalEquations = all.clone();
        // The rows that stay, from two sums: to gather them anew would cost a pass over all rows for every block.
        rest.subtract(own);
        if rest.equations <= rank {
            return None;
        }
        // A little damping holds back what the rest of the rows hardly sees: along a valley the linear step runs too far.
        for index in 0..rest.matrix.nrows() {
            rest.matrix[(index, index)] *= 1.0 + DAMPING;
        }
        let factor = RankRevealingCholesky::new(&rest.matrix);
        let step = factor.solve(&rest.gradient).as_slice().to_vec();
        Some(Self { step, factor, information: rest.matrix })
    }

    /// Of the rows left out, those measured against a surface that nothing else determines: what is foretold of them says where the
    /// surface was thought to lie, and nothing of the arm. `jacobian` is asked for only where there are surfaces.
    pub(crate) fn undetermined(
        &self,
        problem: &ResidualModel<'_>,
        block: &[usize],
        jacobian: impl FnOnce() -> DMatrix<f64>,
    ) -> Vec<usize> {
        let free_parameters = problem.free_parameters().iter().enumerate();
        let surfaces = free_parameters
            .filter(|(_, free_parameter)| matches!(free_parameter, FreeParameter::Surface(..)))
            .map(|(index, _)| index);
        let surfaces: Vec<usize> = surfaces.collect();
        if surfaces.is_empty() {
            return Vec::new();
        }
        let jacobian = jacobian();
        if jacobian.ncols() == 0 {
            return Vec::new();
        }
        // How much less well the rows are foretold because nobody knows the surfaces. Where a surface and the arm cannot be distinguished,
        // each is badly known, and a reading is foretold as well as ever.
        let arm = RankRevealingCholesky::new(
            &self.information.clone().remove_rows_at(&surfaces).remove_columns_at(&surfaces),
        );
        let known = arm.whiten(&jacobian.clone().remove_rows_at(&surfaces));
        let spread = self.factor.whiten(&jacobian);
        // A surface that the rest of the rows does not determine at all has no place in the factor: readings of it are lost whatever the others say.
        let dependent =
            self.factor.dependent.iter().filter(|free_parameter| surfaces.contains(free_parameter));
        let dependent: Vec<usize> = dependent.copied().collect();
        let mut first = 0;
        let undetermined = block.iter().filter(|row| {
            let own = first..first + problem.observations.range(**row).len();
            first = own.end;
            own.into_iter().any(|equation| {
                let added = spread.column(equation).norm_squared() - known.column(equation).norm_squared();
                added > SURFACE_UNKNOWN
                    || dependent.iter().any(|free_parameter| jacobian[(*free_parameter, equation)] != 0.0)
            })
        });
        undetermined.copied().collect()
    }
}

#[cfg(test)]
mod tests;
