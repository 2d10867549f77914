//! Numbers of a world file, each within what it can be.

use std::ops::RangeInclusive;

use serde_yaml::Spanned;

use super::WorldFileError;

/// The number as it was typed, if it is finite and within its range (in `unit`).
pub(crate) fn within(
    file: &str,
    key: &str,
    value: &Spanned<f64>,
    range: RangeInclusive<f64>,
    unit: &str,
) -> Result<f64, WorldFileError> {
    let typed = value.value;
    if typed.is_finite() && range.contains(&typed) {
        return Ok(typed);
    }
    let problem = if typed.is_finite() {
        format!("`{key}` is {typed}, but must be {} to {} {unit}", range.start(), range.end())
    } else {
        format!("`{key}` is {typed}, which is no finite number")
    };
    Err(WorldFileError::at(file, value.referenced, problem))
}
