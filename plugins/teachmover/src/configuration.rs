//! What a cell file says about the arm under `config:`.

use plumb_plugin::{PluginError, Value};
use serde::Deserialize;

use crate::drive::{Joints, RegisterZero};
use crate::speed_code::SpeedCode;

/// The rates the switches of the controller offer.
const BAUD_RATES: [u32; 8] = [110, 150, 300, 600, 1200, 2400, 4800, 9600];

/// What a cell file says about the arm, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// Such as `/dev/ttyUSB0`.
    pub port: String,
    /// The rate the switches SW1 to SW3 are set to.
    pub baud: u32,
    /// The character the arm answers to.
    pub recognition: u8,
    /// Where the arm stands when its registers read zero.
    pub zero: RegisterZero,
    /// The speed number that `speed_fraction` 1 stands for.
    pub full_speed: SpeedCode,
    /// Moves at or below this fraction of full speed read the inputs after every half-step.
    pub fine_at_speed: f64,
    /// How long a stop may take: ms.
    pub stop_within_ms: u32,
    /// How long the controller may take to answer, beside the time on the line and that of the motion: ms.
    pub reply_within_ms: u32,
    /// Where the grip switch is found among the inputs; `None` where nobody has found out.
    pub grip_switch: Option<GripSwitch>,
    /// Whether the operator has confirmed, in the cell file, that hand control is ended by the pendant alone.
    pub hand_control: bool,
}

/// Where the grip switch is found among the inputs that `@READ` reports. No source says it: it is found by closing the fingers on something
/// and reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GripSwitch {
    /// Its bit in the inputs, 0 to 7.
    pub bit: u32,
    /// The level that means that the fingers touch something.
    #[serde(default)]
    pub touching: Level,
}

/// The level of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// 1.
    #[default]
    High,
    /// 0.
    Low,
}

