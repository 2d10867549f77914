//! Answers of a robot's driver that JSON has to write in another way than the contract's messages.

use plumb_plugin::{JogState, JointState, JointVector, MotorState, Value, message};
use serde::Deserialize;

/// The message of a layout of the contract, from what a driver answered: fields left out are zero, unknown ones are refused.
///
/// # Errors
/// What is wrong with the answer.
pub(crate) fn message_of(answer: &Value, layout: &str) -> Result<Value, String> {
    // Through the message's bytes.
    let layout = message::Layout::known(layout);
    let bytes = message::from_json(layout.as_ref(), answer)?;
    Ok(message::to_json(layout.as_ref(), &bytes))
}

/// The state of a robot from an answer such as `{"time_ns", "joints", "moving"}`.
///
/// # Errors
/// What is wrong with the answer.
pub(crate) fn joint_state(answer: &Value) -> Result<JointState, String> {
    serde_json::from_value(message_of(answer, "joint-state/1")?).map_err(|error| error.to_string())
}

/// What an operator has done with a pendant, from an answer such as `{"time_ns", "joints", "moving", "key", "finished"}`: without
/// `key` none was pressed, and without `finished` the operator goes on.
///
/// # Errors
/// What is wrong with the answer.
pub(crate) fn jog_state(mut answer: Value) -> Result<JogState, String> {
    let mut taken = |name: &str| {
        let value = answer.as_object_mut().and_then(|fields| fields.remove(name)).unwrap_or(Value::from(0));
        let number = value.as_u64().or_else(|| value.as_bool().map(u64::from));
        let number = number.and_then(|number| u32::try_from(number).ok());
        number.ok_or_else(|| format!("`{name}` has to be a whole number from 0, and is {value}"))
    };
    let (key, finished) = (taken("key")?, taken("finished")?);
    Ok(JogState { state: joint_state(&answer)?, key, finished })
}

/// What the motors of a robot report, as a driver writes it: a quantity that is left out, and a joint with null, is not reported.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Motors {
    time_ns: u64,
    temperature: Option<Vec<Option<f64>>>,
    load: Option<Vec<Option<f64>>>,
    voltage: Option<Vec<Option<f64>>>,
    temperature_uncertainty: Option<f64>,
    load_uncertainty: Option<f64>,
    voltage_uncertainty: Option<f64>,
}

/// What the motors of a robot of so many joints report: degrees Celsius, fractions of full torque, V, and one standard uncertainty
/// of each.
///
/// # Errors
/// What is wrong with the answer.
pub(crate) fn motor_state(answer: Value, joints: usize) -> Result<MotorState, String> {
    let motors: Motors = serde_json::from_value(answer).map_err(|error| error.to_string())?;
    let mut state = MotorState::unreported(motors.time_ns, joints);
    let quantities = [
        ("temperature", &motors.temperature, &mut state.temperature),
        ("load", &motors.load, &mut state.load),
        ("voltage", &motors.voltage, &mut state.voltage),
    ];
    for (name, reported, vector) in quantities {
        if let Some(reported) = reported {
            fill(vector, reported, joints).map_err(|why| format!("`{name}` {why}"))?;
        }
    }
    let uncertainties = [
        ("temperature_uncertainty", motors.temperature_uncertainty, &mut state.temperature_uncertainty),
        ("load_uncertainty", motors.load_uncertainty, &mut state.load_uncertainty),
        ("voltage_uncertainty", motors.voltage_uncertainty, &mut state.voltage_uncertainty),
    ];
    for (name, reported, uncertainty) in uncertainties {
        let Some(reported) = reported else { continue };
        if reported <= 0.0 {
            return Err(format!(
                "`{name}` is {reported}; give more than 0, or leave it out where it is not known"
            ));
        }
        *uncertainty = reported;
    }
    Ok(state)
}

fn fill(vector: &mut JointVector, reported: &[Option<f64>], joints: usize) -> Result<(), String> {
    if reported.len() != joints {
        return Err(format!(
            "has {} numbers for {joints} joints; give one for each, null where a motor does not report it",
            reported.len()
        ));
    }
    for (joint, value) in reported.iter().enumerate() {
        // What is null stays as it was: not reported.
        if let Some(value) = value {
            vector.set(joint, *value);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_jog_has_a_key_and_an_end_where_the_driver_names_them() {
        let still = jog_state(json!({"time_ns": 7, "joints": [0.5, 12.0]})).unwrap();
        assert_eq!((still.state.joints.as_slice(), still.key, still.finished), (&[0.5, 12.0][..], 0, 0));
        let ended =
            jog_state(json!({"time_ns": 7, "joints": [0.5], "moving": 1, "key": 3, "finished": true}));
        let ended = ended.unwrap();
        assert_eq!((ended.state.moving, ended.key, ended.finished), (1, 3, 1));
    }

    #[test]
    fn a_jog_that_cannot_be_understood_says_why() {
        for (answer, expected) in [
            (json!({"time_ns": 7, "joints": [0], "key": "stop"}), "`key` has to be a whole number from 0"),
            (json!({"time_ns": 7, "joints": [0], "finished": -1}), "`finished` has to be a whole number"),
            (json!({"time_ns": 7, "joints": [0], "kye": 1}), "kye"),
            (json!(null), "null"),
        ] {
            let why = jog_state(answer.clone()).unwrap_err();
            assert!(why.contains(expected), "{answer}: {why}");
        }
    }

    #[test]
    fn motors_report_what_is_written_and_nothing_else() {
        let answer = json!({"time_ns": 9, "temperature": [31.5, null], "temperature_uncertainty": 0.5});
        let motors = motor_state(answer, 2).unwrap();
        assert_eq!((motors.time_ns, motors.temperature.get(0)), (9, Some(31.5)));
        assert!(motors.temperature.as_slice()[1].is_nan());
        assert_eq!((motors.load.len(), motors.temperature_uncertainty), (2, 0.5));
        assert!(motors.load.as_slice().iter().all(|load| load.is_nan()));
        assert!(motors.load_uncertainty.is_nan() && motors.voltage_uncertainty.is_nan());
        let all = json!({"time_ns": 9, "load": [0.25], "voltage": [12.0], "load_uncertainty": 0.01, "voltage_uncertainty": 0.1});
        let motors = motor_state(all, 1).unwrap();
        assert_eq!((motors.load.get(0), motors.voltage.get(0)), (Some(0.25), Some(12.0)));
        assert_eq!((motors.load_uncertainty, motors.voltage_uncertainty), (0.01, 0.1));
    }

    #[test]
    fn motors_that_cannot_be_understood_say_why() {
        for (answer, expected) in [
            (json!({"time_ns": 9, "load": [0.1]}), "`load` has 1 numbers for 2 joints; give one for each"),
            (json!({"time_ns": 9, "temprature": [31, 32]}), "unknown field `temprature`"),
            (json!({"time_ns": 9, "voltage": ["hot", 1]}), "invalid type"),
            (json!({"time_ns": 9, "voltage_uncertainty": 0}), "`voltage_uncertainty` is 0; give more than 0"),
        ] {
            let why = motor_state(answer.clone(), 2).unwrap_err();
            assert!(why.contains(expected), "{answer}: {why}");
        }
    }
}
