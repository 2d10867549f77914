//! In which modes a controller may be, and what the operator is shown for those in which nothing may be read or moved.
//!
//! The numbers: <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/rtde-guide.html> and, of the program's states,
//! <https://forum.universal-robots.com/t/rtde-runtime-state-enumeration/6634>.

use plumb_plugin::PluginError;

/// What the arm is powered for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotMode(pub i32);

/// What the safety system allows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SafetyMode(pub i32);

/// What the program does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RuntimeState(pub i32);

impl RuntimeState {
    /// No program.
    pub const STOPPED: Self = Self(1);
    /// A program runs.
    pub const PLAYING: Self = Self(2);

    /// Whether a program is paused, on its way into a pause or out of one.
    pub fn is_pause(self) -> bool {
        (3..=5).contains(&self.0)
    }

    /// Whether the program has ended or is about to.
    pub fn is_over(self) -> bool {
        matches!(self.0, 0 | 1)
    }
}

/// What keeps the robot from being read and moved, if anything does.
///
/// # Errors
/// [`PluginError::NotReady`] with what to do.
pub(crate) fn require_running(safety_mode: SafetyMode, robot_mode: RobotMode) -> Result<(), PluginError> {
    safety(safety_mode)?;
    power(robot_mode)
}

fn safety(mode: SafetyMode) -> Result<(), PluginError> {
    let text = match mode.0 {
        // Normal, and reduced, in which the arm is slower.
        1 | 2 => return Ok(()),
        3 => {
            "the arm is in a protective stop: find out what it ran into, unlock it at the pendant, then go on"
        }
        4 => "the safety system is in recovery: bring the arm back inside its limits at the pendant",
        5 => "a safeguard input has stopped the arm: close the safeguard and reset it",
        6 => {
            "the system's emergency stop is pressed: release it, switch the arm on at the pendant, then go on"
        }
        7 => {
            "the robot's emergency stop is pressed: release it, switch the arm on at the pendant, then go on"
        }
        8 => {
            "the safety system has found a violation: read the pendant's log, then restart the safety system"
        }
        9 => "the safety system has found a fault: read the pendant's log, then restart the safety system",
        10 => "the safety system wants the joints' identities confirmed at the pendant",
        11 => "the safety system does not know its own mode: read the pendant's log",
        12 => "a safeguard of automatic mode has stopped the arm: close the safeguard and reset it",
        13 => {
            "the three-position switch has stopped the arm: hold it in the middle, or switch to automatic mode"
        }
        other => {
            return Err(PluginError::NotReady(format!(
                "the safety system is in mode {other}, which this driver does not know"
            )));
        }
    };
    Err(PluginError::NotReady(text.to_owned()))
}

fn power(mode: RobotMode) -> Result<(), PluginError> {
    let text = match mode.0 {
        7 => return Ok(()),
        -1 => "the controller has no connection to its safety control board: restart it",
        0 => "the arm is not connected to its controller",
        1 => "the controller wants its safety settings confirmed at the pendant",
        2 => "the controller is still starting: wait until the pendant is ready",
        3 => "the arm is switched off: switch it on at the pendant and release its brakes",
        4 | 5 => "the arm's brakes are on: press START at the pendant to release them",
        6 => "the arm is being moved by hand (backdrive): end that at the pendant",
        8 => "the joints' firmware is being updated: wait",
        other => {
            return Err(PluginError::NotReady(format!(
                "the robot is in mode {other}, which this driver does not know"
            )));
        }
    };
    Err(PluginError::NotReady(text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_running_arm_may_be_read() {
        for (mode, fine) in
            [(1, true), (2, true), (0, false), (3, false), (7, false), (13, false), (99, false)]
        {
            assert_eq!(safety(SafetyMode(mode)).is_ok(), fine, "{mode}");
        }
        for (mode, fine) in [(7, true), (-1, false), (3, false), (5, false), (42, false)] {
            assert_eq!(power(RobotMode(mode)).is_ok(), fine, "{mode}");
        }
    }
}
