//! A world as it is served: whatever arm stands in it.

use std::sync::Arc;

use crate::light::{Light, Switches};
use crate::physics::rigid::Rigid;
use crate::protocol::{Axis, Instrument, JointFacts, JointUnit, Reading, SomeJoints, TruthReport};
use crate::world::{
    AXES, HalfSteps, Joint, Joints, LineChange, MotionOrder, MotionRefused, Point, Resolution, World,
};
use crate::world_file::Described;

/// What a driver may know of the arm that stands in a world.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmFacts {
    /// As cell files name it.
    pub name: &'static str,
    /// As people name it.
    pub model: &'static str,
    /// Its joints, in the order of every list of joint values.
    pub joints: Vec<JointFacts>,
    /// Input lines of its controller.
    pub input_lines: u32,
    /// Output lines of its controller.
    pub output_lines: u32,
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

/// What serving needs of a world. Refusals are sentences that say what would be right.
pub trait ServedWorld: Send {
    /// What a user calls it.
    fn title(&self) -> &str;
    /// What its arm is.
    fn arm(&self) -> ArmFacts;
    /// The text of its file, if it came under a seal.
    fn sealed_text(&self) -> Option<&str>;
    /// What the controller knows; what the pendant does is not the world's to know.
    fn reading(&self) -> Reading;
    /// What is so.
    ///
    /// # Errors
    /// Why the arm does not stand.
    fn truth(&self) -> Result<TruthReport, String>;
    /// Lets time run to `until_ns`.
    fn advance(&mut self, until_ns: u64);
    /// When the motion under way will end, world time, ns.
    fn motion_ends_ns(&self) -> Option<u64>;
    /// Starts a motion.
    ///
    /// # Errors
    /// Why not.
    fn begin(&mut self, order: &MotionOrder) -> Result<(), String>;
    /// Stops whatever moves.
    fn halt(&mut self);
    /// Has the controller believe that the arm stands so.
    ///
    /// # Errors
    /// Why not.
    fn set_registers(&mut self, joints: [f64; AXES]) -> Result<(), String>;
    /// Sets the output lines.
    fn set_outputs(&mut self, bits: u64);
    /// Where the controller must send the arm for its true joints to come to these, as an operator sees by looking.
    fn order_toward(&self, joints: &[Option<f64>; AXES]) -> MotionOrder;
    /// Whether the arm stands as near to these true joints as its motors can be set.
    fn stands_at(&self, joints: &[Option<f64>; AXES]) -> bool;
    /// Measures: the value and its unit.
    ///
    /// # Errors
    /// Why nothing can be measured.
    fn measure(&mut self, used: &Use<'_>) -> Result<(f64, &'static str), String>;

    /// What the camera on the hand sees now, or saw when it took the first picture that waits, to be turned into a picture at leisure.
    ///
    /// # Errors
    /// Why there is no picture.
    fn expose(&mut self) -> Result<Exposure, String> {
        Err("this arm has no camera".to_owned())
    }
    /// Has the camera take a picture every so often (ns) while the arm moves, or only when it is asked.
    ///
    /// # Errors
    /// Why not.
    fn set_shutter(&mut self, _every_ns: Option<u64>) -> Result<(), String> {
        Err("this arm has no camera".to_owned())
    }
    /// Switches the light stripe's laser and puts its filter in or out; none leaves it.
    ///
    /// # Errors
    /// Why not.
    fn shine(&mut self, _laser: Option<bool>, _filter: Option<bool>) -> Result<(), String> {
        Err("this arm has no light stripe".to_owned())
    }
    /// Where a point ahead of the sensor's face truly is along an axis (0 x, 1 y, 2 z) of the target's frame, mm.
    ///
    /// # Errors
    /// Why nobody can tell.
    fn read_point(&self, _axis: usize, _ahead_mm: f64) -> Result<f64, String> {
        Err("no measuring arm stands by this arm's target".to_owned())
    }

