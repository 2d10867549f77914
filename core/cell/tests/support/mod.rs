//! A cell in memory for tests of the engine: an arm of the TeachMover's kind over a T target, and its sensor. Exact, instant, and it breaks
//! when asked to.

#![allow(dead_code, unreachable_pub, reason = "each test file uses its part")]

pub mod running;

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use plumb_cell::StopAction;
use plumb_cell::device::{Act, DeviceError, DeviceLinks, Link, RobotLink, SensorLink};
use plumb_cell::workcell::DeviceSetting;
use plumb_host::ExitReason;
use plumb_plugin::{
    JogState, JointDescription, JointState, JointUnit, JointVector, Motion, MotorState, PluginError,
    ProximityEdge, Reading, RobotCapabilities, RobotDescription, SensorDescription,
};

const JOINTS: [&str; 6] = ["waist", "shoulder", "elbow", "wrist_pitch", "wrist_roll", "gripper"];
const LINK_MM: f64 = 177.8;
const SHOULDER_MM: f64 = 195.0;
const HAND_MM: f64 = 109.0;

/// Informed of each move at its beginning.
pub type OnMove = Box<dyn Fn(usize) + Send>;

/// What outlives hosts: where the arm is, and what breaks next.
pub struct World {
    /// What the arm's host was given to check moves by, each time it was connected.
    pub guards: Mutex<Vec<plumb_plugin::Value>>,
    joints: Mutex<[f64; 6]>,
    edges: Mutex<Vec<ProximityEdge>>,
    fired: AtomicBool,
    time_ns: AtomicUsize,
    /// Where the truth is beyond what the drive says, rad.
    pub zero_error: [f64; 3],
    /// Moves made so far.
    pub moves: AtomicUsize,
    /// The arm's process dies in the middle of this move.
    pub lose_arm_at_move: AtomicUsize,
    /// The operator stops everything in the middle of this move.
    pub stop_at_move: AtomicUsize,
    /// Its controller does not take over what it is given of its zeros.
    pub keeps_its_zeros: AtomicBool,
    stopped: AtomicBool,
    pub connections: AtomicUsize,
    /// No device is there any more after so many connections.
    pub connects_at_most: AtomicUsize,
    /// The heights (mm) at which the sensor fires, one after the other; then 8.
    pub fires_at: Mutex<Vec<f64>>,
    /// What the simulated operator was asked to do.
    pub acts: Mutex<Vec<Act>>,
    /// Called at the beginning of each move with its number.
    pub on_move: Mutex<Option<OnMove>>,
    /// Whether the arm, once handed to its pendant, is given back by that alone.
    pub only_pendant_ends_jog: AtomicBool,
    /// What that pendant has.
    pub pendant: Mutex<PendantHas>,
    /// The robots are in a simulated world started for this run.
    pub is_new: AtomicBool,
    /// What the arm says after a move, in place of what is so.
    pub lie_after_move: Mutex<Option<Lie>>,
    /// The sensor dates its readings so, in place of when they were asked for; 0: it does not.
    pub reads_at_ns: AtomicUsize,
    /// The speed the arm describes for its waist, rad/s.
    pub waist_speed: Mutex<f64>,
    /// What the sensor was asked to change, in order.
    pub configured: Mutex<Vec<serde_json::Value>>,
    /// The sensor refuses every change.
    pub refuses_changes: AtomicBool,
    /// How long each move might take at most.
    pub limits: Mutex<Vec<Duration>>,
    /// What the arm's motors report; none: it cannot report them.
    pub motors: Mutex<Option<MotorState>>,
}

/// Changes a state.
pub type Lie = fn(&mut JointState);

