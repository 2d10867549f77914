//! What happens to a controller, as it is typed.

use std::str::FromStr;
use std::time::Duration;

/// Something that happens to the controller or its connections.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// The safety system stops the arm; the program is paused.
    ProtectiveStop,
    /// Somebody unlocks it.
    UnlockProtectiveStop,
    /// The emergency stop is pressed.
    EmergencyStop,
    /// It is pulled out again; the arm stays without power.
    ReleaseEmergencyStop,
    /// The safety system finds a fault.
    Fault,
    /// The arm's power.
    Power(bool),
    /// The switch on the pendant: remote control, or local.
    Remote(bool),
    /// Somebody stops the program at the pendant.
    StopProgram,
    /// Whether states go on with an old time and old values.
    Freeze(bool),
    /// Whether states are kept back.
    Silence(bool),
    /// States come so much later; zero for at once.
    Late(Duration),
    /// The next state is cut off in its middle and the connection ends.
    Cut,
    /// All connections end; new ones are taken.
    Disconnect,
    /// All connections end, and no new ones are taken.
    Gone,
}

/// A text that gives no event.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is nothing that happens to it; there are `protective-stop`, `unlock`, `emergency-stop`, `release`, `fault`, `power on|off`, `remote`, `local`, `stop-program`, `freeze on|off`, `silence on|off`, `late MS`, `cut`, `disconnect`, `gone`"
)]
pub struct EventError(String);

impl FromStr for Event {
    type Err = EventError;

    fn from_str(text: &str) -> Result<Self, EventError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let wrong = || EventError(text.trim().to_owned());
        let switch = |word: &str| match word {
            "on" => Ok(true),
            "off" => Ok(false),
            _ => Err(wrong()),
        };
        Ok(match words.as_slice() {
            ["protective-stop"] => Self::ProtectiveStop,
            ["unlock"] => Self::UnlockProtectiveStop,
            ["emergency-stop"] => Self::EmergencyStop,
            ["release"] => Self::ReleaseEmergencyStop,
            ["fault"] => Self::Fault,
            ["power", state] => Self::Power(switch(state)?),
            ["remote"] => Self::Remote(true),
            ["local"] => Self::Remote(false),
            ["stop-program"] => Self::StopProgram,
            ["freeze", state] => Self::Freeze(switch(state)?),
            ["silence", state] => Self::Silence(switch(state)?),
            ["late", ms] => Self::Late(Duration::from_millis(ms.parse().map_err(|_| wrong())?)),
            ["cut"] => Self::Cut,
            ["disconnect"] => Self::Disconnect,
            ["gone"] => Self::Gone,
            _ => return Err(wrong()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_can_be_typed_and_what_is_none_is_reported_with_those_there_are() {
        assert_eq!("late 250".parse(), Ok(Event::Late(Duration::from_millis(250))));
        assert_eq!(" power off ".parse(), Ok(Event::Power(false)));
        for text in ["", "power", "power up", "late soon", "explode"] {
            let error = text.parse::<Event>().unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("`{text}` is nothing that happens to it; there are")),
                "{error}"
            );
        }
    }
}
