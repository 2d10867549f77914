//! What is known of a robot before a run: how fast its joints go, and where they are when a step begins, as far as the steps before it show.

use nalgebra::{IsometryMatrix3, Vector3};
use plumb_kinematics::inverse;

use super::geometry::Geometry;
use super::known_point::{RequestedTip, joints_for_tip};
use crate::deg_or_mm::DegOrMm;
use crate::joint_range::JointRange;

/// How long a robot takes to receive a move and to answer, where nobody knows, s.
const TYPICAL_COMMAND_S: f64 = 0.02;

/// Full speed of a joint that turns and that nobody knows, rad/s: 17 deg/s, a slow arm.
const TYPICAL_TURNING_SPEED: f64 = 0.3;

/// Full speed of a joint that slides and that nobody knows, mm/s: a slow axis with a screw.
const TYPICAL_SLIDING_SPEED: f64 = 50.0;

/// How far a joint turns that is sent to a position, or from one, that is not known yet: a typical way, rad.
pub(super) const TYPICAL_TURN: f64 = 0.3;

/// How far a joint slides that is sent to a position, or from one, that is not known yet: a typical way, mm.
const TYPICAL_SLIDE: f64 = 50.0;

/// What a robot says of a joint once it is started, or what is known of it without that.
#[derive(Debug, Clone, PartialEq)]
pub struct JointFacts {
    /// As the device names it.
    pub name: String,
    /// Full speed, rad/s or mm/s.
    pub max_speed: f64,
    /// Where it is when the run begins, rad or mm, where that is known.
    pub start: Option<f64>,
}

/// What is known of a robot without asking it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RobotFacts {
    /// The device.
    pub robot: String,
    /// Its joints.
    pub joints: Vec<JointFacts>,
    /// How far its joints go, by what it allows itself, where that is known.
    pub ranges: Vec<JointRange>,
    /// Full speed of joints that turn and are not listed, rad/s.
    pub turning_speed: Option<f64>,
    /// Full speed of joints that slide and are not listed, mm/s.
    pub sliding_speed: Option<f64>,
    /// How long it takes to receive a move and to answer that it has ended, beside the motion itself, s.
    pub command_s: Option<f64>,
}

/// A robot as the steps of a plan find it, one after the other.
#[derive(Clone)]
pub(crate) struct KnownRobot<'a> {
    name: &'a str,
    /// As the cell lists them.
    joints: &'a [(String, DegOrMm)],
    geometry: Option<&'a dyn Geometry>,
    facts: RobotFacts,
    /// Where the joints of the cell's list are, rad or mm.
    positions: Vec<Option<f64>>,
}

impl<'a> KnownRobot<'a> {
    /// As the run begins.
    pub(crate) fn new(
        name: &'a str,
        joints: &'a [(String, DegOrMm)],
        geometry: Option<&'a dyn Geometry>,
        facts: Option<&RobotFacts>,
    ) -> Self {
        let facts = facts.cloned().unwrap_or_default();
        let start = |(name, _): &(String, _)| facts.joints.iter().find(|joint| joint.name == *name)?.start;
        let positions = joints.iter().map(start).collect();
        Self { name, joints, geometry, facts, positions }
    }

    /// The device.
    pub(crate) fn name(&self) -> &str {
        self.name
    }

    /// How long it takes to receive a move and to answer, s.
    pub(crate) fn command_s(&self) -> f64 {
        self.facts.command_s.unwrap_or(TYPICAL_COMMAND_S)
    }

    /// Full speed of a joint, rad/s or mm/s.
    pub(crate) fn full_speed(&self, joint: &str) -> f64 {
        let listed = self.facts.joints.iter().find(|known| known.name == joint).map(|known| known.max_speed);
        let (alike, typical) = match self.slides(joint) {
            true => (self.facts.sliding_speed, TYPICAL_SLIDING_SPEED),
            false => (self.facts.turning_speed, TYPICAL_TURNING_SPEED),
        };
        listed.or(alike).map_or(typical, |speed| speed.max(1e-3))
    }

    fn slides(&self, joint: &str) -> bool {
        self.unit(joint) == Some(DegOrMm::Mm)
    }

    /// How far a joint goes when nobody knows, rad or mm.
    fn typical_way(&self, joint: &str) -> f64 {
        if self.slides(joint) { TYPICAL_SLIDE } else { TYPICAL_TURN }
    }

    /// Where a joint is, rad or mm, as far as that is known.
    pub(crate) fn position(&self, joint: &str) -> Option<f64> {
        let listed = self.joints.iter().position(|(name, _)| name == joint)?;
        self.positions.get(listed).copied().flatten()
    }

    /// The unit of a joint.
    pub(crate) fn unit(&self, joint: &str) -> Option<DegOrMm> {
        self.joints.iter().find(|(name, _)| name == joint).map(|(_, unit)| *unit)
    }

