//! What a cell file says about the arm under `config:`.

use std::collections::HashSet;
use std::path::PathBuf;
use std::time::Duration;

use plumb_plugin::{PluginError, Value};
use serde::Deserialize;

/// Rates of the bus.
const RATES: [u32; 7] = [38_400, 57_600, 115_200, 128_000, 250_000, 500_000, 1_000_000];
/// As many joints as a message holds.
const MOST_JOINTS: usize = 16;
/// Degrees a servo can be sent to either side of its middle.
const TRAVEL_DEG: [f64; 2] = [-180.0, 179.9];

/// What a cell file says about the arm, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Such as `/dev/ttyACM0`.
    pub port: String,
    /// The rate of the bus.
    pub baud: u32,
    /// The joints in their order.
    pub joints: Vec<JointSetting>,
    /// Where directions and homing offsets are kept.
    pub calibration: Option<PathBuf>,
    /// What full speed means, deg/s.
    pub full_speed: f64,
    /// How the servos speed up, deg/s2.
    pub acceleration: f64,
    /// How near to its target a joint has to come to rest, steps.
    pub settles_within: i32,
    /// How long a servo may take to answer.
    pub reply_within: Duration,
    /// Whether the servos are let loose when the arm is put away.
    pub release_at_end: bool,
}

/// One joint and its servo.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointSetting {
    /// As procedures name it.
    pub name: String,
    /// The servo's number.
    pub servo: u8,
    /// The lowest it may go, deg.
    pub from_deg: f64,
    /// The highest it may go, deg.
    pub to_deg: f64,
    /// Whether the servo counts down where the angle grows.
    #[serde(default)]
    pub reversed: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    cell_directory: Option<PathBuf>,
    #[serde(default)]
    port: String,
    #[serde(default = "usual_baud")]
    baud: u32,
    joints: Vec<JointSetting>,
    calibration: Option<PathBuf>,
    #[serde(default = "usual_speed")]
    full_speed_deg_per_s: f64,
    #[serde(default = "usual_acceleration")]
    acceleration_deg_per_s2: f64,
    #[serde(default = "usual_settling")]
    settles_within_steps: i32,
    #[serde(default = "usual_reply")]
    reply_within_ms: u64,
    #[serde(default)]
    release_at_end: bool,
}

fn usual_baud() -> u32 {
    1_000_000
}

fn usual_speed() -> f64 {
    60.0
}

fn usual_acceleration() -> f64 {
    180.0
}

fn usual_settling() -> i32 {
    1
}

fn usual_reply() -> u64 {
    60
}

fn refused(text: String) -> PluginError {
    PluginError::Refused(format!("config: {text}"))
}

impl Configuration {
    /// Reads and checks what the cell file says.
    ///
    /// # Errors
    /// [`PluginError::Refused`], naming the key and what would be right.
    pub fn read(config: &Value) -> Result<Self, PluginError> {
        if config.is_null() {
            let example = "config: {port: /dev/ttyACM0, joints: [{name: elbow_flex, servo: 3, from_deg: -96, to_deg: 96}]}";
            return Err(PluginError::Refused(format!(
                "config: name the port of the bus adapter and the joints, such as `{example}`"
            )));
        }
        let raw = Raw::deserialize(config).map_err(|error| refused(error.to_string()))?;
        if raw.port.trim().is_empty() {
            return Err(refused(
                "port is missing or empty; name the serial port of the bus adapter, such as /dev/ttyACM0"
                    .to_owned(),
            ));
        }
        if !RATES.contains(&raw.baud) {
            return Err(refused(format!("baud is {}; the servos know {RATES:?}", raw.baud)));
        }
        check_joints(&raw.joints)?;
        for (key, value, [least, most]) in [
            ("full_speed_deg_per_s", raw.full_speed_deg_per_s, [1.0, 270.0]),
            ("acceleration_deg_per_s2", raw.acceleration_deg_per_s2, [9.0, 2200.0]),
            ("settles_within_steps", f64::from(raw.settles_within_steps), [1.0, 40.0]),
            ("reply_within_ms", raw.reply_within_ms as f64, [5.0, 500.0]),
        ] {
            if !(least..=most).contains(&value) {
                return Err(refused(format!("{key} is {value}; give {least} to {most}")));
            }
        }
        let beside_the_cell = |file: PathBuf| match &raw.cell_directory {
            Some(directory) => directory.join(file),
            None => file,
        };
        Ok(Self {
            port: raw.port,
            baud: raw.baud,
            joints: raw.joints,
            calibration: raw.calibration.map(beside_the_cell),
            full_speed: raw.full_speed_deg_per_s,
            acceleration: raw.acceleration_deg_per_s2,
            settles_within: raw.settles_within_steps,
            reply_within: Duration::from_millis(raw.reply_within_ms),
            release_at_end: raw.release_at_end,
        })
    }
}