/// What the pendant has of an arm that it alone gives back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PendantHas {
    Nothing,
    TheArm,
    GivenItBack,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl World {
    /// An arm over the white quadrant, 4 cm up, whose drive is wrong by `zero_error_deg` (waist, shoulder, elbow).
    pub fn new(zero_error_deg: [f64; 3]) -> Arc<Self> {
        let zero_error = zero_error_deg.map(f64::to_radians);
        let world = Self { zero_error, ..Self::fresh() };
        let truth = [11.0_f64, 41.0, -78.0, -90.0, 0.0];
        let mut joints = [0.0; 6];
        for (index, joint) in joints.iter_mut().enumerate().take(5) {
            *joint = truth[index].to_radians() - zero_error.get(index).copied().unwrap_or(0.0);
        }
        *lock(&world.joints) = joints;
        Arc::new(world)
    }

    fn fresh() -> Self {
        Self {
            guards: Mutex::new(Vec::new()),
            joints: Mutex::new([0.0; 6]),
            edges: Mutex::new(Vec::new()),
            fired: AtomicBool::new(false),
            time_ns: AtomicUsize::new(1),
            zero_error: [0.0; 3],
            moves: AtomicUsize::new(0),
            lose_arm_at_move: AtomicUsize::new(usize::MAX),
            stop_at_move: AtomicUsize::new(usize::MAX),
            keeps_its_zeros: AtomicBool::new(false),
            stopped: AtomicBool::new(false),
            connections: AtomicUsize::new(0),
            connects_at_most: AtomicUsize::new(usize::MAX),
            fires_at: Mutex::new(Vec::new()),
            acts: Mutex::new(Vec::new()),
            on_move: Mutex::new(None),
            only_pendant_ends_jog: AtomicBool::new(false),
            pendant: Mutex::new(PendantHas::Nothing),
            is_new: AtomicBool::new(true),
            lie_after_move: Mutex::new(None),
            reads_at_ns: AtomicUsize::new(0),
            waist_speed: Mutex::new(0.4),
            configured: Mutex::new(Vec::new()),
            refuses_changes: AtomicBool::new(false),
            limits: Mutex::new(Vec::new()),
            motors: Mutex::new(None),
        }
    }

    /// Height of the sensor over the table less its working height, where the paper is white; else far away. mm.
    fn light(&self, drive: &[f64; 6]) -> (f64, bool) {
        let truth: Vec<f64> =
            (0..6).map(|index| drive[index] + self.zero_error.get(index).copied().unwrap_or(0.0)).collect();
        let radius = LINK_MM * truth[1].cos() + LINK_MM * truth[2].cos() + HAND_MM * truth[3].cos();
        let height =
            SHOULDER_MM + LINK_MM * truth[1].sin() + LINK_MM * truth[2].sin() + HAND_MM * truth[3].sin();
        let along_b = radius * (truth[0] - 8.0_f64.to_radians()).cos();
        let white = truth[0] > 0.0 && along_b > 140.0;
        (height, white)
    }

    fn is_on(&self, drive: &[f64; 6], was: bool) -> bool {
        let (height, white) = self.light(drive);
        let fires_at = lock(&self.fires_at).first().copied().unwrap_or(8.0);
        white && height <= if was { 10.0 } else { fires_at }
    }

    /// Moves along a straight line in joint space up to `fraction` of the way, noting every edge at its exact position.
    fn go(&self, target: &[f64; 6], fraction: f64) {
        let start = *lock(&self.joints);
        let at = |fraction: f64| {
            let mut pose = start;
            for (index, value) in pose.iter_mut().enumerate() {
                *value += fraction * (target[index] - start[index]);
            }
            pose
        };
        let pieces = 200;
        for piece in 1..=pieces {
            let (mut before, mut after) =
                ((piece - 1) as f64 / pieces as f64 * fraction, piece as f64 / pieces as f64 * fraction);
            let was = self.fired.load(Ordering::SeqCst);
            let now = self.is_on(&at(after), was);
            if now == was {
                continue;
            }
            for _ in 0..80 {
                let middle = 0.5 * (before + after);
                if self.is_on(&at(middle), was) == was { before = middle } else { after = middle }
            }
            self.fired.store(now, Ordering::SeqCst);
            let mut heights = lock(&self.fires_at);
            if now && !heights.is_empty() {
                heights.remove(0);
            }
            drop(heights);
            let time_ns = self.tick();
            let joints = vector(&at(after));
            lock(&self.edges).push(ProximityEdge {
                time_ns,
                fired: u32::from(now),
                joints,
                joints_half_width: JointVector::zeros(JOINTS.len()),
                ..ProximityEdge::default()
            });
        }
        let end = if fraction == 1.0 { *target } else { at(fraction) };
        *lock(&self.joints) = end;
    }

    fn tick(&self) -> u64 {
        self.time_ns.fetch_add(1, Ordering::SeqCst) as u64
    }

    pub fn state(&self) -> JointState {
        JointState::new(self.tick(), vector(&lock(&self.joints)), false)
    }

    /// Height of the sensor over the table, mm.
    pub fn height(&self) -> f64 {
        let joints = *lock(&self.joints);
        self.light(&joints).0
    }

    /// The drive was switched off and on: its counters begin anew, and the arm is where it was. Gives the arm in a world of its own.
    pub fn switched_off_and_on(&self) -> Arc<Self> {
        let joints = *lock(&self.joints);
        let truth: Vec<f64> = (0..3).map(|index| joints[index] + self.zero_error[index]).collect();
        let anew = Self { zero_error: [truth[0], truth[1], truth[2]], ..Self::fresh() };
        *lock(&anew.joints) = [0.0; 6];
        Arc::new(anew)
    }

    /// Moved by its pendant: the drive counts along.
    pub fn push_deg(&self, column: usize, by: f64) {
        lock(&self.joints)[column] += by.to_radians();
    }

    /// True joint angles, degrees.
    pub fn truth_deg(&self) -> Vec<f64> {
        let joints = *lock(&self.joints);
        (0..3).map(|index| (joints[index] + self.zero_error[index]).to_degrees()).collect()
    }
}

