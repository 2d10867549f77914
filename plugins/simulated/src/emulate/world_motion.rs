//! The arm of a world as a controller moves it that does not lead it cycle by cycle: one motion at a time, which can be braked.

use std::path::Path;
use std::time::Duration;

use super::mover::Mover;
use crate::client::{ClientError, WorldClient};
use crate::protocol::{JointFacts, JointUnit, SomeJoints, WorldCommand};

/// How long a motion that was braked may take to end.
const BRAKED_WITHIN: Duration = Duration::from_secs(5);
/// No arm's joint is slower, as a fraction of its greatest speed.
const SLOWEST: f64 = 0.001;

/// The arm cannot be moved any more, or is in no such world.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub(super) struct MotionError(String);

impl From<ClientError> for MotionError {
    fn from(error: ClientError) -> Self {
        Self(error.to_string())
    }
}

/// The arm of a world. Two connections: a motion keeps one of them until it ends.
pub(super) struct WorldMotion {
    client: WorldClient,
    mover: Mover,
    moves: bool,
}

impl WorldMotion {
    /// The arm of the world at `socket`, all of whose joints must turn; `device` says in messages who calls, and `moved_by` what turns its joints.
    pub(super) fn connect(socket: &Path, device: &str, moved_by: &str) -> Result<Self, MotionError> {
        let client = WorldClient::connect(socket, device)?;
        if let Some(slide) = client.welcome().joints.iter().find(|joint| joint.unit != JointUnit::Rad) {
            return Err(MotionError(format!("`{}` of that world's arm slides; {moved_by} turn", slide.name)));
        }
        let mover = Mover::connect(socket, &format!("{device} motors"))?;
        Ok(Self { client, mover, moves: false })
    }

    /// What is known of its joints.
    pub(super) fn joints(&self) -> &[JointFacts] {
        &self.client.welcome().joints
    }

    /// Where its joints are, rad, and whether they move.
    pub(super) fn read(&mut self) -> Result<(Vec<f64>, bool), MotionError> {
        self.settle()?;
        let reading = self.client.read(WorldCommand::Read {})?;
        Ok((reading.joints.to_vec(), self.moves))
    }

    /// Begins a motion of the joints that are given, in place of the one under way, so that they arrive together after `lasts_s` or as soon as they can.
    pub(super) fn begin(&mut self, joints: SomeJoints, lasts_s: f64) -> Result<(), MotionError> {
        self.brake()?;
        let (here, _) = self.read()?;
        let times = joints
            .iter()
            .zip(&here)
            .zip(self.joints())
            .map(|((to, from), facts)| to.map_or(0.0, |to| (to - from).abs() / facts.top_speed));
        let at_full_speed_s = times.fold(0.0, f64::max);
        let speed = (at_full_speed_s / lasts_s).clamp(SLOWEST, 1.0);
        self.mover.begin(WorldCommand::Move { joints, relative: false, speed })?;
        self.moves = true;
        Ok(())
    }

    /// Ends the motion under way.
    pub(super) fn brake(&mut self) -> Result<(), MotionError> {
        self.settle()?;
        if !self.moves {
            return Ok(());
        }
        self.client.read(WorldCommand::Stop {})?;
        let end = self.mover.end(BRAKED_WITHIN);
        self.moves = false;
        let not_braked = || {
            let seconds = BRAKED_WITHIN.as_secs();
            MotionError(format!("it was stopped, and its motion did not end within {seconds} s"))
        };
        Ok(end.ok_or_else(not_braked)?.map(drop)?)
    }

    /// Notes the end of a motion that has ended.
    fn settle(&mut self) -> Result<(), MotionError> {
        let Some(end) = self.mover.ended() else { return Ok(()) };
        self.moves = false;
        Ok(end.map(drop)?)
    }
}
