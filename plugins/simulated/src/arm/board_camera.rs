//! A camera on the hand that sees a board: the pose of the board in the camera's frame, as a program that finds a chessboard's corners gives it.

use super::ArmWorld;
use super::measuring::MeasuringError;
use crate::chance::normal;
use crate::physics::rigid::{Rotation, Vector};
use crate::physics::rotation_vector::rotation_vector;
use crate::protocol::Axis;

/// The board's pose in one picture, camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Picture {
    position: Vector,
    turn: Vector,
}

/// How far aside of its line of sight the camera sees, rad: 40 degrees, a wide lens.
const ASIDE: f64 = 0.7;

impl ArmWorld {
    /// One coordinate of where the board is, mm, or one number of how it is turned (a rotation vector), rad. A new picture is taken when x of the position is
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
        let vector = if turned { picture.turn } else { picture.position };
        Ok(match axis {
            Axis::X => vector.x,
            Axis::Y => vector.y,
            Axis::Z => vector.z,
        })
    }

    fn take_picture(&mut self) -> Result<Picture, MeasuringError> {
        let camera = self.description.board_camera.ok_or(MeasuringError::NoCamera)?;
        let flange = self.arm_state()?.link_frames.world_from_flange;
        let seen = (flange * camera.flange_from_camera).inverse() * camera.world_from_board;
        let position = seen.translation;
        if position.z < ASIDE.cos() * position.norm() {
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
        let position = position + three(camera.error);
        let turn = rotation_vector(&(seen.rotation * Rotation::by(three(camera.turn_error))));
        let picture = Picture { position, turn };
        self.picture = Some(picture);
        Ok(picture)
    }
}