fn check_joints(joints: &[JointSetting]) -> Result<(), PluginError> {
    if joints.is_empty() || joints.len() > MOST_JOINTS {
        return Err(refused(format!("joints lists {}; an arm has 1 to {MOST_JOINTS}", joints.len())));
    }
    let (mut names, mut servos) = (HashSet::new(), HashSet::new());
    for joint in joints {
        let JointSetting { name, servo, from_deg, to_deg, .. } = joint;
        if name.trim().is_empty() || !names.insert(name) {
            return Err(refused(format!("joints: two are called `{name}`, or one has no name")));
        }
        if *servo > 253 || !servos.insert(servo) {
            return Err(refused(format!(
                "joints: {name} has servo {servo}; each has one of its own, 0 to 253"
            )));
        }
        let [least, most] = TRAVEL_DEG;
        if !(*from_deg >= least && from_deg < to_deg && *to_deg <= most) {
            return Err(refused(format!(
                "joints: {name} goes from {from_deg} to {to_deg} degrees; give from_deg below to_deg, both within {least} and {most}"
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn elbow() -> Value {
        json!({"name": "elbow", "servo": 3, "from_deg": -90, "to_deg": 90})
    }

    #[test]
    fn a_port_and_joints_are_enough() {
        let config =
            json!({"port": "p", "joints": [elbow()], "calibration": "c.json", "cell_directory": "/cells"});
        let read = Configuration::read(&config).unwrap();
        assert_eq!((read.baud, read.full_speed, read.release_at_end), (1_000_000, 60.0, false));
        assert_eq!(read.calibration, Some(PathBuf::from("/cells/c.json")));
        assert!(!read.joints[0].reversed);
    }

    #[test]
    fn every_wrong_value_is_named_with_what_would_be_right() {
        let with = |key: &str, value: Value| {
            let mut config = json!({"port": "p", "joints": [elbow()]});
            config[key] = value;
            config
        };
        let mut wide = elbow();
        wide["to_deg"] = json!(190);
        let mut other = elbow();
        other["name"] = json!("wrist");
        for (config, text) in [
            (json!(null), "config: name the port of the bus adapter and the joints, such as"),
            (with("port", json!(" ")), "config: port is missing or empty; name the serial port"),
            (with("baud", json!(9600)), "config: baud is 9600; the servos know"),
            (with("joints", json!([])), "config: joints lists 0; an arm has 1 to 16"),
            (with("joints", json!([elbow(), elbow()])), "config: joints: two are called `elbow`"),
            (
                with("joints", json!([elbow(), other])),
                "config: joints: wrist has servo 3; each has one of its own",
            ),
            (with("joints", json!([wide])), "config: joints: elbow goes from -90 to 190 degrees"),
            (with("full_speed_deg_per_s", json!(0)), "config: full_speed_deg_per_s is 0; give 1 to 270"),
            (with("speed", json!(1)), "config: unknown field `speed`"),
        ] {
            let error = Configuration::read(&config).unwrap_err();
            assert!(error.text().starts_with(text), "{error}");
        }
    }
}
