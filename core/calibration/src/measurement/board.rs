//! Where a camera on the arm sees a board: the origin of the board in the camera's frame.
//!
//! Equation: `z = e_axis . C' (b - c)`, with the board's origin `b`, and the camera at `c` with axes `C = B F T` (base, flange, camera in the flange), all
//! in the frame of the measurements. Gradients: `-C e` by the camera's place, `C e` by the board's, `C e x (b - c)` by a turn of the camera about itself.
//! Together with `board_rotation.rs` this is the problem `AX = ZB` of a camera on the hand and a board in the world (Shah, Solving the robot-world/hand-eye
//! calibration problem using the Kronecker product, Journal of Mechanisms and Robotics 5, 2013).

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::RowReader;
use crate::arm_model::Model;
use crate::fit::FreeParameter;
use crate::table::Table;

/// The board's place: columns `board_x_mm ...`, or OpenCV's `tvec_x_mm ...`.
#[derive(Debug)]
pub(super) struct Board;

/// Says what a model lacks for a table with a board.
pub(super) fn check(model: &Model, table: &Table) -> Result<(), ObservationsError> {
    if !table.sees_a_board() || !model.boards.is_empty() {
        return Ok(());
    }
    let reason = "columns `board_*` are of a board that a camera on the hand sees: the model needs that camera under `targets:` and \
                  `board: {seen_by: p1}` (several: `boards: {left: {seen_by: p1}, right: {seen_by: p1}}`, named in the column `board`). A board on the hand that a fixed camera sees is a target: p1_x_mm ..., p1_qw ...";
    Err(ObservationsError::Incomplete { table: table.source.clone(), reason: reason.to_owned() })
}

/// The camera that sees a board, by its index among the targets.
pub(super) fn camera(model: &Model, board: usize) -> usize {
    model.boards.get(board).map_or(0, |board| board.camera)
}

/// The board that a row sees, by its index in the model.
pub(super) fn board_seen(row: &RowReader<'_>) -> Result<usize, ObservationsError> {
    let named = row.table.board_seen.name(row.row);
    // One without a name is the only one: of two names in a table it would be both.
    let one_for_several = row.table.board_seen.names.len() > 1 && row.model.boards.len() == 1;
    if let Some(board) = row.model.board_position(named).filter(|_| !one_for_several) {
        return Ok(board);
    }
    let names: Vec<&str> = row.model.boards.iter().filter_map(|board| board.name.as_deref()).collect();
    let line = row.line();
    Err(row.incomplete(match named {
        Some(name) if !names.is_empty() => format!(
            "line {line}: `{name}` in column `board` is not in the model's `boards:` ({}){}",
            names.join(", "),
            crate::suggestion::suggestion(name, names.iter().copied())
        ),
        _ if names.is_empty() => {
            let known = row.table.board_seen.names.iter().map(|name| format!("{name}: {{seen_by: p1}}"));
            format!(
                "column `board` names {} boards, and the model has one: write `boards: {{{}}}` in place of `board:`",
                row.table.board_seen.names.len(),
                known.collect::<Vec<_>>().join(", ")
            )
        }
        _ => format!("line {line}: say in column `board` which of the model's boards is seen: {}", names.join(", ")),
    }))
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
        if seen.iter().all(|value| !value.is_finite()) {
            return Ok(());
        }
        let index = board_seen(row)? as u32;
        for (component, value) in (0_u8..).zip(seen).filter(|(_, value)| value.is_finite()) {
            let what = Measurand { kind: &Self, index, component };
            equations.push(Equation::new(what, *value, row.model.noise.board));
        }
        Ok(())
    }

    fn subject(&self, model: &Model, what: Measurand) -> Subject {
        Subject::Camera(camera(model, what.index()))
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let axis = context.body(camera(context.model, what.index())) * Vector3::ith(what.axis(), 1.0);
        let board = context
            .state
            .boards
            .get(what.index())
            .map_or_else(Vector3::zeros, |board| board.translation.vector);
        let away = board - context.point;
        Prediction { value: axis.dot(&away), by_point: -axis, by_rotation: axis.cross(&away) }
    }

    fn own_derivatives(
        &self,
        what: Measurand,
        context: &RowContext<'_>,
        set: &mut dyn FnMut(FreeParameter, f64),
    ) {
        let along = context.body(camera(context.model, what.index())) * Vector3::ith(what.axis(), 1.0);
        for (axis, part) in along.iter().enumerate() {
            set(FreeParameter::BoardShift(what.index(), axis), *part);
        }
    }
}