fn vector(joints: &[f64; 6]) -> JointVector {
    JointVector::from_slice(joints).unwrap_or_default()
}

struct Arm {
    world: Arc<World>,
    description: RobotDescription,
}

impl RobotLink for Arm {
    fn description(&self) -> &RobotDescription {
        &self.description
    }

    fn activate(&mut self) -> Result<(), DeviceError> {
        self.world.stopped.store(false, Ordering::SeqCst);
        Ok(())
    }

    fn deactivate(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn read_joints(&mut self) -> Result<JointState, DeviceError> {
        Ok(self.world.state())
    }

    fn move_joints(&mut self, motion: &Motion, limit: Duration) -> Result<JointState, DeviceError> {
        lock(&self.world.limits).push(limit);
        let number = self.world.moves.fetch_add(1, Ordering::SeqCst) + 1;
        if let Some(on_move) = lock(&self.world.on_move).as_ref() {
            on_move(number);
        }
        let target = motion.end_from(&self.world.state().joints);
        let mut joints = [0.0; 6];
        joints.copy_from_slice(target.as_slice());
        if number == self.world.lose_arm_at_move.load(Ordering::SeqCst) {
            self.world.go(&joints, 0.4);
            return Err(died("arm", "move joints"));
        }
        if self.world.stopped.load(Ordering::SeqCst) {
            self.world.go(&joints, 0.4);
            let error = PluginError::stopped();
            return Err(DeviceError::refused("arm", "move joints", error));
        }
        self.world.go(&joints, 1.0);
        let mut state = self.world.state();
        if let Some(lie) = *lock(&self.world.lie_after_move) {
            lie(&mut state);
        }
        Ok(state)
    }

    fn jog(&mut self, on: bool) -> Result<JogState, DeviceError> {
        let mut pendant = lock(&self.world.pendant);
        if self.world.only_pendant_ends_jog.load(Ordering::SeqCst) {
            match (*pendant, on) {
                (PendantHas::TheArm, false) => {
                    let error = PluginError::NotReady("press STOP on the pendant".to_owned());
                    return Err(DeviceError::refused("arm", "jog", error));
                }
                (PendantHas::Nothing, true) => *pendant = PendantHas::TheArm,
                (PendantHas::GivenItBack, false) => *pendant = PendantHas::Nothing,
                _ => {}
            }
        }
        let finished = u32::from(*pendant != PendantHas::TheArm);
        Ok(JogState { state: self.world.state(), key: 0, finished })
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), DeviceError> {
        if !self.world.keeps_its_zeros.load(Ordering::SeqCst) {
            lock(&self.world.joints).copy_from_slice(joints.as_slice());
        }
        Ok(())
    }

    fn read_motors(&mut self) -> Result<MotorState, DeviceError> {
        let cannot =
            || DeviceError::refused("arm", "read motors", PluginError::unsupported("read its motors"));
        lock(&self.world.motors).ok_or_else(cannot)
    }

    fn stop_action(&self) -> StopAction {
        let world = Arc::clone(&self.world);
        Box::new(move || world.stopped.store(true, Ordering::SeqCst))
    }
}

/// The process of a device was killed.
fn died(device: &str, operation: &'static str) -> DeviceError {
    let reason = ExitReason {
        code: None,
        signal: Some("SIGKILL".to_owned()),
        killed_because: None,
        last_output: Vec::new(),
    };
    DeviceError::HostDied { device: device.to_owned(), operation, reason: Box::new(reason) }
}

struct Eye {
    world: Arc<World>,
    description: SensorDescription,
}

impl SensorLink for Eye {
    fn description(&self) -> &SensorDescription {
        &self.description
    }

