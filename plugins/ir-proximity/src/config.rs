//! What a cell file gives under `config:`.

use plumb_plugin::{PluginError, Value};
use serde::{Deserialize, Serialize};

/// The most a change may be waited on, ms.
const LONGEST_DEBOUNCE_MS: f64 = 1000.0;

/// How the sensor is wired, and how its line is read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Config {
    /// The input line, from 0.
    pub(crate) bit: u32,
    /// The level while the sensor sees a reflection.
    #[serde(default)]
    pub(crate) active: Active,
    /// A change that is taken back sooner than this is not one, ms.
    #[serde(default)]
    pub(crate) debounce_ms: f64,
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
        let config: Config = Config::deserialize(value).map_err(|error| {
            PluginError::Refused(format!(
                "{error}; ir-proximity takes {{bit: 0 to 63, active: high or low, debounce_ms: 0 to 1000}}, of which `bit` must be given"
            ))
        })?;
        if config.bit > 63 {
            return Err(PluginError::Refused(format!("`bit` is {}; a line's bit is 0 to 63", config.bit)));
        }
        if !(0.0..=LONGEST_DEBOUNCE_MS).contains(&config.debounce_ms) {
            return Err(PluginError::Refused(format!(
                "`debounce_ms` is {}; it must be 0 to {LONGEST_DEBOUNCE_MS}",
                config.debounce_ms
            )));
        }
        Ok(config)
    }

    /// This configuration with some of its keys changed.
    pub(crate) fn with(&self, changes: &Value) -> Result<Config, PluginError> {
        let Value::Object(changes) = changes else {
            return Err(PluginError::Refused("settings are given as {key: value}".to_owned()));
        };
        let mut merged =
            serde_json::to_value(self).map_err(|error| PluginError::Failed(error.to_string()))?;
        if let Value::Object(keys) = &mut merged {
            keys.extend(changes.clone());
        }
        Config::read(&merged)
    }

    pub(crate) fn debounce_ns(&self) -> u64 {
        (self.debounce_ms * 1e6) as u64
    }
}
