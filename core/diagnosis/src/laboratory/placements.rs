//! Where bodies, cameras, the board and the base were found, and how sure that is.

use nalgebra::{Rotation3, Vector3};
use plumb_calibration::fit::{Fit, ResidualModel, Slot};
use plumb_calibration::measurement::{Measurand, ReadingUnit};
use plumb_calibration::table::quaternion;
use serde::Serialize;

use super::point_errors::ErrorSummary;

/// Where something sits, and how sure that is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Placement {
    /// What: `p1`, `board`, `base`.
    pub name: String,
    /// In whose frame: `flange` or `measurements`.
    pub frame: &'static str,
    /// mm.
    pub xyz_mm: [f64; 3],
    /// One standard error of each; nothing where it is not fitted, or cannot be told.
    pub se_mm: [Option<f64>; 3],
    /// Roll, pitch and yaw: Rz(yaw) Ry(pitch) Rx(roll).
    pub rpy_deg: [f64; 3],
    /// The same as a unit quaternion: w, x, y, z.
    pub quaternion: [f64; 4],
    /// One standard error of the turn about each axis of that frame; nothing where it is not fitted, or cannot be told.
    pub se_deg: [Option<f64>; 3],
}

/// What the standard errors are read from.
struct Errors<'f, 'm> {
    machine: &'f ResidualModel<'m>,
    fit: &'f Fit,
}

impl Errors<'_, '_> {
    /// One standard error of a number, internal unit.
    fn of(&self, slot: Slot) -> Option<f64> {
        let index = self.machine.slots().iter().position(|known| *known == slot)?;
        let variance = self.fit.covariance.get((index, index))?;
        (!self.fit.factor.dependent.contains(&index)).then(|| variance.max(0.0).sqrt())
    }

    fn placement(
        &self,
        (name, frame): (&str, &'static str),
        (xyz, turn): (Vector3<f64>, Rotation3<f64>),
        (shift, turned): (impl Fn(usize) -> Slot, impl Fn(usize) -> Slot),
    ) -> Placement {
        let (roll, pitch, yaw) = turn.euler_angles();
        Placement {
            name: name.to_owned(),
            frame,
            xyz_mm: xyz.into(),
            se_mm: [0, 1, 2].map(|axis| self.of(shift(axis))),
            rpy_deg: [roll, pitch, yaw].map(f64::to_degrees),
            quaternion: quaternion(&turn),
            se_deg: [0, 1, 2].map(|axis| self.of(turned(axis)).map(f64::to_degrees)),
        }
    }
}

/// Where the bodies whose orientation was measured, the camera or the laser line sensor, and the board are, and the base where it is free; nothing of a table without orientations.
pub(super) fn placements(machine: &ResidualModel<'_>, fit: &Fit) -> Vec<Placement> {
    let (model, state) = (machine.model, &fit.state);
    let bodies = machine.seen_bodies();
    let line_sensor = model.profile_sensor.filter(|_| !machine.table.profiles.is_empty());
    if bodies.is_empty() && !machine.table.sees_a_board() && line_sensor.is_none() {
        return Vec::new();
    }
    let errors = Errors { machine, fit };
    // A pose is told only of what an orientation, a board or profiles were read of: of a bare point the turn is not known.
    let mut seen: Vec<usize> = bodies.iter().map(|body| body.target(machine)).collect();
    let boards = machine.boards_named();
    seen.extend(boards.iter().filter_map(|board| model.boards.get(*board)).map(|board| board.camera));
    seen.extend(line_sensor);
    let mut found = Vec::new();
    for (index, target) in model.targets.iter().enumerate().filter(|(index, _)| seen.contains(index)) {
        let xyz = state.targets.get(index).copied().unwrap_or(target.xyz);
        let turn = state.turns.get(index).copied().unwrap_or(target.turn);
        let slots = (move |axis| Slot::Target(index, axis), move |axis| Slot::TargetTurn(index, axis));
        found.push(errors.placement((&target.name, "flange"), (xyz, turn), slots));
    }
    for (index, board) in boards.iter().filter_map(|index| Some((*index, state.boards.get(*index)?))) {
        let place = (board.translation.vector, board.rotation);
        let slots = (move |axis| Slot::BoardShift(index, axis), move |axis| Slot::BoardTurn(index, axis));
        found.push(errors.placement((model.board_name(index), "measurements"), place, slots));
    }
    if model.base.free {
        let place = (state.base.translation.vector, state.base.rotation);
        found.push(errors.placement(("base", "measurements"), place, (Slot::BaseShift, Slot::BaseTurn)));
    }
    found
}

/// Whether a reading's error is shown as an angle besides the others.
fn is_angle(what: Measurand, beside_lengths: bool) -> bool {
    what.kind.is_orientation() || (beside_lengths && !what.is_length())
}

/// How far measured orientations, and any other angles beside lengths, are off in some rows, degrees; nothing if none was measured.
pub(super) fn orientation_errors(
    machine: &ResidualModel<'_>,
    residuals: &[f64],
    rows: &[usize],
) -> Option<ErrorSummary> {
    let beside_lengths = machine.observations.unit() == ReadingUnit::Mm;
    ErrorSummary::of(rows.iter().flat_map(|row| {
        let own = residuals.get(machine.observations.range(*row)).unwrap_or(&[]);
        let equations = machine.observations.of_row(*row).iter().zip(own);
        let mut squares: Vec<((&str, u32), f64)> = Vec::new();
        for (equation, residual) in equations.filter(|(one, _)| is_angle(one.measurand, beside_lengths)) {
            let key = (equation.measurand.kind.name(), equation.measurand.index);
            // Three small turns about perpendicular axes add as a vector: their squares make the square of the angle.
            let square = residual.to_degrees().powi(2);
            match squares.iter_mut().find(|(known, _)| *known == key) {
                Some((_, sum)) => *sum += square,
                None => squares.push((key, square)),
            }
        }
        squares.into_iter().map(|(_, square)| square)
    }))
}