    fn activate(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        lock(&self.world.edges).clear();
        Ok(())
    }

    fn read(&mut self, after_ns: u64) -> Result<Reading, DeviceError> {
        let edges = std::mem::take(&mut *lock(&self.world.edges));
        let fired = Some(self.world.fired.load(Ordering::SeqCst));
        let time_ns = match self.world.reads_at_ns.load(Ordering::SeqCst) {
            0 => after_ns,
            old => old as u64,
        };
        Ok(Reading { time_ns, fired, edges, quantities: Vec::new() })
    }

    fn configure(&mut self, settings: &serde_json::Value) -> Result<(), DeviceError> {
        if self.world.refuses_changes.load(Ordering::SeqCst) {
            let error = PluginError::OutOfRange("too far".to_owned());
            return Err(DeviceError::refused("eye", "configure", error));
        }
        lock(&self.world.configured).push(settings.clone());
        Ok(())
    }
}

/// The cell's devices, in memory.
pub struct Devices(pub Arc<World>);

impl DeviceLinks for Devices {
    fn connect(&mut self, device: &DeviceSetting, guard: plumb_plugin::Value) -> Result<Link, DeviceError> {
        let world = Arc::clone(&self.0);
        if world.connections.fetch_add(1, Ordering::SeqCst) >= world.connects_at_most.load(Ordering::SeqCst) {
            return Err(died(&device.name, "connect"));
        }
        Ok(match device.name.as_str() {
            "arm" => {
                lock(&world.guards).push(guard);
                let mut description = arm_description();
                if let Some(waist) = description.joints.first_mut() {
                    waist.max_speed = *lock(&world.waist_speed);
                }
                description.capabilities.only_pendant_ends_jog =
                    world.only_pendant_ends_jog.load(Ordering::SeqCst);
                Link::Robot(Box::new(Arm { world, description }))
            }
            _ => Link::Sensor(Box::new(Eye {
                world,
                description: SensorDescription {
                    model: "eye".into(),
                    switches: true,
                    quantities: Vec::new(),
                },
            })),
        })
    }

    fn simulate(&mut self, act: &Act) -> Result<Option<f64>, String> {
        lock(&self.0.acts).push(act.clone());
        match act.name.as_str() {
            "read_level" => Ok(Some(0.25)),
            "dance" => Err("the simulated operator does not know `dance`".to_owned()),
            _ => Ok(None),
        }
    }

    fn is_new_world(&self) -> bool {
        self.0.is_new.load(Ordering::SeqCst)
    }

    fn world_socket(&self) -> Option<String> {
        Some("in memory".to_owned())
    }

    fn shut_down(&mut self, _keep_world: bool) {}
}

fn arm_description() -> RobotDescription {
    let joint = |name: &str| {
        let (unit, lower, upper) = match name {
            "gripper" => (JointUnit::Millimetre, 0.0, 76.0),
            _ => (JointUnit::Radian, -3.2, 3.2),
        };
        JointDescription {
            name: name.to_owned(),
            unit,
            lower,
            upper,
            resolution: 0.0,
            max_speed: 0.4,
            home: 0.0,
        }
    };
    RobotDescription {
        model: "an arm in memory".to_owned(),
        joints: JOINTS.map(joint).to_vec(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        capabilities: RobotCapabilities {
            interruptible: true,
            stop_time_ms: 0,
            jog: true,
            ..RobotCapabilities::default()
        },
    }
}
