//! Units in which readings, their noise and their errors are shown, and errors with their unit.

use std::fmt;

use serde::ser::SerializeMap as _;
use serde::{Serialize, Serializer};

/// A unit in which readings, their noise and their errors are shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ReadingUnit {
    /// Millimetres.
    #[default]
    Mm,
    /// Degrees.
    Deg,
}

impl ReadingUnit {
    /// Of a reading that is a length, or an angle.
    pub fn of(is_length: bool) -> Self {
        if is_length { Self::Mm } else { Self::Deg }
    }

    /// `mm` or `deg`.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Mm => "mm",
            Self::Deg => "deg",
        }
    }

    /// What a value inside (mm or rad) is multiplied by.
    pub fn factor(self) -> f64 {
        match self {
            Self::Mm => 1.0,
            Self::Deg => 1.0_f64.to_degrees(),
        }
    }
}

impl fmt::Display for ReadingUnit {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.symbol())
    }
}

/// A root mean square error of readings, with its unit. Serialized it is one field, `rms_mm` or `rms_deg`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RmsError {
    /// In `unit`.
    pub value: f64,
    /// Of the value.
    pub unit: ReadingUnit,
}

impl fmt::Display for RmsError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{:.4} {}", self.value, self.unit)
    }
}

impl Serialize for RmsError {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(1))?;
        map.serialize_entry(&format!("rms_{}", self.unit), &self.value)?;
        map.end()
    }
}
