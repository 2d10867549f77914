//! Numbers as people read them.

use serde::{Deserialize, Serialize};

/// A number with its name and unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NamedValue {
    /// As a procedure's expressions call it, the unit's suffix left off: `shoulder`.
    pub name: String,
    /// The number, in `unit`.
    pub value: f64,
    /// `deg`, `mm`, `micron`, ...; empty for a bare number.
    pub unit: String,
    /// One standard uncertainty in the same unit, where known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uncertainty: Option<f64>,
}
