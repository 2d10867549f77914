//! What the controller does with commands: some at once, some in their turn.

use std::collections::VecDeque;

use super::arm::{AXES, Angles, Arm, ArmError, HOME};
use super::framing::Command;

const VERSION: u8 = 2;
const POSE: u8 = 10;
const ALARMS: u8 = 20;
const HOMING: u8 = 31;
const JOINT_PARAMETERS: u8 = 80;
const COMMON_PARAMETERS: u8 = 83;
const MOVE: u8 = 84;
const START: u8 = 240;
const STOP: u8 = 241;
const FORCE_STOP: u8 = 242;
const CLEAR: u8 = 245;
const INDEX: u8 = 246;
const SPACE: u8 = 247;

/// Moves to joint angles, all joints arriving together; the only ones this controller knows.
const TO_ANGLES: u8 = 4;
/// What fits into the queue.
const QUEUE: usize = 32;
/// Alarms: a reset; a command that it does not know; a target it cannot plan a way to; the first of the joints' ends; the arms against each other.
const RESET: u8 = 0x00;
const UNKNOWN: u8 = 0x01;
const NO_WAY_THERE: u8 = 0x12;
const ENDS: u8 = 0x40;
const ARMS_APART: u8 = 0x48;
const ARMS_TOGETHER: u8 = 0x49;
/// How far each joint goes, deg.
const TRAVEL: [[f64; 2]; AXES] = [[-90.0, 90.0], [0.0, 85.0], [-10.0, 95.0], [-90.0, 90.0]];
/// How far the parallelogram opens, deg; as the maker's own simulator of the arm's successor has it.
const OPENS: [f64; 2] = [20.0, 145.0];
/// A target that is a float's rounding beyond an end is still in reach, deg.
const ROUNDING: f64 = 0.05;
/// Lengths that the pose is computed with, mm: rear arm, forearm, and from there to the middle of the suction cup.
const LENGTHS: [f64; 3] = [135.0, 147.0, 59.7];

/// A command in the queue.
#[derive(Debug, Clone)]
struct Waiting {
    index: u64,
    command: Command,
}

/// The controller.
pub(super) struct Controller {
    arm: Arm,
    pub(super) powered: bool,
    runs: bool,
    queue: VecDeque<Waiting>,
    /// The move under way.
    under_way: Option<u64>,
    pub(super) done: u64,
    latest: u64,
    alarms: u128,
    /// deg/s of each joint, and the part of it that is used.
    speeds: Angles,
    ratio: f64,
    /// Whether something holds the arm, so that a move does not end.
    pub(super) held: bool,
}

impl Controller {
    pub(super) fn new(arm: Arm) -> Self {
        Self {
            arm,
            powered: true,
            runs: false,
            queue: VecDeque::new(),
            under_way: None,
            done: 0,
            latest: 0,
            alarms: 0,
            speeds: [100.0; AXES],
            ratio: 0.5,
            held: false,
        }
    }

    /// What the sensors say, and whether the arm moves.
    pub(super) fn look(&mut self, now_ns: u64) -> Result<(Angles, bool), ArmError> {
        self.arm.read(now_ns)
    }

    pub(super) fn is_busy(&self) -> bool {
        self.under_way.is_some()
    }

    pub(super) fn alarms_on(&self) -> Vec<u8> {
        (0..0x80).filter(|code| self.alarms >> code & 1 == 1).collect()
    }

    /// An alarm goes on: the arm stops, and its move is over.
    pub(super) fn alarm(&mut self, code: u8, now_ns: u64) -> Result<(), ArmError> {
        self.alarms |= 1 << code;
        self.under_way = None;
        self.arm.brake(now_ns)
    }

    /// The arm stops, and its move counts as done.
    pub(super) fn block(&mut self, now_ns: u64) -> Result<(), ArmError> {
        self.arm.brake(now_ns)
    }

    /// The power goes or comes. After it came the queue is empty and is stopped, and the controller says so.
    pub(super) fn power(&mut self, on: bool, now_ns: u64) -> Result<(), ArmError> {
        self.arm.brake(now_ns)?;
        self.powered = on;
        (self.runs, self.under_way, self.held) = (false, None, false);
        (self.done, self.latest) = (0, 0);
        self.queue.clear();
        self.alarms = u128::from(on) << RESET;
        Ok(())
    }

