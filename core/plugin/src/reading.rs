//! What a sensor has seen.

use serde::{Deserialize, Serialize};

use crate::ProximityEdge;

/// What a sensor has seen since its last reading.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    /// Everything up to this moment has been seen: ns of the cell's clock.
    pub time_ns: u64,
    /// The sensor's output at that moment, for a sensor that switches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fired: Option<bool>,
    /// The changes of the output since the last reading, oldest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub edges: Vec<ProximityEdge>,
    /// The values measured, for a sensor that measures; the names are those of the sensor's description.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub quantities: Vec<Quantity>,
}

/// One measured value.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quantity {
    /// What was measured, as in the sensor's description.
    pub name: String,
    /// The value, in the unit of the description.
    pub value: f64,
    /// Its standard uncertainty, in the same unit; 0 when not known.
    pub standard_uncertainty: f64,
}