    /// The robot once it has gone to these positions.
    pub(crate) fn gone<'j>(&self, goals: impl IntoIterator<Item = (&'j str, Option<f64>)>) -> Self {
        let mut there = self.clone();
        there.went(goals);
        there
    }

    /// How long joints take to these positions at full speed, all starting and ending together, s. `None` means a position that is not known.
    pub(crate) fn way_s<'j>(&self, goals: impl IntoIterator<Item = (&'j str, Option<f64>)>) -> f64 {
        let times = goals.into_iter().map(|(joint, goal)| {
            let way = self.position(joint).zip(goal);
            let way = way.map_or_else(|| self.typical_way(joint), |(here, goal)| (goal - here).abs());
            way / self.full_speed(joint)
        });
        times.fold(0.0, f64::max)
    }

    /// The joints with a position each, for a list of positions.
    pub(crate) fn named<'s>(&'s self, positions: &'s [f64]) -> impl Iterator<Item = (&'s str, Option<f64>)> {
        let names = self.joints.iter().map(|(name, _)| name.as_str());
        names.zip(positions.iter().copied().map(Some))
    }

    /// All joints, their positions not known.
    pub(crate) fn anywhere(&self) -> impl Iterator<Item = (&str, Option<f64>)> {
        self.joints.iter().map(|(name, _)| (name.as_str(), None))
    }

    /// The joints nearest to where they are that bring the flange somewhere, in the order of the cell's list; none where it is not known where all of them are, for from
    /// another start they may come out otherwise.
    pub(crate) fn joints_for(&self, flange: &IsometryMatrix3<f64>) -> Option<Vec<f64>> {
        let geometry = self.geometry?;
        let start: Option<Vec<f64>> = self.positions.iter().copied().collect();
        inverse(|joints| geometry.flange(joints), flange, &start?).ok()
    }

    /// The positions of the joints `by` that bring the model's point somewhere (mm, in the model's frame of measurements), the others going where `goals` say.
    pub(crate) fn joints_for_tip(
        &self,
        (xyz_mm, target): (Vector3<f64>, Option<&str>),
        by: &[&str],
        goals: &[(String, Option<f64>)],
    ) -> Option<Vec<f64>> {
        let there = self.gone(goals.iter().map(|(joint, goal)| (joint.as_str(), *goal)));
        let start: Option<Vec<f64>> = there.positions.iter().copied().collect();
        let by = by.iter().map(|joint| {
            let listed = self.joints.iter().position(|(name, _)| name == joint)?;
            Some((listed, self.joints.get(listed)?.1 == DegOrMm::Mm))
        });
        let requested = RequestedTip { xyz_mm, target, by: by.collect::<Option<Vec<_>>>()? };
        joints_for_tip(self.geometry?, &start?, &requested)
    }

    /// It has gone to these positions.
    pub(crate) fn went<'j>(&mut self, goals: impl IntoIterator<Item = (&'j str, Option<f64>)>) {
        for (joint, goal) in goals {
            let listed = self.joints.iter().position(|(name, _)| name == joint);
            if let Some(position) = listed.and_then(|listed| self.positions.get_mut(listed)) {
                *position = goal;
            }
        }
    }

    /// It has moved the joints of which this holds, nobody knows where to.
    pub(crate) fn moved(&mut self, is_moved: impl Fn(&str) -> bool) {
        for ((name, _), position) in self.joints.iter().zip(&mut self.positions) {
            if is_moved(name) {
                *position = None;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slide_that_nobody_knows_goes_millimetres_where_a_joint_turns_by_parts_of_a_radian() {
        let joints = [("turn".to_owned(), DegOrMm::Deg), ("slide".to_owned(), DegOrMm::Mm)];
        let mut robot = KnownRobot::new("arm", &joints, None, None);
        assert_eq!((robot.full_speed("turn"), robot.full_speed("slide")), (0.3, 50.0));
        // Each a typical way at its own speed.
        assert_eq!(robot.way_s(robot.anywhere()), 1.0);
        robot.went([("slide", Some(100.0))]);
        assert_eq!(robot.way_s([("slide", Some(600.0))]), 10.0);
    }

    /// Three slides at right angles.
    struct Slides;

    impl Geometry for Slides {
        fn flange(&self, joints: &[f64]) -> IsometryMatrix3<f64> {
            IsometryMatrix3::translation(joints[0], joints[1], joints[2])
        }

        fn tips(&self, _: Option<&str>, _: &[Vec<f64>]) -> Option<Vec<Vector3<f64>>> {
            None
        }
    }

    #[test]
    fn a_hand_is_brought_somewhere_only_from_where_all_joints_are_known() {
        let joints = ["x", "y", "z"].map(|name| (name.to_owned(), DegOrMm::Mm));
        let mut robot = KnownRobot::new("arm", &joints, Some(&Slides), None);
        robot.went([("x", Some(10.0)), ("y", Some(0.0))]);
        let there = IsometryMatrix3::translation(5.0, 6.0, 7.0);
        assert_eq!(robot.joints_for(&there), None, "nobody knows where z is");
        robot.went([("z", Some(0.0))]);
        let found = robot.joints_for(&there).unwrap();
        assert!(
            found.iter().zip([5.0, 6.0, 7.0]).all(|(one, other)| (one - other).abs() < 1e-5),
            "{found:?}"
        );
    }
}
