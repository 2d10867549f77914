//! How a board is turned that a camera on the arm sees.
//!
//! Equation: `0 = log(M' P)`, three numbers, with the measured orientation `M` of the board in the camera and the predicted one `P = C' W` of the camera's
//! axes `C` and the board's `W`; see `orientation.rs`. A small turn `w` of the board about the axes of the measurements makes of it `log(M' P) + J^-1 W' w`,
//! one of the camera the same with the other sign.

use nalgebra::{Matrix3, Vector3};

use super::board::{board_seen, camera, check};
use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::orientation::apart;
use super::row::RowReader;
use crate::arm_model::Model;
use crate::fit::FreeParameter;
use crate::table::{Body, Table};

/// The board's orientation: columns `board_qw ...` or `board_rx_rad ...`, or OpenCV's `rvec_x_rad ...`.
#[derive(Debug)]
pub(super) struct BoardRotation;

/// The rotation vector between what was measured and what is believed, rad, and how it changes with a turn of the board about the axes of the measurements.
fn off(context: &RowContext<'_>, board: usize) -> Option<(Vector3<f64>, Matrix3<f64>)> {
    let camera = camera(context.model, board);
    let board = context.state.boards.get(board)?.rotation;
    let believed = context.body(camera).inverse() * board;
    let measured = context.table.orientations_as(Body::Board)?.measured(context.row, &believed)?;
    let (vector, jacobian) = apart(&measured, &believed);
    Some((vector, jacobian * board.inverse().into_inner()))
}

impl MeasurementKind for BoardRotation {
    fn name(&self) -> &'static str {
        "board_rotation"
    }

    fn columns(&self) -> &'static str {
        "board_qw ... (or board_rx_rad ...)"
    }

    fn is_length(&self) -> bool {
        false
    }

    fn is_orientation(&self) -> bool {
        true
    }

    fn noise_key(&self, _model: &Model, _what: Measurand) -> String {
        "board_deg".to_owned()
    }

    fn check(&self, model: &Model, table: &Table) -> Result<(), ObservationsError> {
        check(model, table)
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        if row.table.orientations_as(Body::Board).is_some_and(|columns| columns.is_in(row.row)) {
            let index = board_seen(row)? as u32;
            for component in 0..3 {
                // The prediction is a difference, which is zero where both orientations agree.
                let what = Measurand { kind: &Self, index, component };
                equations.push(Equation::new(what, 0.0, row.model.noise.board_rotation));
            }
        }
        Ok(())
    }

    fn subject(&self, model: &Model, what: Measurand) -> Subject {
        Subject::Camera(camera(model, what.index()))
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let Some((vector, by_board)) = off(context, what.index()) else {
            return Prediction::of_point(0.0, Vector3::zeros());
        };
        // As the camera turns one way the board turns the other in its view.
        let by_rotation = -by_board.row(what.axis()).transpose();
        Prediction { value: vector[what.axis()], by_point: Vector3::zeros(), by_rotation }
    }

    fn own_derivatives(
        &self,
        what: Measurand,
        context: &RowContext<'_>,
        set: &mut dyn FnMut(FreeParameter, f64),
    ) {
        let Some((_, by_board)) = off(context, what.index()) else { return };
        for (axis, part) in by_board.row(what.axis()).iter().enumerate() {
            set(FreeParameter::BoardRotation(what.index(), axis), *part);
        }
    }
}
