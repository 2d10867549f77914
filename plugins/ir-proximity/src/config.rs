//! What a cell file gives under `config:`.

use plumb_plugin::{PluginError, Value};
use serde::{Deserialize, Serialize};

/// The most a change may be waited on, ms.
const LONGEST_DEBOUNCE_MS: f64 = 1000.0;

/// How the sensor is wired, and how its line is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConfig {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bit: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gpio: Option<GpioSetting>,
    #[serde(default)]
    active: Active,
    #[serde(default)]
    debounce_ms: f64,
}

/// How the sensor is wired, and how its line is read: checked.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Config {
    /// Where the line ends.
    pub(crate) wiring: Wiring,
    /// The level while the sensor sees a reflection.
    pub(crate) active: Active,
    /// A change that is taken back sooner than this is not one, ms.
    debounce_ms: f64,
}

/// Where the sensor's line ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Wiring {
    /// At an input of the robot that carries it: its bit.
    RobotInput(u32),
    /// At a line of this computer.
    Gpio(GpioSetting),
}

/// A line of a GPIO chip of this computer.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GpioSetting {
    /// The chip's device file.
    pub(crate) chip: String,
    /// The line's number on it.
    pub(crate) line: u32,
}

/// A level of the line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Active {
    /// 1.
    #[default]
    High,
    /// 0.
    Low,
}

impl Config {
    pub(crate) fn read(value: &Value) -> Result<Config, PluginError> {
        let raw = RawConfig::deserialize(value).map_err(|error| {
            PluginError::Refused(format!(
                "{error}; ir-proximity takes {{bit: 0 to 63}} or {{gpio: {{chip, line}}}}, and {{active: high or low, debounce_ms: 0 to 1000}}"
            ))
        })?;
        raw.check()
    }

    /// This configuration with some of its keys changed.
    pub(crate) fn with(&self, changes: &Value) -> Result<Config, PluginError> {
        let Value::Object(changes) = changes else {
            return Err(PluginError::Refused("settings are given as {key: value}".to_owned()));
        };
        let raw = RawConfig {
            bit: self.robot_input(),
            gpio: self.gpio().cloned(),
            active: self.active,
            debounce_ms: self.debounce_ms,
        };
        let mut merged = serde_json::to_value(raw).map_err(|error| PluginError::Failed(error.to_string()))?;
        if let Value::Object(keys) = &mut merged {
            keys.extend(changes.clone());
        }
        let changed = Config::read(&merged)?;
        if changed.gpio() != self.gpio() {
            let text = "which line of the computer the sensor is wired to is said in the cell file, not while it is in use";
            return Err(PluginError::Refused(text.to_owned()));
        }
        Ok(changed)
    }

    /// The bit of the levels that are watched: a line of this computer is reported as the only one there is.
    pub(crate) fn bit(&self) -> u32 {
        self.robot_input().unwrap_or(0)
    }

    /// The line of this computer, if that is where the sensor is wired to.
    pub(crate) fn gpio(&self) -> Option<&GpioSetting> {
        match &self.wiring {
            Wiring::RobotInput(_) => None,
            Wiring::Gpio(setting) => Some(setting),
        }
    }

    fn robot_input(&self) -> Option<u32> {
        match self.wiring {
            Wiring::RobotInput(bit) => Some(bit),
            Wiring::Gpio(_) => None,
        }
    }

    pub(crate) fn debounce_ns(&self) -> u64 {
        (self.debounce_ms * 1e6) as u64
    }

    #[cfg(test)]
    pub(crate) fn of_bit(bit: u32, active: Active, debounce_ms: f64) -> Config {
        Config { wiring: Wiring::RobotInput(bit), active, debounce_ms }
    }
}

impl RawConfig {
    fn check(self) -> Result<Config, PluginError> {
        let refused = |text: String| Err(PluginError::Refused(text));
        let wiring = match (self.bit, self.gpio) {
            (Some(bit), None) if bit > 63 => {
                return refused(format!("`bit` is {bit}; a line's bit is 0 to 63"));
            }
            (Some(bit), None) => Wiring::RobotInput(bit),
            (None, Some(gpio)) => Wiring::Gpio(gpio),
            (None, None) | (Some(_), Some(_)) => {
                return refused(
                    "say where the sensor's line ends, once: `bit: 0` for an input of the robot (with `inputs: {line: ROBOT/inputs}`), or `gpio: {chip: /dev/gpiochip0, line: 17}` for a line of this computer (with `inputs: {joints: ROBOT/joints}`)"
                        .to_owned(),
                );
            }
        };
        if !(0.0..=LONGEST_DEBOUNCE_MS).contains(&self.debounce_ms) {
            return refused(format!(
                "`debounce_ms` is {}; it must be 0 to {LONGEST_DEBOUNCE_MS}",
                self.debounce_ms
            ));
        }
        Ok(Config { wiring, active: self.active, debounce_ms: self.debounce_ms })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn refusal(config: Value) -> String {
        Config::read(&config).unwrap_err().to_string()
    }

    #[test]
    fn the_line_ends_at_the_robot_or_at_this_computer() {
        assert_eq!(Config::read(&json!({"bit": 2})).unwrap().wiring, Wiring::RobotInput(2));
        let gpio = Config::read(&json!({"gpio": {"chip": "/dev/gpiochip0", "line": 17}})).unwrap();
        assert_eq!(gpio.wiring, Wiring::Gpio(GpioSetting { chip: "/dev/gpiochip0".to_owned(), line: 17 }));
        assert_eq!(gpio.bit(), 0);
    }

    #[test]
    fn neither_both_and_impossible_lines_are_refused_with_what_would_be_right() {
        for config in [json!({}), json!({"bit": 0, "gpio": {"chip": "/dev/gpiochip0", "line": 1}})] {
            assert!(refusal(config).starts_with("say where the sensor's line ends, once: `bit: 0`"));
        }
        assert_eq!(refusal(json!({"bit": 64})), "`bit` is 64; a line's bit is 0 to 63");
        assert_eq!(
            refusal(json!({"bit": 0, "debounce_ms": -1})),
            "`debounce_ms` is -1; it must be 0 to 1000"
        );
        assert!(refusal(json!({"pin": 3})).starts_with("unknown field `pin`"));
    }

    #[test]
    fn a_line_of_the_computer_is_not_changed_while_it_is_in_use() {
        let config = Config::read(&json!({"gpio": {"chip": "/dev/gpiochip0", "line": 17}})).unwrap();
        assert_eq!(config.with(&json!({"active": "low"})).unwrap().active, Active::Low);
        let error = config.with(&json!({"gpio": {"chip": "/dev/gpiochip0", "line": 18}})).unwrap_err();
        assert!(error.to_string().contains("is said in the cell file"), "{error}");
    }
}
