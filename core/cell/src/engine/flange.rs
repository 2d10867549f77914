//! Where the flange goes for a tool to look at a place.

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use super::Engine;
use super::step_context::StepContext;
use super::step_error::StepError;
use crate::expression::Expression;

impl Engine {
    /// The flange's attitude by tilt, azimuth and turn, deg, each 0 where it is left out: looking straight down.
    pub(crate) fn attitude(
        &mut self,
        angles: [&Option<Expression>; 3],
        at: &StepContext,
    ) -> Result<Rotation3<f64>, StepError> {
        let mut angle = |expression: &Option<Expression>| match expression {
            None => Ok(0.0),
            Some(expression) => self.number(at.scope, expression).map(f64::to_radians),
        };
        let [tilt, azimuth, turn] = angles;
        Ok(attitude_of(angle(tilt)?, angle(azimuth)?, angle(turn)?))
    }

    pub(crate) fn place(
        &mut self,
        place: &[Expression; 3],
        at: &StepContext,
    ) -> Result<Vector3<f64>, StepError> {
        let [x, y, z] = place;
        Ok(Vector3::new(self.number(at.scope, x)?, self.number(at.scope, y)?, self.number(at.scope, z)?))
    }
}

/// The flange's attitude, angles in rad: tilted so that it stands in the direction of the azimuth and looks back at the place.
pub(crate) fn attitude_of(tilt: f64, azimuth: f64, turn: f64) -> Rotation3<f64> {
    let about_z = |angle: f64| Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
    let down = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let tilted = about_z(azimuth) * Rotation3::from_axis_angle(&Vector3::y_axis(), tilt) * about_z(-azimuth);
    tilted * about_z(turn) * down
}

/// Where the flange is that brings a point of its frame, `aim`, to a place of the base's, mm.
pub(crate) fn flange_at(
    place: Vector3<f64>,
    attitude: Rotation3<f64>,
    aim: Vector3<f64>,
) -> IsometryMatrix3<f64> {
    IsometryMatrix3::from_parts(Translation3::from(place - attitude * aim), attitude)
}
