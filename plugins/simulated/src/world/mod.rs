//! The simulated world: a TeachMover over a table with a T target, a proximity sensor in its hand, and a clock of its own.
//!
//! Nothing here knows a wall clock, a socket or a file: [`World`] is given how far to let its time run, and everything that
//! happens is a function of its description, its seed and what it was asked to do.

mod advance;
mod arm_state;
mod crossing;
mod description;
mod drive;
pub mod file;
mod mechanism;
mod motion;
mod pose;
mod reach;
mod sensor;
pub(crate) mod served;
mod target;

use std::collections::VecDeque;

pub use description::{ArmDescription, Instruments, WorldDescription};
pub use drive::{AXES, GRIPPER_HALF_STEPS_PER_MM, HALF_STEPS_PER_TURN, HalfSteps, Joint, Joints};
pub use mechanism::{ArmGeometry, CableDrag, Droop, Mechanism};
pub use motion::Resolution;
pub use pose::ArmPose;
pub use sensor::{Optics, ProximitySensor, Scene, Seen, Spot, Table};
pub use target::TTarget;

use crate::physics::rigid::Vector;
use arm_state::{ArmState, Held};
use mechanism::GRIP_SWITCH;
use motion::Motion;

/// How many changes of the input lines the world remembers.
const REMEMBERED_CHANGES: usize = 4096;

/// No joint goes further than this, rad or mm.
const FURTHEST: f64 = 200.0;

/// The smallest share of the greatest speed.
const SLOWEST: f64 = 0.001;

/// No motor makes more half-steps in a motion, or in a second.
const MOST_HALF_STEPS: f64 = 100_000.0;

/// More the hand does not lift, kg: the TeachMover's data sheet says one pound.
const MOST_CARRIED: f64 = 0.454;

/// The world's time at its beginning, ns: not 0, so that no moment of it can be taken for none.
const BEGINS_NS: u64 = 1_000_000_000;

/// What the controller knows of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerReading {
    /// The world's time, ns.
    pub time_ns: u64,
    /// Whether a motion is under way.
    pub moving: bool,
    /// Joint values computed from the half-steps issued, rad or mm.
    pub joints: Joints,
    /// Half-steps issued.
    pub half_steps: HalfSteps,
    /// Levels of the input lines, a bit each.
    pub inputs: u64,
    /// Whether the gripper's switch is closed: the fingers hold something, or each other.
    pub grip: bool,
}

/// A change of the input lines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LineChange {
    /// Counts the changes from 1.
    pub number: u64,
    /// When it happened, world time, ns.
    pub time_ns: u64,
    /// Levels after the change, a bit each.
    pub levels: u64,
    /// The bits that changed.
    pub changed: u64,
    /// The joint values as the controller counts them at that moment, rad or mm.
    pub joints: Joints,
    /// The joints are known to within this, rad or mm: 0 for joints at rest and in a continuous world.
    pub half_width: Joints,
}

/// What is so, whether or not anybody knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// The world's time, ns.
    pub time_ns: u64,
    /// What the controller counts, rad or mm.
    pub counted: Joints,
    /// True attitudes, rad or mm.
    pub attitudes: Joints,
    /// Where the arm's parts are, mm.
    pub pose: ArmPose,
    /// What the sensor sees, without its noise.
    pub seen: Seen,
    /// Whether the sensor fires.
    pub fired: bool,
    /// Whether the arm rests on something it cannot enter.
    pub touching: bool,
    /// Half-steps issued that the motors did not make, since the world began.
    pub lost: HalfSteps,
}

/// A motion that somebody wants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionOrder {
    /// Where each joint shall go, as the controller counts, rad or mm; None stays.
    pub joints: [Option<f64>; AXES],
    /// Whether the values are added to where the joints are.
    pub relative: bool,
    /// Fraction of the arm's greatest speed, above 0 and at most 1.
    pub speed: f64,
}

