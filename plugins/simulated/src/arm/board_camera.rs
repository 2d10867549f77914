//! A camera on the hand that sees a board: the pose of the board in the camera's frame, as a program that finds a chessboard's corners gives it.

use super::ArmWorld;
use super::measuring::MeasuringError;
use crate::physics::rigid::{Rotation, Vector};
use crate::protocol::Axis;
use crate::world::normal;

/// The board's pose in one picture, camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Picture {
    place: Vector,
    turn: Vector,
}

/// How far aside of its line of sight the camera sees, rad: 40 degrees, a wide lens.
const ASIDE: f64 = 0.7;

/// The rotation vector of a rotation, rad (Diebel 2006, section 7).
fn rotation_vector(rotation: &Rotation) -> Vector {
    let trace = rotation.x.x + rotation.y.y + rotation.z.z;
    let angle = ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos();
    let twist =
        Vector::new(rotation.y.z - rotation.z.y, rotation.z.x - rotation.x.z, rotation.x.y - rotation.y.x);
    match twist.unit() {
        Some(axis) if angle < HALF_TURN => axis * angle,
        _ if angle < HALF_TURN => Vector::ZERO,
        _ => half_turn(rotation, twist) * angle,
    }
}

/// Above this angle (rad) the axis is taken from the symmetric part: the other one vanishes at half a turn.
const HALF_TURN: f64 = 3.0;

/// The axis of about half a turn, from `R + R' = 2 cos(angle) + 2 (1 - cos(angle)) a a'`; `twist` says which way it points.
fn half_turn(rotation: &Rotation, twist: Vector) -> Vector {
    let rows = rotation.inverse();
    let both = [rotation.x + rows.x, rotation.y + rows.y, rotation.z + rows.z];
    let twice_cosine = rotation.x.x + rotation.y.y + rotation.z.z - 1.0;
    let units = [Vector::X, Vector::Y, Vector::Z];
    let along = both.into_iter().zip(units).map(|(column, unit)| column - unit * twice_cosine);
    let longest = along.fold(Vector::ZERO, |best, one| if one.norm() > best.norm() { one } else { best });
    let axis = longest.unit().unwrap_or(Vector::X);
    if axis.dot(twist) < 0.0 { -axis } else { axis }
}

impl ArmWorld {
    /// One coordinate of where the board is, mm, or one number of how it is turned (a rotation vector), rad. A new picture is taken when x of the place is
    /// asked for; the rest is read from the same picture.
    ///
    /// # Errors
    /// [`MeasuringError`]
    pub fn read_board(&mut self, turned: bool, axis: Option<Axis>) -> Result<f64, MeasuringError> {
        let axis = axis.ok_or(MeasuringError::NoAxis)?;
        let picture = match self.picture {
            Some(picture) if turned || axis != Axis::X => picture,
            _ => self.take_picture()?,
        };
        let vector = if turned { picture.turn } else { picture.place };
        Ok(match axis {
            Axis::X => vector.x,
            Axis::Y => vector.y,
            Axis::Z => vector.z,
        })
    }

    fn take_picture(&mut self) -> Result<Picture, MeasuringError> {
        let camera = self.description.board_camera.ok_or(MeasuringError::NoCamera)?;
        let flange = self.standing()?.posture.world_from_flange;
        let seen = (flange * camera.flange_from_camera).inverse() * camera.world_from_board;
        let place = seen.translation;
        if place.z < ASIDE.cos() * place.norm() {
            return Err(MeasuringError::OutOfView);
        }
        self.readings_taken += 1;
        let (seed, first) = (self.description.seed ^ 0x0b0a_4d5e, self.readings_taken.wrapping_mul(6));
        let mut drawn = 0;
        let mut three = |sigma: f64| {
            let mut one = || {
                drawn += 1;
                sigma * normal(seed, first.wrapping_add(drawn))
            };
            Vector::new(one(), one(), one())
        };
        let place = place + three(camera.error);
        let turn = rotation_vector(&(seen.rotation * Rotation::by(three(camera.turn_error))));
        let picture = Picture { place, turn };
        self.picture = Some(picture);
        Ok(picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_vector_is_that_of_its_rotation_up_to_half_a_turn() {
        let axes = [Vector::X, Vector::Z, Vector::new(0.6, -0.64, 0.48), Vector::new(-0.36, 0.48, 0.8)];
        for axis in axes {
            for angle in [0.0, 1e-3, 0.7, 2.0, 2.99, 3.05, 3.13, std::f64::consts::PI - 1e-9] {
                let found = rotation_vector(&Rotation::about(axis, angle));
                assert!((found - axis * angle).norm() < 1e-5, "{axis:?} {angle}: {found:?}");
            }
        }
    }
}
