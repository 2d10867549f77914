//! The drive of a TeachMover: six stepper motors, and the joint values its controller computes from their half-steps.
//!
//! The cables keep attitudes: the shoulder's motor turns the upper arm alone, so `shoulder`, `elbow` (the forearm) and
//! `wrist_pitch` are absolute angles from the horizontal, positive upward. The two wrist motors work a differential, and
//! the gripper's cable runs over the elbow, so that its opening is the difference of two motors.

use std::f64::consts::TAU;

/// How many joints, and how many motors, the arm has.
pub const AXES: usize = 6;

/// Half-steps of each motor for one turn of its joint: base, shoulder, elbow, right wrist, left wrist.
pub const HALF_STEPS_PER_TURN: [f64; 5] = [7072.0, 7072.0, 4158.0, 1536.0, 1536.0];

/// Half-steps of the gripper's motor for one millimetre of opening: 371 for an inch.
pub const GRIPPER_HALF_STEPS_PER_MM: f64 = 371.0 / 25.4;

/// One joint, in the order in which every list of joint values is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Joint {
    /// About the vertical axis.
    Waist,
    /// Attitude of the upper arm.
    Shoulder,
    /// Attitude of the forearm.
    Elbow,
    /// Attitude of the hand.
    WristPitch,
    /// Turn of the hand about its own axis.
    WristRoll,
    /// Opening of the fingers.
    Gripper,
}

impl Joint {
    /// Every joint, in order.
    pub const ALL: [Joint; AXES] =
        [Joint::Waist, Joint::Shoulder, Joint::Elbow, Joint::WristPitch, Joint::WristRoll, Joint::Gripper];

    /// The name a user writes.
    pub const fn name(self) -> &'static str {
        match self {
            Joint::Waist => "waist",
            Joint::Shoulder => "shoulder",
            Joint::Elbow => "elbow",
            Joint::WristPitch => "wrist_pitch",
            Joint::WristRoll => "wrist_roll",
            Joint::Gripper => "gripper",
        }
    }

    /// The joint a user means, if there is one of that name.
    pub fn named(name: &str) -> Option<Joint> {
        Joint::ALL.into_iter().find(|joint| joint.name() == name)
    }

    /// The joint's index in a list of joint values.
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// Joint values in the order of [`Joint::ALL`]: rad, and mm for the gripper.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Joints(pub [f64; AXES]);

impl Joints {
    /// The values of the arm's drives, one a joint.
    pub(super) fn of_drives(values: &[f64]) -> Joints {
        Joints(std::array::from_fn(|axis| values.get(axis).copied().unwrap_or_default()))
    }

    /// One joint's value, rad or mm.
    pub fn of(&self, joint: Joint) -> f64 {
        self.0[joint.index()]
    }

    /// The sum, joint by joint.
    pub fn plus(&self, other: &Joints) -> Joints {
        Joints(std::array::from_fn(|axis| self.0[axis] + other.0[axis]))
    }

    /// The difference, joint by joint.
    pub fn minus(&self, other: &Joints) -> Joints {
        Joints(std::array::from_fn(|axis| self.0[axis] - other.0[axis]))
    }

    /// The value furthest from zero, without its sign.
    pub fn largest(&self) -> f64 {
        self.0.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()))
    }
}

/// Positions of the motors in half-steps: base, shoulder, elbow, right wrist, left wrist, gripper.
///
/// Positive as the controller counts: base left, shoulder down, elbow down, pitch down, gripper open.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct HalfSteps(pub [f64; AXES]);

impl HalfSteps {
    /// The motor positions that correspond to these joint values.
    pub fn from_joints(joints: &Joints) -> HalfSteps {
        let [waist, shoulder, elbow, wrist_pitch, wrist_roll, opening] = joints.0;
        let [base_turn, shoulder_turn, elbow_turn, right_turn, left_turn] = HALF_STEPS_PER_TURN;
        let elbow_motor = -elbow * elbow_turn / TAU;
        HalfSteps([
            waist * base_turn / TAU,
            -shoulder * shoulder_turn / TAU,
            elbow_motor,
            -(wrist_pitch + wrist_roll) * right_turn / TAU,
            (wrist_roll - wrist_pitch) * left_turn / TAU,
            opening * GRIPPER_HALF_STEPS_PER_MM + elbow_motor,
        ])
    }

