//! The servos' shafts: joints of the arm of a world, and on a bench what no world's arm has, such as a gripper.

use std::f64::consts::TAU;
use std::path::Path;

use crate::emulate::world_motion::{MotionError, WorldMotion};
use crate::protocol::JointFacts;

/// Counts of an encoder for a radian.
const COUNTS_PER_RAD: f64 = 4096.0 / TAU;
/// What an encoder shows where a joint's angle is zero: horns are put on with the servo in its middle.
const AT_ZERO: f64 = 2048.0;
/// Less of a way than this is none, counts.
const NO_WAY: f64 = 0.01;

/// The shafts cannot be driven any more.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the arm behind the servos is gone: {0}")]
pub struct ShaftError(String);

impl From<MotionError> for ShaftError {
    fn from(error: MotionError) -> Self {
        Self(error.to_string())
    }
}

/// Where a shaft is to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aim {
    /// The position of the encoder.
    pub(super) counts: f64,
    /// Counts a second.
    pub(super) speed: f64,
}

/// A shaft with nothing on it.
#[derive(Debug, Clone, Copy)]
struct Bare {
    from: f64,
    to: f64,
    began_ns: u64,
    lasts_ns: u64,
}

impl Bare {
    fn at(&self, now_ns: u64) -> f64 {
        let gone = now_ns.saturating_sub(self.began_ns);
        if gone >= self.lasts_ns {
            return self.to;
        }
        self.from + (self.to - self.from) * gone as f64 / self.lasts_ns as f64
    }

    fn rest(&mut self, now_ns: u64) {
        let here = self.at(now_ns);
        *self = Bare { from: here, to: here, began_ns: now_ns, lasts_ns: 0 };
    }
}

/// The arm of a world.
struct WorldArm {
    motion: WorldMotion,
}

/// All shafts.
pub(super) struct Shafts {
    world: Option<WorldArm>,
    /// Those beyond the world's joints.
    bench: Vec<Bare>,
    /// Whether shafts on the bench turn in no time.
    at_once: bool,
}

impl Shafts {
    /// The joints of the arm in the world at `socket`, if there is one, and bare shafts up to `count` in all.
    pub(super) fn connect(socket: Option<&Path>, count: usize, at_once: bool) -> Result<Shafts, ShaftError> {
        let world = socket.map(WorldArm::connect).transpose()?;
        let joints = world.as_ref().map_or(0, WorldArm::count);
        if joints > count {
            return Err(ShaftError(format!(
                "that world's arm has {joints} joints, and there are {count} servos"
            )));
        }
        let bare = Bare { from: AT_ZERO, to: AT_ZERO, began_ns: 0, lasts_ns: 0 };
        Ok(Shafts { world, bench: vec![bare; count - joints], at_once })
    }

    /// Where each shaft is, counts of an encoder that looks the joint's own way, and whether it moves.
    pub(super) fn read(&mut self, now_ns: u64) -> Result<Vec<(f64, bool)>, ShaftError> {
        let mut positions = Vec::new();
        if let Some(arm) = &mut self.world {
            let (joints, moves) = arm.motion.read()?;
            positions.extend(joints.iter().map(|angle| (AT_ZERO + angle * COUNTS_PER_RAD, moves)));
        }
        let bare =
            self.bench.iter().map(|shaft| (shaft.at(now_ns), now_ns < shaft.began_ns + shaft.lasts_ns));
        positions.extend(bare);
        Ok(positions)
    }

    /// Has each shaft go where it is aimed at from now on; one without an aim stays where it is. The shafts that would run against a stop of
    /// the arm are reported in the answer, and then none of the arm's moves.
    pub(super) fn drive(&mut self, aims: &[Option<Aim>], now_ns: u64) -> Result<Vec<usize>, ShaftError> {
        let joints = self.world.as_ref().map_or(0, WorldArm::count);
        for (shaft, aim) in self.bench.iter_mut().zip(aims.iter().skip(joints)) {
            shaft.rest(now_ns);
            let Some(aim) = aim else { continue };
            let seconds =
                if self.at_once { 0.0 } else { (aim.counts - shaft.from).abs() / aim.speed.max(1.0) };
            *shaft = Bare { to: aim.counts, lasts_ns: (seconds * 1e9) as u64, ..*shaft };
        }
        match &mut self.world {
            Some(arm) => arm.drive(aims.get(..joints).unwrap_or_default()),
            None => Ok(Vec::new()),
        }
    }
}

impl WorldArm {
    fn connect(socket: &Path) -> Result<WorldArm, ShaftError> {
        Ok(WorldArm { motion: WorldMotion::connect(socket, "servo bus", "servos")? })
    }

    fn count(&self) -> usize {
        self.motion.joints().len()
    }

    fn drive(&mut self, aims: &[Option<Aim>]) -> Result<Vec<usize>, ShaftError> {
        self.motion.brake()?;
        let (here, _) = self.motion.read()?;
        let mut joints = Vec::with_capacity(aims.len());
        // The world moves its joints so that they arrive together: in the time of the servo that needs longest.
        let mut lasts_s = 0.0_f64;
        for (aim, angle) in aims.iter().zip(here) {
            let way = aim.map_or(0.0, |aim| (aim.counts - AT_ZERO - angle * COUNTS_PER_RAD).abs());
            joints.push(aim.filter(|_| way > NO_WAY).map(|aim| (aim.counts - AT_ZERO) / COUNTS_PER_RAD));
            lasts_s = lasts_s.max(way / aim.map_or(1.0, |aim| aim.speed.max(1.0)));
        }
        if joints.iter().all(Option::is_none) {
            return Ok(Vec::new());
        }
        if let Some(beyond) = self.against_stops(&joints) {
            return Ok(beyond);
        }
        self.motion.begin(joints, lasts_s)?;
        Ok(Vec::new())
    }

    /// The joints that would be driven beyond their travel and some degrees more.
    fn against_stops(&self, joints: &[Option<f64>]) -> Option<Vec<usize>> {
        const TO_THE_STOP: f64 = 2.0 * TAU / 360.0;
        let outside = |(index, (angle, facts)): (usize, (&Option<f64>, &JointFacts))| {
            let angle = (*angle)?;
            let free = (facts.lower - TO_THE_STOP..=facts.upper + TO_THE_STOP).contains(&angle);
            (!free).then_some(index)
        };
        let beyond: Vec<usize> =
            joints.iter().zip(self.motion.joints()).enumerate().filter_map(outside).collect();
        (!beyond.is_empty()).then_some(beyond)
    }
}
