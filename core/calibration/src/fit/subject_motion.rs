//! How the subject of a measurement (a target's point, a frame's attitude) moves with every free number: the Jacobian that
//! all kinds of measurement share.
//!
//! A number of a joint's row moves all that lies beyond by a twist (Whitney, The mathematics of coordinated control of
//! prosthetic arms and manipulators, 1972): a point p by `v + w x p`, an attitude by `w`.

use std::cell::LazyCell;

use nalgebra::Vector3;
use plumb_kinematics::DhParameter;

use super::arm_pose::ArmPose;
use super::residual_model::ResidualModel;
use super::response::ResponseTo;
use super::scratch::{Motion, Scratch, SubjectMotion};
use super::state::FreeParameter;
use crate::arm_model::Frame;
use crate::effect::{Contribution, Dof, Effect, LooksAt};
use crate::measurement::{SensorShift, Subject};
use crate::table::Stretch;

const STILL: Motion = (Vector3::new(0.0, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.0));

/// The frames one row's derivatives are taken in.
struct SubjectFrames<'a> {
    pose: &'a ArmPose,
    subject: Subject,
    /// The subject's point in the frame of the measurements, and in the base's frame without what bent links add, mm.
    point: Vector3<f64>,
    stiff: Vector3<f64>,
    /// How the subject moves when a joint turns, where that has been worked out.
    by_joint: &'a [Motion],
}

impl SubjectFrames<'_> {
    /// How the subject moves with one number of one joint's row.
    fn with_joint(&self, joint: usize, dh_parameter: DhParameter) -> Motion {
        // The twist is worked out where the point would be without bent links, which then carry it on, and turned into the frame of the measurements.
        let twist = self.pose.link_frames.twist(joint, dh_parameter, &self.stiff);
        (self.pose.carried * twist.linear, self.pose.carried * twist.angular)
    }

    /// Whether a joint's row lies beyond the frame whose attitude is measured, so that it does not turn it.
    fn is_beyond(&self, joint: usize) -> bool {
        match self.subject {
            Subject::Target(_) | Subject::Body(_) | Subject::Camera(_) | Subject::Stretch(_) => false,
            Subject::Frame(Frame::Base) => joint > 0,
            Subject::Frame(Frame::After(carrier)) => joint > carrier,
        }
    }

    /// How the subject's point and attitude move with one degree of freedom.
    fn with(&self, dof: &Dof) -> Motion {
        let pose = self.pose;
        match *dof {
            // What lies beyond the base does not tilt it.
            Dof::Joint(..) if self.subject == Subject::Frame(Frame::Base) => STILL,
            Dof::Twist { after: joint, .. } if self.is_beyond(joint) => STILL,
            Dof::Joint(joint, dh_parameter) => {
                let stiff = self.with_stiff_joint(joint, dh_parameter);
                self.with_response(stiff, pose.response.to_joint(joint, dh_parameter))
            }
            Dof::Twist { shift, rotation, about, .. } => {
                (pose.base * (shift + rotation.cross(&(self.stiff - about))), pose.base * rotation)
            }
            Dof::Target(target, axis) if self.is_of(target) => {
                (pose.rotated_from_flange(Vector3::ith(axis.min(2), 1.0)), Vector3::zeros())
            }
            // What a light stripe or a camera on the hand sees no instrument reads.
            Dof::Reading(_) if matches!(self.subject, Subject::Stretch(_) | Subject::Camera(_)) => STILL,
            Dof::BaseShift(axis) | Dof::Reading(axis) => (Vector3::ith(axis.min(2), 1.0), Vector3::zeros()),
            Dof::BaseRotation(axis) => {
                self.with_base_rotated_about(pose.rotation_by_vector.column(axis.min(2)).into())
            }
            Dof::Target(..)
            | Dof::Trigger
            | Dof::Edge
            | Dof::Rig(_)
            | Dof::ReadingZero(_)
            | Dof::ReadingScale(_) => STILL,
        }
    }

    /// How the subject moves with one number of one joint's row while nothing bends otherwise.
    fn with_stiff_joint(&self, joint: usize, dh_parameter: DhParameter) -> Motion {
        match (dh_parameter, self.by_joint.get(joint)) {
            _ if self.is_beyond(joint) || self.subject == Subject::Frame(Frame::Base) => STILL,
            // Most effects turn joints: that is worked out once a row.
            (DhParameter::Theta, Some(turned)) => *turned,
            _ => self.with_joint(joint, dh_parameter),
        }
    }

    /// A motion, and what gravity bends in response to what makes it.
    fn with_response(&self, (mut moved, mut turned): Motion, response: Option<ResponseTo<'_>>) -> Motion {
        let Some(response) = response else { return (moved, turned) };
        for (joint, dh_parameter, amount) in response.joints() {
            let (linear, angular) = self.with_stiff_joint(joint, dh_parameter);
            moved += linear * amount;
            turned += angular * amount;
        }
        let (shift, rotation) = response.carried();
        (moved + self.pose.base * (shift + rotation.cross(&self.stiff)), turned + self.pose.base * rotation)
    }

    /// Whether the subject sits where a target does.
    fn is_of(&self, target: usize) -> bool {
        matches!(self.subject, Subject::Target(own) | Subject::Body(own) | Subject::Camera(own) if own == target)
    }

    /// How the subject moves when a target turns about an axis of the flange.
    fn with_target_rotated(&self, target: usize, axis: usize) -> Motion {
        match self.subject {
            Subject::Body(own) | Subject::Camera(own) if own == target => {
                (Vector3::zeros(), self.pose.hand().matrix().column(axis.min(2)).into())
            }
            _ => STILL,
        }
    }

    /// How the subject moves when the base turns about an axis through its origin.
    fn with_base_rotated_about(&self, axis: Vector3<f64>) -> Motion {
        (axis.cross(&(self.point - self.pose.origin)), axis)
    }

    /// Adds how the subject moves with so many parameters of an effect that contributes this.
    fn add_effect(
        &self,
        parameters: usize,
        contributions: &[Contribution],
        sensor: Option<Dof>,
        motion: &mut SubjectMotion,
    ) {
        let first = motion.extend(parameters);
        for contribution in contributions {
            let index = first + contribution.parameter;
            if sensor == Some(contribution.dof)
                && let Some(own) = motion.sensor.get_mut(index)
            {
                *own += contribution.rate;
            }
            motion.add(index, self.with(&contribution.dof), contribution.rate);
            motion.add_reading(index, &contribution.dof, contribution.rate);
        }
    }
}

