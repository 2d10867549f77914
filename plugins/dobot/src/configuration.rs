//! What a cell file says about the arm under `config:`.

use std::path::PathBuf;
use std::time::Duration;

use plumb_plugin::{PluginError, Value};
use serde::Deserialize;

/// What a cell file says about the arm, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Such as `/dev/ttyUSB0`.
    pub port: String,
    /// Whether the servo that turns the hand is there.
    pub hand: bool,
    /// What full speed means, deg/s.
    pub full_speed: f64,
    /// How the joints speed up and slow down, deg/s2.
    pub acceleration: f64,
    /// How near to its target a joint has to come to rest, deg.
    pub settles_within: f64,
    /// The least and the greatest angle between the arms, deg.
    pub between_arms: [f64; 2],
    /// How long the controller may take to answer.
    pub reply_within: Duration,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    #[serde(rename = "cell_directory")]
    _cell_directory: Option<PathBuf>,
    #[serde(default)]
    port: String,
    hand: Option<bool>,
    full_speed_deg_per_s: Option<f64>,
    acceleration_deg_per_s2: Option<f64>,
    settles_within_deg: Option<f64>,
    between_arms_deg: Option<[f64; 2]>,
    reply_within_ms: Option<u32>,
}

/// A number of the cell file, what it is unless given, and what it may be.
type Number = (&'static str, Option<f64>, f64, [f64; 2]);

impl Configuration {
    /// Reads and checks what the cell file says.
    ///
    /// # Errors
    /// [`PluginError::Refused`], naming the key and what would be right.
    pub fn read(config: &Value) -> Result<Self, PluginError> {
        let refused = |text: String| PluginError::Refused(format!("config: {text}"));
        let missing = || {
            refused("port is missing or empty; name the arm's serial port, such as /dev/ttyUSB0".to_owned())
        };
        if config.is_null() {
            return Err(missing());
        }
        let raw = Raw::deserialize(config).map_err(|error| refused(error.to_string()))?;
        if raw.port.trim().is_empty() {
            return Err(missing());
        }
        // The User Guide's technical specifications: 320 deg/s with 250 g in the hand.
        let speed = ("full_speed_deg_per_s", raw.full_speed_deg_per_s, 60.0, [1.0, 320.0]);
        let acceleration = ("acceleration_deg_per_s2", raw.acceleration_deg_per_s2, 100.0, [1.0, 1000.0]);
        let settles = ("settles_within_deg", raw.settles_within_deg, 0.05, [0.01, 2.0]);
        let reply = ("reply_within_ms", raw.reply_within_ms.map(f64::from), 200.0, [10.0, 2000.0]);
        let between_arms = raw.between_arms_deg.unwrap_or([20.0, 145.0]);
        let [least, most] = between_arms;
        if !(0.0 <= least && least < most && most <= 180.0) {
            return Err(refused(format!(
                "between_arms_deg is [{least}, {most}]; give the least and the greatest angle, within 0 and 180"
            )));
        }
        Ok(Self {
            port: raw.port,
            hand: raw.hand.unwrap_or(true),
            full_speed: number(speed)?,
            acceleration: number(acceleration)?,
            settles_within: number(settles)?,
            between_arms,
            reply_within: Duration::from_secs_f64(number(reply)? / 1e3),
        })
    }
}

fn number((key, given, unless_given, [least, most]): Number) -> Result<f64, PluginError> {
    let value = given.unwrap_or(unless_given);
    match (least..=most).contains(&value) {
        true => Ok(value),
        false => Err(PluginError::Refused(format!("config: {key} is {value}; give {least} to {most}"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_port_is_enough() {
        let read = Configuration::read(&json!({"port": "p", "cell_directory": "/cells"})).unwrap();
        assert_eq!((read.hand, read.full_speed, read.between_arms), (true, 60.0, [20.0, 145.0]));
    }

    #[test]
    fn every_wrong_value_is_named_with_what_would_be_right() {
        for (config, text) in [
            (json!(null), "config: port is missing or empty; name the arm's serial port"),
            (json!({"port": " "}), "config: port is missing or empty"),
            (
                json!({"port": "p", "full_speed_deg_per_s": 900}),
                "config: full_speed_deg_per_s is 900; give 1 to 320",
            ),
            (
                json!({"port": "p", "settles_within_deg": 0}),
                "config: settles_within_deg is 0; give 0.01 to 2",
            ),
            (
                json!({"port": "p", "between_arms_deg": [145, 20]}),
                "config: between_arms_deg is [145, 20]; give",
            ),
            (json!({"port": "p", "baud": 9600}), "config: unknown field `baud`"),
        ] {
            let error = Configuration::read(&config).unwrap_err();
            assert!(error.text().starts_with(text), "{error}");
        }
    }
}