    /// Lets time run to the end of the motion under way, if there is one.
    fn finish_motion(&mut self) {
        while let Some(end_ns) = self.motion_ends_ns() {
            self.advance(end_ns);
        }
    }
    /// How a joint is to be turned to bring a spirit level's bubble to the middle; none when it stands there.
    ///
    /// # Errors
    /// Why it cannot be done.
    fn level_order(&mut self, _joint: &str, _used: &Use<'_>) -> Result<Option<MotionOrder>, String> {
        Err("in this world no joint is levelled; bring the arm to a pose instead".to_owned())
    }
    /// The number of the latest change of the input lines, 0 before the first.
    fn latest_change(&self) -> u64 {
        0
    }
    /// The changes of the input lines after the one with this number, as far as the world remembers.
    fn changes_after(&self, _number: u64) -> Vec<LineChange> {
        Vec::new()
    }
    /// Starts a motion of the motors themselves.
    ///
    /// # Errors
    /// Why not.
    fn begin_half_steps(&mut self, _travel: [f64; AXES], _rate: f64) -> Result<(), String> {
        Err("this arm has no stepper motors; move its joints instead".to_owned())
    }
    /// The world at its beginning, in place of this one, whose time goes on.
    fn again(&self, described: Described) -> Box<dyn ServedWorld>;
    /// True attitudes with which the sensor's face is so high (mm) over the table, only the shoulder having moved; none where there are none.
    fn attitudes_at_height(&mut self, _height_mm: f64) -> Option<SomeJoints> {
        None
    }
    /// True attitudes with which the sensor's face is over this point, as well as the operator's eye tells; none where there are none.
    fn attitudes_over(&mut self, _point: &Point) -> Option<SomeJoints> {
        None
    }
    /// Turns the sensor's trim resistor until it just fires.
    ///
    /// # Errors
    /// Why not.
    fn trim_to_fire(&mut self) -> Result<(), String> {
        Err("this arm has no proximity sensor".to_owned())
    }
    /// Turns the sensor's trim resistor.
    ///
    /// # Errors
    /// Why not.
    fn turn_trim(&mut self, _by: f64) -> Result<(), String> {
        Err("this arm has no proximity sensor".to_owned())
    }
    /// Hangs a weight (kg) on the flange, or puts it into the fingers, in place of what was there.
    ///
    /// # Errors
    /// Why not.
    fn hang(&mut self, _mass_kg: f64) -> Result<(), String> {
        Err("nothing is hung on this arm".to_owned())
    }
    /// Puts something of this width (mm) between the fingers.
    ///
    /// # Errors
    /// Why not.
    fn put_between_fingers(&mut self, _width_mm: f64) -> Result<(), String> {
        Err("this arm has no fingers".to_owned())
    }
}

impl ServedWorld for World {
    fn title(&self) -> &str {
        &self.description().title
    }

    fn arm(&self) -> ArmFacts {
        let arm = &self.description().arm;
        let home = arm.start.minus(&arm.zero_error);
        let step = each_alone(&HalfSteps([1.0; AXES]));
        let top_speed = each_alone(&arm.top_rates);
        let joints = Joint::ALL.map(|joint| {
            let (unit, lower, upper) = range(joint);
            JointFacts {
                name: joint.name().to_owned(),
                unit,
                lower,
                upper,
                resolution: match arm.resolution {
                    Resolution::Continuous => 0.0,
                    Resolution::HalfStep => step.of(joint),
                },
                top_speed: top_speed.of(joint),
                home: home.of(joint),
            }
        });
        ArmFacts {
            name: "teachmover",
            model: "Microbot TeachMover",
            joints: joints.into(),
            input_lines: 7,
            output_lines: 5,
        }
    }

    fn sealed_text(&self) -> Option<&str> {
        self.description().sealed_text.as_deref()
    }

    fn reading(&self) -> Reading {
        Reading::of(&World::reading(self), self.outputs())
    }

    fn truth(&self) -> Result<TruthReport, String> {
        Ok(World::truth(self).into())
    }

    fn advance(&mut self, until_ns: u64) {
        World::advance(self, until_ns);
    }

    fn motion_ends_ns(&self) -> Option<u64> {
        World::motion_ends_ns(self)
    }

    fn begin(&mut self, order: &MotionOrder) -> Result<(), String> {
        World::begin(self, order).map_err(in_words)
    }

    fn halt(&mut self) {
        World::halt(self);
    }

    fn set_registers(&mut self, joints: [f64; AXES]) -> Result<(), String> {
        World::set_registers(self, &Joints(joints)).map_err(in_words)
    }

    fn set_outputs(&mut self, bits: u64) {
        World::set_outputs(self, bits);
    }

    fn order_toward(&self, joints: &[Option<f64>; AXES]) -> MotionOrder {
        World::order_toward(self, joints, 1.0)
    }

    fn stands_at(&self, joints: &[Option<f64>; AXES]) -> bool {
        let near = match self.description().arm.resolution {
            Resolution::Continuous => 1e-10,
            Resolution::HalfStep => 0.51,
        };
        let order = World::order_toward(self, joints, 1.0);
        let short = Joints(order.joints.map(Option::unwrap_or_default));
        HalfSteps::from_joints(&short).0.iter().all(|motor| motor.abs() <= near)
    }

