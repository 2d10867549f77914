//! The limits of a move, checked in the host whatever was checked before.

use plumb_plugin::{JointDescription, JointUnit, JointVector, Motion, PluginError, RobotDescription};

use crate::JointRange;

/// A check of where a move leads, beyond the joints' ranges: keep-out volumes.
pub trait MoveGuard {
    /// Whether the robot may go from one pose to another (rad, or mm where the description says so).
    ///
    /// # Errors
    /// Why not, for an operator.
    fn check(&self, from: &JointVector, to: &JointVector) -> Result<(), String>;
}

/// No check beyond the joints' ranges.
#[derive(Clone, Copy, Debug)]
pub struct NoGuard;

impl MoveGuard for NoGuard {
    fn check(&self, _from: &JointVector, _to: &JointVector) -> Result<(), String> {
        Ok(())
    }
}

/// How far past its end a joint may be asked to go: what rounding makes of a move exactly to the end.
const ROUNDING: f64 = 1e-9;

/// The ranges of a robot's joints, narrowed by the cell's.
pub(crate) struct Limits {
    joints: Vec<JointDescription>,
}

impl Limits {
    /// The robot's own ranges narrowed by the cell's.
    pub(crate) fn new(robot: &RobotDescription, ranges: &[JointRange]) -> Result<Self, PluginError> {
        let mut joints = robot.joints.clone();
        for range in ranges {
            let Some(joint) = joints.iter_mut().find(|joint| joint.name == range.joint) else {
                let names: Vec<&str> = robot.joints.iter().map(|joint| joint.name.as_str()).collect();
                return Err(PluginError::Refused(format!(
                    "a range is given for joint '{}'; the robot's joints are {}",
                    range.joint,
                    names.join(", ")
                )));
            };
            joint.lower = joint.lower.max(range.lower);
            joint.upper = joint.upper.min(range.upper);
        }
        Ok(Self { joints })
    }

    /// Whether a move makes sense at all for this robot.
    pub(crate) fn check_motion(&self, motion: &Motion) -> Result<(), PluginError> {
        if motion.target.len() != self.joints.len() {
            return Err(PluginError::Refused(format!(
                "the move has {} joint values; the robot has {} joints",
                motion.target.len(),
                self.joints.len()
            )));
        }
        if !(motion.speed_fraction > 0.0 && motion.speed_fraction <= 1.0) {
            return Err(PluginError::Refused(format!(
                "the move's speed is {} of full speed; give more than 0 and at most 1",
                motion.speed_fraction
            )));
        }
        let bad = (0..motion.target.len())
            .find(|joint| motion.moves(*joint) && !motion.target.get(*joint).is_some_and(f64::is_finite));
        match bad.and_then(|joint| self.joints.get(joint)) {
            Some(joint) => Err(PluginError::Refused(format!("the target of {} is not a number", joint.name))),
            None => Ok(()),
        }
    }

    /// Whether a move from a pose ends within every moving joint's range. A joint outside its range may come back towards it.
    pub(crate) fn check_end(&self, motion: &Motion, from: &JointVector) -> Result<JointVector, PluginError> {
        let end = motion.end_from(from);
        for (index, joint) in self.joints.iter().enumerate().filter(|(index, _)| motion.moves(*index)) {
            let (Some(start), Some(end)) = (from.get(index), end.get(index)) else { continue };
            let too_low = end < joint.lower - ROUNDING && end < start;
            let too_high = end > joint.upper + ROUNDING && end > start;
            if too_low || too_high {
                return Err(PluginError::OutOfRange(format!(
                    "{} would go to {}; it may go from {} to {}",
                    joint.name,
                    shown(end, joint.unit),
                    shown(joint.lower, joint.unit),
                    shown(joint.upper, joint.unit)
                )));
            }
        }
        Ok(end)
    }
}

