//! The part of a model that is the same in every pose, as links and joints.

use nalgebra::{IsometryMatrix3, Matrix3, Rotation3, Translation3, Vector3};
use plumb_kinematics::{Convention, Deviation, DhParameter, LinkFrames, Motion};
use thiserror::Error;

use crate::arm_model::{AddedEffect, Model};
use crate::effect::{self, Dof, EffectNameError};
use crate::forward::constant_contributions;

/// Why a model cannot be written in another form.
#[derive(Debug, Error)]
pub enum ExportError {
    /// An effect that cannot be where the file has it.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// A joint whose drive keeps an attitude.
    #[error(
        "joint `{0}` turns by its coordinate less another joint's: rigid links between joints cannot say that, so this arm has no such form"
    )]
    KeepsAttitude(String),
    /// The form is made for arms of another number of joints.
    #[error("a UR driver's calibration is of six joints; `{arm}` has {joints}: write it as a URDF")]
    NotSixJoints {
        /// The arm.
        arm: String,
        /// How many it has.
        joints: usize,
    },
}

/// Frames closer than this are the same: rounding makes 1e-12 of either, and nobody measures so well.
const SAME_MM: f64 = 1e-6;
const SAME_DEG: f64 = 1e-7;

/// A joint between two rigid links.
#[derive(Debug, Clone)]
pub struct RigidJoint {
    /// Its name.
    pub name: String,
    /// Whether it turns about z or slides along z.
    pub motion: Motion,
    /// 1, or -1 where its coordinate counts against z.
    pub sign: f64,
    /// Least and greatest coordinate, rad or mm.
    pub limits: (f64, f64),
    /// The joint's frame at coordinate zero, in that of the joint before it (or the base), mm. Its z is the axis; for rows of the distal convention it
    /// lies where the row's common normal leaves the axis, as the frames of UR's own descriptions do.
    pub parent_from_joint: IsometryMatrix3<f64>,
}

/// An arm of rigid links: all of a model that does not depend on pose, load, temperature, time or side of approach.
#[derive(Debug, Clone)]
pub struct RigidArm {
    /// The arm's name.
    pub name: String,
    /// Its joints from the base on.
    pub joints: Vec<RigidJoint>,
    /// The flange in the last joint's frame, mm.
    pub joint_from_flange: IsometryMatrix3<f64>,
    /// Measured points in the flange's frame, mm.
    pub targets: Vec<(String, Vector3<f64>)>,
    /// What the errors of each row come to, mm and rad.
    pub(super) deviations: Vec<Deviation>,
    /// Effects that rigid links cannot hold, as people write them.
    pub left_out: Vec<String>,
    /// Effects that are no part of the robot: they say where the base was before the instrument, or what the instrument read.
    pub not_the_robot: Vec<String>,
}

impl RigidArm {
    /// The rigid part of a model with everything that has been added to it.
    ///
    /// # Errors
    /// [`ExportError`].
    pub fn of(model: &Model) -> Result<Self, ExportError> {
        // The motor turns by the coordinate less another joint's: no rigid link does that.
        if let Some(joint) = model.chain.joints.iter().find(|joint| joint.less.is_some()) {
            return Err(ExportError::KeepsAttitude(joint.name.clone()));
        }
        // Targets begin where the model has them, and effects of tools move them.
        let mut rigid = Constants {
            deviations: vec![Deviation::default(); model.chain.len()],
            targets: model.targets.iter().map(|target| (target.name.clone(), target.xyz)).collect(),
            left_out: Vec::new(),
            not_the_robot: Vec::new(),
        };
        for added in model.effects.iter().chain(&model.fitted) {
            rigid.take(model, added)?;
        }
        if model.residual_map.is_some() {
            rigid.left_out.push("the residual map".to_owned());
        }
        let Constants { deviations, targets, left_out, not_the_robot } = rigid;
        let frames = joint_frames(model, &deviations);
        let mut before = IsometryMatrix3::identity();
        let mut joints = Vec::with_capacity(frames.len());
        for (joint, base_from_joint) in model.chain.joints.iter().zip(&frames) {
            joints.push(RigidJoint {
                name: joint.name.clone(),
                motion: joint.motion,
                sign: joint.sign,
                limits: joint.limits,
                parent_from_joint: before.inverse() * base_from_joint,
            });
            before = *base_from_joint;
        }
        let flange = LinkFrames::of(&model.chain, &[], &deviations).flange;
        let joint_from_flange = before.inverse() * flange;
        Ok(Self {
            name: model.arm.clone(),
            joints,
            joint_from_flange,
            targets,
            deviations,
            left_out,
            not_the_robot,
        })
    }