    fn measure(&mut self, used: &Use<'_>) -> Result<(f64, &'static str), String> {
        if let Some(place) = used.at.filter(|place| *place != "hand") {
            return Err(format!("on this arm one measures at the `hand`, not at `{place}`"));
        }
        Ok(match used.with {
            Instrument::Level => (self.read_level().to_degrees(), "deg"),
            Instrument::Ruler => (self.read_ruler(), "mm"),
            Instrument::Tracker => return Err("no laser tracker stands in this world".to_owned()),
        })
    }

    fn read_point(&self, axis: usize, ahead_mm: f64) -> Result<f64, String> {
        let point = World::point_ahead(self, ahead_mm);
        [point.x, point.y, point.z]
            .get(axis)
            .copied()
            .ok_or_else(|| "an axis is 0, 1 or 2: x, y or z".to_owned())
    }

    fn latest_change(&self) -> u64 {
        World::latest_change(self)
    }

    fn changes_after(&self, number: u64) -> Vec<LineChange> {
        World::changes_after(self, number)
    }

    fn begin_half_steps(&mut self, travel: [f64; AXES], rate: f64) -> Result<(), String> {
        World::begin_half_steps(self, &HalfSteps(travel), rate).map_err(in_words)
    }

    fn again(&self, described: Described) -> Box<dyn ServedWorld> {
        match described {
            Described::TeachMover(described) => Box::new(World::in_place_of(self, *described)),
            other => other.into_world(),
        }
    }

    fn attitudes_at_height(&mut self, height_mm: f64) -> Option<SomeJoints> {
        World::attitudes_at_height(self, height_mm)
    }

    fn attitudes_over(&mut self, point: &Point) -> Option<SomeJoints> {
        World::attitudes_over(self, point)
    }

    fn trim_to_fire(&mut self) -> Result<(), String> {
        let turned = World::trim_to_fire(self);
        turned.then_some(()).ok_or_else(|| "this sensor has no trim resistor".to_owned())
    }

    fn turn_trim(&mut self, by: f64) -> Result<(), String> {
        let turned = World::turn_trim(self, by);
        turned.then_some(()).ok_or_else(|| "this sensor has no trim resistor".to_owned())
    }

    fn put_between_fingers(&mut self, width_mm: f64) -> Result<(), String> {
        let fits = World::put_between_fingers(self, width_mm);
        fits.then_some(()).ok_or_else(|| "the fingers do not stand so far open; open them first".to_owned())
    }

    fn hang(&mut self, mass_kg: f64) -> Result<(), String> {
        let holds = World::carry(self, mass_kg);
        holds
            .then_some(())
            .ok_or_else(|| format!("this hand lifts 0 to 0.454 kg (one pound), not {mass_kg} kg"))
    }
}

fn in_words(refused: MotionRefused) -> String {
    refused.to_string()
}

/// How far a joint's reckoned value may go: its mechanical stops, those of forearm and hand, which are relative to the link
/// before, taken with that link at its own.
fn range(joint: Joint) -> (JointUnit, f64, f64) {
    let degrees = |lower: f64, upper: f64| (JointUnit::Rad, lower.to_radians(), upper.to_radians());
    match joint {
        Joint::Waist => degrees(-90.0, 90.0),
        Joint::Shoulder => degrees(-35.0, 144.0),
        Joint::Elbow => degrees(-184.0, 144.0),
        Joint::WristPitch => degrees(-274.0, 234.0),
        Joint::WristRoll => degrees(-360.0, 360.0),
        Joint::Gripper => (JointUnit::Mm, 0.0, 76.2),
    }
}

/// How far each joint goes when the motors that work it, and no others, go this far: both of the wrist's for its pitch and roll.
fn each_alone(motors: &HalfSteps) -> Joints {
    let [base, shoulder, elbow, right, left, gripper] = motors.0;
    let of = |motors: [f64; AXES], joint: Joint| HalfSteps(motors).to_joints().of(joint).abs();
    let wrist = right.min(left);
    Joints([
        of([base, 0.0, 0.0, 0.0, 0.0, 0.0], Joint::Waist),
        of([0.0, shoulder, 0.0, 0.0, 0.0, 0.0], Joint::Shoulder),
        of([0.0, 0.0, elbow, 0.0, 0.0, 0.0], Joint::Elbow),
        of([0.0, 0.0, 0.0, wrist, wrist, 0.0], Joint::WristPitch),
        of([0.0, 0.0, 0.0, -wrist, wrist, 0.0], Joint::WristRoll),
        of([0.0, 0.0, 0.0, 0.0, 0.0, gripper], Joint::Gripper),
    ])
}