impl GripSwitch {
    /// Whether these inputs say that the fingers touch something.
    pub fn is_touching(self, inputs: u8) -> bool {
        (u32::from(inputs) >> self.bit & 1 == 1) == (self.touching == Level::High)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawConfiguration {
    port: String,
    #[serde(default = "usual_baud")]
    baud: u32,
    #[serde(default = "usual_recognition")]
    recognition: char,
    #[serde(default)]
    registers_zero: RawPose,
    #[serde(default = "usual_speed")]
    full_speed_code: u8,
    #[serde(default = "usual_fine_speed")]
    fine_at_speed: f64,
    #[serde(default = "usual_stop")]
    stop_within_ms: u32,
    #[serde(default = "usual_reply")]
    reply_within_ms: u32,
    grip_switch: Option<GripSwitch>,
    #[serde(default)]
    only_the_pendant_stops: Vec<PendantMode>,
}

/// What runs in the controller by itself, so that only its pendant stops it.
#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum PendantMode {
    HandControl,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct RawPose {
    waist_deg: f64,
    shoulder_deg: f64,
    elbow_deg: f64,
    wrist_pitch_deg: f64,
    wrist_roll_deg: f64,
    gripper_mm: f64,
}

fn usual_baud() -> u32 {
    9600
}

fn usual_recognition() -> char {
    '@'
}

/// 290 half-steps a second: under the rated speed of every motor without load.
fn usual_speed() -> u8 {
    220
}

/// The speed of the second, slow approach of a search.
fn usual_fine_speed() -> f64 {
    0.25
}

fn usual_stop() -> u32 {
    100
}

fn usual_reply() -> u32 {
    1000
}

impl RawPose {
    fn joints(&self) -> Joints {
        [
            self.waist_deg.to_radians(),
            self.shoulder_deg.to_radians(),
            self.elbow_deg.to_radians(),
            self.wrist_pitch_deg.to_radians(),
            self.wrist_roll_deg.to_radians(),
            self.gripper_mm,
        ]
    }
}

impl Configuration {
    /// Reads and checks what the cell file says.
    ///
    /// # Errors
    /// [`PluginError::Refused`], naming the key and what would be right.
    pub fn read(config: &Value) -> Result<Self, PluginError> {
        if config.get("port").is_none() {
            return Err(PluginError::Refused(
                "config: name the serial port the arm is on, such as `config: {port: /dev/ttyUSB0}`"
                    .to_owned(),
            ));
        }
        let raw: RawConfiguration = serde_json::from_value(config.clone())
            .map_err(|error| PluginError::Refused(format!("config: {error}")))?;
        raw.check()
    }
}

impl RawConfiguration {
    fn check(self) -> Result<Configuration, PluginError> {
        let wrong = |key: &str, value: String, right: &str| {
            Err(PluginError::Refused(format!("config: {key} is {value}; {right}")))
        };
        if self.port.trim().is_empty() {
            return wrong("port", "empty".to_owned(), "name the serial port, such as /dev/ttyUSB0");
        }
        if !BAUD_RATES.contains(&self.baud) {
            let right = "the controller's switches offer 110, 150, 300, 600, 1200, 2400, 4800 and 9600";
            return wrong("baud", self.baud.to_string(), right);
        }
        if !self.recognition.is_ascii_graphic() {
            return wrong(
                "recognition",
                format!("{:?}", self.recognition),
                "give one printable character, usually '@'",
            );
        }
        let Some(full_speed) = SpeedCode::new(self.full_speed_code) else {
            return wrong(
                "full_speed_code",
                self.full_speed_code.to_string(),
                "the controller takes 0 to 245",
            );
        };
        if !(0.0..=1.0).contains(&self.fine_at_speed) {
            return wrong(
                "fine_at_speed",
                self.fine_at_speed.to_string(),
                "give a part of full speed, from 0 to 1",
            );
        }
        if !(50..=2000).contains(&self.stop_within_ms) {
            return wrong("stop_within_ms", self.stop_within_ms.to_string(), "give 50 to 2000");
        }
        if !(100..=10_000).contains(&self.reply_within_ms) {
            return wrong("reply_within_ms", self.reply_within_ms.to_string(), "give 100 to 10000");
        }
        if let Some(switch) = self.grip_switch.filter(|switch| switch.bit > 7) {
            return wrong("grip_switch: bit", switch.bit.to_string(), "the controller reports inputs 0 to 7");
        }
        Ok(Configuration {
            zero: RegisterZero::at(self.registers_zero.joints()),
            port: self.port,
            baud: self.baud,
            recognition: self.recognition as u8,
            full_speed,
            fine_at_speed: self.fine_at_speed,
            stop_within_ms: self.stop_within_ms,
            reply_within_ms: self.reply_within_ms,
            grip_switch: self.grip_switch,
            hand_control: self.only_the_pendant_stops.contains(&PendantMode::HandControl),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn refusal(config: Value) -> String {
        match Configuration::read(&config) {
            Err(PluginError::Refused(text)) => text,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_port_is_enough() {
        let configuration = Configuration::read(&json!({"port": "/dev/ttyUSB0"})).unwrap();
        assert_eq!(configuration.baud, 9600);
        assert_eq!(configuration.recognition, b'@');
        assert_eq!(configuration.grip_switch, None);
        assert!(!configuration.hand_control);
    }

    #[test]
    fn every_wrong_value_is_named_with_what_would_be_right() {
        let port = "/dev/ttyUSB0";
        for (config, text) in [
            (
                json!(null),
                "config: name the serial port the arm is on, such as `config: {port: /dev/ttyUSB0}`",
            ),
            (json!({"port": " "}), "config: port is empty; name the serial port, such as /dev/ttyUSB0"),
            (
                json!({"port": port, "baud": 19200}),
                "config: baud is 19200; the controller's switches offer 110, 150, 300, 600, 1200, 2400, 4800 and 9600",
            ),
            (
                json!({"port": port, "recognition": "\u{e9}"}),
                "config: recognition is 'é'; give one printable character, usually '@'",
            ),
            (
                json!({"port": port, "full_speed_code": 250}),
                "config: full_speed_code is 250; the controller takes 0 to 245",
            ),
            (
                json!({"port": port, "fine_at_speed": 2}),
                "config: fine_at_speed is 2; give a part of full speed, from 0 to 1",
            ),
            (json!({"port": port, "stop_within_ms": 10}), "config: stop_within_ms is 10; give 50 to 2000"),
            (
                json!({"port": port, "reply_within_ms": 10}),
                "config: reply_within_ms is 10; give 100 to 10000",
            ),
            (
                json!({"port": port, "grip_switch": {"bit": 8}}),
                "config: grip_switch: bit is 8; the controller reports inputs 0 to 7",
            ),
        ] {
            assert_eq!(refusal(config), text);
        }
    }

    #[test]
    fn an_unknown_key_is_named() {
        let text = refusal(json!({"port": "/dev/ttyUSB0", "bawd": 9600}));
        assert!(text.starts_with("config: unknown field `bawd`, expected one of `port`, `baud`"), "{text}");
    }

    #[test]
    fn the_grip_switch_may_be_closed_at_either_level() {
        let high = GripSwitch { bit: 7, touching: Level::High };
        let low = GripSwitch { bit: 7, touching: Level::Low };
        assert!(high.is_touching(0x80) && !high.is_touching(0x7f));
        assert!(low.is_touching(0x7f) && !low.is_touching(0x80));
    }
}
