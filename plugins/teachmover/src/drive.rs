//! The six motors of the arm, and how their half-steps correspond to joints.
//!
//! The cables keep attitudes: the shoulder's motor turns the upper arm alone, so the forearm and the hand keep their angle from the horizontal
//! when it runs. The two wrist motors drive the hand through a differential. The gripper's cable runs along the forearm, so the gripper's
//! motor has to follow the elbow's to hold the opening: half-step for half-step when new, otherwise when worn.

use std::f64::consts::TAU;

/// The number of motors, and of joints.
pub const MOTORS: usize = 6;

/// The motors, in the order of every command and register line: base, shoulder, elbow, right wrist, left wrist, gripper.
pub const MOTOR_NAMES: [&str; MOTORS] = ["base", "shoulder", "elbow", "right wrist", "left wrist", "gripper"];

/// Half-steps for one turn of the joint, of the base, shoulder, elbow and either wrist motor.
///
/// The manual's columns for a turn, a radian and a degree differ by 1.5 %; the turn is the one that agrees with the gearing.
const HALF_STEPS_PER_TURN: [f64; 4] = [7072.0, 7072.0, 4158.0, 1536.0];

/// Half-steps of the gripper's motor for one millimetre of opening: 371 for an inch.
const GRIPPER_HALF_STEPS_PER_MM: f64 = 371.0 / 25.4;

/// A joint of the arm, in the order of the joint vectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Joint {
    /// The base, positive to the left seen from behind the arm: rad.
    Waist,
    /// The upper arm's angle from the horizontal, positive upward: rad.
    Shoulder,
    /// The forearm's angle from the horizontal, positive upward: rad.
    Elbow,
    /// The hand's angle from the horizontal, positive upward: rad.
    WristPitch,
    /// The hand's turn about its own axis: rad.
    WristRoll,
    /// The opening between the fingers: mm.
    Gripper,
}

impl Joint {
    /// Every joint, in order.
    pub const ALL: [Self; MOTORS] =
        [Self::Waist, Self::Shoulder, Self::Elbow, Self::WristPitch, Self::WristRoll, Self::Gripper];

    /// Its index in a joint vector.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Its name in cell files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Waist => "waist",
            Self::Shoulder => "shoulder",
            Self::Elbow => "elbow",
            Self::WristPitch => "wrist_pitch",
            Self::WristRoll => "wrist_roll",
            Self::Gripper => "gripper",
        }
    }

    /// Half-steps for one rad, or one mm of opening, of the motor or motors that drive it alone, of a new arm.
    pub fn half_steps_per_unit(self) -> f64 {
        let [base, shoulder, elbow, wrist] = HALF_STEPS_PER_TURN;
        match self {
            Self::Waist => base / TAU,
            Self::Shoulder => shoulder / TAU,
            Self::Elbow => elbow / TAU,
            Self::WristPitch | Self::WristRoll => wrist / TAU,
            Self::Gripper => GRIPPER_HALF_STEPS_PER_MM,
        }
    }
}

/// Whole half-steps of the six motors: a register line, or the counts of a move.
///
/// Positive: base to the left, shoulder, elbow and wrists down, gripper open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HalfSteps(pub [i32; MOTORS]);

impl HalfSteps {
    /// The counts that lead from `start` to `self`.
    pub fn since(self, start: Self) -> Self {
        self.zip(start, |end, start| end.wrapping_sub(start))
    }

    /// Where the counts `self` lead from `start`.
    pub fn after(self, start: Self) -> Self {
        self.zip(start, |count, start| start.wrapping_add(count))
    }

    /// The count of the motor that makes the most half-steps.
    pub fn largest(self) -> u32 {
        self.0.iter().map(|count| count.unsigned_abs()).fold(0, u32::max)
    }

    /// The same counts of an arm some of whose motors turn the other way.
    #[must_use]
    pub fn turned(self, senses: Senses) -> Self {
        self.zip(Self(senses.0), i32::wrapping_mul)
    }

    fn zip(self, other: Self, combine: impl Fn(i32, i32) -> i32) -> Self {
        let mut result = self;
        for (value, other) in result.0.iter_mut().zip(other.0) {
            *value = combine(*value, other);
        }
        result
    }
}

