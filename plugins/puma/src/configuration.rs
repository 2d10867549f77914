//! What a cell file says about the arm under `config:`.

use std::time::Duration;

use plumb_plugin::{PluginError, Value};
use serde::Deserialize;

/// The rates a system terminal is set to.
const BAUD_RATES: [u32; 7] = [300, 1200, 2400, 4800, 9600, 19200, 38400];

/// What a cell file says about the arm, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Such as `/dev/ttyUSB0`.
    pub port: String,
    /// Its rate.
    pub baud: u32,
    /// How lines are typed.
    pub typing: Typing,
    /// The SPEED that full speed means, percent.
    pub full_speed_percent: f64,
    /// Whether CALIBRATE may be run when the arm is activated.
    pub calibrate: bool,
    /// How long an echo may take, beside the time on the line.
    pub echo_within: Duration,
    /// How long an answer may take, beside the time on the line.
    pub reply_within: Duration,
}

/// How lines are typed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Typing {
    /// A character at a time, each echo awaited.
    #[default]
    Careful,
    /// Whole lines, their echo compared before the carriage return.
    Fast,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    port: String,
    #[serde(default = "usual_baud")]
    baud: u32,
    #[serde(default)]
    typing: Typing,
    #[serde(default = "usual_speed")]
    full_speed_percent: f64,
    #[serde(default)]
    calibrate: bool,
    #[serde(default = "usual_echo")]
    echo_within_ms: u64,
    #[serde(default = "usual_reply")]
    reply_within_ms: u64,
}

fn usual_baud() -> u32 {
    9600
}

fn usual_speed() -> f64 {
    50.0
}

fn usual_echo() -> u64 {
    400
}

fn usual_reply() -> u64 {
    2000
}

impl Configuration {
    /// Reads and checks what the cell file says.
    ///
    /// # Errors
    /// [`PluginError::Refused`], naming the key and what would be right.
    pub fn read(config: &Value) -> Result<Self, PluginError> {
        if config.is_null() {
            let text = "config: name the serial port of the controller's terminal, such as `config: {port: /dev/ttyUSB0}`";
            return Err(PluginError::Refused(text.to_owned()));
        }
        let raw: Raw =
            Raw::deserialize(config).map_err(|error| PluginError::Refused(format!("config: {error}")))?;
        let wrong = |key: &str, value: String, right: &str| {
            Err(PluginError::Refused(format!("config: {key} is {value}; {right}")))
        };
        if raw.port.trim().is_empty() {
            return wrong("port", "empty".to_owned(), "name the serial port, such as /dev/ttyUSB0");
        }
        if !BAUD_RATES.contains(&raw.baud) {
            return wrong("baud", raw.baud.to_string(), "give 300, 1200, 2400, 4800, 9600, 19200 or 38400");
        }
        if !(1.0..=100.0).contains(&raw.full_speed_percent) {
            return wrong("full_speed_percent", raw.full_speed_percent.to_string(), "give 1 to 100");
        }
        if !(20..=5000).contains(&raw.echo_within_ms) {
            return wrong("echo_within_ms", raw.echo_within_ms.to_string(), "give 20 to 5000");
        }
        if !(100..=20_000).contains(&raw.reply_within_ms) {
            return wrong("reply_within_ms", raw.reply_within_ms.to_string(), "give 100 to 20000");
        }
        Ok(Self {
            port: raw.port,
            baud: raw.baud,
            typing: raw.typing,
            full_speed_percent: raw.full_speed_percent,
            calibrate: raw.calibrate,
            echo_within: Duration::from_millis(raw.echo_within_ms),
            reply_within: Duration::from_millis(raw.reply_within_ms),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_port_is_enough_and_every_wrong_value_is_named() {
        let plain = Configuration::read(&json!({"port": "/dev/ttyUSB0"})).unwrap();
        assert_eq!((plain.baud, plain.typing, plain.calibrate), (9600, Typing::Careful, false));
        assert_eq!(Configuration::read(&json!({"port": "p", "baud": 38400})).unwrap().baud, 38_400);
        for (config, text) in [
            (json!(null), "config: name the serial port of the controller's terminal"),
            (json!({"port": ""}), "config: port is empty; name the serial port, such as /dev/ttyUSB0"),
            (
                json!({"port": "p", "baud": 110}),
                "config: baud is 110; give 300, 1200, 2400, 4800, 9600, 19200 or 38400",
            ),
            (json!({"port": "p", "full_speed_percent": 0}), "config: full_speed_percent is 0; give 1 to 100"),
            (
                json!({"port": "p", "typing": "hasty"}),
                "config: unknown variant `hasty`, expected `careful` or `fast`",
            ),
        ] {
            let error = Configuration::read(&config).unwrap_err();
            assert!(error.text().starts_with(text), "{error}");
        }
    }

    #[test]
    fn what_is_not_given_is_as_the_manual_says() {
        let plain = Configuration::read(&json!({"port": "p"})).unwrap();
        assert_eq!(plain.full_speed_percent, 50.0);
        assert_eq!(plain.echo_within, Duration::from_millis(400));
        assert_eq!(plain.reply_within, Duration::from_secs(2));
    }

    #[test]
    fn every_value_may_be_the_least_and_the_greatest_and_none_beyond() {
        for (key, inside, outside) in [
            ("full_speed_percent", [1.0, 100.0], [0.99, 100.1]),
            ("echo_within_ms", [20.0, 5000.0], [19.0, 5001.0]),
            ("reply_within_ms", [100.0, 20_000.0], [99.0, 20_001.0]),
        ] {
            let read = |value: f64| {
                let whole = key.ends_with("_ms");
                let value = if whole { json!(value as u64) } else { json!(value) };
                Configuration::read(&json!({"port": "p", key: value}))
            };
            for value in inside {
                assert!(read(value).is_ok(), "{key} {value}");
            }
            for value in outside {
                let error = read(value).unwrap_err();
                assert!(error.text().starts_with(&format!("config: {key} is {value}; give ")), "{error}");
            }
        }
    }
}
