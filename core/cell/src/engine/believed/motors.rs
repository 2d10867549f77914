//! What a robot says of its motors, held against what motors may say.

use plumb_plugin::{JointVector, MotorState, RobotDescription};

use super::{OLDEST_STATE, RequestTimes, Source, check_time};
use crate::motor_quantity::{MOTOR_QUANTITIES, MotorQuantity};

/// Whether a robot's motors can be in this state: a number for each joint, NaN where nothing is reported, and a time that can be.
pub(crate) fn check_motors(
    source: Source<'_>,
    robot: &RobotDescription,
    motors: &MotorState,
    asked: RequestTimes,
) -> Result<(), String> {
    for quantity in &MOTOR_QUANTITIES {
        check_values(source, robot, quantity, (quantity.values)(motors))?;
        let (device, name, uncertainty) = (source.device, quantity.name, (quantity.uncertainty)(motors));
        if uncertainty.is_infinite() || uncertainty <= 0.0 {
            return Err(source.blame(&format!(
                "{device} gives its motors' {name} a standard uncertainty of {uncertainty}; it is above 0, or NaN where it is not known"
            )));
        }
    }
    let is_unreported =
        |quantity: &MotorQuantity| (quantity.values)(motors).as_slice().iter().all(|value| value.is_nan());
    if MOTOR_QUANTITIES.iter().all(is_unreported) {
        return Err(source.blame(&format!(
            "{} reports nothing of its motors; a robot that cannot report them answers `unsupported`",
            source.device
        )));
    }
    check_time(source, motors.time_ns, asked, OLDEST_STATE)
}

/// Whether a quantity has a value for each joint that a motor can have, or NaN.
fn check_values(
    source: Source<'_>,
    robot: &RobotDescription,
    quantity: &MotorQuantity,
    values: &JointVector,
) -> Result<(), String> {
    let (device, name, lowest) = (source.device, quantity.name, quantity.lowest);
    if values.len() != robot.joints.len() {
        let (reported, has) = (values.len(), robot.joints.len());
        return Err(source.blame(&format!(
            "{device} reports the {name} of {reported} motors; it has {has} joints, and gives NaN for a motor that does not report it"
        )));
    }
    for (joint, value) in robot.joints.iter().zip(values.as_slice()) {
        if value.is_infinite() || *value < lowest {
            return Err(source.blame(&format!(
                "{device} reports a {name} of {value} for the motor of {}; it is a number from {lowest}, or NaN where it is not reported",
                joint.name
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ARM, robot, says, vector};
    use super::*;

    fn motors() -> MotorState {
        MotorState { temperature: vector([31.0, f64::NAN]), ..MotorState::unreported(5, 2) }
    }

    fn with(change: impl Fn(&mut MotorState)) -> Result<(), String> {
        let mut motors = motors();
        change(&mut motors);
        check_motors(ARM, &robot(), &motors, RequestTimes::default())
    }

    #[test]
    fn what_motors_may_report_is_believed() {
        assert_eq!(with(|_| ()), Ok(()));
        assert_eq!(with(|motors| motors.load = vector([0.0, 1.2])), Ok(()), "over full torque for a while");
        assert_eq!(with(|motors| motors.temperature_uncertainty = 0.3), Ok(()));
    }

    #[test]
    fn what_no_motor_can_report_names_joint_value_and_what_would_be_right() {
        let cold = with(|motors| motors.temperature = vector([20.0, -274.0]));
        says(cold, &["arm reports a temperature of -274", "motor of slide", "from -273.15", "`scara4`"]);
        says(with(|motors| motors.load = vector([-0.1, 0.0])), &["a load of -0.1", "motor of turn"]);
        says(with(|motors| motors.voltage = vector([f64::INFINITY, 7.0])), &["a voltage of inf"]);
        let short = with(|motors| motors.voltage = JointVector::zeros(1));
        says(short, &["the voltage of 1 motors; it has 2 joints", "NaN"]);
    }

    #[test]
    fn an_uncertainty_that_is_not_known_is_nan_and_never_0() {
        for uncertainty in [0.0, -0.1, f64::INFINITY] {
            let wrong = with(|motors| motors.voltage_uncertainty = uncertainty);
            says(wrong, &["voltage a standard uncertainty of", "above 0, or NaN"]);
        }
    }

    #[test]
    fn a_robot_that_reports_nothing_should_say_that_it_cannot() {
        says(with(|motors| motors.temperature = motors.load), &["nothing of its motors", "`unsupported`"]);
    }

    #[test]
    fn motors_of_long_ago_are_not_believed() {
        let second = 1_000_000_000;
        let asked = RequestTimes { reported_before_ns: 0, between_ns: Some((10 * second, 11 * second)) };
        let dated = |time_ns| check_motors(ARM, &robot(), &MotorState { time_ns, ..motors() }, asked);
        assert_eq!(dated(10 * second), Ok(()));
        says(dated(7 * second), &["3.000 s old"]);
    }
}