    /// Takes a command, and gives what its answer holds; none for one that it does not know.
    pub(super) fn take(&mut self, command: &Command, now_ns: u64) -> Result<Option<Vec<u8>>, ArmError> {
        if command.waits() {
            if self.queue.len() >= QUEUE {
                return Ok(None);
            }
            self.latest += 1;
            self.queue.push_back(Waiting { index: self.latest, command: command.clone() });
            return Ok(Some(self.latest.to_le_bytes().to_vec()));
        }
        let nothing = Some(Vec::new());
        Ok(match (command.id, command.sets()) {
            (VERSION, false) => Some(vec![3, 6, 1, 0]),
            (POSE, false) => Some(self.pose(now_ns)?),
            (ALARMS, false) => Some(self.alarms.to_le_bytes().to_vec()),
            (ALARMS, true) => {
                self.alarms = 0;
                nothing
            }
            (START, true) => {
                self.runs = true;
                nothing
            }
            (STOP, true) => {
                self.runs = false;
                nothing
            }
            (FORCE_STOP, true) => {
                self.runs = false;
                self.under_way = None;
                self.arm.brake(now_ns)?;
                nothing
            }
            (CLEAR, true) => {
                self.queue.clear();
                nothing
            }
            (INDEX, false) => Some(self.done.to_le_bytes().to_vec()),
            (SPACE, false) => Some(((QUEUE - self.queue.len()) as u32).to_le_bytes().to_vec()),
            (JOINT_PARAMETERS | COMMON_PARAMETERS, true) => {
                self.set(command);
                nothing
            }
            _ => None,
        })
    }

    /// Goes on with the queue, where it can.
    pub(super) fn work(&mut self, now_ns: u64) -> Result<(), ArmError> {
        if let Some(index) = self.under_way
            && !self.held
            && !self.arm.read(now_ns)?.1
        {
            self.done = index;
            self.under_way = None;
        }
        while self.powered && self.runs && self.alarms == 0 && self.under_way.is_none() {
            let Some(Waiting { index, command }) = self.queue.pop_front() else { break };
            self.carry_out(index, &command, now_ns)?;
        }
        Ok(())
    }

    fn carry_out(&mut self, index: u64, command: &Command, now_ns: u64) -> Result<(), ArmError> {
        match command.id {
            MOVE if command.body.first() == Some(&TO_ANGLES) && command.body.len() == 1 + 4 * AXES => {
                let target = floats(command.body.get(1..).unwrap_or_default());
                self.set_out(
                    index,
                    std::array::from_fn(|axis| target.get(axis).copied().unwrap_or(0.0)),
                    now_ns,
                )
            }
            HOMING => self.set_out(index, HOME, now_ns),
            JOINT_PARAMETERS | COMMON_PARAMETERS => {
                self.set(command);
                self.done = index;
                Ok(())
            }
            _ => self.alarm(UNKNOWN, now_ns),
        }
    }

    fn set_out(&mut self, index: u64, target: Angles, now_ns: u64) -> Result<(), ArmError> {
        if let Some(code) = out_of_reach(&target) {
            return self.alarm(code, now_ns);
        }
        let (here, _) = self.arm.read(now_ns)?;
        let times = (0..AXES)
            .map(|axis| (target[axis] - here[axis]).abs() / (self.speeds[axis] * self.ratio).max(0.1));
        let lasts_s = times.fold(0.0, f64::max);
        self.under_way = Some(index);
        if lasts_s > 0.0 { self.arm.go(target, lasts_s, now_ns) } else { Ok(()) }
    }

    fn set(&mut self, command: &Command) {
        let numbers = floats(&command.body);
        match (command.id, numbers.as_slice()) {
            (JOINT_PARAMETERS, [speeds @ .., _, _, _, _]) => {
                for (speed, given) in self.speeds.iter_mut().zip(speeds) {
                    *speed = *given;
                }
            }
            (COMMON_PARAMETERS, [ratio, _]) => self.ratio = ratio / 100.0,
            _ => {}
        }
    }

    /// Where the suction cup is as the controller counts, from the middle of its three motors, and its joints.
    fn pose(&mut self, now_ns: u64) -> Result<Vec<u8>, ArmError> {
        let (angles, _) = self.arm.read(now_ns)?;
        let [base, rear_arm, forearm, hand] = angles.map(f64::to_radians);
        let [rear, fore, cup] = LENGTHS;
        let out = rear * rear_arm.sin() + fore * forearm.cos() + cup;
        let up = rear * rear_arm.cos() - fore * forearm.sin();
        let pose = [out * base.cos(), out * base.sin(), up, (base + hand).to_degrees()];
        Ok(pose.into_iter().chain(angles).flat_map(|number| (number as f32).to_le_bytes()).collect())
    }
}

/// The alarm of a target that the arm cannot reach.
fn out_of_reach(target: &Angles) -> Option<u8> {
    if target.iter().any(|angle| !angle.is_finite()) {
        return Some(NO_WAY_THERE);
    }
    for (axis, (angle, [from, to])) in (0_u8..).zip(target.iter().zip(TRAVEL)) {
        if *angle > to + ROUNDING {
            return Some(ENDS + 2 * axis);
        }
        if *angle < from - ROUNDING {
            return Some(ENDS + 2 * axis + 1);
        }
    }
    let open = 90.0 + target[1] - target[2];
    match open {
        _ if open > OPENS[1] + ROUNDING => Some(ARMS_APART),
        _ if open < OPENS[0] - ROUNDING => Some(ARMS_TOGETHER),
        _ => None,
    }
}

fn floats(bytes: &[u8]) -> Vec<f64> {
    let (whole, _) = bytes.as_chunks::<4>();
    whole.iter().map(|four| f64::from(f32::from_le_bytes(*four))).collect()
}
