//! The serial line, with a count of what went over it, and what can go wrong in a conversation.

use std::time::Duration;

use plumb_plugin::PluginError;
use plumb_serial_line::{OpenFailure, SerialLine, Unplugged, WriteFailure};

use crate::reply::text_of;

/// What went wrong on the line, and in which command.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{port}: in `{command}`: {failure}")]
pub struct LineError {
    /// Such as `/dev/ttyUSB0`.
    pub port: String,
    /// What was typed, or what was being done.
    pub command: String,
    /// Why.
    pub failure: LineFailure,
}

/// Why a conversation fails.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineFailure {
    /// The port cannot be opened.
    #[error("cannot open the serial port: {0}")]
    Open(OpenFailure),
    /// The line takes no more characters.
    #[error(transparent)]
    NotTaken(WriteFailure),
    /// The port is gone.
    #[error(transparent)]
    Unplugged(#[from] Unplugged),
    /// The controller does not answer to a control C.
    #[error(
        "the controller does not answer; check that it is switched on, the cable, the rate (9600 baud, 8 bits, no parity), and that its terminal line is the one plugged in"
    )]
    Silent,
    /// A character was not echoed.
    #[error(
        "the character `{character}` was not echoed; the line was cancelled and nothing moved. Check the cable; where the computer or the controller is slow, wait longer for the echo (`echo_within_ms`)"
    )]
    NotEchoed {
        /// The character.
        character: char,
    },
    /// Another character came back.
    #[error(
        "`{came}` came back for `{sent}`; the line was cancelled and nothing moved. Check the cable and the rate"
    )]
    WrongEcho {
        /// What was sent.
        sent: String,
        /// What came back.
        came: String,
    },
    /// The answer does not come to its end.
    #[error("the answer did not come to its end within {} ms; it began with `{came}`", waited.as_millis())]
    Unfinished {
        /// How long was waited.
        waited: Duration,
        /// What came, shortened.
        came: String,
    },
    /// The answer is not of the kind that belongs to the command.
    #[error(
        "the answer `{came}` is not the one that belongs to it; nothing more is sent until the arm is activated again"
    )]
    Unexpected {
        /// What came, shortened.
        came: String,
    },
    /// The controller was started anew.
    #[error(
        "the controller was started anew: its points and its calibration are lost. Press ARM POWER, see that the arm is clear, and activate the arm again"
    )]
    Rebooted,
}

impl LineFailure {
    /// Whether what was typed did not come back as it was typed.
    pub(crate) fn is_of_echo(&self) -> bool {
        matches!(self, Self::NotEchoed { .. } | Self::WrongEcho { .. })
    }
}

impl LineError {
    /// As an error of the driver.
    pub fn plugin_error(&self) -> PluginError {
        let text = self.to_string();
        match self.failure {
            LineFailure::Open(ref failure) if failure.is_of_the_name() => PluginError::Refused(text),
            LineFailure::Open(_)
            | LineFailure::NotTaken(_)
            | LineFailure::Unplugged(_)
            | LineFailure::Silent => PluginError::Disconnected(text),
            LineFailure::Rebooted => PluginError::NotReady(text),
            LineFailure::Unfinished { .. } => PluginError::TimedOut(text),
            LineFailure::NotEchoed { .. }
            | LineFailure::WrongEcho { .. }
            | LineFailure::Unexpected { .. } => PluginError::Failed(text),
        }
    }
}

/// Printable and short.
pub(crate) fn shown(bytes: &[u8]) -> String {
    let text = text_of(bytes).replace('\n', "|");
    let short: String = text.chars().take(60).collect();
    if short.len() < text.len() { format!("{short}...") } else { short }
}

/// How long the line may take for its bytes, beside their own time on it.
const TAKEN_WITHIN: Duration = Duration::from_secs(2);

/// An open port, with the number of characters that went over it each way since it was opened.
#[derive(Debug)]
pub(crate) struct Line {
    line: SerialLine,
    pub(crate) sent: u32,
    pub(crate) received: u32,
}

impl Line {
    pub(crate) fn open(name: &str, baud: u32) -> Result<Self, LineFailure> {
        let line = SerialLine::open(name, baud).map_err(LineFailure::Open)?;
        Ok(Self { line, sent: 0, received: 0 })
    }

    pub(crate) fn name(&self) -> &str {
        self.line.name()
    }

    /// How long `characters` take on the line.
    pub(crate) fn duration(&self, characters: u32) -> Duration {
        self.line.duration(characters as usize)
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), LineFailure> {
        let written = self.line.write(bytes, TAKEN_WITHIN + self.line.duration(bytes.len()));
        let sent = written.as_ref().map_or_else(|error| error.sent, |()| bytes.len());
        self.sent = self.sent.saturating_add(sent as u32);
        written.map_err(|error| LineFailure::NotTaken(error.failure))
    }

    /// What comes within `limit`; it returns as soon as something has come.
    pub(crate) fn read(&mut self, limit: Duration) -> Result<Vec<u8>, LineFailure> {
        let came = self.line.read(limit)?;
        self.received = self.received.saturating_add(came.len() as u32);
        Ok(came)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_character_takes_ten_bits_of_the_lines_rate() {
        let pair = nix::pty::openpty(None, None).unwrap();
        let port = nix::unistd::ttyname(&pair.slave).unwrap().display().to_string();
        let at = |baud: u32| Line::open(&port, baud).unwrap().duration(480);
        assert_eq!((at(9600), at(4800)), (Duration::from_millis(500), Duration::from_secs(1)));
    }

    #[test]
    fn what_came_is_shown_on_one_line_of_sixty_characters() {
        assert_eq!(shown(b"\r\n*Servo*\r\n. "), "|*Servo*|. ");
        assert_eq!(shown(&[b'x'; 60]), "x".repeat(60));
        assert_eq!(shown(&[b'x'; 61]), format!("{}...", "x".repeat(60)));
    }

    #[test]
    fn what_went_wrong_on_the_line_says_what_follows_and_names_port_and_command() {
        let error = |failure: LineFailure| {
            let error = LineError { port: "/dev/ttyS9".to_owned(), command: "WHERE".to_owned(), failure };
            assert!(error.to_string().starts_with("/dev/ttyS9: in `WHERE`: "), "{error}");
            error.plugin_error()
        };
        assert!(matches!(error(LineFailure::Silent), PluginError::Disconnected(_)));
        // Another name has to be given, or this port brought back.
        assert!(matches!(error(LineFailure::Open(OpenFailure::NotAPort)), PluginError::Refused(_)));
        assert!(matches!(error(LineFailure::Open(OpenFailure::Missing)), PluginError::Disconnected(_)));
        assert!(matches!(error(LineFailure::Rebooted), PluginError::NotReady(_)));
        let (waited, came) = (Duration::from_secs(2), "1.0".to_owned());
        assert!(matches!(error(LineFailure::Unfinished { waited, came }), PluginError::TimedOut(_)));
        let not_echoed = LineFailure::NotEchoed { character: 'W' };
        assert!(not_echoed.is_of_echo() && !LineFailure::Silent.is_of_echo());
        assert!(matches!(error(not_echoed), PluginError::Failed(_)));
    }
}
