//! The arm that is in a world, as its controller drives it.

use std::path::Path;

use crate::arm::puma560;
use crate::client::{ClientError, WorldClient};
use crate::emulate::mover::Mover;
use crate::physics::arms;
use crate::physics::rigid::Rigid;
use crate::physics::shape::{Arm, Shape};
use crate::protocol::WorldCommand;

/// Why the arm cannot be driven any more.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the arm of the world is gone: {0}")]
pub struct ArmError(String);

/// How a motion ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ended {
    Arrived,
    CutShort,
    Refused,
}

/// The arm. Two connections: a motion keeps one of them busy until it has ended, so that a stop never queues behind it.
#[derive(Debug)]
pub(super) struct DrivenArm {
    client: WorldClient,
    mover: Mover,
    nominal: Arm,
}

impl DrivenArm {
    pub(super) fn connect(socket: &Path) -> Result<Self, ArmError> {
        let client = WorldClient::connect(socket, "VAL-II").map_err(gone)?;
        if client.welcome().arm != puma560::NAME {
            return Err(ArmError(format!(
                "there is a {} in that world, no PUMA 560",
                client.welcome().model
            )));
        }
        let mover = Mover::connect(socket, "VAL-II servos").map_err(gone)?;
        let nominal = match arms::by_name(puma560::NAME) {
            Some(Ok(described)) => Shape::nominal(&described).arm(),
            _ => return Err(ArmError("the PUMA's description cannot be read".to_owned())),
        };
        Ok(Self { client, mover, nominal })
    }

    /// Where the joints are, deg, and whether they move.
    pub(super) fn read(&mut self) -> Result<([f64; 6], bool), ArmError> {
        let reading = self.client.read(WorldCommand::Read {}).map_err(gone)?;
        let joints: [f64; 6] = reading
            .joints
            .fixed()
            .ok_or_else(|| ArmError(format!("it has {} joints, no PUMA's six", reading.joints.len())))?;
        Ok((joints.map(f64::to_degrees), reading.moving))
    }

    /// Where the flange would be, were the arm as on paper.
    pub(super) fn base_from_flange(&self, degrees: &[f64; 6]) -> Rigid {
        self.nominal.link_frames(&degrees.map(f64::to_radians), &[], Rigid::IDENTITY).world_from_flange
    }

    /// Starts a motion of the joints named, deg, at a fraction of full speed.
    pub(super) fn start(
        &mut self,
        joints: [Option<f64>; 6],
        relative: bool,
        speed: f64,
    ) -> Result<(), ArmError> {
        let joints = joints.iter().map(|joint| joint.map(f64::to_radians)).collect();
        let command = WorldCommand::Move { joints, relative, speed: speed.clamp(0.001, 1.0) };
        self.mover.begin(command).map_err(gone)
    }

    /// How the motion ended, if it has.
    pub(super) fn ended(&mut self) -> Result<Option<Ended>, ArmError> {
        match self.mover.ended() {
            None => Ok(None),
            Some(Ok(reading)) => Ok(Some(if reading.stopped { Ended::CutShort } else { Ended::Arrived })),
            Some(Err(ClientError::Refused(_))) => Ok(Some(Ended::Refused)),
            Some(Err(error)) => Err(gone(error)),
        }
    }

    /// Puts the brakes on; the motion ends a little later.
    pub(super) fn stop(&mut self) -> Result<(), ArmError> {
        self.client.read(WorldCommand::Stop {}).map(drop).map_err(gone)
    }

    /// Takes where the arm is for this pose, deg.
    pub(super) fn define(&mut self, degrees: [f64; 6]) -> Result<(), ArmError> {
        self.client
            .read(WorldCommand::SetZero { joints: degrees.map(f64::to_radians).into() })
            .map(drop)
            .map_err(gone)
    }
}

fn gone(error: ClientError) -> ArmError {
    ArmError(error.to_string())
}
