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

/// How far the nearest part of a robot is clear of a plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaneClearance {
    /// What people call the plane.
    pub plane: String,
    /// How far the nearest end of a link is on the free side, mm; negative beyond the plane. None while the position of a joint is not known.
    pub clearance_mm: Option<f64>,
}
