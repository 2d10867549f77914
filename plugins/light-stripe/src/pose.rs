//! Where the robot was at a moment, from what it reported before and after.

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
    /// What it reports next will say.
    NotYet,
    /// The moment lies so long before the first pose that is remembered, ns.
    Before(u64),
    /// It was at rest before, and elsewhere after: when it set out and how it went it has not reported.
    Untold,
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

    /// How fast it went when it last reported where it was.
    fn last_speeds(&self) -> JointVector {
        let mut last = self.states.iter().rev();
        match (last.next(), last.next()) {
            (Some(last), Some(before)) => match between(before, last, last.time_ns) {
                Pose::At(_, speeds) => speeds,
                _ => JointVector::zeros(last.joints.len()),
            },
            (Some(last), None) => JointVector::zeros(last.joints.len()),
            _ => JointVector::zeros(0),
        }
    }

    /// Where the robot was at a moment, interpolated between what it reported.
    pub(crate) fn at(&self, time_ns: u64) -> Pose {
        let after = self.states.partition_point(|state| state.time_ns <= time_ns);
        let Some(before) = after.checked_sub(1).and_then(|before| self.states.get(before)) else {
            return self.states.front().map_or(Pose::NotYet, |first| Pose::Before(first.time_ns - time_ns));
        };
        match self.states.get(after) {
            Some(next) if !before.is_moving() && before.time_ns < time_ns && !is_same_pose(before, next) => {
                Pose::Untold
            }
            Some(next) => between(before, next, time_ns),
            None if !before.is_moving() => Pose::At(before.joints, JointVector::zeros(before.joints.len())),
            None if before.time_ns == time_ns => Pose::At(before.joints, self.last_speeds()),
            None => Pose::NotYet,
        }
    }
}

/// A drive at rest reports its joints alike to within its last digit; less than this moves no point of an arm by more than 0.01 mm, rad or mm.
const SAME_POSE: f64 = 1e-5;

fn is_same_pose(before: &JointState, next: &JointState) -> bool {
    let mut ways = before.joints.as_slice().iter().zip(next.joints.as_slice()).map(|(from, to)| to - from);
    ways.all(|way| way.abs() <= SAME_POSE)
}

fn between(before: &JointState, next: &JointState, time_ns: u64) -> Pose {
    let span = next.time_ns.saturating_sub(before.time_ns).max(1) as f64;
    let fraction = time_ns.saturating_sub(before.time_ns) as f64 / span;
    let (mut joints, mut speeds) = (before.joints, JointVector::zeros(before.joints.len()));
    let each = joints.as_mut_slice().iter_mut().zip(speeds.as_mut_slice()).zip(next.joints.as_slice());
    for ((joint, speed), to) in each {
        let way = to - *joint;
        *speed = way / (span * 1e-9);
        *joint += way * fraction;
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
            _ => None,
        }
    }

    #[test]
    fn a_pose_between_two_that_were_reported_is_interpolated() {
        let way = way(&[(100, 0.0, true), (200, 1.0, true)]);
        assert_eq!(joint(way.at(150)), Some(0.5));
        assert_eq!(joint(way.at(200)), Some(1.0));
    }

    #[test]
    fn how_fast_it_went_is_reported_beside_where_it_was() {
        let speed = |way: &Way, time_ns| match way.at(time_ns) {
            Pose::At(_, speeds) => speeds.get(0),
            _ => None,
        };
        let moving = way(&[(0, 0.0, true), (500_000_000, 1.0, true), (1_000_000_000, 3.0, true)]);
        assert_eq!(speed(&moving, 250_000_000), Some(2.0));
        assert_eq!(speed(&moving, 750_000_000), Some(4.0));
        assert_eq!(speed(&moving, 1_000_000_000), Some(4.0));
        assert_eq!(speed(&way(&[(0, 0.0, true), (500_000_000, 1.0, false)]), 600_000_000), Some(0.0));
    }

    #[test]
    fn beyond_what_was_reported_a_moving_arm_is_waited_for_and_a_resting_one_is_there() {
        assert_eq!(way(&[(100, 0.0, true), (200, 1.0, true)]).at(201), Pose::NotYet);
        assert_eq!(joint(way(&[(100, 0.0, true), (200, 1.0, false)]).at(900)), Some(1.0));
        assert_eq!(way(&[(100, 0.0, false)]).at(99), Pose::Before(1));
        assert_eq!(Way::default().at(5), Pose::NotYet);
    }

    #[test]
    fn where_an_arm_was_that_reports_nothing_on_its_way_is_not_made_up() {
        let way = way(&[(100, 0.0, false), (200, 0.0, false), (300, 1.0, false)]);
        assert_eq!(joint(way.at(150)), Some(0.0));
        assert_eq!(joint(way.at(200)), Some(0.0));
        assert_eq!(way.at(201), Pose::Untold);
        assert_eq!(way.at(299), Pose::Untold);
        assert_eq!(joint(way.at(300)), Some(1.0));
    }
}
