//! What the primary and the secondary interface report, as bytes: versions, errors, and now and then how the robot is.
//!
//! Every message begins with its length (int32, big-endian, itself included) and its kind (uint8).

use super::controller::Controller;
use super::states::{RobotMode, RuntimeState, SafetyMode};

/// Kinds of messages.
const ROBOT_STATE: u8 = 16;
const ROBOT_MESSAGE: u8 = 20;
/// Kinds of robot messages.
const TEXT: u8 = 0;
const VERSION: u8 = 3;
const RUNTIME_EXCEPTION: u8 = 10;
/// The part of a robot state about modes.
const ROBOT_MODE_DATA: u8 = 0;
/// Who reports it: the controller itself.
const SOURCE: u8 = 253;

/// The message a client is greeted with.
pub(super) fn version(controller: &Controller) -> Vec<u8> {
    let [major, minor, bugfix, build] = controller.series.version();
    let name = b"URControl";
    let mut body = vec![name.len() as u8];
    body.extend(name);
    body.extend([major as u8, minor as u8]);
    body.extend(bugfix.to_be_bytes());
    body.extend(build.to_be_bytes());
    body.extend(b"01-01-2026, 00:00:00");
    robot_message(controller, VERSION, &body)
}

/// A runtime error by its line and column; without a line, a text.
pub(super) fn runtime_message(controller: &Controller, line: i32, column: i32, text: &str) -> Vec<u8> {
    if line == 0 {
        return robot_message(controller, TEXT, text.as_bytes());
    }
    let mut body = line.to_be_bytes().to_vec();
    body.extend(column.to_be_bytes());
    body.extend(text.as_bytes());
    robot_message(controller, RUNTIME_EXCEPTION, &body)
}

/// How the robot is.
pub(super) fn state(controller: &Controller) -> Vec<u8> {
    let has = |yes: bool| u8::from(yes);
    let mut part = microseconds(controller).to_be_bytes().to_vec();
    part.extend([
        1,
        1,
        has(controller.robot_mode != RobotMode::PowerOff),
        has(controller.safety_mode == SafetyMode::RobotEmergencyStop),
        has(controller.safety_mode == SafetyMode::ProtectiveStop),
        has(controller.runtime == RuntimeState::Playing),
        has(controller.runtime == RuntimeState::Paused),
        controller.robot_mode as u8,
        0,
    ]);
    for fraction in [1.0_f64, 1.0, 1.0] {
        part.extend(fraction.to_be_bytes());
    }
    part.push(0);
    message(ROBOT_STATE, &message(ROBOT_MODE_DATA, &part))
}

fn robot_message(controller: &Controller, kind: u8, body: &[u8]) -> Vec<u8> {
    let mut whole = microseconds(controller).to_be_bytes().to_vec();
    whole.extend([SOURCE, kind]);
    whole.extend(body);
    message(ROBOT_MESSAGE, &whole)
}

fn microseconds(controller: &Controller) -> u64 {
    (controller.time_s() * 1e6) as u64
}

fn message(kind: u8, body: &[u8]) -> Vec<u8> {
    let [.., a, b, c, d] = (5 + body.len()).to_be_bytes();
    [&[a, b, c, d, kind], body].concat()
}
