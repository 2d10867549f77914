//! How a target is turned, as a tracker body or motion capture gives it.
//!
//! Equation: `0 = log(M' R)`, three numbers, with the measured orientation `M` and the predicted one `R = B F T` (base, flange, target's axes in the
//! flange), both from the target's axes to those of the measurements; `log` is the rotation vector, so that the residual is an angle about the target's own
//! axes whatever the orientation (Barfoot, State Estimation for Robotics, 2017, section 7.3.1). A small turn `w` about the axes of the measurements makes of it
//! `log(M' R) + J^-1 R' w`, with the right Jacobian `J` of the rotations (Sola, Deray and Atchuthan, A micro Lie theory, 2018, equation 144).

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::RowReader;
use crate::arm_model::Model;
use crate::table::{Body, Table};

/// Orientations of targets: columns `p1_qw ...` or `p1_rx_rad ...`.
#[derive(Debug)]
pub(super) struct Orientation;

/// Below this angle (rad) rounding is larger than what the Jacobian differs from its series by.
const SMALL_ROTATION: f64 = 1e-6;

/// The rotation vector from a measured orientation to a predicted one, rad, and how it changes with a small turn on the right.
pub(super) fn apart(measured: &Rotation3<f64>, predicted: &Rotation3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    // By quaternions: the axis of half a turn is lost in a matrix's own formula.
    let vector = UnitQuaternion::from_rotation_matrix(&(measured.inverse() * predicted)).scaled_axis();
    let angle = vector.norm();
    let cross = vector.cross_matrix();
    let fraction = match angle < SMALL_ROTATION {
        true => 1.0 / 12.0,
        false => (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle),
    };
    (vector, Matrix3::identity() + cross * 0.5 + cross * cross * fraction)
}

impl MeasurementKind for Orientation {
    fn name(&self) -> &'static str {
        "orientation"
    }

    fn columns(&self) -> &'static str {
        "p1_qw ... (or p1_rx_rad ...)"
    }

    fn is_length(&self) -> bool {
        false
    }

    fn is_orientation(&self) -> bool {
        true
    }

    fn noise_key(&self, model: &Model, what: Measurand) -> String {
        let name = model.targets.get(what.index()).map_or("p?", |target| target.name.as_str());
        format!("{name}_deg")
    }

    fn check(&self, model: &Model, table: &Table) -> Result<(), ObservationsError> {
        let mut targets = table.orientations.iter().filter(|columns| columns.body != Body::Board);
        let unknown = targets.find(|columns| model.target_position(&columns.body.name()).is_none());
        unknown.map_or(Ok(()), |columns| {
            Err(ObservationsError::UnknownTarget { table: table.source.clone(), target: columns.body.name() })
        })
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        for columns in row.table.orientations.iter().filter(|columns| columns.body != Body::Board) {
            let name = columns.body.name();
            let Some(target) = row.model.target_position(&name) else { continue };
            if columns.is_in(row.row) {
                let sigma = row.model.noise.of_orientation(&name);
                for component in 0..3 {
                    let what = Measurand { kind: &Self, index: target as u32, component };
                    equations.push(Equation::new(what, 0.0, sigma));
                }
            }
        }
        Ok(())
    }

    fn subject(&self, _model: &Model, what: Measurand) -> Subject {
        Subject::Body(what.index())
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let believed = context.body(what.index());
        let measured =
            context.model.targets.get(what.index()).and_then(|target| {
                context.table.orientations_of(&target.name)?.measured(context.row, &believed)
            });
        let Some(measured) = measured else { return Prediction::of_point(0.0, Vector3::zeros()) };
        let (vector, jacobian) = apart(&measured, &believed);
        let by_rotation = believed * jacobian.row(what.axis()).transpose();
        Prediction { value: vector[what.axis()], by_point: Vector3::zeros(), by_rotation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_on_the_right_moves_the_rotation_vector_by_its_jacobian() {
        let measured = Rotation3::new(Vector3::new(0.3, -1.1, 0.7));
        for angle in [0.0, 1e-8, 0.02, 1.0, 2.5, 3.1] {
            let predicted = measured * Rotation3::new(Vector3::new(1.0, 2.0, -2.0).normalize() * angle);
            let (vector, jacobian) = apart(&measured, &predicted);
            assert!((vector.norm() - angle).abs() < 1e-9, "{angle}: {vector}");
            for axis in 0..3 {
                let step = Vector3::ith(axis, 1e-6);
                let slope = (apart(&measured, &(predicted * Rotation3::new(step))).0
                    - apart(&measured, &(predicted * Rotation3::new(-step))).0)
                    / 2e-6;
                assert!((jacobian.column(axis) - slope).norm() < 1e-6, "{angle}, {axis}: {jacobian} {slope}");
            }
        }
    }
}
