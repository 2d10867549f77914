//! What a cell file says about the arm under `config:`.

use std::time::Duration;

use plumb_plugin::{PluginError, Value};
use serde::Deserialize;

/// What a cell file says about the arm, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Where the controller is.
    pub address: String,
    /// Of RTDE.
    pub rtde_port: u16,
    /// Of the primary or secondary interface.
    pub script_port: u16,
    /// Of the dashboard; none where there is none.
    pub dashboard_port: Option<u16>,
    /// Of the joint that goes furthest, rad/s.
    pub full_speed: f64,
    /// rad/s2.
    pub acceleration: f64,
    /// rad/s2.
    pub stop_deceleration: f64,
    /// How long the controller goes on without a sign of life.
    pub watchdog: Duration,
    /// The first of two integer registers.
    pub first_register: u8,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    #[serde(default)]
    address: Option<String>,
    rtde_port: Option<u16>,
    script_port: Option<u16>,
    dashboard_port: Option<u16>,
    full_speed_deg_per_s: Option<f64>,
    acceleration_deg_per_s2: Option<f64>,
    stop_deceleration_deg_per_s2: Option<f64>,
    watchdog_ms: Option<u64>,
    first_register: Option<u8>,
}

impl Configuration {
    /// Reads and checks what the cell file says.
    ///
    /// # Errors
    /// [`PluginError::Refused`], naming the key and what would be right.
    pub fn read(config: &Value) -> Result<Self, PluginError> {
        let unnamed = || {
            let text = "config: name the controller's address on the network, such as `config: {address: 192.168.1.10}`";
            PluginError::Refused(text.to_owned())
        };
        if config.is_null() {
            return Err(unnamed());
        }
        let raw: Raw =
            Raw::deserialize(config).map_err(|error| PluginError::Refused(format!("config: {error}")))?;
        let given = raw.address.ok_or_else(unnamed)?;
        let address = given.trim().to_owned();
        if address.is_empty() || address.contains(['/', ' ']) {
            return Err(wrong("address", &given, "give an address alone, such as 192.168.1.10"));
        }
        let port = |key: &str, value: Option<u16>, usual: u16| match value {
            Some(0) => Err(wrong(key, "0", "give 1 to 65535")),
            value => Ok(value.unwrap_or(usual)),
        };
        let degrees = |key: &str, value: Option<f64>, usual: f64, [least, most]: [f64; 2]| {
            let value = value.unwrap_or(usual);
            match (least..=most).contains(&value) {
                true => Ok(value.to_radians()),
                false => Err(wrong(key, &value.to_string(), &format!("give {least} to {most}"))),
            }
        };
        let watchdog_ms = raw.watchdog_ms.unwrap_or(250);
        if !(50..=2000).contains(&watchdog_ms) {
            return Err(wrong("watchdog_ms", &watchdog_ms.to_string(), "give 50 to 2000"));
        }
        let first_register = raw.first_register.unwrap_or(24);
        if !(24..=46).contains(&first_register) {
            let right = "give 24 to 46; those below are for fieldbuses";
            return Err(wrong("first_register", &first_register.to_string(), right));
        }
        Ok(Self {
            address,
            rtde_port: port("rtde_port", raw.rtde_port, 30_004)?,
            script_port: port("script_port", raw.script_port, 30_001)?,
            dashboard_port: Some(raw.dashboard_port.unwrap_or(29_999)).filter(|port| *port != 0),
            full_speed: degrees("full_speed_deg_per_s", raw.full_speed_deg_per_s, 60.0, [1.0, 180.0])?,
            acceleration: degrees(
                "acceleration_deg_per_s2",
                raw.acceleration_deg_per_s2,
                80.0,
                [5.0, 800.0],
            )?,
            stop_deceleration: degrees(
                "stop_deceleration_deg_per_s2",
                raw.stop_deceleration_deg_per_s2,
                300.0,
                [30.0, 2000.0],
            )?,
            watchdog: Duration::from_millis(watchdog_ms),
            first_register,
        })
    }
}

fn wrong(key: &str, value: &str, right: &str) -> PluginError {
    PluginError::Refused(format!("config: {key} is {value}; {right}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn an_address_is_enough_and_every_wrong_value_is_named() {
        let plain = Configuration::read(&json!({"address": "192.168.1.10"})).unwrap();
        assert_eq!(
            (plain.rtde_port, plain.script_port, plain.dashboard_port),
            (30_004, 30_001, Some(29_999))
        );
        assert!((plain.full_speed - 60.0_f64.to_radians()).abs() < 1e-12);
        for (config, text) in [
            (json!(null), "config: name the controller's address on the network"),
            (json!({"watchdog_ms": 100}), "config: name the controller's address on the network"),
            (json!({"address": " "}), "config: address is  ; give an address alone, such as 192.168.1.10"),
            (json!({"address": "http://ur"}), "config: address is http://ur; give an address alone"),
            (json!({"address": "a", "rtde_port": 0}), "config: rtde_port is 0; give 1 to 65535"),
            (
                json!({"address": "a", "full_speed_deg_per_s": 400}),
                "config: full_speed_deg_per_s is 400; give 1 to 180",
            ),
            (json!({"address": "a", "watchdog_ms": 5}), "config: watchdog_ms is 5; give 50 to 2000"),
            (json!({"address": "a", "first_register": 3}), "config: first_register is 3; give 24 to 46"),
            (json!({"adress": "a"}), "config: unknown field `adress`"),
        ] {
            let error = Configuration::read(&config).unwrap_err();
            assert!(error.text().starts_with(text), "{error}");
        }
    }
}