/// Why the arm does not start to move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum MotionRefused {
    /// Another motion is under way.
    #[error("the arm is moving already; wait for it or stop it first")]
    Moving,
    /// A value is not a finite number.
    #[error("the target of joint `{}` is not a finite number", joint.name())]
    NotFinite {
        /// The joint.
        joint: Joint,
    },
    /// A joint would have to go further than any joint can.
    #[error("the target of joint `{}` is further than any joint goes: at most {FURTHEST} rad or mm", joint.name())]
    TooFar {
        /// The joint.
        joint: Joint,
    },
    /// The speed is out of its range.
    #[error("the speed must be a fraction of the greatest, {SLOWEST} to 1")]
    Speed,
    /// The motors cannot be driven so.
    #[error(
        "a motor makes at most {MOST_HALF_STEPS} half-steps in one motion, and 1 to {MOST_HALF_STEPS} in a second"
    )]
    HalfSteps,
}

/// The world and everything in it.
#[derive(Debug, Clone)]
pub struct World {
    description: WorldDescription,
    /// Before anybody turned or held anything.
    as_described: WorldDescription,
    time_ns: u64,
    /// When it began.
    began_ns: u64,
    registers: HalfSteps,
    slip: HalfSteps,
    lost: HalfSteps,
    arm_state: ArmState,
    fired: bool,
    /// Whether the sensor is near the surface since it last came down.
    near: bool,
    outputs: u64,
    motion: Option<Motion>,
    slipping: advance::Slipping,
    changes: VecDeque<LineChange>,
    changes_seen: u64,
    readings_taken: u64,
}

impl World {
    /// A world at its beginning: the arm is where it was left, and the controller believes what the file says.
    pub fn new(description: WorldDescription) -> World {
        let arm = &description.arm;
        let arm_state = ArmState::at_start(&description);
        let believed = HalfSteps::from_joints(&arm.start.minus(&arm.zero_error));
        let registers = match arm.resolution {
            Resolution::Continuous => believed,
            Resolution::HalfStep => HalfSteps(believed.0.map(f64::round)),
        };
        World {
            time_ns: BEGINS_NS,
            began_ns: BEGINS_NS,
            registers,
            slip: arm_state.rotors.minus(&registers),
            lost: HalfSteps::default(),
            fired: arm_state.seen.past_firing >= 0.0,
            near: description.scene.is_near(false, &arm_state.pose),
            arm_state,
            outputs: 0,
            motion: None,
            slipping: advance::Slipping::default(),
            changes: VecDeque::new(),
            changes_seen: 0,
            readings_taken: 0,
            as_described: description.clone(),
            description,
        }
    }

    /// A world that begins where another was: its clock and the count of its line's changes run on, nothing else is left of the other.
    pub fn in_place_of(other: &World, description: WorldDescription) -> World {
        let mut world = World::new(description);
        world.time_ns = other.time_ns;
        world.began_ns = other.time_ns;
        world.changes_seen = other.changes_seen;
        world.fired = other.fired;
        // Anyone who watches the line hears of it if it is another now.
        world.watch_at_rest();
        world
    }

    /// How its file describes the world, before anybody turned or held anything.
    pub(crate) fn as_described(&self) -> &WorldDescription {
        &self.as_described
    }

    /// How the world was described.
    pub fn description(&self) -> &WorldDescription {
        &self.description
    }

    /// What the controller knows.
    pub fn reading(&self) -> ControllerReading {
        ControllerReading {
            time_ns: self.time_ns,
            moving: self.motion.is_some(),
            joints: self.registers.to_joints(),
            half_steps: self.registers,
            inputs: self.inputs(),
            grip: self.arm_state.grip >= GRIP_SWITCH,
        }
    }

    /// What is so.
    pub fn truth(&self) -> Truth {
        Truth {
            time_ns: self.time_ns,
            counted: self.registers.to_joints(),
            attitudes: self.arm_state.attitudes,
            pose: self.arm_state.pose,
            seen: self.arm_state.seen,
            fired: self.fired,
            touching: self.arm_state.trespass > -arm_state::TOUCH,
            lost: self.lost,
        }
    }

    /// The number of the latest change of the input lines, 0 before the first.
    pub fn latest_change(&self) -> u64 {
        self.changes_seen
    }

