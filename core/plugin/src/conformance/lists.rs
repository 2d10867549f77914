//! Whether a manifest lists what the device then says of itself: `plumb check` believes the manifest.

use super::CheckOutcome;
use crate::{Manifest, QuantityDescription, RobotDescription, SensorDescription};

/// The name of the check in reports.
pub const LISTS: &str = "its manifest lists the quantities and input lines it describes";

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

/// Holds a robot's input lines against its manifest.
pub fn check_input_lines(manifest: &Manifest, robot: &RobotDescription) -> CheckOutcome {
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