impl ResidualModel<'_> {
    /// Works out the subject's motion per free number and probe; returns its point as the instrument reads it, and what the
    /// sensor adds to where it triggers there.
    pub(super) fn motions(
        &self,
        row: usize,
        subject: Subject,
        probes: &[&dyn Effect],
        scratch: &mut Scratch<'_>,
    ) -> (Vector3<f64>, SensorShift) {
        let Scratch { state, pose, contributions, motion, by_joint, seen, .. } = scratch;
        let pose = &*pose;
        let stretch = self.stretch(subject);
        let (point, in_base) = match subject {
            Subject::Target(target) | Subject::Body(target) | Subject::Camera(target) => {
                pose.point(state, target)
            }
            // An attitude has no point; one is needed for the effects that ask for it.
            Subject::Frame(_) => pose.point(state, 0),
            Subject::Stretch(_) => seen.look(stretch, pose),
        };
        let (read, shift) = match subject {
            // What the instrument adds is no matter of a camera.
            Subject::Camera(_) => (point, SensorShift::default()),
            _ => {
                let read = point + self.reading_shift(state, row, point, pose, contributions);
                (read, self.sensor_shift(state, row, read, pose, contributions))
            }
        };

        let stiff = pose.without_bent_links(in_base);
        let mut frames = SubjectFrames { pose, subject, point, stiff, by_joint: &[] };
        by_joint.clear();
        by_joint
            .extend((0..self.model.chain.len()).map(|joint| frames.with_joint(joint, DhParameter::Theta)));
        frames.by_joint = by_joint;

        let of_probes: usize = probes.iter().map(|probe| probe.parameters().len()).sum();
        motion.begin(self.free_parameters.len() + of_probes);
        self.move_by_free_parameters(&frames, motion);
        // With the point: effects of the instrument go by it.
        let sample = LazyCell::new(|| self.sample(state, row, &pose.link_frames, &pose.moments, Some(point)));
        let sensor = self.sensor_dof(row);
        for part in &self.parts {
            let all = match part.looks_at {
                LooksAt::Nothing => &part.constant,
                _ => sample.contributions_of(part.effect.as_ref(), contributions),
            };
            frames.add_effect(part.effect.parameters().len(), all, sensor, motion);
        }
        for probe in probes {
            let all = sample.contributions_of(*probe, contributions);
            frames.add_effect(probe.parameters().len(), all, sensor, motion);
        }
        seen.move_by(motion.rig.iter().map(|(_, number, _)| *number), stretch, pose);
        (read, shift)
    }

    /// How the subject moves with every free number but those of effects.
    fn move_by_free_parameters(&self, frames: &SubjectFrames<'_>, motion: &mut SubjectMotion) {
        for free_parameter in &self.free_parameters {
            let dof = match *free_parameter {
                FreeParameter::BaseShift(axis) => Dof::BaseShift(axis),
                FreeParameter::BaseRotation(axis) => {
                    // What effects turn the base by comes on top of where it is believed to be.
                    let about = frames.pose.rotated_base.column(axis.min(2)).into();
                    let index = motion.extend(1);
                    let stiff = frames.with_base_rotated_about(about);
                    let response = frames.pose.response.to_base_rotation(axis);
                    motion.add(index, frames.with_response(stiff, response), 1.0);
                    continue;
                }
                FreeParameter::Target(target, axis) => Dof::Target(target, axis),
                FreeParameter::TargetRotation(target, axis) => {
                    let index = motion.extend(1);
                    motion.add(index, frames.with_target_rotated(target, axis), 1.0);
                    continue;
                }
                // Places, surfaces and a board do not move the subject; see `own_derivatives`.
                FreeParameter::Place(..)
                | FreeParameter::Surface(..)
                | FreeParameter::BoardShift(..)
                | FreeParameter::BoardRotation(..) => {
                    motion.extend(1);
                    continue;
                }
                FreeParameter::Effect(..) => continue,
            };
            let index = motion.extend(1);
            motion.add(index, frames.with(&dof), 1.0);
        }
    }

    /// The stretch of a light stripe that a subject is; none for any other.
    pub(super) fn stretch(&self, subject: Subject) -> Option<&Stretch> {
        let Subject::Stretch(index) = subject else { return None };
        self.table.stretches.get(index)
    }

    /// The sensor's own number that a row's trigger depends on, if it triggered there.
    fn sensor_dof(&self, row: usize) -> Option<Dof> {
        let measurands = self.observations.of_row(row).iter().map(|equation| equation.measurand);
        measurands.filter_map(|what| what.kind.sensor_dof(self.model, what)).next()
    }
}
