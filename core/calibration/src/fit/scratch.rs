//! Room for the computation of one row, kept from row to row so that nothing is allocated anew.

use nalgebra::Vector3;

use super::arm_pose::ArmPose;
use super::seen::Seen;
use crate::arm_model::RigNumber;
use crate::effect::{Channel, Contribution, Dof};

/// A small motion of the subject: of its point (mm) and attitude (rad), frame of the measurements.
pub(super) type Motion = (Vector3<f64>, Vector3<f64>);

/// The subject's motion per free number and probe.
#[derive(Default)]
pub(crate) struct SubjectMotion {
    pub(super) linear: Vec<Vector3<f64>>,
    pub(super) angular: Vec<Vector3<f64>>,
    /// How the sensor's own number (its height, at an edge the place left of it) grows, mm.
    pub(super) sensor: Vec<f64>,
    /// The number that is read that it changes, and how fast its zero (mm or rad) and its scale grow.
    pub(super) reading: Vec<Option<(Channel, f64, f64)>>,
    /// The number of the light stripe's rig that it moves, and how fast.
    pub(super) rig: Vec<Option<(RigNumber, f64)>>,
    /// Numbers whose motion is worked out so far.
    used: usize,
}

impl SubjectMotion {
    /// Makes room for so many numbers, none of which moves anything yet: once a row, not number by number.
    pub(super) fn begin(&mut self, width: usize) {
        self.used = 0;
        self.linear.clear();
        self.linear.resize(width, Vector3::zeros());
        self.angular.clear();
        self.angular.resize(width, Vector3::zeros());
        self.sensor.clear();
        self.sensor.resize(width, 0.0);
        self.reading.clear();
        self.reading.resize(width, None);
        self.rig.clear();
        self.rig.resize(width, None);
    }

    /// The next so many numbers; returns the first of them.
    pub(super) fn extend(&mut self, by: usize) -> usize {
        let first = self.used;
        self.used += by;
        first
    }

    /// Adds what a number changes of what is read out.
    pub(super) fn add_reading(&mut self, index: usize, dof: Dof, rate: f64) {
        if let (Dof::Rig(number), Some(entry)) = (dof, self.rig.get_mut(index)) {
            *entry = Some((number, rate));
            return;
        }
        let (channel, zero, scale) = match dof {
            Dof::ReadingZero(channel) => (channel, rate, 0.0),
            Dof::ReadingScale(channel) => (channel, 0.0, rate),
            _ => return,
        };
        if let Some(entry) = self.reading.get_mut(index) {
            let (_, known_zero, known_scale) = entry.unwrap_or((channel, 0.0, 0.0));
            *entry = Some((channel, known_zero + zero, known_scale + scale));
        }
    }

    pub(super) fn add(&mut self, index: usize, (moved, turned): Motion, rate: f64) {
        if let (Some(linear), Some(angular)) = (self.linear.get_mut(index), self.angular.get_mut(index)) {
            *linear += moved * rate;
            *angular += turned * rate;
        }
    }
}

/// Room for one row's computation.
#[derive(Default)]
pub(crate) struct Scratch {
    pub(super) pose: ArmPose,
    pub(super) contributions: Vec<Contribution>,
    pub(super) motion: SubjectMotion,
    /// How the subject moves when a joint turns, one a joint.
    pub(super) by_joint: Vec<Motion>,
    /// The points of the light stripe that is looked at.
    pub(super) seen: Seen,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_several_contributions_change_of_a_reading_adds_up() {
        let channel = Channel::TiltX;
        let mut motion = SubjectMotion::default();
        motion.begin(2);
        motion.add_reading(1, Dof::ReadingZero(channel), 2.0);
        motion.add_reading(1, Dof::ReadingScale(channel), 3.0);
        motion.add_reading(1, Dof::ReadingZero(channel), 5.0);
        motion.add_reading(1, Dof::ReadingScale(channel), -1.0);
        assert!(motion.reading[1].is_some_and(|(_, zero, scale)| (zero, scale) == (7.0, 2.0)));
        motion.add_reading(0, Dof::BaseShift(0), 4.0);
        assert!(motion.reading[0].is_none(), "a shift of the base is no number that is read");
        assert_eq!((motion.extend(1), motion.extend(3), motion.extend(1)), (0, 1, 4));
    }
}
