//! Where the flange goes for a tool to look at a point.

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

    pub(crate) fn position(
        &mut self,
        coordinates: &[Expression; 3],
        at: &StepContext,
    ) -> Result<Vector3<f64>, StepError> {
        let [x, y, z] = coordinates;
        Ok(Vector3::new(self.number(at.scope, x)?, self.number(at.scope, y)?, self.number(at.scope, z)?))
    }
}

/// The flange's attitude, angles in rad: tilted so that it is in the direction of the azimuth and looks back at the point.
pub(crate) fn attitude_of(tilt: f64, azimuth: f64, turn: f64) -> Rotation3<f64> {
    let about_z = |angle: f64| Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
    let down = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let tilted = about_z(azimuth) * Rotation3::from_axis_angle(&Vector3::y_axis(), tilt) * about_z(-azimuth);
    tilted * about_z(turn) * down
}

/// Where the flange is that brings a point of its frame, `aim`, to a position in the base's, mm.
pub(crate) fn flange_at(
    position: Vector3<f64>,
    attitude: Rotation3<f64>,
    aim: Vector3<f64>,
) -> IsometryMatrix3<f64> {
    IsometryMatrix3::from_parts(Translation3::from(position - attitude * aim), attitude)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    fn assert_near(found: Vector3<f64>, expected: [f64; 3]) {
        assert!((found - Vector3::from(expected)).norm() < 1e-9, "{found} is not {expected:?}");
    }

    #[test]
    fn a_flange_looks_down_tilts_towards_its_azimuth_and_turns_about_its_own_axis() {
        let straight = attitude_of(0.0, 1.0, 0.0);
        assert_near(straight * Vector3::z(), [0.0, 0.0, -1.0]);
        assert_near(straight * Vector3::x(), [1.0, 0.0, 0.0]);
        // Tilted by 30 degrees towards y it is on that side and looks back; x, about which it is tilted, stays.
        let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
        let tilted = attitude_of(30.0_f64.to_radians(), FRAC_PI_2, 0.0);
        assert_near(tilted * Vector3::z(), [0.0, -sine, -cosine]);
        assert_near(tilted * Vector3::x(), [1.0, 0.0, 0.0]);
        let turned = attitude_of(30.0_f64.to_radians(), FRAC_PI_2, FRAC_PI_2);
        assert_near(turned * Vector3::z(), [0.0, -sine, -cosine]);
        assert_near(turned * Vector3::x(), [0.0, cosine, -sine]);
    }

    #[test]
    fn the_aim_is_brought_to_the_position() {
        let (position, aim) = (Vector3::new(10.0, 20.0, 30.0), Vector3::new(1.0, 2.0, 3.0));
        let flange = flange_at(position, attitude_of(0.3, 0.7, -0.4), aim);
        assert_near(flange * nalgebra::Point3::from(aim) - nalgebra::Point3::origin(), [10.0, 20.0, 30.0]);
        assert_near(
            flange_at(position, attitude_of(0.0, 0.0, 0.0), aim).translation.vector,
            [9.0, 22.0, 33.0],
        );
    }
}
