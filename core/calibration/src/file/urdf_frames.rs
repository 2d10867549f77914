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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    /// One joint about z, whose tip is 100 mm out and turned a quarter about z.
    const ARM: &str = r#"<robot name="one">
  <link name="base"/><link name="arm"/><link name="tip"/>
  <joint name="j1" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="out" type="fixed"><parent link="arm"/><child link="tip"/><origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/></joint>
</robot>"#;

    #[test]
    fn a_target_is_placed_and_turned_in_the_frame_of_the_tip() {
        let arm = UrdfArm::parse(ARM, None).unwrap();
        // A quarter about x in the tip's frame: its y points along the tip's z, its z along the tip's -y.
        let about_x = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        let target = Target { rotation: about_x, ..Target::point("p1", Vector3::new(10.0, 0.0, 5.0), true) };
        let placed = at_tip(vec![target], &arm);
        // At zero the file's root and tip decide, whatever frames the rows have between them.
        let flange = arm.root_from_base * plumb_kinematics::LinkFrames::of(&arm.chain, &[0.0], &[]).flange;
        let at = flange * nalgebra::Point3::from(placed[0].xyz);
        assert!((at.coords - Vector3::new(100.0, 10.0, 5.0)).norm() < 1e-9, "{at}");
        let axes = (flange.rotation * placed[0].rotation).into_inner();
        // The tip's x is the root's y, its y the root's -x.
        let requested = nalgebra::Matrix3::from_columns(&[Vector3::y(), Vector3::z(), Vector3::x()]);
        assert!((axes - requested).norm() < 1e-9, "{axes}");
    }
}