/// A joint's number as an operator reads it.
fn shown(value: f64, unit: JointUnit) -> String {
    match unit {
        JointUnit::Radian => format!("{:.2} deg", value.to_degrees()),
        JointUnit::Millimetre => format!("{value:.2} mm"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::RobotCapabilities;

    fn robot() -> RobotDescription {
        let joint = |name: &str, unit, lower, upper| JointDescription {
            name: name.to_owned(),
            unit,
            lower,
            upper,
            resolution: 0.0,
            max_speed: 1.0,
            home: 0.0,
        };
        RobotDescription {
            model: "test".to_owned(),
            joints: vec![
                joint("waist", JointUnit::Radian, -1.0, 1.0),
                joint("gripper", JointUnit::Millimetre, 0.0, 75.0),
            ],
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities::default(),
        }
    }

    fn vector(waist: f64, gripper: f64) -> JointVector {
        JointVector::from_slice(&[waist, gripper]).unwrap()
    }

    fn refusal(motion: &Motion, from: &JointVector) -> String {
        let range = JointRange { joint: "gripper".to_owned(), lower: -5.0, upper: 50.0 };
        let limits = Limits::new(&robot(), &[range]).unwrap();
        let checked = limits.check_motion(motion).and_then(|()| limits.check_end(motion, from).map(|_| ()));
        checked.unwrap_err().to_string()
    }

    #[test]
    fn a_move_past_a_joints_end_is_refused_with_its_range() {
        let motion = Motion::relative(vector(0.5, 0.0), 1.0);
        let message = refusal(&motion, &vector(0.8, 0.0));
        assert_eq!(message, "waist would go to 74.48 deg; it may go from -57.30 deg to 57.30 deg");
    }

    #[test]
    fn the_cells_range_narrows_the_robots_and_never_widens_it() {
        let message = refusal(&Motion::absolute(vector(0.0, 60.0), 1.0), &vector(0.0, 0.0));
        assert_eq!(message, "gripper would go to 60.00 mm; it may go from 0.00 mm to 50.00 mm");
        let message = refusal(&Motion::absolute(vector(0.0, -1.0), 1.0), &vector(0.0, 0.0));
        assert_eq!(message, "gripper would go to -1.00 mm; it may go from 0.00 mm to 50.00 mm");
    }

    #[test]
    fn a_wider_range_of_the_cell_leaves_the_robots_own() {
        let wide = JointRange { joint: "gripper".to_owned(), lower: -500.0, upper: 500.0 };
        let limits = Limits::new(&robot(), &[wide]).unwrap();
        let own = robot().joints[1].clone();
        let at = |millimetres: f64| {
            limits.check_end(&Motion::absolute(vector(0.0, millimetres), 1.0), &vector(0.0, 1.0))
        };
        assert!(at(own.upper).is_ok() && at(own.lower).is_ok());
        for beyond in [own.upper + 0.1, own.lower - 0.1] {
            let message = at(beyond).unwrap_err().to_string();
            assert!(message.contains("it may go from 0.00 mm to 75.00 mm"), "{message}");
        }
    }

    #[test]
    fn a_joint_outside_its_range_may_come_back() {
        let limits = Limits::new(&robot(), &[]).unwrap();
        let motion = Motion::relative(vector(-0.1, 0.0), 1.0);
        assert!(limits.check_end(&motion, &vector(1.5, 0.0)).is_ok());
    }

    #[test]
    fn a_joint_outside_its_range_may_stay_and_may_not_go_further() {
        let limits = Limits::new(&robot(), &[]).unwrap();
        for (outside, further) in [(1.5, 1.6), (-1.5, -1.6)] {
            let from = vector(outside, 0.0);
            assert!(limits.check_end(&Motion::absolute(from, 1.0), &from).is_ok());
            assert!(limits.check_end(&Motion::absolute(vector(further, 0.0), 1.0), &from).is_err());
        }
    }

    #[test]
    fn both_ends_of_a_range_can_be_reached_and_neither_passed() {
        let limits = Limits::new(&robot(), &[]).unwrap();
        let ends_at = |waist: f64| {
            limits.check_end(&Motion::absolute(vector(waist, 10.0), 1.0), &vector(0.0, 10.0)).is_ok()
        };
        assert!(ends_at(1.0) && ends_at(-1.0));
        assert!(ends_at(1.0 + 0.5 * ROUNDING) && ends_at(-1.0 - 0.5 * ROUNDING));
        assert!(!ends_at(1.0 + 2.0 * ROUNDING) && !ends_at(-1.0 - 2.0 * ROUNDING));
    }

    #[test]
    fn a_speed_is_above_0_and_at_most_1() {
        let limits = Limits::new(&robot(), &[]).unwrap();
        let goes = |speed| limits.check_motion(&Motion::absolute(vector(0.0, 0.0), speed)).is_ok();
        assert!(goes(1.0) && goes(1e-9));
        assert!(![0.0, -0.5, 1.1, f64::NAN, f64::INFINITY].into_iter().any(goes));
    }

    #[test]
    fn a_joint_that_does_not_take_part_is_not_checked() {
        let limits = Limits::new(&robot(), &[]).unwrap();
        let motion = Motion::absolute(vector(f64::NAN, 10.0), 1.0).only(0b10);
        assert!(limits.check_motion(&motion).is_ok());
        assert!(limits.check_end(&motion, &vector(1.5, 0.0)).is_ok());
    }

    #[test]
    fn nonsense_is_refused() {
        let from = vector(0.0, 0.0);
        let target = JointVector::from_slice(&[0.0]).unwrap();
        assert_eq!(
            refusal(&Motion::absolute(target, 1.0), &from),
            "the move has 1 joint values; the robot has 2 joints"
        );
        assert_eq!(
            refusal(&Motion::absolute(vector(f64::NAN, 0.0), 1.0), &from),
            "the target of waist is not a number"
        );
        assert_eq!(
            refusal(&Motion::absolute(vector(0.0, 0.0), 0.0), &from),
            "the move's speed is 0 of full speed; give more than 0 and at most 1"
        );
    }

    #[test]
    fn a_range_for_an_unknown_joint_is_refused() {
        let range = JointRange { joint: "wrist".to_owned(), lower: 0.0, upper: 1.0 };
        let message = Limits::new(&robot(), &[range]).map(|_| ()).unwrap_err().to_string();
        assert_eq!(message, "a range is given for joint 'wrist'; the robot's joints are waist, gripper");
    }
}
