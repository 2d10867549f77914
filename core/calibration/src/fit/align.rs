//! A first guess of where the base is and where the targets sit: closed forms that need no good start.

use nalgebra::{
    DMatrix, DVector, IsometryMatrix3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3,
};

use super::place_bodies::place_bodies;
use super::place_profiles::place_profiles;
use super::residual_model::ResidualModel;

use super::state::{FreeParameter, State};
use crate::measurement::Equation;
use plumb_estimation::RankRevealingCholesky;
use plumb_estimation::{CAREFUL, Settings, descend};
use plumb_estimation::{Cancelled, Progress};

/// Rows looked at, spread over the table.
const LOOKED_AT: usize = 500;

/// Fraction of the measured points' spread by which the arm must be off for the targets to be looked for.
const FAR: f64 = 0.02;

/// How many times smaller the left-over must be before the targets are moved for the first guess.
const CLEARLY: f64 = 2.0;

/// Steps of the descent in which base and targets alone are free.
const STEPS: usize = 30;

/// A whole measured point of a target (frame of the measurements), and where the flange was (base frame), mm.
pub struct Sight {
    /// The target, by its index in the model.
    pub target: usize,
    /// Where it was measured, mm, frame of the measurements.
    pub measured: Vector3<f64>,
    /// The flange, base frame, mm.
    pub flange: IsometryMatrix3<f64>,
}

