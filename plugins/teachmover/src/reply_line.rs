//! The serial line as the TeachMover speaks on it: commands go out, replies come in line by line.

mod error;

pub use error::{ReplyFailure, SerialError};

use std::time::{Duration, Instant};

use plumb_serial_line::SerialLine;

/// The longest reply line that makes sense. A peer that sends more without a carriage return is no TeachMover.
const LONGEST_LINE: usize = 200;

/// How long the line must be quiet to be taken as quiet: several characters at the slowest rate anyone uses, and longer than a USB adapter
/// holds bytes back.
const QUIET: Duration = Duration::from_millis(40);

/// The same after a reply that did not come whole: longer than a busy machine holds the rest of it back.
const LATE: Duration = Duration::from_millis(300);

/// How many bytes may come in before a line that is to become quiet is called babbling.
const BABBLE: usize = 2000;

/// An open port, and what came in on it and was not read yet.
#[derive(Debug)]
pub struct ReplyLine {
    line: SerialLine,
    /// Bytes that came in and belong to no line yet.
    pending: Vec<u8>,
}

impl ReplyLine {
    /// Opens the port and throws away what waits in it.
    ///
    /// # Errors
    /// [`SerialError::Open`], saying what to check.
    pub fn open(name: &str, baud: u32) -> Result<Self, SerialError> {
        let line = SerialLine::open(name, baud)
            .map_err(|failure| SerialError::Open { port: name.to_owned(), failure })?;
        Ok(Self { line, pending: Vec::new() })
    }

    /// The port's name, such as `/dev/ttyUSB0`.
    pub fn name(&self) -> &str {
        self.line.name()
    }

    /// How long `bytes` characters take on the line.
    pub fn duration(&self, bytes: usize) -> Duration {
        self.line.duration(bytes)
    }

    /// Hands a command to the line.
    ///
    /// # Errors
    /// [`SerialError::WriteCommand`] when the line has not taken all within `limit`.
    pub fn write(&mut self, command: &str, bytes: &[u8], limit: Duration) -> Result<(), SerialError> {
        self.line.write(bytes, limit).map_err(|error| SerialError::WriteCommand {
            port: self.name().to_owned(),
            command: command.to_owned(),
            sent: error.sent,
            length: bytes.len(),
            failure: error.failure,
        })
    }

    /// The next line up to its carriage return, which is left out; line feeds and NULs are passed over.
    ///
    /// # Errors
    /// [`ReplyFailure::Silent`] or [`ReplyFailure::CutShort`] when it has not come within `limit`, [`ReplyFailure::Babbling`] when it is too
    /// long for any reply, [`ReplyFailure::Unplugged`] when the port is gone.
    pub fn read_line(&mut self, limit: Duration) -> Result<Vec<u8>, ReplyFailure> {
        let deadline = Instant::now() + limit;
        loop {
            if let Some(line) = self.take_line() {
                return Ok(line);
            }
            if self.pending.len() > LONGEST_LINE {
                return Err(ReplyFailure::babbling(LONGEST_LINE, std::mem::take(&mut self.pending)));
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let received = std::mem::take(&mut self.pending);
                return Err(if received.is_empty() {
                    ReplyFailure::Silent { waited: limit }
                } else {
                    ReplyFailure::CutShort { received, waited: limit }
                });
            }
            self.receive(left)?;
        }
    }

    /// The lines that have come in already, without waiting.
    ///
    /// # Errors
    /// [`ReplyFailure::Unplugged`] when the port is gone.
    pub fn line_at_hand(&mut self) -> Result<Option<Vec<u8>>, ReplyFailure> {
        self.receive(Duration::ZERO)?;
        Ok(self.take_line())
    }

    /// Throws away what comes in until the line is quiet, and returns it.
    ///
    /// # Errors
    /// [`SerialError::Resynchronise`] when the line does not become quiet, or the port is gone.
    pub fn drain(&mut self) -> Result<Vec<u8>, SerialError> {
        self.drain_until_quiet_for(QUIET)
    }

    /// As [`ReplyLine::drain`], after a reply that did not come whole: its rest may be on its way, and must not be taken for the next reply.
    ///
    /// # Errors
    /// As [`ReplyLine::drain`].
    pub fn drain_late(&mut self) -> Result<Vec<u8>, SerialError> {
        self.drain_until_quiet_for(LATE)
    }

    fn drain_until_quiet_for(&mut self, quiet: Duration) -> Result<Vec<u8>, SerialError> {
        let error =
            |failure, line: &Self| SerialError::Resynchronise { port: line.name().to_owned(), failure };
        let mut thrown_away = std::mem::take(&mut self.pending);
        loop {
            self.receive(quiet + self.line.duration(2)).map_err(|failure| error(failure, self))?;
            if self.pending.is_empty() {
                return Ok(thrown_away);
            }
            thrown_away.append(&mut self.pending);
            if thrown_away.len() > BABBLE {
                return Err(error(ReplyFailure::babbling(BABBLE, thrown_away), self));
            }
        }
    }

    /// What has come in and has not been read, thrown away without waiting.
    ///
    /// # Errors
    /// [`ReplyFailure::Unplugged`] when the port is gone.
    pub fn take_stray(&mut self) -> Result<Vec<u8>, ReplyFailure> {
        self.receive(Duration::ZERO)?;
        Ok(std::mem::take(&mut self.pending))
    }

    /// Adds what comes in within `limit` to the pending bytes; nothing when nothing comes.
    fn receive(&mut self, limit: Duration) -> Result<(), ReplyFailure> {
        self.pending.extend(self.line.read(limit)?);
        Ok(())
    }

    fn take_line(&mut self) -> Option<Vec<u8>> {
        let end = self.pending.iter().position(|byte| *byte == b'\r')?;
        let mut line: Vec<u8> = self.pending.drain(..=end).collect();
        line.retain(|byte| !matches!(byte, b'\r' | b'\n' | 0));
        Some(line)
    }
}
