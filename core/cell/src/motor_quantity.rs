//! What motors may report of themselves: the one table of it.

use plumb_plugin::{JointVector, MotorState};

use crate::in_words::with_decimals;

/// What a motor may report of itself.
pub(crate) struct MotorQuantity {
    /// In the names of values, and for people.
    pub(crate) name: &'static str,
    /// The unit of results, as people and the record call it.
    pub(crate) unit: &'static str,
    /// The same unit at the end of a name in expressions.
    suffix: &'static str,
    /// How many of it the unit of the contract is.
    pub(crate) scale: f64,
    /// No motor has less than this, in the unit of the contract.
    pub(crate) lowest: f64,
    /// A number for each joint, in the unit of the contract.
    pub(crate) values: fn(&MotorState) -> &JointVector,
    /// The standard uncertainty of each of them.
    pub(crate) uncertainty: fn(&MotorState) -> f64,
}

/// The highest of its values is a result of its own.
pub(crate) const TEMPERATURE: MotorQuantity = MotorQuantity {
    name: "temperature",
    unit: "degC",
    suffix: "c",
    scale: 1.0,
    lowest: -273.15,
    values: |motors| &motors.temperature,
    uncertainty: |motors| motors.temperature_uncertainty,
};

const LOAD: MotorQuantity = MotorQuantity {
    name: "load",
    unit: "%",
    suffix: "percent",
    scale: 100.0,
    lowest: 0.0,
    values: |motors| &motors.load,
    uncertainty: |motors| motors.load_uncertainty,
};

const VOLTAGE: MotorQuantity = MotorQuantity {
    name: "voltage",
    unit: "V",
    suffix: "v",
    scale: 1.0,
    lowest: 0.0,
    values: |motors| &motors.voltage,
    uncertainty: |motors| motors.voltage_uncertainty,
};

/// All that motors may report of themselves.
pub(crate) const MOTOR_QUANTITIES: [MotorQuantity; 3] = [TEMPERATURE, LOAD, VOLTAGE];

impl MotorQuantity {
    /// By which expressions call it of a joint: `elbow_temperature_c`.
    pub(crate) fn result_name(&self, joint: &str) -> String {
        format!("{joint}_{}_{}", self.name, self.suffix)
    }

    /// The joints whose motors report it, with its value in the unit of results.
    pub(crate) fn reported<'a>(&self, joints: &[&'a str], motors: &MotorState) -> Vec<(&'a str, f64)> {
        let all = joints.iter().zip((self.values)(motors).as_slice());
        all.filter(|(_, value)| !value.is_nan()).map(|(joint, value)| (*joint, value * self.scale)).collect()
    }

    /// From its least to its greatest value, for people.
    pub(crate) fn range_in_words(&self, reported: &[(&str, f64)]) -> Option<String> {
        let values = || reported.iter().map(|(_, value)| *value);
        let (least, greatest) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        let (least, greatest) = (with_decimals(least, 1), with_decimals(greatest, 1));
        let range = if least == greatest { least } else { format!("{least} to {greatest}") };
        Some(format!("{} {range} {}", self.name, self.unit))
    }
}