/// Which way each motor of an arm turns: 1 as [`HalfSteps`] has it, -1 for one that was wired or strung the other way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Senses([i32; MOTORS]);

impl Default for Senses {
    fn default() -> Self {
        Self([1; MOTORS])
    }
}

impl Senses {
    /// All as usual but these motors (from 0).
    pub fn reversed(motors: &[usize]) -> Self {
        let mut senses = Self::default();
        for (motor, sense) in senses.0.iter_mut().enumerate() {
            if motors.contains(&motor) {
                *sense = -1;
            }
        }
        senses
    }
}

/// How the gripper's motor has to follow the elbow's to hold the opening: its half-steps for one of the elbow's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GripperCable {
    follows: f64,
    half_steps_per_mm: f64,
}

impl Default for GripperCable {
    /// Half-step for half-step, as the maker says.
    fn default() -> Self {
        Self { follows: 1.0, half_steps_per_mm: GRIPPER_HALF_STEPS_PER_MM }
    }
}

impl GripperCable {
    /// Of an arm that was measured.
    pub fn following(half_steps_per_elbow_half_step: f64) -> Self {
        Self { follows: half_steps_per_elbow_half_step, ..Self::default() }
    }

    /// The same with another figure of half-steps for a millimetre of opening.
    #[must_use]
    pub fn with_half_steps_per_mm(self, half_steps_per_mm: f64) -> Self {
        Self { half_steps_per_mm, ..self }
    }

    /// Half-steps for one rad, or one mm of opening, of a joint of an arm with this cable.
    pub fn half_steps_per_unit(self, joint: Joint) -> f64 {
        if joint == Joint::Gripper { self.half_steps_per_mm } else { joint.half_steps_per_unit() }
    }

    /// Where the gripper's motor replaces an elbow's, the opening being what it is when both read zero.
    fn taken_along(self, elbow: i32) -> i32 {
        whole(f64::from(elbow) * self.follows)
    }

    /// The count of the gripper's motor that changes the opening in a move of these counts from `start`: what it makes beyond following the elbow.
    pub fn opening(self, start: HalfSteps, counts: HalfSteps) -> i32 {
        let [.., gripper] = counts.0;
        gripper.wrapping_sub(self.following_counts(start, counts))
    }

    /// The same counts from `start` with the gripper's motor following the elbow's, so that the opening stays as it is.
    pub fn holding_the_opening(self, start: HalfSteps, counts: HalfSteps) -> HalfSteps {
        let [base, shoulder, elbow, right, left, _] = counts.0;
        HalfSteps([base, shoulder, elbow, right, left, self.following_counts(start, counts)])
    }

    /// What the gripper's motor makes to follow the elbow's; over the pieces of a move it adds up to what it makes over the whole.
    fn following_counts(self, start: HalfSteps, counts: HalfSteps) -> i32 {
        let ([_, _, from, ..], [_, _, by, ..]) = (start.0, counts.0);
        self.taken_along(from.wrapping_add(by)).wrapping_sub(self.taken_along(from))
    }
}

/// Joint values in the order of [`Joint::ALL`]: rad, and mm for the gripper.
pub type Joints = [f64; MOTORS];

/// Where the arm is when every register reads zero. The arm has no sensors on its joints: this is what an operator has declared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegisterZero {
    joints: Joints,
    cable: GripperCable,
}

impl RegisterZero {
    /// The registers read zero when the arm is at `joints`.
    pub fn at(joints: Joints) -> Self {
        Self { joints, cable: GripperCable::default() }
    }

    /// The same with another gripper's cable.
    #[must_use]
    pub fn with_cable(self, cable: GripperCable) -> Self {
        Self { cable, ..self }
    }

    /// The gripper's cable.
    pub fn cable(&self) -> GripperCable {
        self.cable
    }

    /// The zero with which `registers` correspond to `joints`; the cable is the same.
    #[must_use]
    pub fn declared(self, joints: Joints, registers: HalfSteps) -> Self {
        let travelled = travel(registers, self.cable);
        let mut zero = joints;
        for (zero, travelled) in zero.iter_mut().zip(travelled) {
            *zero -= travelled;
        }
        Self { joints: zero, ..self }
    }

