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

/// What a camera measures besides the picture itself.
pub(crate) const PICTURE_QUANTITIES: [&str; 3] = ["mean", "brightest", "waiting"];

impl Reading {
    /// What a camera reports of a picture: its mean and its brightest grey value, and how many pictures wait behind it.
    pub fn of_picture(time_ns: u64, pixels: &[u8], waiting: u64) -> Self {
        let sum: u64 = pixels.iter().map(|pixel| u64::from(*pixel)).sum();
        let mean = sum as f64 / pixels.len().max(1) as f64;
        let brightest = pixels.iter().copied().max().unwrap_or(0);
        let values = [mean, f64::from(brightest), waiting as f64];
        let quantities = PICTURE_QUANTITIES.iter().zip(values).map(|(name, value)| Quantity {
            name: (*name).to_owned(),
            value,
            standard_uncertainty: 0.0,
        });
        Self { time_ns, quantities: quantities.collect(), ..Self::default() }
    }
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
