//! A first guess of where the base stands: the rigid motion that brings predicted points onto measured ones.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};

use super::machine::Machine;
use super::observations::Reading;
use super::state::State;

/// The rigid motion `to = motion * from` that fits best (Kabsch).
fn rigid(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<IsometryMatrix3<f64>> {
    if from.len() < 3 {
        return None;
    }
    let mean = |points: &[Vector3<f64>]| points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let (from_mean, to_mean) = (mean(from), mean(to));
    let covariance: Matrix3<f64> =
        from.iter().zip(to).map(|(from, to)| (to - to_mean) * (from - from_mean).transpose()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut mirror = Matrix3::identity();
    mirror[(2, 2)] = (u * v_t).determinant().signum();
    let rotation = Rotation3::from_matrix_unchecked(u * mirror * v_t);
    Some(IsometryMatrix3::from_parts(Translation3::from(to_mean - rotation * from_mean), rotation))
}

/// Places the base, if it is free and whole points were measured, so that the nominal arm fits best.
pub(crate) fn align(machine: &Machine<'_>, start: &State, rows: &[usize]) -> State {
    let mut state = start.clone();
    if machine.model.base.free {
        let (mut predicted, mut measured) = (Vec::new(), Vec::new());
        let mut at_origin = start.clone();
        at_origin.base = IsometryMatrix3::identity();
        let mut residuals = Vec::new();
        let mut scratch = super::machine::Scratch::default();
        // A few hundred rows spread over the table are plenty for a first guess.
        for row in rows.iter().step_by(rows.len().div_ceil(500).max(1)) {
            residuals.clear();
            machine.row_residuals(&at_origin, *row, &mut scratch, &mut residuals);
            let equations = machine.observations.of_row(*row);
            for (three, residual) in equations.windows(3).zip(residuals.windows(3)) {
                if let [Reading::Position(a, 0), Reading::Position(b, 1), Reading::Position(c, 2)] =
                    [three[0].reading, three[1].reading, three[2].reading]
                    && a == b
                    && b == c
                {
                    let point = Vector3::new(three[0].measured, three[1].measured, three[2].measured);
                    measured.push(point);
                    predicted.push(point - Vector3::new(residual[0], residual[1], residual[2]));
                }
            }
        }
        let better = rigid(&predicted, &measured).map(|pose| State { base: pose, ..start.clone() });
        if let Some(better) = better {
            let ones = vec![1.0; machine.observations.rows()];
            if machine.squares(&better, rows, &ones) < machine.squares(start, rows, &ones) {
                state = better;
            }
        }
    }
    place_touched(machine, &mut state, rows);
    state
}

/// Starts every touched place at the mean of where the arm believes it to be.
pub(crate) fn place_touched(machine: &Machine<'_>, state: &mut State, rows: &[usize]) {
    if state.places.is_empty() {
        return;
    }
    let mut sums = vec![(Vector3::zeros(), 0.0); state.places.len()];
    let mut scratch = super::machine::Scratch::default();
    let mut residuals = Vec::new();
    for place in &mut state.places {
        *place = Vector3::zeros();
    }
    for row in rows {
        residuals.clear();
        machine.row_residuals(state, *row, &mut scratch, &mut residuals);
        for (equation, residual) in machine.observations.of_row(*row).iter().zip(&residuals) {
            if let Reading::Touch(place, axis) = equation.reading
                && let Some((sum, count)) = sums.get_mut(place as usize)
                && let Some(part) = sum.get_mut(usize::from(axis))
            {
                *part -= residual;
                *count += 1.0 / 3.0;
            }
        }
    }
    for (place, (sum, count)) in state.places.iter_mut().zip(sums) {
        if count > 0.5 {
            *place = sum / count;
        }
    }
}