    /// The changes of the input lines after the one with this number, as far as the world remembers.
    pub fn changes_after(&self, number: u64) -> Vec<LineChange> {
        self.changes.iter().filter(|change| change.number > number).copied().collect()
    }

    /// Levels of the output lines, a bit each.
    pub fn outputs(&self) -> u64 {
        self.outputs
    }

    /// Sets the output lines.
    pub fn set_outputs(&mut self, bits: u64) {
        self.outputs = bits;
    }

    /// Has the controller believe that the arm is so; the arm does not stir. Whole half-steps in a half-step world.
    pub fn set_registers(&mut self, joints: &Joints) -> Result<(), MotionRefused> {
        if self.motion.is_some() {
            return Err(MotionRefused::Moving);
        }
        self.require_finite(&joints.0.map(Some))?;
        let believed = HalfSteps::from_joints(joints);
        let registers = match self.description.arm.resolution {
            Resolution::Continuous => believed,
            Resolution::HalfStep => HalfSteps(believed.0.map(f64::round)),
        };
        self.slip = self.slip.plus(&self.registers).minus(&registers);
        self.registers = registers;
        Ok(())
    }

    /// Starts a motion; time must run for the arm to go. A target it is at already is a motion that ends at once.
    pub fn begin(&mut self, order: &MotionOrder) -> Result<(), MotionRefused> {
        if self.motion.is_some() {
            return Err(MotionRefused::Moving);
        }
        self.require_finite(&order.joints)?;
        if !(SLOWEST..=1.0).contains(&order.speed) {
            return Err(MotionRefused::Speed);
        }
        let here = self.registers.to_joints();
        let target = Joints(std::array::from_fn(|axis| match order.joints[axis] {
            None => here.0[axis],
            Some(by) if order.relative => here.0[axis] + by,
            Some(to) => to,
        }));
        if let Some(joint) = Joint::ALL.into_iter().find(|joint| target.of(*joint).abs() > FURTHEST) {
            return Err(MotionRefused::TooFar { joint });
        }
        self.begin_toward(HalfSteps::from_joints(&target), order.speed);
        Ok(())
    }

    /// Starts a motion of each motor by these half-steps; the one with the most runs at `rate` half-steps/s, whether it can or
    /// not.
    pub fn begin_half_steps(&mut self, travel: &HalfSteps, rate: f64) -> Result<(), MotionRefused> {
        if self.motion.is_some() {
            return Err(MotionRefused::Moving);
        }
        let few = travel.0.iter().all(|steps| steps.abs() <= MOST_HALF_STEPS);
        if !few || !(1.0..=MOST_HALF_STEPS).contains(&rate) {
            return Err(MotionRefused::HalfSteps);
        }
        self.begin_at_rates(self.registers.plus(travel), &HalfSteps([rate; AXES]));
        Ok(())
    }

    fn begin_toward(&mut self, requested: HalfSteps, speed: f64) {
        self.begin_at_rates(requested, &self.description.arm.top_rates.times(speed));
    }

    /// Starts a motion of the registers to these half-steps.
    fn begin_at_rates(&mut self, requested: HalfSteps, rates: &HalfSteps) {
        let arm = &self.description.arm;
        let target = match arm.resolution {
            Resolution::Continuous => requested,
            Resolution::HalfStep => requested.rounded_from(&self.registers),
        };
        let motion = Motion::plan(
            self.registers,
            target,
            arm.resolution,
            rates,
            self.time_ns,
            arm.mechanism.geometry.reach(),
            self.description.scene.watch_interval_ns(),
        );
        self.slipping.start_motion();
        self.motion = Some(motion);
    }

    /// When the motion under way will end, world time, ns.
    pub fn motion_ends_ns(&self) -> Option<u64> {
        self.motion.as_ref().map(Motion::end_ns)
    }

    /// Stops the arm where it is.
    pub fn halt(&mut self) {
        self.motion = None;
    }

