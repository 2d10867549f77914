//! The dashboard server: a line of text each way.

use super::controller::Controller;
use super::states::{RobotMode, RuntimeState, SafetyMode, Series};

/// Said to anyone who connects.
pub(super) const GREETING: &str = "Connected: Universal Robots Dashboard Server\n";

/// The answer to one line. Commands that change something are taken in remote control only.
pub(super) fn answer(controller: &mut Controller, line: &str) -> String {
    let command = line.trim();
    let asks = |command: &str| {
        matches!(
            command,
            "robotmode" | "safetymode" | "safetystatus" | "programState" | "running" | "PolyscopeVersion"
        ) || command == "is in remote control"
    };
    let message = if controller.series == Series::E && !controller.remote && !asks(command) {
        format!("Command is not allowed due to safety reasons: {command}")
    } else {
        obeyed(controller, command)
    };
    message + "\n"
}

fn obeyed(controller: &mut Controller, command: &str) -> String {
    match command {
        "robotmode" => format!("Robotmode: {}", controller.robot_mode.name()),
        "safetymode" => format!("Safetymode: {}", controller.safety_mode.name()),
        "safetystatus" => format!("Safetystatus: {}", controller.safety_mode.name()),
        "is in remote control" if controller.series == Series::E => controller.remote.to_string(),
        "running" => {
            let running = controller.runtime == RuntimeState::Playing;
            format!("Program running: {running}")
        }
        "programState" => {
            let state = match controller.runtime {
                RuntimeState::Playing => "PLAYING",
                RuntimeState::Paused => "PAUSED",
                RuntimeState::Stopping | RuntimeState::Stopped => "STOPPED",
            };
            format!("{state} <unnamed>")
        }
        "PolyscopeVersion" => {
            let [major, minor, bugfix, build] = controller.series.version();
            format!("URSoftware {major}.{minor}.{bugfix}.{build}")
        }
        "stop" => {
            controller.stop_program();
            "Stopped".to_owned()
        }
        "unlock protective stop" => {
            controller.unlock();
            "Protective stop releasing".to_owned()
        }
        "power on" => {
            if controller.robot_mode == RobotMode::PowerOff && controller.safety_mode == SafetyMode::Normal {
                controller.robot_mode = RobotMode::Idle;
            }
            "Powering on".to_owned()
        }
        "brake release" => {
            if controller.safety_mode == SafetyMode::Normal {
                controller.robot_mode = RobotMode::Running;
            }
            "Brake releasing".to_owned()
        }
        "power off" => {
            controller.happen(&super::event::Event::Power(false));
            "Powering off".to_owned()
        }
        "close safety popup" => "closing safety popup".to_owned(),
        other => format!("could not understand: '{other}'"),
    }
}
