//! Whether a manifest lists what the device then says of itself: `plumb check` believes the manifest.

use super::CheckOutcome;
use crate::{Manifest, ManifestJoint, QuantityDescription, RobotDescription, SensorDescription};

/// The name of the check in reports.
pub const LISTS: &str = "its manifest lists the quantities, input lines and joints it describes";

/// Holds a sensor's quantities against its manifest.
pub fn check_quantities(manifest: &Manifest, sensor: &SensorDescription) -> CheckOutcome {
    // It need not: then its procedures' names are checked once it is started.
    let Some(listed) = &manifest.quantities else { return CheckOutcome::Passed };
    let named = |quantities: &[QuantityDescription]| {
        let mut names: Vec<String> =
            quantities.iter().map(|one| format!("{} [{}]", one.name, one.unit)).collect();
        names.sort();
        names
    };
    let (listed, described) = (named(listed), named(&sensor.quantities));
    if listed == described {
        return CheckOutcome::Passed;
    }
    CheckOutcome::Failed(format!(
        "the manifest lists {}; the sensor describes {}",
        listed.join(", "),
        described.join(", ")
    ))
}

/// Two ends of a joint's way are the same when they differ by no more than this, rad or mm: what is lost between degrees and radians.
const SAME_END: f64 = 1e-6;

/// Holds a robot's input lines and joints against its manifest.
pub fn check_robot_lists(manifest: &Manifest, robot: &RobotDescription) -> CheckOutcome {
    match check_input_lines(manifest, robot) {
        CheckOutcome::Passed => check_joints(manifest, robot),
        wrong => wrong,
    }
}

/// A joint that is listed may be missing in the description: some settings leave joints out.
fn check_joints(manifest: &Manifest, robot: &RobotDescription) -> CheckOutcome {
    let Some(listed) = &manifest.joints else { return CheckOutcome::Passed };
    for joint in &robot.joints {
        let name = &joint.name;
        let found = listed.iter().find(|one| one.name == *name);
        let Some((from, to)) = found.and_then(ManifestJoint::range) else {
            return CheckOutcome::Failed(format!(
                "the robot describes a joint {name}, which the manifest does not list"
            ));
        };
        if (from - joint.lower).abs() > SAME_END || (to - joint.upper).abs() > SAME_END {
            let (lower, upper, unit) = (joint.lower, joint.upper, joint.unit.symbol());
            return CheckOutcome::Failed(format!(
                "by the manifest {name} goes from {from:.6} to {to:.6} {unit}; the robot describes {lower:.6} to {upper:.6}"
            ));
        }
    }
    CheckOutcome::Passed
}

fn check_input_lines(manifest: &Manifest, robot: &RobotDescription) -> CheckOutcome {
    let Some(listed) = manifest.input_lines else { return CheckOutcome::Passed };
    let mut bits: Vec<u32> = robot.inputs.iter().map(|line| line.bit).collect();
    bits.sort_unstable();
    if bits.iter().copied().eq(0..listed) {
        return CheckOutcome::Passed;
    }
    CheckOutcome::Failed(format!(
        "the manifest says {listed} input lines; the robot describes the bits {bits:?}"
    ))
}