    /// The joints that correspond to registers.
    pub fn joints(&self, registers: HalfSteps) -> Joints {
        let mut joints = travel(registers, self.cable);
        for (joint, zero) in joints.iter_mut().zip(self.joints) {
            *joint += zero;
        }
        joints
    }

    /// The registers nearest to `target` for the joints that `moves` names; motors of the other joints keep their register, but the gripper's
    /// motor follows the elbow's. Joints of `target` that do not move are not looked at.
    pub fn registers(&self, start: HalfSteps, target: &Joints, moves: impl Fn(Joint) -> bool) -> HalfSteps {
        let here = self.joints(start);
        let change = |joint: Joint| match (target.get(joint.index()), here.get(joint.index())) {
            (Some(target), Some(here)) if moves(joint) => {
                (target - here) * self.cable.half_steps_per_unit(joint)
            }
            _ => 0.0,
        };
        let pitch = -change(Joint::WristPitch);
        let roll = change(Joint::WristRoll);
        let counts = HalfSteps([
            whole(change(Joint::Waist)),
            whole(-change(Joint::Shoulder)),
            whole(-change(Joint::Elbow)),
            whole(pitch - roll),
            whole(pitch + roll),
            0,
        ]);
        let mut counts = self.cable.holding_the_opening(start, counts);
        let [.., gripper] = &mut counts.0;
        *gripper = gripper.saturating_add(whole(change(Joint::Gripper)));
        counts.after(start)
    }
}

/// The joints' travel from where the registers read zero: rad, and mm for the gripper.
fn travel(registers: HalfSteps, cable: GripperCable) -> Joints {
    let [base, shoulder, elbow, right, left, gripper] = registers.0.map(f64::from);
    let [_, _, elbow_register, ..] = registers.0;
    let taken_along = f64::from(cable.taken_along(elbow_register));
    let of = |count: f64, joint: Joint| count / cable.half_steps_per_unit(joint);
    [
        of(base, Joint::Waist),
        of(-shoulder, Joint::Shoulder),
        of(-elbow, Joint::Elbow),
        of(-(right + left) / 2.0, Joint::WristPitch),
        of((left - right) / 2.0, Joint::WristRoll),
        of(gripper - taken_along, Joint::Gripper),
    ]
}

