//! What a robot's motors report of themselves.

use bytemuck::{Pod, Zeroable};

use super::JointVector;

/// What the motor of each joint reports of itself, a number for each joint in the order of the robot's description.
///
/// NaN stands for what a motor does not report, and for an uncertainty that is not known. 0 never does.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct MotorState {
    /// When the motors reported this: ns of the cell's clock.
    pub time_ns: u64,
    /// The temperature of each motor: degrees Celsius.
    pub temperature: JointVector,
    /// The load of each motor as a fraction of its full torque, without a sign: from 0; 1 is full.
    pub load: JointVector,
    /// The supply voltage of each motor: V.
    pub voltage: JointVector,
    /// One standard uncertainty of each temperature: degrees Celsius.
    pub temperature_uncertainty: f64,
    /// One standard uncertainty of each load, as a fraction of full torque.
    pub load_uncertainty: f64,
    /// One standard uncertainty of each voltage: V.
    pub voltage_uncertainty: f64,
}

impl MotorState {
    /// Motors of so many joints of which nothing is reported yet: the values that are known are written over the NaN.
    pub fn unreported(time_ns: u64, joints: usize) -> Self {
        let mut nothing = JointVector::zeros(joints);
        nothing.as_mut_slice().fill(f64::NAN);
        Self {
            time_ns,
            temperature: nothing,
            load: nothing,
            voltage: nothing,
            temperature_uncertainty: f64::NAN,
            load_uncertainty: f64::NAN,
            voltage_uncertainty: f64::NAN,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nobody_has_written_is_not_reported_and_never_0() {
        let mut motors = MotorState::unreported(7, 2);
        motors.temperature.set(1, 31.0);
        assert_eq!((motors.temperature.len(), motors.temperature.get(1)), (2, Some(31.0)));
        for vector in [motors.load, motors.voltage] {
            assert!(vector.as_slice().iter().all(|value| value.is_nan()), "{vector:?}");
        }
        assert!(motors.temperature.as_slice()[0].is_nan());
        let uncertainties =
            [motors.temperature_uncertainty, motors.load_uncertainty, motors.voltage_uncertainty];
        assert!(uncertainties.iter().all(|value| value.is_nan()), "{uncertainties:?}");
    }
}
