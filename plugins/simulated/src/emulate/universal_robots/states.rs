//! The numbers in which a controller says how it is.

use std::str::FromStr;

/// Joints of these arms.
pub(super) const AXES: usize = 6;

/// From cycle to cycle, s: the pace of a CB3; an e-Series controller counts four times as fast.
pub(super) const CYCLE_S: f64 = 0.008;

/// General purpose registers of one kind.
pub(super) const REGISTERS: usize = 48;

/// Which generation of controllers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Series {
    /// CB3: 125 Hz, no switch between local and remote control.
    Cb3,
    /// e-Series: 500 Hz; programs from the network are taken in remote control only.
    #[default]
    E,
}

/// A text that names no series.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no series of controllers; there are `cb3` and `e`")]
pub struct SeriesError(String);

impl FromStr for Series {
    type Err = SeriesError;

    fn from_str(text: &str) -> Result<Self, SeriesError> {
        match text {
            "cb3" => Ok(Self::Cb3),
            "e" => Ok(Self::E),
            other => Err(SeriesError(other.to_owned())),
        }
    }
}

impl Series {
    /// Software version: major, minor, bugfix, build.
    pub(super) fn version(self) -> [u32; 4] {
        match self {
            Self::Cb3 => [3, 15, 8, 106_339],
            Self::E => [5, 19, 0, 1_210_631],
        }
    }

    /// The fastest that states are sent, Hz.
    pub(super) fn most_hz(self) -> f64 {
        match self {
            Self::Cb3 => 125.0,
            Self::E => 500.0,
        }
    }
}

/// What the arm is powered for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub(super) enum RobotMode {
    PowerOff = 3,
    Idle = 5,
    Running = 7,
}

impl RobotMode {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::PowerOff => "POWER_OFF",
            Self::Idle => "IDLE",
            Self::Running => "RUNNING",
        }
    }
}

/// What the safety system allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub(super) enum SafetyMode {
    Normal = 1,
    ProtectiveStop = 3,
    RobotEmergencyStop = 7,
    Fault = 9,
}

impl SafetyMode {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Normal => "NORMAL",
            Self::ProtectiveStop => "PROTECTIVE_STOP",
            Self::RobotEmergencyStop => "ROBOT_EMERGENCY_STOP",
            Self::Fault => "FAULT",
        }
    }
}

/// What the program does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum RuntimeState {
    Stopping = 0,
    Stopped = 1,
    Playing = 2,
    Paused = 4,
}