    /// By how much the flange lies off the last joint's own frame, mm and deg; nothing where it lies in it. Forms that end with the last joint cannot hold it.
    pub fn behind_last_joint(&self) -> Option<(f64, f64)> {
        let off_mm = self.joint_from_flange.translation.vector.norm();
        let off_deg = self.joint_from_flange.rotation.angle().to_degrees();
        (off_mm > SAME_MM || off_deg > SAME_DEG).then_some((off_mm, off_deg))
    }

    /// The flange in the base's frame, mm, for coordinates in rad or mm.
    pub fn flange(&self, q: &[f64]) -> IsometryMatrix3<f64> {
        let mut pose = IsometryMatrix3::identity();
        for (joint, q) in self.joints.iter().zip(q) {
            // In the joint's own frame z is the axis, whichever way its coordinate counts.
            let driven = joint.sign * q;
            let moved = match joint.motion {
                Motion::Turns => IsometryMatrix3::rotation(Vector3::z() * driven),
                Motion::Slides => IsometryMatrix3::translation(0.0, 0.0, driven),
            };
            pose = pose * joint.parent_from_joint * moved;
        }
        pose * self.joint_from_flange
    }
}

/// What effects come to that is the same in every pose.
struct Constants {
    deviations: Vec<Deviation>,
    targets: Vec<(String, Vector3<f64>)>,
    left_out: Vec<String>,
    not_the_robot: Vec<String>,
}

impl Constants {
    /// Takes an effect in, or notes that it cannot be.
    fn take(&mut self, model: &Model, added: &AddedEffect) -> Result<(), ExportError> {
        let built = effect::build(&added.id, model)?;
        let label = model.label(&added.id);
        if added.values.iter().all(|value| *value == 0.0) {
            return Ok(());
        }
        // Only errors of the shape are the same in every pose.
        let is_geometry =
            effect::kind(&added.id.name).is_some_and(|kind| kind.family == effect::Family::Geometry);
        let is_instrument = effect::kind(&added.id.name)
            .is_some_and(|kind| matches!(kind.family, effect::Family::Instrument | effect::Family::Sensor));
        if is_instrument {
            self.not_the_robot.push(label);
            return Ok(());
        }
        if !is_geometry {
            self.left_out.push(label);
            return Ok(());
        }
        for contribution in constant_contributions(model, built.as_ref()) {
            let amount = contribution.rate * added.values.get(contribution.parameter).copied().unwrap_or(0.0);
            match contribution.dof {
                Dof::Joint(joint, dh_parameter) => self.shift_row(joint, dh_parameter, amount),
                Dof::Target(target, axis) => {
                    let slot = self.targets.get_mut(target).and_then(|(_, xyz)| xyz.get_mut(axis));
                    slot.into_iter().for_each(|slot| *slot += amount);
                }
                // Base and instrument: the arm's position is no part of it.
                _ => {
                    if !self.not_the_robot.contains(&label) {
                        self.not_the_robot.push(label.clone());
                    }
                }
            }
        }
        Ok(())
    }

    fn shift_row(&mut self, joint: usize, dh_parameter: DhParameter, amount: f64) {
        if let Some(deviation) = self.deviations.get_mut(joint) {
            deviation.add(dh_parameter, amount);
        }
    }
}

/// Each joint's frame in the base's at coordinate zero: z along its axis, x along its row's common normal.
fn joint_frames(model: &Model, deviations: &[Deviation]) -> Vec<IsometryMatrix3<f64>> {
    let link_frames = LinkFrames::of(&model.chain, &[], deviations);
    let rows = link_frames.joints.iter().zip(&model.chain.joints).zip(deviations);
    rows.map(|((frame, joint), deviation)| {
        let z = frame.axis;
        // Where the axis leans in its link's plane, the normal is not quite across it.
        let x = (frame.normal - z * frame.normal.dot(&z)).normalize();
        let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
        let foot = match model.chain.convention {
            Convention::Distal => frame.end.translation.vector - frame.normal * (joint.a + deviation.a),
            Convention::Proximal => frame.end.translation.vector,
        };
        IsometryMatrix3::from_parts(Translation3::from(foot), axes)
    })
    .collect()
}
