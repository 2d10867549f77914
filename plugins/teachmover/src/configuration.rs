//! What a cell file says about the arm under `config:`.

use std::path::PathBuf;

use plumb_plugin::{PluginError, Value};
use serde::Deserialize;

use crate::drive::{GripperCable, Joints, MOTOR_NAMES, RegisterZero, Senses};
use crate::protocol::Command;
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
    /// The character it may answer to yet, and is made to answer to `recognition` then: on a chain every arm begins with `@`.
    pub renamed_from: Option<u8>,
    /// What the controller waits between the characters of its replies; `None` leaves it as it is.
    pub reply_delay: Option<u8>,
    /// Where the arm is when its registers read zero.
    pub zero: RegisterZero,
    /// Whether the half-steps that were sent are counted here, for a controller without `@READ`.
    pub dead_reckoning: bool,
    /// Which way each motor turns.
    pub senses: Senses,
    /// The speed number that `speed_fraction` 1 means.
    pub full_speed: SpeedCode,
    /// Moves at or below this fraction of full speed read the inputs after every half-step.
    pub fine_at_speed: f64,
    /// How long a stop may take: ms.
    pub stop_within_ms: u32,
    /// How long the controller may take to answer, beside the time on the line and that of the motion: ms.
    pub reply_within_ms: u32,
    /// Where the grip switch is found among the inputs; `None` where nobody has found out.
    pub grip_switch: Option<GripSwitch>,
    /// What the operator has confirmed, in the cell file, that the pendant alone stops: what the arm is handed over to, where it is.
    pub pendant: Option<PendantMode>,
    /// The program taught to the controller, where it is kept in files.
    pub program: ProgramFiles,
}

/// Where the program taught to the controller is kept.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProgramFiles {
    /// What the controller holds is kept here when the arm is connected.
    pub keep_in: Option<PathBuf>,
    /// What is here is written into the controller then.
    pub write_from: Option<PathBuf>,
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
    renamed_from: Option<char>,
    reply_delay: Option<u8>,
    #[serde(default = "usual_following")]
    gripper_follows_elbow: f64,
    gripper_half_steps_per_mm: Option<f64>,
    #[serde(default)]
    reversed_motors: Vec<String>,
    #[serde(default)]
    dead_reckoning: bool,
    #[serde(default)]
    taught_program: RawProgram,
    /// The cell file's, given by the cell.
    cell_directory: Option<PathBuf>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct RawProgram {
    keep_in: Option<PathBuf>,
    write_from: Option<PathBuf>,
}

/// What runs in the controller by itself, so that only its pendant stops it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PendantMode {
    /// The pendant drives the arm.
    HandControl,
    /// The program taught to the controller runs.
    TaughtProgram,
}

impl PendantMode {
    /// The command that begins it.
    pub fn command(self) -> Command {
        match self {
            Self::HandControl => Command::HandControl,
            Self::TaughtProgram => Command::RunProgram,
        }
    }

    /// Its name in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::HandControl => "hand control",
            Self::TaughtProgram => "the taught program",
        }
    }
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

