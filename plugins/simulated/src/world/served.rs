//! The world of a TeachMover as it is served.

use super::mechanism::{WIDEST, attitude_range_deg};
use super::{AXES, HalfSteps, Joint, Joints, LineChange, MotionOrder, MotionRefused, Resolution, World};
use crate::joint_values::JointValues;
use crate::physics::rigid::Vector;
use crate::protocol::{Instrument, JointFacts, JointUnit, Reading, SomeJoints, TruthReport};
use crate::served_world::{
    Arm, ArmFacts, Camera, Fingers, LevelledJoints, MotionRequest, Operator, ServedWorld, StepperMotors,
    Switch, Use,
};

/// As cell files name the arm.
pub(crate) const NAME: &str = "teachmover";

/// Input lines of its controller.
pub(crate) const INPUT_LINES: u32 = 7;

/// Said where the sensor's optics are ideal.
const NO_TRIM: &str = "this sensor has no trim resistor";

impl ServedWorld for World {
    fn title(&self) -> &str {
        &self.description().title
    }

    fn sealed_text(&self) -> Option<&str> {
        self.description().sealed_text.as_deref()
    }

    fn advance(&mut self, until_ns: u64) {
        World::advance(self, until_ns);
    }

    fn again(&self, seed: u64) -> Box<dyn ServedWorld> {
        let mut description = self.as_described().clone();
        description.seed = seed;
        Box::new(World::in_place_of(self, description))
    }

    fn switch(&self) -> Option<&dyn Switch> {
        Some(self)
    }

    fn switch_mut(&mut self) -> Option<&mut dyn Switch> {
        Some(self)
    }

    fn camera(&mut self) -> Option<&mut dyn Camera> {
        None
    }

    fn levelled_joints(&mut self) -> Option<&mut dyn LevelledJoints> {
        None
    }

    fn stepper_motors(&mut self) -> Option<&mut dyn StepperMotors> {
        Some(self)
    }

    fn fingers(&mut self) -> Option<&mut dyn Fingers> {
        Some(self)
    }
}

impl Arm for World {
    fn facts(&self) -> ArmFacts {
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
            name: NAME.to_owned(),
            model: "Microbot TeachMover".to_owned(),
            joints: joints.into(),
            input_lines: INPUT_LINES,
            output_lines: 5,
            braking_ms: 0,
        }
    }

    fn reading(&self) -> Reading {
        Reading::of(&World::reading(self), self.outputs())
    }

    fn truth(&self) -> Result<TruthReport, String> {
        Ok(World::truth(self).into())
    }

    fn motion_ends_ns(&self) -> Option<u64> {
        World::motion_ends_ns(self)
    }

    fn begin(&mut self, request: &MotionRequest) -> Result<(), String> {
        let joints = six(&request.joints)?;
        let order = MotionOrder { joints, relative: request.relative, speed: request.speed };
        World::begin(self, &order).map_err(in_words)
    }

    fn halt(&mut self) {
        World::halt(self);
    }

    fn set_registers(&mut self, joints: &[f64]) -> Result<(), String> {
        World::set_registers(self, &Joints(six(joints)?)).map_err(in_words)
    }

    fn set_outputs(&mut self, bits: u64) {
        World::set_outputs(self, bits);
    }
}

impl Operator for World {
    fn request_toward(&self, joints: &[Option<f64>]) -> MotionRequest {
        let order = World::order_toward(self, &of_each(joints), 1.0);
        MotionRequest { joints: order.joints.into(), relative: order.relative, speed: order.speed }
    }

    fn is_at(&self, joints: &[Option<f64>]) -> bool {
        let near = match self.description().arm.resolution {
            Resolution::Continuous => 1e-10,
            Resolution::HalfStep => 0.51,
        };
        let order = World::order_toward(self, &of_each(joints), 1.0);
        let short = Joints(order.joints.map(Option::unwrap_or_default));
        HalfSteps::from_joints(&short).0.iter().all(|motor| motor.abs() <= near)
    }

    fn measure(&mut self, used: &Use<'_>) -> Result<(f64, &'static str), String> {
        if let Some(location) = used.at.filter(|location| *location != "hand") {
            return Err(format!("on this arm one measures at the `hand`, not at `{location}`"));
        }
        Ok(match used.with {
            Instrument::Level => (self.read_level().to_degrees(), "deg"),
            Instrument::Ruler => (self.read_ruler(), "mm"),
            Instrument::Probe => return Err("no measuring probe is on this hand".to_owned()),
            Instrument::Tracker => return Err("there is no laser tracker in this world".to_owned()),
            Instrument::Board | Instrument::BoardTurn => {
                return Err("no camera on this hand sees a board".to_owned());
            }
        })
    }

    fn hang(&mut self, mass_kg: f64) -> Result<(), String> {
        let holds = World::carry(self, mass_kg);
        holds
            .then_some(())
            .ok_or_else(|| format!("this hand lifts 0 to 0.454 kg (one pound), not {mass_kg} kg"))
    }
}

impl Switch for World {
    fn latest_change(&self) -> u64 {
        World::latest_change(self)
    }

    fn changes_after(&self, number: u64) -> Vec<LineChange> {
        World::changes_after(self, number)
    }

    fn trim_to_fire(&mut self) -> Result<(), String> {
        World::trim_to_fire(self).then_some(()).ok_or_else(|| NO_TRIM.to_owned())
    }

    fn turn_trim(&mut self, by: f64) -> Result<(), String> {
        World::turn_trim(self, by).then_some(()).ok_or_else(|| NO_TRIM.to_owned())
    }

    fn attitudes_at_height(&mut self, height_mm: f64) -> Option<SomeJoints> {
        World::attitudes_at_height(self, height_mm).map(Vec::from)
    }

    fn attitudes_over(&mut self, point: &Vector) -> Option<SomeJoints> {
        World::attitudes_over(self, point).map(Vec::from)
    }

    fn read_point(&self, axis: usize, ahead_mm: f64) -> Result<f64, String> {
        let point = World::point_ahead(self, ahead_mm);
        [point.x, point.y, point.z]
            .get(axis)
            .copied()
            .ok_or_else(|| "an axis is 0, 1 or 2: x, y or z".to_owned())
    }
}

impl StepperMotors for World {
    fn begin_half_steps(&mut self, travel: &JointValues, rate: f64) -> Result<(), String> {
        World::begin_half_steps(self, &HalfSteps(six(travel)?), rate).map_err(in_words)
    }
}

impl Fingers for World {
    fn put_between_fingers(&mut self, width_mm: f64) -> Result<(), String> {
        let fits = World::put_between_fingers(self, width_mm);
        fits.then_some(()).ok_or_else(|| "the fingers are not so far open; open them first".to_owned())
    }
}

/// The values of this arm's joints, out of a list that came from outside.
fn six<T: Copy>(values: &[T]) -> Result<[T; AXES], String> {
    values.try_into().map_err(|_| format!("{} joint values for an arm of {AXES} joints", values.len()))
}

/// The values of this arm's joints; what a list leaves out at its end takes no part.
fn of_each(joints: &[Option<f64>]) -> [Option<f64>; AXES] {
    std::array::from_fn(|axis| joints.get(axis).copied().flatten())
}

fn in_words(refused: MotionRefused) -> String {
    refused.to_string()
}

/// How far a joint's value may go, as the controller counts it.
fn range(joint: Joint) -> (JointUnit, f64, f64) {
    match attitude_range_deg(joint) {
        Some([lower, upper]) => (JointUnit::Rad, lower.to_radians(), upper.to_radians()),
        None => (JointUnit::Mm, 0.0, WIDEST),
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