/// The nearest whole number; one that no register can hold becomes the largest that can.
fn whole(count: f64) -> i32 {
    count.round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn straight_out() -> RegisterZero {
        RegisterZero::at([0.0; MOTORS])
    }

    fn registers() -> impl Strategy<Value = HalfSteps> {
        prop::array::uniform6(-4000..4000_i32).prop_map(HalfSteps)
    }

    proptest! {
        #[test]
        fn the_joints_of_registers_lead_back_to_them(registers in registers(), zero in prop::array::uniform6(-3.0..3.0_f64)) {
            let zero = RegisterZero::at(zero);
            prop_assert_eq!(zero.registers(HalfSteps::default(), &zero.joints(registers), |_| true), registers);
        }

        #[test]
        fn no_joint_ends_further_than_half_a_half_step_from_its_target(
            start in registers(), target in prop::array::uniform6(-2.0..2.0_f64),
        ) {
            let zero = straight_out();
            let reached = zero.joints(zero.registers(start, &target, |_| true));
            for joint in Joint::ALL {
                // Pitch and roll share two motors, each rounded by itself.
                let miss = (reached[joint.index()] - target[joint.index()]).abs() * joint.half_steps_per_unit();
                prop_assert!(miss <= 0.5 + 1e-9, "{} misses by {miss} half-steps", joint.name());
            }
        }

        #[test]
        fn a_declared_pose_is_what_the_registers_then_say(registers in registers(), pose in prop::array::uniform6(-3.0..3.0_f64)) {
            let joints = straight_out().declared(pose, registers).joints(registers);
            for (joint, pose) in joints.iter().zip(pose) {
                prop_assert!((joint - pose).abs() < 1e-12);
            }
        }

        #[test]
        fn joints_that_do_not_move_keep_their_values(start in registers(), target in prop::array::uniform6(-2.0..2.0_f64), mask in 0..64_u32) {
            let zero = straight_out();
            let end = zero.registers(start, &target, |joint| mask & (1 << joint.index()) != 0);
            let (before, after) = (zero.joints(start), zero.joints(end));
            for joint in Joint::ALL {
                let shares_motors = matches!(joint, Joint::WristPitch | Joint::WristRoll) && mask & 0b11000 == 0b11000;
                if mask & (1 << joint.index()) == 0 && !shares_motors {
                    prop_assert!((before[joint.index()] - after[joint.index()]).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn the_gripper_follows_the_elbow_so_that_the_opening_stays() {
        let end = straight_out()
            .registers(HalfSteps::default(), &[0.0, 0.0, -1.0, 0.0, 0.0, 0.0], |joint| joint == Joint::Elbow);
        assert_eq!(end, HalfSteps([0, 0, 662, 0, 0, 662]));
        assert_eq!(GripperCable::default().opening(HalfSteps::default(), end), 0);
    }

    #[test]
    fn a_worn_cable_takes_the_gripper_along_by_less() {
        let worn = straight_out().with_cable(GripperCable::following(0.75));
        let elbow = |by: f64| {
            let target = [0.0, 0.0, by, 0.0, 0.0, 0.0];
            worn.registers(HalfSteps::default(), &target, |joint| joint == Joint::Elbow)
        };
        let down = elbow(-1.0);
        assert_eq!(down, HalfSteps([0, 0, 662, 0, 0, 497]));
        assert_eq!(worn.joints(down)[Joint::Gripper.index()], 0.0);
        // In pieces it comes to the same.
        let mut here = HalfSteps::default();
        for _ in 0..662 {
            let piece = worn.cable().holding_the_opening(here, HalfSteps([0, 0, 1, 0, 0, 0]));
            assert_eq!(worn.cable().opening(here, piece), 0);
            here = piece.after(here);
        }
        assert_eq!(here, down);
    }

    #[test]
    fn a_gripper_of_another_figure_opens_by_it() {
        // 2330 an inch, as one owner's program has it.
        let cable = GripperCable::default().with_half_steps_per_mm(2330.0 / 25.4);
        let zero = straight_out().with_cable(cable);
        let open = zero.registers(HalfSteps::default(), &[0.0, 0.0, 0.0, 0.0, 0.0, 25.4], |joint| {
            joint == Joint::Gripper
        });
        assert_eq!(open, HalfSteps([0, 0, 0, 0, 0, 2330]));
        assert!((zero.joints(open)[Joint::Gripper.index()] - 25.4).abs() < 1e-9);
    }

    #[test]
    fn a_reversed_motor_counts_the_other_way_and_back_again() {
        let senses = Senses::reversed(&[0, 5]);
        let counts = HalfSteps([1, 2, 3, 4, 5, 6]);
        assert_eq!(counts.turned(senses), HalfSteps([-1, 2, 3, 4, 5, -6]));
        assert_eq!(counts.turned(senses).turned(senses), counts);
    }

    #[test]
    fn the_manuals_start_position_has_its_register_values() {
        // Fingertips 5 in out on the table, hand hanging, with the manual's shoulder height of 7.625 in and links of 7 and 3.8 in:
        // its programs load 0, -508 and 1162 (the formula gives 1163), and 384 for either wrist motor.
        let (radius, height) = (5.0_f64, 3.8 - 7.625);
        let reach = radius.hypot(height);
        let half_angle = (reach / 14.0).acos();
        let shoulder = height.atan2(radius) + half_angle;
        let elbow = height.atan2(radius) - half_angle;
        let hanging = -TAU / 4.0;
        let registers = straight_out().registers(
            HalfSteps::default(),
            &[0.0, shoulder, elbow, hanging, 0.0, 0.0],
            |_| true,
        );
        assert_eq!(registers.0[..5], [0, -508, 1163, 384, 384]);
    }

    #[test]
    fn rolling_turns_the_wrist_motors_against_each_other() {
        let end =
            straight_out().registers(HalfSteps::default(), &[0.0, 0.0, 0.0, 0.0, TAU / 4.0, 0.0], |joint| {
                joint == Joint::WristRoll
            });
        assert_eq!(end, HalfSteps([0, 0, 0, -384, 384, 0]));
    }
}
