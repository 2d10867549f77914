//! Levenberg-Marquardt descent on scaled normal equations.

use nalgebra::{Cholesky, DVector};

use super::linear::Factor;
use super::machine::Machine;
use super::normal::Normal;
use super::state::State;
use crate::progress::{Cancelled, Progress};

/// Where a descent ended.
pub(crate) struct Descent {
    pub(crate) state: State,
    pub(crate) normal: Normal,
    pub(crate) steps: usize,
    pub(crate) settled: bool,
}

/// Damping, relative to the scales, of the first step from anywhere.
pub(crate) const CAREFUL: f64 = 1e-3;

/// Damping of the first step from a place that was the bottom until a few weights changed.
pub(crate) const NEAR: f64 = 1e-8;

/// Steps in a row that gain next to nothing before a descent counts as settled whatever a full step promises.
const IDLE: usize = 10;

/// Steps refused in a row, and share of the squares a full step may promise, after which a descent ends.
const REFUSED: usize = 3;
const NEVER_COMES: f64 = 3e-4;

/// The step to the bottom if the problem were linear. The slots in `held` stay where they are.
pub(super) fn full_step(normal: &Normal, held: &[usize]) -> DVector<f64> {
    let (mut matrix, mut gradient) = (normal.matrix.clone(), normal.gradient.clone());
    for slot in held {
        matrix.row_mut(*slot).fill(0.0);
        matrix.column_mut(*slot).fill(0.0);
        gradient[*slot] = 0.0;
    }
    Factor::new(&matrix).solve(&gradient)
}

/// What a full step would gain if the problem were linear: under heavy damping a step promises little however far the
/// bottom is.
fn promised(normal: &Normal, held: &[usize]) -> f64 {
    normal.gradient.dot(&full_step(normal, held))
}

/// Goes downhill from `start` until neither steps nor gains matter any more. The slots in `held` stay where they are.
pub(crate) fn descend(
    machine: &Machine<'_>,
    start: &State,
    rows: &[usize],
    weights: &[f64],
    held: &[usize],
    (steps, damping): (usize, f64),
    progress: &Progress,
) -> Result<Descent, Cancelled> {
    let normal = machine.normal(start, rows, weights, &[]);
    descend_from(machine, (start.clone(), normal), (rows, weights), held, (steps, damping), progress)
}

/// The same from a state whose normal equations are known.
pub(crate) fn descend_from(
    machine: &Machine<'_>,
    (mut state, mut normal): (State, Normal),
    (rows, weights): (&[usize], &[f64]),
    held: &[usize],
    (steps, mut damping): (usize, f64),
    progress: &Progress,
) -> Result<Descent, Cancelled> {
    let mut scales: DVector<f64> = normal.matrix.diagonal();
    let mut growth = 2.0;
    let (mut idle, mut refused) = (0, 0);
    for step in 0..steps {
        progress.check()?;
        for (scale, fresh) in scales.iter_mut().zip(normal.matrix.diagonal().iter()) {
            *scale = scale.max(*fresh);
        }
        let mut damped = normal.matrix.clone();
        for index in 0..damped.nrows() {
            damped[(index, index)] += damping * scales[index].max(1e-300);
        }
        let mut gradient = normal.gradient.clone();
        for slot in held {
            damped.row_mut(*slot).fill(0.0);
            damped.column_mut(*slot).fill(0.0);
            damped[(*slot, *slot)] = 1.0;
            gradient[*slot] = 0.0;
        }
        let Some(factor) = Cholesky::new(damped) else {
            damping = (damping * growth).max(1e-12);
            growth *= 2.0;
            if damping > 1e12 {
                return Ok(Descent { state, normal, steps: step, settled: false });
            }
            continue;
        };
        let change = factor.solve(&gradient);
        let scaled: f64 =
            change.iter().zip(scales.iter()).map(|(change, scale)| change * change * scale).sum();
        let predicted = damping * scaled + change.dot(&gradient);
        // A further gain of a few thousandths of one measurement's own variance says nothing any more.
        let settled_by = 3e-3 * normal.squares / normal.equations.max(1) as f64 + 1e-18;
        if predicted <= settled_by && (idle >= IDLE || promised(&normal, held) <= settled_by) {
            return Ok(Descent { state, normal, steps: step, settled: true });
        }
        let next = state.stepped(machine.slots(), change.as_slice());
        // Nearly every step is taken: what is needed there comes with the look at how good it is.
        let there = machine.normal(&next, rows, weights, &[]);
        let gain = (normal.squares - there.squares) / predicted;
        if there.squares.is_finite() && next.is_finite() && gain > 1e-4 {
            idle = if normal.squares - there.squares <= settled_by { idle + 1 } else { 0 };
            (state, normal) = (next, there);
            damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(0.1, 2.0);
            damping = damping.max(1e-14);
            growth = 2.0;
            refused = 0;
        } else {
            refused += 1;
            // Where derivatives are good to first order only, the last thousandths are promised again and again, and never come.
            let little = promised(&normal, held) <= NEVER_COMES * normal.squares;
            if damping > 1e12 || (refused >= REFUSED && little) {
                let settled = predicted <= 1e-8 * normal.squares || little;
                return Ok(Descent { state, normal, steps: step, settled });
            }
            damping = (damping * growth).max(1e-12);
            growth *= 2.0;
        }
    }
    Ok(Descent { state, normal, steps, settled: false })
}
