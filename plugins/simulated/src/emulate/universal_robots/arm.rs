//! The arm that is in a world, as the controller leads it.

use std::path::Path;

use super::states::AXES;
use crate::client::{ClientError, WorldClient};
use crate::protocol::{JointUnit, Reading, WorldCommand};

/// Why the arm cannot be led any more.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the arm of the world is gone: {0}")]
pub struct ArmError(String);

/// What became of a cycle.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Led {
    /// Where the joints are, rad, and whether they still go.
    At([f64; AXES], bool),
    /// The arm does not go there.
    Refused(String),
}

/// The arm.
#[derive(Debug)]
pub(super) struct LedArm {
    client: WorldClient,
}

impl LedArm {
    pub(super) fn connect(socket: &Path) -> Result<Self, ArmError> {
        let client = WorldClient::connect(socket, "Universal Robots").map_err(gone)?;
        let joints = &client.welcome().joints;
        if joints.len() != AXES || joints.iter().any(|joint| joint.unit != JointUnit::Rad) {
            let there = &client.welcome().model;
            return Err(ArmError(format!(
                "there is a {there} in that world, no arm whose six joints all turn"
            )));
        }
        Ok(Self { client })
    }

    /// Top speeds of the joints, rad/s.
    pub(super) fn top_speeds(&self) -> [f64; AXES] {
        let mut speeds = [0.0; AXES];
        for (speed, joint) in speeds.iter_mut().zip(&self.client.welcome().joints) {
            *speed = joint.top_speed;
        }
        speeds
    }

    /// Where the joints are, rad, and whether they move.
    pub(super) fn read(&mut self) -> Result<([f64; AXES], bool), ArmError> {
        joints_of(&self.client.read(WorldCommand::Read {}).map_err(gone)?)
    }

    /// Leads the joints (rad) for a cycle, s.
    pub(super) fn lead(&mut self, joints: [f64; AXES], seconds: f64) -> Result<Led, ArmError> {
        match self.client.read(WorldCommand::Follow { joints: joints.into(), ms: seconds * 1e3 }) {
            Ok(reading) => joints_of(&reading).map(|(joints, moving)| Led::At(joints, moving)),
            Err(ClientError::Refused(why)) => Ok(Led::Refused(why)),
            Err(error) => Err(gone(error)),
        }
    }
}

fn joints_of(reading: &Reading) -> Result<([f64; AXES], bool), ArmError> {
    let joints = reading.joints.fixed();
    let joints =
        joints.ok_or_else(|| ArmError(format!("it has {} joints, not six", reading.joints.len())))?;
    Ok((joints, reading.moving))
}

fn gone(error: ClientError) -> ArmError {
    ArmError(error.to_string())
}
