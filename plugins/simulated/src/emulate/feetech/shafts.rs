//! The servos' shafts: joints of the arm of a world, and on a bench what no world's arm has, such as a gripper.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::Duration;

use crate::client::{ClientError, WorldClient};
use crate::protocol::{JointUnit, Reading, Verb};

/// Counts of an encoder for a radian.
const COUNTS_PER_RAD: f64 = 4096.0 / TAU;
/// What an encoder shows where a joint's angle is zero: horns are put on with the servo in its middle.
const AT_ZERO: f64 = 2048.0;
/// How long a motion that was braked may take to end.
const BRAKED_WITHIN: Duration = Duration::from_secs(5);
/// Less of a way than this is none, counts.
const NO_WAY: f64 = 0.01;

/// The shafts cannot be driven any more.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the arm behind the servos is gone: {0}")]
pub struct ShaftError(String);

fn gone(error: ClientError) -> ShaftError {
    ShaftError(error.to_string())
}

/// Where a shaft is to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Aim {
    /// The place of the encoder.
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

/// The arm of a world. Two connections: a motion keeps one of them until it ends.
struct WorldArm {
    client: WorldClient,
    motions: Sender<Verb>,
    ends: Receiver<Result<Reading, ClientError>>,
    top_speeds: Vec<f64>,
    moves: bool,
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
        let joints = world.as_ref().map_or(0, |arm| arm.top_speeds.len());
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
        let mut places = Vec::new();
        if let Some(arm) = &mut self.world {
            arm.settle()?;
            let reading = arm.client.read(Verb::Read {}).map_err(gone)?;
            let moves = arm.moves;
            places.extend(reading.joints.iter().map(|angle| (AT_ZERO + angle * COUNTS_PER_RAD, moves)));
        }
        let bare =
            self.bench.iter().map(|shaft| (shaft.at(now_ns), now_ns < shaft.began_ns + shaft.lasts_ns));
        places.extend(bare);
        Ok(places)
    }

    /// Has each shaft go where it is aimed at from now on; one without an aim stays where it is. The shafts that would run against a stop of
    /// the arm are told in the answer, and then none of the arm's moves.
    pub(super) fn drive(&mut self, aims: &[Option<Aim>], now_ns: u64) -> Result<Vec<usize>, ShaftError> {
        let joints = self.world.as_ref().map_or(0, |arm| arm.top_speeds.len());
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
        let client = WorldClient::connect(socket, "servo bus").map_err(gone)?;
        let joints = &client.welcome().joints;
        if let Some(slide) = joints.iter().find(|joint| joint.unit != JointUnit::Rad) {
            return Err(ShaftError(format!("`{}` of that world's arm slides; servos turn", slide.name)));
        }
        let top_speeds = joints.iter().map(|joint| joint.top_speed * COUNTS_PER_RAD).collect();
        let mut mover = WorldClient::connect(socket, "servo motors").map_err(gone)?;
        let (motions, wanted) = channel::<Verb>();
        let (report, ends) = channel();
        std::thread::spawn(move || {
            while let Ok(motion) = wanted.recv() {
                if report.send(mover.read(motion)).is_err() {
                    break;
                }
            }
        });
        Ok(WorldArm { client, motions, ends, top_speeds, moves: false })
    }

    /// Notes the end of a motion that has ended.
    fn settle(&mut self) -> Result<Option<Reading>, ShaftError> {
        match self.ends.try_recv() {
            Ok(end) => {
                self.moves = false;
                end.map(Some).map_err(gone)
            }
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(ShaftError("nobody moves it any more".to_owned())),
        }
    }

    /// Ends the motion under way.
    fn brake(&mut self) -> Result<(), ShaftError> {
        self.settle()?;
        if !self.moves {
            return Ok(());
        }
        self.client.read(Verb::Stop {}).map_err(gone)?;
        let end = self.ends.recv_timeout(BRAKED_WITHIN).map_err(|error| ShaftError(error.to_string()))?;
        self.moves = false;
        end.map(drop).map_err(gone)
    }

    fn drive(&mut self, aims: &[Option<Aim>]) -> Result<Vec<usize>, ShaftError> {
        self.brake()?;
        let here = self.client.read(Verb::Read {}).map_err(gone)?;
        let mut joints = Vec::with_capacity(aims.len());
        // The world moves its joints so that they arrive together: in the time of the servo that needs longest.
        let (mut lasts_s, mut at_full_speed_s) = (0.0_f64, 0.0_f64);
        for ((aim, angle), top_speed) in aims.iter().zip(here.joints.iter()).zip(&self.top_speeds) {
            let way = aim.map_or(0.0, |aim| (aim.counts - AT_ZERO - angle * COUNTS_PER_RAD).abs());
            joints.push(aim.filter(|_| way > NO_WAY).map(|aim| (aim.counts - AT_ZERO) / COUNTS_PER_RAD));
            lasts_s = lasts_s.max(way / aim.map_or(1.0, |aim| aim.speed.max(1.0)));
            at_full_speed_s = at_full_speed_s.max(way / top_speed);
        }
        if joints.iter().all(Option::is_none) {
            return Ok(Vec::new());
        }
        if let Some(beyond) = self.against_stops(&joints) {
            return Ok(beyond);
        }
        let speed = (at_full_speed_s / lasts_s).clamp(0.001, 1.0);
        let motion = Verb::Move { joints, relative: false, speed };
        self.motions.send(motion).map_err(|_| ShaftError("nobody moves it any more".to_owned()))?;
        self.moves = true;
        Ok(Vec::new())
    }

    /// The joints that would be driven beyond their travel and some degrees more.
    fn against_stops(&self, joints: &[Option<f64>]) -> Option<Vec<usize>> {
        const TO_THE_STOP: f64 = 2.0 * TAU / 360.0;
        let facts = &self.client.welcome().joints;
        let outside = |(place, (angle, facts)): (usize, (&Option<f64>, &crate::protocol::JointFacts))| {
            let angle = (*angle)?;
            let free = (facts.lower - TO_THE_STOP..=facts.upper + TO_THE_STOP).contains(&angle);
            (!free).then_some(place)
        };
        let beyond: Vec<usize> = joints.iter().zip(facts).enumerate().filter_map(outside).collect();
        (!beyond.is_empty()).then_some(beyond)
    }
}
