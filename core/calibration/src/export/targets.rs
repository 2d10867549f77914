//! Joint targets for a machine that is as its calibrated model says: they bring the measured point, and the hand, to where the maker's drawing would have had them.

use nalgebra::{IsometryMatrix3, Translation3, Vector3};
use plumb_kinematics::{Motion, OutOfReach, inverse};
use thiserror::Error;

use crate::arm_model::Model;
use crate::effect::EffectNameError;
use crate::forward::ForwardModel;
use crate::prediction::without_events;
use crate::table::Table;

/// Joints with which a hand can be brought to any place and turned any way.
const WHOLE_POSE: usize = 6;

/// Why there are no such targets.
#[derive(Debug, Error)]
pub enum TargetsError {
    /// An effect that cannot be where the file has it.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// No point to bring anywhere.
    #[error("the model has no target, so it has no point to bring anywhere: give it one under `targets:`")]
    NoTarget,
    /// An arm that cannot keep its hand's direction.
    #[error(
        "targets are made anew for the whole pose of the hand, for which an arm has six joints or more; `{arm}` has {joints}: let a cell send it to points (`to_point`)"
    )]
    FewJoints {
        /// The arm.
        arm: String,
        /// How many it has.
        joints: usize,
    },
    /// Poses of another arm.
    #[error("{path}: poses of {found} joints for an arm of {requested}")]
    OtherArm {
        /// The table.
        path: String,
        /// In the table.
        found: usize,
        /// In the model.
        requested: usize,
    },
    /// A column in the wrong unit.
    #[error("{path}: column `{column}` is in {found}, and joint `{joint}` {moves}: write it in {requested}")]
    Unit {
        /// The table.
        path: String,
        /// As the table has it.
        column: String,
        /// deg or mm.
        found: &'static str,
        /// The joint.
        joint: String,
        /// Turns or slides.
        moves: &'static str,
        /// mm or deg.
        requested: &'static str,
    },
    /// A pose that is not to be had.
    #[error("{path}: line {line}: {reason}")]
    Pose {
        /// The table.
        path: String,
        /// Its line.
        line: u32,
        /// What keeps the arm from it.
        reason: String,
    },
}

/// A target made anew.
#[derive(Debug, Clone, PartialEq)]
pub struct CompensatedTarget {
    /// What the joints are to be sent to, rad or mm.
    pub q: Vec<f64>,
    /// Where the drawing has the point, frame of the measurements, mm.
    pub requested: Vector3<f64>,
    /// How far off it the point would come at the old target, by the calibrated model, mm.
    pub off_before: f64,
}

/// Targets for the calibrated arm in place of the table's, which were worked out by the drawing. A joint arrives from the side on which the row before lies.
///
/// # Errors
/// [`TargetsError`]
pub fn compensated_targets(
    drawing: &Model,
    calibrated: &Model,
    poses: &Table,
) -> Result<Vec<CompensatedTarget>, TargetsError> {
    check(calibrated, poses)?;
    let (drawn, known) = (Hand::new(drawing)?, Hand::new(calibrated)?);
    let mut before: Option<&[f64]> = None;
    let rows = poses.q.chunks_exact(poses.joints).zip(&poses.lines);
    rows.map(|(q, line)| {
        let wrong = |reason: String| TargetsError::Pose { path: poses.source.clone(), line: *line, reason };
        let sides = sides(before, q);
        before = Some(q);
        // Where the one who worked out the target believed the hand to be: by the drawing, which has no play.
        let requested = drawn.at(q, &[]);
        // From the old target on: the new one is a fraction of a degree away, on the same branch.
        let found = inverse(|q| known.at(q, &sides), &requested, q)
            .map_err(|out: OutOfReach| wrong(out.to_string()))?;
        let held = within_limits(calibrated, &found).and_then(|()| calibrated.holds_at(&found));
        held.map_err(wrong)?;
        let off_before = (known.at(q, &sides).translation.vector - requested.translation.vector).norm();
        Ok(CompensatedTarget { q: found, requested: requested.translation.vector, off_before })
    })
    .collect()
}

/// Whether the poses are of this arm.
fn check(model: &Model, poses: &Table) -> Result<(), TargetsError> {
    let joints = model.chain.len();
    if joints < WHOLE_POSE {
        return Err(TargetsError::FewJoints { arm: model.arm.clone(), joints });
    }
    if poses.joints != joints {
        return Err(TargetsError::OtherArm {
            path: poses.source.clone(),
            found: poses.joints,
            requested: joints,
        });
    }
    for (joint, (column, in_mm)) in model.chain.joints.iter().zip(&poses.coordinate_columns) {
        let slides = joint.motion == Motion::Slides;
        if slides != *in_mm {
            return Err(TargetsError::Unit {
                path: poses.source.clone(),
                column: column.clone(),
                found: unit_name(*in_mm),
                joint: joint.name.clone(),
                moves: if slides { "slides" } else { "turns" },
                requested: unit_name(slides),
            });
        }
    }
    Ok(())
}

/// The way in which each joint arrives from the row before; not known of the first.
fn sides(before: Option<&[f64]>, q: &[f64]) -> Vec<i8> {
    let Some(before) = before else { return Vec::new() };
    // `Ordering` counts -1, 0, 1: down, at rest, up.
    before.iter().zip(q).map(|(before, now)| now.total_cmp(before) as i8).collect()
}

fn unit_name(in_mm: bool) -> &'static str {
    if in_mm { "mm" } else { "deg" }
}

/// A coordinate as people read it.
fn shown(motion: Motion, value: f64) -> String {
    match motion {
        Motion::Turns => format!("{:.3} deg", value.to_degrees()),
        Motion::Slides => format!("{value:.3} mm"),
    }
}

fn within_limits(model: &Model, q: &[f64]) -> Result<(), String> {
    for (joint, value) in model.chain.joints.iter().zip(q) {
        let (lower, upper) = joint.limits;
        if !(lower..=upper).contains(value) {
            let [value, lower, upper] = [*value, lower, upper].map(|value| shown(joint.motion, value));
            return Err(format!(
                "`{}` would have to go to {value}; it goes from {lower} to {upper}",
                joint.name
            ));
        }
    }
    Ok(())
}

/// A model's measured point, with the directions of its hand.
struct Hand {
    forward: ForwardModel,
    world_from_base: IsometryMatrix3<f64>,
    flange_from_point: Translation3<f64>,
}

impl Hand {
    fn new(model: &Model) -> Result<Self, TargetsError> {
        let point = model.targets.first().ok_or(TargetsError::NoTarget)?;
        Ok(Self {
            world_from_base: model.base.pose,
            flange_from_point: Translation3::from(point.xyz),
            forward: ForwardModel::new(without_events(model))?,
        })
    }

    fn at(&self, q: &[f64], sides: &[i8]) -> IsometryMatrix3<f64> {
        self.world_from_base * self.forward.flange(q, sides) * self.flange_from_point
    }
}