/// The rigid motion `to = motion * from` that fits best (Kabsch 1976); nothing from fewer than three points.
pub fn rigid(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<IsometryMatrix3<f64>> {
    // Two points leave the turn about the line through them open.
    if from.len() < 3 {
        return None;
    }
    let [from_mean, to_mean] =
        [from, to].map(|points| points.iter().sum::<Vector3<f64>>() / points.len() as f64);
    let covariance: Matrix3<f64> =
        from.iter().zip(to).map(|(from, to)| (to - to_mean) * (from - from_mean).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut mirror = Matrix3::identity();
    // A mirror image may fit points of a plane just as well.
    mirror[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = Rotation3::from_matrix_unchecked(u * mirror * v_t);
    Some(IsometryMatrix3::from_parts(Translation3::from(to_mean - rotation * from_mean), rotation))
}

/// Places the base so that points of the flange's frame that are already known fit best.
fn base_of(sights: &[Sight], targets: &[Vector3<f64>]) -> Option<IsometryMatrix3<f64>> {
    let from: Vec<Vector3<f64>> = sights
        .iter()
        .map(|sight| {
            let tool = targets.get(sight.target).copied().unwrap_or_else(Vector3::zeros);
            (sight.flange * nalgebra::Point3::from(tool)).coords
        })
        .collect();
    let to: Vec<Vector3<f64>> = sights.iter().map(|sight| sight.measured).collect();
    rigid(&from, &to)
}

/// Base and targets at once, from no start at all. Seen from the arm, `turn' * measured - origin' = flange * target` is
/// linear in the nine numbers of the base's inverse turn, in its origin and in the targets; what the sights cannot settle
/// stays as it is. `free` says which targets may move.
pub fn base_and_targets(
    sights: &[Sight],
    base: &IsometryMatrix3<f64>,
    targets: &[Vector3<f64>],
    free: &[bool],
) -> Option<(IsometryMatrix3<f64>, Vec<Vector3<f64>>)> {
    let size = 12 + 3 * targets.len();
    let mut matrix = DMatrix::zeros(size, size);
    let mut gradient = DVector::zeros(size);
    let inverse = base.inverse();
    for sight in sights {
        let tool = targets.get(sight.target).copied().unwrap_or_else(Vector3::zeros);
        let left = (sight.flange * nalgebra::Point3::from(tool)).coords
            - (inverse * nalgebra::Point3::from(sight.measured)).coords;
        for axis in 0..3 {
            let mut row = DVector::zeros(size);
            for part in 0..3 {
                row[3 * axis + part] = sight.measured[part];
                if free.get(sight.target) == Some(&true) {
                    row[12 + 3 * sight.target + part] = -sight.flange.rotation.matrix()[(axis, part)];
                }
            }
            // The origin, as the arm sees it.
            row[9 + axis] = 1.0;
            matrix.ger(1.0, &row, &row, 1.0);
            gradient.axpy(left[axis], &row, 1.0);
        }
    }
    let step = RankRevealingCholesky::new(&matrix).solve(&gradient);
    let targets: Vec<Vector3<f64>> = targets
        .iter()
        .enumerate()
        .map(|(index, target)| target + step.fixed_rows::<3>(12 + 3 * index))
        .collect();
    // The nine numbers are a matrix that need not be a rotation: the base is placed anew with the targets that were found.
    let base = base_of(sights, &targets)?;
    targets.iter().flatten().all(|part| part.is_finite()).then_some((base, targets))
}

/// The whole points among some rows, with the flange as the model at `start` has it.
pub(super) fn sights(problem: &ResidualModel<'_>, start: &State, rows: &[usize]) -> Vec<Sight> {
    let mut scratch = problem.scratch(start);
    let mut found = Vec::new();
    for row in rows {
        let flange = problem.flange(*row, &mut scratch);
        let equations = problem.observations.of_row(*row);
        found.extend(equations.windows(3).filter_map(|three| sight(three, flange)));
    }
    found
}

/// Three equations as a whole point of one target, if they are that.
fn sight(three: &[Equation], flange: IsometryMatrix3<f64>) -> Option<Sight> {
    let [x, y, z] = three else { return None };
    let target = x.measurand.kind.seen_target(x.measurand)?;
    let is_whole = [x, y, z].into_iter().enumerate().all(|(axis, equation)| {
        let what = equation.measurand;
        what.kind.seen_target(what) == Some(target) && what.coordinate() == Some(axis)
    });
    let measured = Vector3::new(x.measured, y.measured, z.measured);
    is_whole.then_some(Sight { target, measured, flange })
}

/// Whether the arm is off by more than a good guess of the targets would leave.
fn far_off(sights: &[Sight], state: &State) -> bool {
    let count = sights.len().max(1) as f64;
    let middle = sights.iter().map(|sight| sight.measured).sum::<Vector3<f64>>() / count;
    let (mut off, mut spread) = (0.0, 0.0);
    for sight in sights {
        let tool = state.targets.get(sight.target).copied().unwrap_or_else(Vector3::zeros);
        let believed = state.base * sight.flange * nalgebra::Point3::from(tool);
        off += (believed.coords - sight.measured).norm_squared();
        spread += (sight.measured - middle).norm_squared();
    }
    // Both are sums of squares over the same points.
    off > FAR * FAR * spread
}

/// Places the base, if it is free and whole points were measured, so that the nominal arm fits best; and the targets, if
/// they are free and sit so far from where the model has them that the arm would not fit without.
pub(crate) fn align(
    problem: &ResidualModel<'_>,
    start: &State,
    rows: &[usize],
    progress: &Progress,
) -> Result<State, Cancelled> {
    let mut state = start.clone();
    if problem.model.base.free {
        // Where every session has a base of its own, the first says where base and targets are.
        let one_base: Vec<usize> = match problem.model.base.per_session {
            true => rows.iter().copied().filter(|row| problem.epoch(*row) == 0).collect(),
            false => rows.to_vec(),
        };
        let stride = one_base.len().div_ceil(LOOKED_AT).max(1);
        let some: Vec<usize> = one_base.into_iter().step_by(stride).collect();
        let sights = sights(problem, start, &some);
        let ones = vec![1.0; problem.observations.rows()];
        let mut least = problem.squares(&state, &some, &ones);
        if let Some(base) = base_of(&sights, &state.targets) {
            let better = State { base, ..start.clone() };
            let left = problem.squares(&better, &some, &ones);
            if left < least {
                (state, least) = (better, left);
            }
        }
        let free: Vec<bool> = problem.model.targets.iter().map(|target| target.free).collect();
        if far_off(&sights, &state)
            && let Some((base, targets)) = base_and_targets(&sights, &state.base, &state.targets, &free)
        {
            let guess = State { base, targets, ..start.clone() };
            let others = problem.free_parameters().iter().enumerate().filter(|(_, free_parameter)| {
                !matches!(
                    free_parameter,
                    FreeParameter::BaseShift(_) | FreeParameter::BaseRotation(_) | FreeParameter::Target(..)
                )
            });
            let held: Vec<usize> = others.map(|(index, _)| index).collect();
            let settings = Settings { steps: STEPS, damping: CAREFUL };
            let settled = descend(&problem.over(&some, &ones), &guess, &held, settings, progress)?;
            // What the file says of base and targets is not given up for a chance fit.
            if CLEARLY * CLEARLY * settled.normal.squares < least {
                state = settled.state;
            }
        }
    }
    if !problem.table.orientations.is_empty() {
        let stride = rows.len().div_ceil(LOOKED_AT).max(1);
        let some: Vec<usize> = rows.iter().copied().step_by(stride).collect();
        place_bodies(problem, &mut state, &some);
    }
    if problem.model.base.per_session {
        place_bases(problem, &mut state, rows);
    }
    place_profiles(problem, &mut state, rows, progress)?;
    place_touched(problem, &mut state, rows);
    Ok(state)
}

/// Places the base of every session but the first where the points measured in it say, against that of the first.
fn place_bases(problem: &ResidualModel<'_>, state: &mut State, rows: &[usize]) {
    let Some(part) = problem.parts.iter().position(|part| part.id.name == "base_reset") else { return };
    for epoch in 1..problem.model.epoch_count() {
        let own: Vec<usize> = rows.iter().copied().filter(|row| problem.epoch(*row) == epoch).collect();
        let sights = sights(problem, state, &own);
        let Some(base) = base_of(&sights, &state.targets) else { continue };
        // By quaternions: the axis of half a turn is lost in a matrix's own formula.
        let rotation = UnitQuaternion::from_rotation_matrix(&(base.rotation * state.base.rotation.inverse()));
        let rotation = rotation.scaled_axis();
        let shift = base.translation.vector - state.base.translation.vector;
        let first = 6 * (epoch - 1);
        let own = state.effects.get_mut(part).and_then(|values| values.get_mut(first..first + 6));
        for (value, found) in own.into_iter().flatten().zip(shift.iter().chain(rotation.iter())) {
            *value = *found;
        }
    }
}

/// Starts every touched place at the mean of where the arm believes it to be.
pub(crate) fn place_touched(problem: &ResidualModel<'_>, state: &mut State, rows: &[usize]) {
    if state.places.is_empty() {
        return;
    }
    let mut sums = vec![(Vector3::zeros(), 0.0); state.places.len()];
    for place in &mut state.places {
        *place = Vector3::zeros();
    }
    let mut scratch = problem.scratch(state);
    let mut residuals = Vec::new();
    for row in rows {
        residuals.clear();
        problem.row_residuals(*row, &mut scratch, &mut residuals);
        for (equation, residual) in problem.observations.of_row(*row).iter().zip(&residuals) {
            let what = equation.measurand;
            if let Some(index) = what.kind.touched_place(what)
                && let Some((sum, count)) = sums.get_mut(index)
                && let Some(part) = sum.get_mut(what.axis())
            {
                *part -= residual;
                *count += 1.0 / 3.0;
            }
        }
    }
    // Three equations are one visit, each a third of it: half a visit is none.
    for (place, (sum, count)) in state.places.iter_mut().zip(sums) {
        if count > 0.5 {
            *place = sum / count;
        }
    }
}
