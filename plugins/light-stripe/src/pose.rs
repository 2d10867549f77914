//! Where the robot was at a moment, from what it told before and after.

use std::collections::VecDeque;

use plumb_plugin::{JointState, JointVector};

/// How many states are remembered: some seconds of a fast robot's.
const REMEMBERED: usize = 4096;

/// The way of a robot through the last seconds.
#[derive(Debug, Default)]
pub(crate) struct Way {
    states: VecDeque<JointState>,
}

/// Where the robot was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Pose {
    /// There, and so fast, rad/s or mm/s.
    At(JointVector, JointVector),
    /// What it tells next will say.
    NotYet,
    /// It has been forgotten, or was never told.
    Unknown,
}

impl Way {
    pub(crate) fn add(&mut self, state: JointState) {
        if self.states.back().is_some_and(|last| state.time_ns < last.time_ns) {
            // A clock that goes back is another clock: a world or controller that was started anew.
            self.states.clear();
        }
        if self.states.len() == REMEMBERED {
            self.states.pop_front();
        }
        self.states.push_back(state);
    }

    pub(crate) fn forget(&mut self) {
        self.states.clear();
    }

    /// How fast it went when it last told where it was.
    fn last_speeds(&self) -> JointVector {
        let mut last = self.states.iter().rev();
        match (last.next(), last.next()) {
            (Some(last), Some(before)) => match between(before, last, last.time_ns) {
                Pose::At(_, speeds) => speeds,
                Pose::NotYet | Pose::Unknown => JointVector::zeros(last.joints.len()),
            },
            (Some(last), None) => JointVector::zeros(last.joints.len()),
            _ => JointVector::zeros(0),
        }
    }

    /// Where the robot was at a moment, interpolated between what it told.
    pub(crate) fn at(&self, time_ns: u64) -> Pose {
        let after = self.states.partition_point(|state| state.time_ns <= time_ns);
        let Some(before) = after.checked_sub(1).and_then(|before| self.states.get(before)) else {
            return if self.states.is_empty() { Pose::NotYet } else { Pose::Unknown };
        };
        match self.states.get(after) {
            Some(next) => between(before, next, time_ns),
            None if !before.is_moving() => Pose::At(before.joints, JointVector::zeros(before.joints.len())),
            None if before.time_ns == time_ns => Pose::At(before.joints, self.last_speeds()),
            None => Pose::NotYet,
        }
    }
}

fn between(before: &JointState, next: &JointState, time_ns: u64) -> Pose {
    let span = next.time_ns.saturating_sub(before.time_ns).max(1) as f64;
    let share = time_ns.saturating_sub(before.time_ns) as f64 / span;
    let (mut joints, mut speeds) = (before.joints, JointVector::zeros(before.joints.len()));
    let each = joints.as_mut_slice().iter_mut().zip(speeds.as_mut_slice()).zip(next.joints.as_slice());
    for ((joint, speed), to) in each {
        let way = to - *joint;
        *speed = way / (span * 1e-9);
        *joint += way * share;
    }
    Pose::At(joints, speeds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(states: &[(u64, f64, bool)]) -> Way {
        let mut way = Way::default();
        for (time_ns, joint, moving) in states {
            way.add(JointState::new(*time_ns, JointVector::from_slice(&[*joint]).unwrap(), *moving));
        }
        way
    }

    fn joint(pose: Pose) -> Option<f64> {
        match pose {
            Pose::At(joints, _) => joints.get(0),
            Pose::NotYet | Pose::Unknown => None,
        }
    }

    #[test]
    fn a_pose_between_two_that_were_told_is_interpolated() {
        let way = way(&[(100, 0.0, true), (200, 1.0, true)]);
        assert_eq!(joint(way.at(150)), Some(0.5));
        assert_eq!(joint(way.at(200)), Some(1.0));
    }

    #[test]
    fn how_fast_it_went_is_told_beside_where_it_was() {
        let speed = |way: &Way, time_ns| match way.at(time_ns) {
            Pose::At(_, speeds) => speeds.get(0),
            Pose::NotYet | Pose::Unknown => None,
        };
        let moving = way(&[(0, 0.0, false), (500_000_000, 1.0, true), (1_000_000_000, 3.0, true)]);
        assert_eq!(speed(&moving, 250_000_000), Some(2.0));
        assert_eq!(speed(&moving, 750_000_000), Some(4.0));
        assert_eq!(speed(&moving, 1_000_000_000), Some(4.0));
        assert_eq!(speed(&way(&[(0, 0.0, true), (500_000_000, 1.0, false)]), 600_000_000), Some(0.0));
    }

    #[test]
    fn beyond_what_was_told_a_moving_arm_is_waited_for_and_a_resting_one_is_there() {
        assert_eq!(way(&[(100, 0.0, true), (200, 1.0, true)]).at(201), Pose::NotYet);
        assert_eq!(joint(way(&[(100, 0.0, true), (200, 1.0, false)]).at(900)), Some(1.0));
        assert_eq!(way(&[(100, 0.0, false)]).at(99), Pose::Unknown);
        assert_eq!(Way::default().at(5), Pose::NotYet);
    }
}