    /// The joint values the controller computes from these positions.
    pub fn to_joints(&self) -> Joints {
        let [base, shoulder, elbow, right, left, gripper] = self.0;
        let [base_turn, shoulder_turn, elbow_turn, right_turn, left_turn] = HALF_STEPS_PER_TURN;
        let right_angle = right * TAU / right_turn;
        let left_angle = left * TAU / left_turn;
        Joints([
            base * TAU / base_turn,
            -shoulder * TAU / shoulder_turn,
            -elbow * TAU / elbow_turn,
            -(right_angle + left_angle) / 2.0,
            (left_angle - right_angle) / 2.0,
            (gripper - elbow) / GRIPPER_HALF_STEPS_PER_MM,
        ])
    }

    /// The sum, motor by motor.
    pub fn plus(&self, other: &HalfSteps) -> HalfSteps {
        HalfSteps(std::array::from_fn(|axis| self.0[axis] + other.0[axis]))
    }

    /// The difference, motor by motor.
    pub fn minus(&self, other: &HalfSteps) -> HalfSteps {
        HalfSteps(std::array::from_fn(|axis| self.0[axis] - other.0[axis]))
    }

    /// Every motor's position times a factor.
    pub fn times(&self, factor: f64) -> HalfSteps {
        HalfSteps(self.0.map(|position| position * factor))
    }

    /// Every motor's position at the nearest whole half-step. A position within a millionth of the middle between two goes to
    /// the one further from `from`: an edge found on a half-step is reported in its middle, and anyone who returns there from the
    /// same side shall have it behind him.
    pub fn rounded_from(&self, from: &HalfSteps) -> HalfSteps {
        HalfSteps(std::array::from_fn(|axis| {
            let travel = self.0[axis] - from.0[axis];
            let whole = (travel.abs() + 0.5 + 1e-6).floor();
            from.0[axis] + whole.copysign(travel)
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn any_joints() -> impl Strategy<Value = Joints> {
        prop::array::uniform6(-3.0..3.0_f64).prop_map(Joints)
    }

    proptest! {
        #[test]
        fn motors_and_joints_convert_both_ways(joints in any_joints()) {
            let there_and_back = HalfSteps::from_joints(&joints).to_joints();
            prop_assert!(there_and_back.minus(&joints).largest() < 1e-14);
        }

        #[test]
        fn rounding_moves_no_motor_more_than_half_a_half_step(
            requested in prop::array::uniform6(-3000.0..3000.0_f64),
            from in prop::array::uniform6(-3000..3000_i32),
        ) {
            let from = HalfSteps(from.map(f64::from));
            let rounded = HalfSteps(requested).rounded_from(&from);
            for (rounded, requested) in rounded.0.iter().zip(requested) {
                prop_assert_eq!(rounded.fract(), 0.0);
                prop_assert!((rounded - requested).abs() <= 0.5 + 2e-6);
            }
        }
    }

    #[test]
    fn a_turn_of_the_waist_is_7072_half_steps() {
        let motors = HalfSteps::from_joints(&Joints([TAU, 0.0, 0.0, 0.0, 0.0, 0.0]));
        assert_eq!(motors, HalfSteps([7072.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn holding_the_opening_takes_the_gripper_motor_along_with_the_elbow() {
        let motors = HalfSteps::from_joints(&Joints([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]));
        assert_eq!(motors.0[2], motors.0[5]);
        assert_eq!(motors.to_joints().of(Joint::Gripper), 0.0);
    }

    #[test]
    fn the_middle_between_two_half_steps_goes_to_the_further_one() {
        let from = HalfSteps([10.0; AXES]);
        assert_eq!(HalfSteps([7.5; AXES]).rounded_from(&from), HalfSteps([7.0; AXES]));
        assert_eq!(HalfSteps([12.5; AXES]).rounded_from(&from), HalfSteps([13.0; AXES]));
    }
}