    /// Where the controller must send the arm for its true attitudes to come to these, as an operator sees by looking; play
    /// may make it come short, so that the operator looks and sends again.
    pub fn order_toward(&self, attitudes: &[Option<f64>; AXES], speed: f64) -> MotionOrder {
        let requested = Joints(std::array::from_fn(|axis| {
            attitudes[axis].unwrap_or_else(|| self.arm_state.attitudes.0[axis])
        }));
        let here = self.arm_state.command_for(&self.arm_state.attitudes);
        let short = self.arm_state.command_for(&requested).minus(&here);
        MotionOrder { joints: short.0.map(Some), relative: true, speed }
    }

    /// Turns the sensor's trim resistor: the level at which it fires, a fraction of the most light there can be, changes by this.
    /// False when the sensor has none.
    pub fn turn_trim(&mut self, by: f64) -> bool {
        by.is_finite() && self.description.scene.sensor.turn_trim(by) && {
            self.look_again();
            true
        }
    }

    /// Turns the trim resistor until the sensor just fires at what it sees now. False when the sensor has none.
    pub fn trim_to_fire(&mut self) -> bool {
        // A touch below, as the last digit must not decide.
        let signal = (self.arm_state.seen.signal + self.noise_at(self.time_ns)) * (1.0 - 1e-9);
        self.description.scene.sensor.trim_to(signal) && {
            self.look_again();
            true
        }
    }

    /// The noise of the sensor's signal at a moment, the same after every beginning.
    fn noise_at(&self, time_ns: u64) -> f64 {
        let since = BEGINS_NS.saturating_add(time_ns.saturating_sub(self.began_ns));
        self.description.scene.noise(self.description.seed, since)
    }

    /// Puts something of this width (mm) between the fingers, or nothing (0). The fingers must be open wider. False when they
    /// do not.
    pub fn put_between_fingers(&mut self, width: f64) -> bool {
        let fits = width.is_finite() && width >= 0.0 && self.arm_state.attitudes.of(Joint::Gripper) >= width;
        if fits {
            self.hold(Held { width, ..self.arm_state.held });
        }
        fits
    }

    /// Has the fingers carry this mass (kg) in place of what they carried. False when it is more than they hold.
    pub fn carry(&mut self, mass: f64) -> bool {
        let holds = (0.0..=MOST_CARRIED).contains(&mass);
        if holds {
            self.hold(Held { mass, ..self.arm_state.held });
        }
        holds
    }

    /// Sees anew what is there, after something other than a motor changed it.
    fn look_again(&mut self) {
        self.hold(self.arm_state.held);
    }

    fn hold(&mut self, held: Held) {
        self.arm_state = self.arm_state.holding(&self.description, held);
        self.watch_at_rest();
    }

    /// What the operator's spirit level reads on the hand: its tilt from hanging straight down, outward positive, rad.
    pub fn read_level(&mut self) -> f64 {
        self.readings_taken += 1;
        let tilt = self.arm_state.attitudes.of(Joint::WristPitch) + std::f64::consts::FRAC_PI_2;
        self.description.instruments.level.read(tilt, self.description.seed, self.readings_taken)
    }

    /// What the operator's ruler reads from the table up to the sensor's face, mm.
    pub fn read_ruler(&mut self) -> f64 {
        self.readings_taken += 1;
        let height = self.arm_state.pose.tool.z;
        self.description.instruments.ruler.read(height, self.description.seed, self.readings_taken)
    }

    /// Where a point truly is that lies so far ahead of the sensor's face, in the target's own frame: that of the world, had the target been laid
    /// where it was meant to.
    pub fn point_ahead(&self, ahead_mm: f64) -> Vector {
        let pose = &self.arm_state.pose;
        self.description.scene.target.as_meant(pose.tool + pose.looks * ahead_mm)
    }

    fn inputs(&self) -> u64 {
        u64::from(self.fired) << self.description.scene.sensor.input_bit
    }

    fn require_finite(&self, values: &[Option<f64>; AXES]) -> Result<(), MotionRefused> {
        let wrong = Joint::ALL
            .into_iter()
            .find(|joint| values[joint.index()].is_some_and(|value| !value.is_finite()));
        wrong.map_or(Ok(()), |joint| Err(MotionRefused::NotFinite { joint }))
    }
}
