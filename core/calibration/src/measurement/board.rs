//! Where a camera on the arm sees a board: the origin of the board in the camera's frame.
//!
//! Equation: `z = e_axis . C' (b - c)`, with the board's origin `b`, and the camera at `c` with axes `C = B F T` (base, flange, camera in the flange), all
//! in the frame of the measurements. Gradients: `-C e` by the camera's place, `C e` by the board's, `C e x (b - c)` by a turn of the camera about itself.
//! Together with `board_turn.rs` this is the problem `AX = ZB` of a camera on the hand and a board in the world (Shah, Solving the robot-world/hand-eye
//! calibration problem using the Kronecker product, Journal of Mechanisms and Robotics 5, 2013).

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::RowReader;
use crate::arm_model::Model;
use crate::fit::Slot;
use crate::table::Table;

/// The board's place: columns `board_x_mm ...`, or OpenCV's `tvec_x_mm ...`.
#[derive(Debug)]
pub(super) struct Board;

/// Says what a model lacks for a table with a board.
pub(super) fn check(model: &Model, table: &Table) -> Result<(), ObservationsError> {
    if !table.sees_a_board() || model.board.is_some() {
        return Ok(());
    }
    let reason = "columns `board_*` are of a board that a camera on the hand sees: the model needs that camera under `targets:` and \
                  `board: {seen_by: p1}`. A board on the hand that a fixed camera sees is a target: p1_x_mm ..., p1_qw ...";
    Err(ObservationsError::Incomplete { table: table.source.clone(), reason: reason.to_owned() })
}

/// The camera that sees the board, by its place among the targets.
pub(super) fn camera(model: &Model) -> usize {
    model.board.as_ref().map_or(0, |board| board.camera)
}

impl MeasurementKind for Board {
    fn name(&self) -> &'static str {
        "board"
    }

    fn columns(&self) -> &'static str {
        "board_x_mm ..."
    }

    fn check(&self, model: &Model, table: &Table) -> Result<(), ObservationsError> {
        check(model, table)
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        let Some(seen) = row.table.board.as_ref().and_then(|board| board.get(row.row)) else { return Ok(()) };
        for (component, value) in (0_u8..).zip(seen).filter(|(_, value)| value.is_finite()) {
            let what = Measurand { kind: &Self, index: 0, component };
            equations.push(Equation::new(what, *value, row.model.noise.board));
        }
        Ok(())
    }

    fn subject(&self, model: &Model, _what: Measurand) -> Subject {
        Subject::Camera(camera(model))
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let axis = context.body(camera(context.model)) * Vector3::ith(what.axis(), 1.0);
        let away = context.state.board.translation.vector - context.point;
        Prediction { value: axis.dot(&away), by_point: -axis, by_turn: axis.cross(&away) }
    }

    fn own_derivatives(&self, what: Measurand, context: &RowContext<'_>, set: &mut dyn FnMut(Slot, f64)) {
        let along = context.body(camera(context.model)) * Vector3::ith(what.axis(), 1.0);
        for (axis, part) in along.iter().enumerate() {
            set(Slot::BoardShift(axis), *part);
        }
    }
}
