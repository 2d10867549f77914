//! The rig that a cell's light stripe works with: the numbers of its file with the corrections that the record has in force.

use std::path::Path;

use plumb_cell::engine::sensor_corrections;
use plumb_cell::workcell::{DeviceSetting, Workcell};
use plumb_light_stripe::geometry::{Rig, RigCorrections};
use plumb_record::{AppliedCorrection, Record};
use serde_json::Value;

use super::lab_error::LabError;

/// The corrections of a sensor that the record in `directory` has in force; none where there is no record.
///
/// # Errors
/// When there is a record that cannot be read.
pub(crate) fn in_force(
    directory: &Path,
    cell: &Workcell,
    sensor: &DeviceSetting,
) -> Result<Vec<AppliedCorrection>, LabError> {
    if !Record::file_in(directory).is_file() {
        return Ok(Vec::new());
    }
    Ok(Record::open(directory)?.corrections_in_force(&cell.name, &sensor.name)?)
}

/// The rig of the file with these corrections in force.
///
/// # Errors
/// When a correction is none that a rig has, or is implausible.
pub(crate) fn rig_with(drawn: &Rig, in_force: &[AppliedCorrection]) -> Result<Rig, LabError> {
    let named = Value::Object(sensor_corrections(in_force));
    if named.as_object().is_none_or(serde_json::Map::is_empty) {
        return Ok(drawn.clone());
    }
    let corrections: RigCorrections =
        serde_json::from_value(named).map_err(|cause| LabError::Corrections(cause.to_string()))?;
    drawn.corrected(&corrections).map_err(|cause| LabError::Corrections(cause.to_string()))
}
