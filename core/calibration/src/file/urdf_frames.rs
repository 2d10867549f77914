//! Between the frames of a URDF file and those of the rows made of it: a model file speaks of the file's root link and tip, the rows have frames of their own.

use nalgebra::Vector3;
use plumb_kinematics::urdf::UrdfArm;

use crate::arm_model::{Base, MeasuredFrom, Model, Target};

/// The base is the file's root link, wherever that is.
pub(super) fn on_root(base: Base, arm: &UrdfArm) -> Base {
    Base { pose: base.pose * arm.root_from_base, ..base }
}

/// Direction of gravity in the frame of the first row, which may be on its head in the file's root link: as given for the root link, and along its -z
/// where nothing else says what is down.
pub(super) fn gravity(model: &Model, arm: &UrdfArm) -> Option<Vector3<f64>> {
    let in_root = match (model.gravity, model.measured_from) {
        (Some(given), _) => given,
        (None, MeasuredFrom::Instrument) => -Vector3::z(),
        (None, MeasuredFrom::World) => return None,
    };
    Some(arm.root_from_base.rotation.inverse() * in_root)
}

/// Targets are given in the tip's frame; where none is given, the tip's origin is the one.
pub(super) fn at_tip(mut targets: Vec<Target>, arm: &UrdfArm) -> Vec<Target> {
    if targets.is_empty() {
        targets.push(Target::point("p1", Vector3::zeros(), true));
    }
    for target in &mut targets {
        target.rotation = arm.flange_from_tip.rotation * target.rotation;
        target.xyz = (arm.flange_from_tip * nalgebra::Point3::from(target.xyz)).coords;
    }
    targets
}
