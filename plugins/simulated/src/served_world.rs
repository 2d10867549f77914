//! A world as it is served: whatever arm is in it, and what can be done there. What not every arm has is a capability of its own.

use std::sync::Arc;

use crate::joint_values::JointValues;
use crate::light::{Light, Switches};
use crate::physics::rigid::Rigid;
use crate::physics::rigid::Vector;
use crate::protocol::{Axis, Instrument, JointFacts, Reading, SomeJoints, TruthReport};
use crate::world::LineChange;

/// What a driver may know of the arm that is in a world.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmFacts {
    /// As cell files name it.
    pub name: String,
    /// As people name it.
    pub model: String,
    /// Its joints, in the order of every list of joint values.
    pub joints: Vec<JointFacts>,
    /// Input lines of its controller.
    pub input_lines: u32,
    /// Output lines of its controller.
    pub output_lines: u32,
    /// How long its brakes take from full speed, ms; 0 for an arm that has none.
    pub braking_ms: u32,
}

/// A motion of joints that somebody asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionRequest {
    /// Where each joint shall go, as the controller counts, rad or mm; None stays.
    pub joints: SomeJoints,
    /// Whether the values are added to where the joints are.
    pub relative: bool,
    /// Fraction of the arm's greatest speed, above 0 and at most 1.
    pub speed: f64,
}

/// How the operator uses an instrument.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Use<'a> {
    /// Which instrument.
    pub with: Instrument,
    /// Where; what it is where nothing is said, the world knows.
    pub at: Option<&'a str>,
    /// Whether it is turned end for end.
    pub turned: bool,
    /// Which coordinate is read.
    pub axis: Option<Axis>,
    /// For a joint that is driven: whether its reading has to increase (or decrease) as it arrives.
    pub rising: Option<bool>,
}

/// The moment a picture is taken in.
#[derive(Debug, Clone)]
pub struct Exposure {
    /// As the camera says, world time, ns.
    pub time_ns: u64,
    /// What there is to see.
    pub light: Arc<Light>,
    /// Where the flange truly is.
    pub world_from_flange: Rigid,
    /// Laser and filter.
    pub switches: Switches,
    /// Which picture it is.
    pub number: u64,
    /// How many that the camera took by itself still wait.
    pub waiting: u32,
}

/// An arm and its controller. Refusals are sentences that say what would be right.
pub trait Arm {
    /// What a driver may know of it.
    fn facts(&self) -> ArmFacts;
    /// What the controller knows; what the pendant does is not the world's to know.
    fn reading(&self) -> Reading;
    /// What is so.
    ///
    /// # Errors
    /// Why the arm finds no equilibrium.
    fn truth(&self) -> Result<TruthReport, String>;
    /// When the motion under way will end, world time, ns.
    fn motion_ends_ns(&self) -> Option<u64>;
    /// Starts a motion.
    ///
    /// # Errors
    /// Why not.
    fn begin(&mut self, request: &MotionRequest) -> Result<(), String>;
    /// Goes evenly to these joints (rad or mm) within a time (ns), in place of where it was being led.
    ///
    /// # Errors
    /// Why not; an arm whose motors step is not led.
    fn follow(&mut self, _joints: &[f64], _duration_ns: u64) -> Result<(), String> {
        Err("the motors of this arm are not led; move its joints instead".to_owned())
    }
    /// Stops whatever moves.
    fn halt(&mut self);
    /// Has the controller believe that the arm is so, rad or mm.
    ///
    /// # Errors
    /// Why not.
    fn set_registers(&mut self, joints: &[f64]) -> Result<(), String>;
    /// Sets the output lines.
    fn set_outputs(&mut self, bits: u64);
}

/// The person beside the arm: what eyes, hands and instruments do on any arm.
pub trait Operator {
    /// Where the controller must send the arm for its true joints to come to these (rad or mm), as an operator sees by looking.
    fn request_toward(&self, joints: &[Option<f64>]) -> MotionRequest;
    /// Whether the arm is as near to these true joints (rad or mm) as its motors can be set.
    fn is_at(&self, joints: &[Option<f64>]) -> bool;
    /// Measures: the value and its unit.
    ///
    /// # Errors
    /// Why nothing can be measured.
    fn measure(&mut self, used: &Use<'_>) -> Result<(f64, &'static str), String>;
    /// One coordinate of one point (from 1) of the profile that a laser line sensor on the hand sees of a thing, mm.
    ///
    /// # Errors
    /// Why nothing is seen.
    fn read_profile(&mut self, _of: &str, _point: usize, _axis: Axis) -> Result<f64, String> {
        Err("no laser line sensor is on this hand".to_owned())
    }
    /// Hangs a weight (kg) on the flange, or puts it into the fingers, in place of what was there.
    ///
    /// # Errors
    /// Why not.
    fn hang(&mut self, mass_kg: f64) -> Result<(), String>;
}