fn usual_following() -> f64 {
    1.0
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

/// A value that cannot be: its key, the value, and what would be right.
fn wrong<T>(key: &str, value: impl std::fmt::Display, right: &str) -> Result<T, PluginError> {
    Err(PluginError::Refused(format!("config: {key} is {value}; {right}")))
}

/// A number that lies in its range.
fn within<T: PartialOrd + std::fmt::Display>(
    key: &str,
    value: T,
    range: std::ops::RangeInclusive<T>,
    right: &str,
) -> Result<T, PluginError> {
    if range.contains(&value) { Ok(value) } else { wrong(key, value, right) }
}

/// A character that a controller can be set to answer to.
fn printable(key: &str, character: char) -> Result<u8, PluginError> {
    match u8::try_from(character) {
        Ok(byte) if byte.is_ascii_graphic() => Ok(byte),
        _ => wrong(key, format!("{character:?}"), "give one printable character, usually '@'"),
    }
}

impl RawConfiguration {
    fn check(self) -> Result<Configuration, PluginError> {
        self.check_line()?;
        self.check_dead_reckoning()?;
        let recognition = printable("recognition", self.recognition)?;
        let Some(full_speed) = SpeedCode::new(self.full_speed_code) else {
            return wrong("full_speed_code", self.full_speed_code, "the controller takes 0 to 245");
        };
        let right = "give a part of full speed, from 0 to 1";
        let fine_at_speed = within("fine_at_speed", self.fine_at_speed, 0.0..=1.0, right)?;
        let stop_within_ms = within("stop_within_ms", self.stop_within_ms, 50..=2000, "give 50 to 2000")?;
        let reply_within_ms =
            within("reply_within_ms", self.reply_within_ms, 100..=10_000, "give 100 to 10000")?;
        if let Some(switch) = self.grip_switch {
            within("grip_switch: bit", switch.bit, 0..=7, "the controller reports inputs 0 to 7")?;
        }
        let renamed_from = self.renamed_from.map(|from| printable("renamed_from", from)).transpose()?;
        let right = "give 0 to 2 half-steps for one of the elbow, 1 for a new arm";
        let following = within("gripper_follows_elbow", self.gripper_follows_elbow, 0.0..=2.0, right)?;
        let mut cable = GripperCable::following(following);
        if let Some(figure) = self.gripper_half_steps_per_mm {
            let right = "give 1 to 200; a new arm has 14.6 (371 for an inch)";
            cable = cable.with_half_steps_per_mm(within(
                "gripper_half_steps_per_mm",
                figure,
                1.0..=200.0,
                right,
            )?);
        }
        Ok(Configuration {
            zero: RegisterZero::at(self.registers_zero.joints()).with_cable(cable),
            dead_reckoning: self.dead_reckoning,
            senses: self.senses()?,
            pendant: self.pendant()?,
            program: self.program(),
            port: self.port,
            baud: self.baud,
            recognition,
            renamed_from,
            reply_delay: self.reply_delay,
            full_speed,
            fine_at_speed,
            stop_within_ms,
            reply_within_ms,
            grip_switch: self.grip_switch,
        })
    }

    /// The port has a name, and its rate is one of the controller's.
    fn check_line(&self) -> Result<(), PluginError> {
        if self.port.trim().is_empty() {
            return wrong("port", "empty", "name the serial port, such as /dev/ttyUSB0");
        }
        if !BAUD_RATES.contains(&self.baud) {
            let right = "the controller's switches offer 110, 150, 300, 600, 1200, 2400, 4800 and 9600";
            return wrong("baud", self.baud, right);
        }
        Ok(())
    }

    /// Without `@READ` there are no inputs and no registers: what needs them cannot be had.
    fn check_dead_reckoning(&self) -> Result<(), PluginError> {
        if !self.dead_reckoning {
            return Ok(());
        }
        let needs_reading = [
            ("grip_switch", self.grip_switch.is_some()),
            ("renamed_from", self.renamed_from.is_some()),
            ("only_the_pendant_stops", !self.only_the_pendant_stops.is_empty()),
        ];
        match needs_reading.iter().find(|(_, is_given)| *is_given) {
            None => Ok(()),
            Some((key, _)) => wrong(
                "dead_reckoning",
                "true",
                &format!(
                    "it cannot go with `{key}`, which needs @READ: leave one of them out of the cell file"
                ),
            ),
        }
    }

    /// Which way the motors turn.
    fn senses(&self) -> Result<Senses, PluginError> {
        let mut motors = Vec::new();
        for name in &self.reversed_motors {
            let Some(motor) = MOTOR_NAMES.iter().position(|known| known.replace(' ', "_") == *name) else {
                let right = "the motors are base, shoulder, elbow, right_wrist, left_wrist and gripper";
                return wrong("reversed_motors", format!("`{name}`"), right);
            };
            motors.push(motor);
        }
        Ok(Senses::reversed(&motors))
    }

    /// What the arm is handed over to, if anything.
    fn pendant(&self) -> Result<Option<PendantMode>, PluginError> {
        match self.only_the_pendant_stops.as_slice() {
            [] => Ok(None),
            [mode] => Ok(Some(*mode)),
            _ => {
                let right =
                    "name what the arm is handed over to: hand_control or taught_program, one of them";
                wrong("only_the_pendant_stops", "a list of several", right)
            }
        }
    }

    /// Where the taught program is kept; paths count from the cell file's folder.
    fn program(&self) -> ProgramFiles {
        let directory = self.cell_directory.clone().unwrap_or_default();
        let beside = |file: &PathBuf| directory.join(file);
        ProgramFiles {
            keep_in: self.taught_program.keep_in.as_ref().map(beside),
            write_from: self.taught_program.write_from.as_ref().map(beside),
        }
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
    fn dead_reckoning_has_no_inputs_and_no_pendant() {
        for (key, value) in [
            ("grip_switch", json!({"bit": 7})),
            ("renamed_from", json!("A")),
            ("only_the_pendant_stops", json!(["hand_control"])),
        ] {
            let mut config = json!({"port": "p", "dead_reckoning": true});
            assert!(Configuration::read(&config).unwrap().dead_reckoning);
            config[key] = value;
            assert_eq!(
                refusal(config),
                format!(
                    "config: dead_reckoning is true; it cannot go with `{key}`, which needs @READ: leave one of them out of the cell file"
                )
            );
        }
    }

    #[test]
    fn a_port_is_enough() {
        let configuration = Configuration::read(&json!({"port": "/dev/ttyUSB0"})).unwrap();
        assert_eq!(configuration.baud, 9600);
        assert_eq!(configuration.recognition, b'@');
        assert_eq!(configuration.grip_switch, None);
        assert_eq!(configuration.pendant, None);
        assert_eq!(configuration.program, ProgramFiles::default());
        assert_eq!(configuration.zero.cable(), GripperCable::default());
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
            (
                json!({"port": port, "gripper_follows_elbow": 3}),
                "config: gripper_follows_elbow is 3; give 0 to 2 half-steps for one of the elbow, 1 for a new arm",
            ),
            (
                json!({"port": port, "renamed_from": " "}),
                "config: renamed_from is ' '; give one printable character, usually '@'",
            ),
            (
                json!({"port": port, "only_the_pendant_stops": ["hand_control", "taught_program"]}),
                "config: only_the_pendant_stops is a list of several; name what the arm is handed over to: hand_control or taught_program, one of them",
            ),
        ] {
            assert_eq!(refusal(config), text);
        }
    }

    #[test]
    fn the_files_of_a_program_lie_beside_the_cell_file() {
        let program = json!({"keep_in": "kept.csv", "write_from": "/programs/wave.csv"});
        let config = json!({"port": "p", "taught_program": program, "cell_directory": "/cells"});
        let program = Configuration::read(&config).unwrap().program;
        assert_eq!(program.keep_in, Some(PathBuf::from("/cells/kept.csv")));
        assert_eq!(program.write_from, Some(PathBuf::from("/programs/wave.csv")));
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
