//! The serial line: bytes with deadlines, and errors that say what to check.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use plumb_plugin::PluginError;
use serialport::{ClearBuffer, DataBits, FlowControl, Parity, SerialPort, StopBits, TTYPort};

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
    #[error(
        "the port cannot be opened: {0}; check its name (ls /dev/serial/by-id), that the adapter is plugged in, and that no other program has it"
    )]
    Open(String),
    /// The port is gone.
    #[error("the port is gone ({0}); check that the adapter is plugged in")]
    Unplugged(String),
    /// The controller does not answer to a control C.
    #[error(
        "the controller does not answer; check that it is switched on, the cable, the rate (9600 baud, 8 bits, no parity), and that its terminal line is the one plugged in"
    )]
    Silent,
    /// A character was not echoed.
    #[error(
        "the character `{character}` was not echoed; the line was cancelled and nothing moved. Check the cable; if it happens again, type carefully (`typing: careful`)"
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

impl LineError {
    /// As an error of the driver.
    pub fn plugin_error(&self) -> PluginError {
        let text = self.to_string();
        match self.failure {
            LineFailure::Open(_) | LineFailure::Unplugged(_) | LineFailure::Silent => {
                PluginError::Disconnected(text)
            }
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

/// A port that is open, 8 data bits, no parity, 1 stop bit, no handshake.
#[derive(Debug)]
pub(crate) struct Line {
    port: TTYPort,
    pub(crate) name: String,
    baud: u32,
    /// Bytes sent and received since the line was opened.
    pub(crate) sent: u32,
    pub(crate) received: u32,
}

impl Line {
    pub(crate) fn open(name: &str, baud: u32) -> Result<Self, LineFailure> {
        let failed = |error: serialport::Error| LineFailure::Open(error.description);
        let port = serialport::new(name, baud)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .timeout(Duration::from_millis(10))
            .open_native()
            .map_err(failed)?;
        port.clear(ClearBuffer::All).map_err(failed)?;
        Ok(Self { port, name: name.to_owned(), baud, sent: 0, received: 0 })
    }

    /// How long `bytes` characters take on the line: each is ten bits.
    pub(crate) fn duration(&self, bytes: u32) -> Duration {
        Duration::from_secs_f64(f64::from(bytes) * 10.0 / f64::from(self.baud.max(1)))
    }

    pub(crate) fn write(&mut self, bytes: &[u8]) -> Result<(), LineFailure> {
        let deadline = Instant::now() + Duration::from_secs(2) + self.duration(bytes.len() as u32);
        for byte in bytes {
            loop {
                match self.port.write(&[*byte]) {
                    Ok(1..) => break,
                    Ok(0) => {}
                    Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::TimedOut) => {}
                    Err(error) => return Err(LineFailure::Unplugged(error.to_string())),
                }
                if Instant::now() > deadline {
                    return Err(LineFailure::Unplugged("it takes no more characters".to_owned()));
                }
            }
            self.sent = self.sent.saturating_add(1);
        }
        Ok(())
    }

    /// What comes within `limit`; it returns as soon as something has come.
    pub(crate) fn read(&mut self, limit: Duration) -> Result<Vec<u8>, LineFailure> {
        let unplugged = |error: &dyn std::fmt::Display| LineFailure::Unplugged(error.to_string());
        let mut bytes = [0; 256];
        self.port.set_timeout(limit).map_err(|error| unplugged(&error))?;
        match self.port.read(&mut bytes) {
            Ok(count) => {
                self.received = self.received.saturating_add(count as u32);
                Ok(bytes.get(..count).unwrap_or_default().to_vec())
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                Ok(Vec::new())
            }
            Err(error) => Err(unplugged(&error)),
        }
    }

    /// What comes until the line has been quiet for `quiet`, but no longer than `most`.
    pub(crate) fn read_until_quiet(
        &mut self,
        quiet: Duration,
        most: Duration,
    ) -> Result<Vec<u8>, LineFailure> {
        let deadline = Instant::now() + most;
        let mut came = Vec::new();
        while Instant::now() < deadline {
            let more = self.read(quiet)?;
            if more.is_empty() {
                break;
            }
            came.extend(more);
        }
        Ok(came)
    }
}