/// A proximity switch on the hand, wired to an input line of the controller, over a table with a target.
pub trait Switch {
    /// The number of the latest change of the input lines, 0 before the first.
    fn latest_change(&self) -> u64;
    /// The changes of the input lines after the one with this number, as far as the world remembers.
    fn changes_after(&self, number: u64) -> Vec<LineChange>;
    /// Turns the trim resistor until the switch just fires.
    ///
    /// # Errors
    /// Why not.
    fn trim_to_fire(&mut self) -> Result<(), String>;
    /// Turns the trim resistor, by a fraction of the most light there can be.
    ///
    /// # Errors
    /// Why not.
    fn turn_trim(&mut self, by: f64) -> Result<(), String>;
    /// True attitudes with which the switch's face is so high (mm) over the table, only the shoulder having moved; none where there are none.
    fn attitudes_at_height(&mut self, height_mm: f64) -> Option<SomeJoints>;
    /// True attitudes with which the switch's face is over this point, as well as the operator's eye can see; none where there are none.
    fn attitudes_over(&mut self, point: &Vector) -> Option<SomeJoints>;
    /// Where a point ahead of the switch's face truly is along an axis (0 x, 1 y, 2 z) of the target's frame, mm.
    ///
    /// # Errors
    /// Why it cannot be determined.
    fn read_point(&self, axis: usize, ahead_mm: f64) -> Result<f64, String>;
}

/// A camera on the hand, with the laser and the filter of a light stripe.
pub trait Camera {
    /// What the camera sees now, or saw when it took the first picture that waits, to be turned into a picture at leisure.
    ///
    /// # Errors
    /// Why there is no picture.
    fn expose(&mut self) -> Result<Exposure, String>;
    /// Has the camera take a picture every so often (ns) while the arm moves, or only when it is asked.
    ///
    /// # Errors
    /// Why not.
    fn set_shutter(&mut self, every_ns: Option<u64>) -> Result<(), String>;
    /// Switches the laser and puts the filter in or out; none leaves it.
    fn shine(&mut self, laser: Option<bool>, filter: Option<bool>);
}

/// Joints that the operator can bring to level by the bubble of a spirit level.
pub trait LevelledJoints {
    /// How a joint is to be turned to bring the bubble to the middle; none when it is there.
    ///
    /// # Errors
    /// Why it cannot be done.
    fn level_request(&mut self, joint: &str, used: &Use<'_>) -> Result<Option<MotionRequest>, String>;
}

/// Stepper motors that a controller drives one by one.
pub trait StepperMotors {
    /// Starts a motion of so many half-steps of each motor, the one with the most at `rate` half-steps/s.
    ///
    /// # Errors
    /// Why not.
    fn begin_half_steps(&mut self, travel: &JointValues, rate: f64) -> Result<(), String>;
}

/// Fingers that hold things.
pub trait Fingers {
    /// Puts something of this width (mm) between the fingers.
    ///
    /// # Errors
    /// Why not.
    fn put_between_fingers(&mut self, width_mm: f64) -> Result<(), String>;
}

/// What serving needs of a world: an arm, an operator, time, and what else there may be.
pub trait ServedWorld: Arm + Operator + Send {
    /// What a user calls it.
    fn title(&self) -> &str;
    /// The text of its file, if it came under a seal.
    fn sealed_text(&self) -> Option<&str>;
    /// Lets time run to `until_ns`.
    fn advance(&mut self, until_ns: u64);
    /// The world at its beginning, drawn from another seed, in place of this one, whose time goes on.
    fn again(&self, seed: u64) -> Box<dyn ServedWorld>;
    /// The proximity switch on the hand, if there is one, to be looked at.
    fn switch(&self) -> Option<&dyn Switch>;
    /// The proximity switch on the hand, if there is one.
    fn switch_mut(&mut self) -> Option<&mut dyn Switch>;
    /// The camera on the hand, if there is one.
    fn camera(&mut self) -> Option<&mut dyn Camera>;
    /// The joints that can be levelled, if there are any.
    fn levelled_joints(&mut self) -> Option<&mut dyn LevelledJoints>;
    /// The stepper motors, if the arm has any.
    fn stepper_motors(&mut self) -> Option<&mut dyn StepperMotors>;
    /// The fingers, if the arm has any.
    fn fingers(&mut self) -> Option<&mut dyn Fingers>;

    /// Lets time run to the end of the motion under way, if there is one.
    fn finish_motion(&mut self) {
        while let Some(end_ns) = self.motion_ends_ns() {
            self.advance(end_ns);
        }
    }
}
