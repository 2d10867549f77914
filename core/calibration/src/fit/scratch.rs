//! Room for the computation of one row, kept from row to row so that nothing is allocated anew.

use nalgebra::Vector3;

use super::arm_pose::{ArmPose, Changes};
use super::seen::Seen;
use super::state::State;
use crate::arm_model::RigNumber;
use crate::effect::{Channel, Contribution, Dof};

/// A small motion of the subject: of its point (mm) and attitude (rad), frame of the measurements.
pub(super) type Motion = (Vector3<f64>, Vector3<f64>);

/// How one free number or probe changes a number that is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ReadingRates {
    /// Which of the free numbers and probes.
    pub(super) index: usize,
    /// The number that is read.
    pub(super) channel: Channel,
    /// How fast its zero grows, mm or rad.
    pub(super) zero: f64,
    /// How fast its scale grows.
    pub(super) scale: f64,
}

/// The subject's motion per free number and probe.
#[derive(Default)]
pub(crate) struct SubjectMotion {
    pub(super) linear: Vec<Vector3<f64>>,
    pub(super) angular: Vec<Vector3<f64>>,
    /// How the sensor's own number (its height, at an edge the place left of it) grows, mm.
    pub(super) sensor: Vec<f64>,
    /// Of the few that change a number that is read.
    pub(super) readings: Vec<ReadingRates>,
    /// Of the few that move a number of the light stripe's rig: which number of the fit, which of the rig, and how fast.
    pub(super) rig: Vec<(usize, RigNumber, f64)>,
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
        self.readings.clear();
        self.rig.clear();
    }

    /// The next so many numbers; returns the first of them.
    pub(super) fn extend(&mut self, by: usize) -> usize {
        let first = self.used;
        self.used += by;
        first
    }

    /// Adds what a number changes of what is read out.
    pub(super) fn add_reading(&mut self, index: usize, dof: &Dof, rate: f64) {
        let (channel, zero, scale) = match *dof {
            Dof::Rig(number) => {
                self.rig.retain(|(known, ..)| *known != index);
                self.rig.push((index, number, rate));
                return;
            }
            Dof::ReadingZero(channel) => (channel, rate, 0.0),
            Dof::ReadingScale(channel) => (channel, 0.0, rate),
            _ => return,
        };
        match self.readings.iter_mut().find(|known| known.index == index) {
            Some(known) => {
                known.zero += zero;
                known.scale += scale;
            }
            None => self.readings.push(ReadingRates { index, channel, zero, scale }),
        }
    }

    pub(super) fn add(&mut self, index: usize, (moved, turned): Motion, rate: f64) {
        if let (Some(linear), Some(angular)) = (self.linear.get_mut(index), self.angular.get_mut(index)) {
            *linear += moved * rate;
            *angular += turned * rate;
        }
    }
}

/// Room for the computation of rows in one state.
pub(crate) struct Scratch<'s> {
    /// The state; `constant` is of it.
    pub(super) state: &'s State,
    /// What effects that look at nothing change, in every row alike.
    pub(super) constant: Changes,
    pub(super) pose: ArmPose,
    pub(super) contributions: Vec<Contribution>,
    pub(super) motion: SubjectMotion,
    /// How the subject moves when a joint turns, one a joint.
    pub(super) by_joint: Vec<Motion>,
    /// The points of the light stripe that is looked at.
    pub(super) seen: Seen,
}

impl<'s> Scratch<'s> {
    /// Room for rows in a state in which every row has these changes.
    pub(super) fn new(state: &'s State, constant: Changes) -> Self {
        Self {
            state,
            constant,
            pose: ArmPose::default(),
            contributions: Vec::new(),
            motion: SubjectMotion::default(),
            by_joint: Vec::new(),
            seen: Seen::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_several_contributions_change_of_a_reading_adds_up() {
        let channel = Channel::TiltX;
        let mut motion = SubjectMotion::default();
        motion.begin(2);
        motion.add_reading(1, &Dof::ReadingZero(channel), 2.0);
        motion.add_reading(1, &Dof::ReadingScale(channel), 3.0);
        motion.add_reading(1, &Dof::ReadingZero(channel), 5.0);
        motion.add_reading(1, &Dof::ReadingScale(channel), -1.0);
        // A shift of the base is no number that is read.
        motion.add_reading(0, &Dof::BaseShift(0), 4.0);
        assert_eq!(motion.readings, [ReadingRates { index: 1, channel, zero: 7.0, scale: 2.0 }]);
        assert_eq!((motion.extend(1), motion.extend(3), motion.extend(1)), (0, 1, 4));
    }
}
