//! The serial line: bytes with deadlines, and errors that say what to check.

mod error;

pub use error::{OpenFailure, ReplyFailure, SerialError, WriteFailure};

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, DataBits, FlowControl, Parity, SerialPort, StopBits, TTYPort};

/// The longest reply line that makes sense. A peer that sends more without a carriage return is no TeachMover.
const LONGEST_LINE: usize = 200;

/// How long the line must be quiet to be taken as quiet: several characters at the slowest rate anyone uses, and longer than a USB adapter
/// holds bytes back.
const QUIET: Duration = Duration::from_millis(40);

/// How many bytes may come in before a line that is to become quiet is called babbling.
const BABBLE: usize = 2000;

/// A port that is open, 8 data bits, no parity, 1 stop bit, no handshake.
#[derive(Debug)]
pub struct SerialLine {
    port: TTYPort,
    name: String,
    baud: u32,
    /// Bytes that came in and belong to no line yet.
    pending: Vec<u8>,
}

impl SerialLine {
    /// Opens the port and throws away what waits in it.
    ///
    /// # Errors
    /// [`SerialError::Open`], saying what to check.
    pub fn open(name: &str, baud: u32) -> Result<Self, SerialError> {
        let open_error =
            |failure| SerialError::Open { port: name.to_owned(), failure: OpenFailure::of(name, failure) };
        let mut port = serialport::new(name, baud)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .timeout(Duration::from_millis(10))
            .open_native()
            .map_err(open_error)?;
        // What the settings read back as is not looked at: pseudo-terminals and some adapters report others than they use.
        if let Err(error) = port.clear(ClearBuffer::All) {
            return Err(open_error(error));
        }
        port.set_timeout(Duration::from_millis(10)).map_err(open_error)?;
        Ok(Self { port, name: name.to_owned(), baud, pending: Vec::new() })
    }

    /// The port's name, such as `/dev/ttyUSB0`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How long `bytes` characters take on the line: each is ten bits.
    pub fn duration(&self, bytes: usize) -> Duration {
        Duration::from_secs_f64(bytes as f64 * 10.0 / f64::from(self.baud.max(1)))
    }

    /// Hands a command to the line.
    ///
    /// One byte at a time, each when the system has room for it: a longer write may find less room than it needs and then waits without end,
    /// whatever time-out is set.
    ///
    /// # Errors
    /// [`SerialError::WriteCommand`] when the line has not taken all within `limit`.
    pub fn write(&mut self, command: &str, bytes: &[u8], limit: Duration) -> Result<(), SerialError> {
        let deadline = Instant::now() + limit;
        for (sent, byte) in bytes.iter().enumerate() {
            if let Err(error) = self.write_byte(*byte, deadline) {
                return Err(SerialError::WriteCommand {
                    port: self.name.clone(),
                    command: command.to_owned(),
                    sent,
                    length: bytes.len(),
                    failure: WriteFailure::of(&error, limit),
                });
            }
        }
        Ok(())
    }

    fn write_byte(&mut self, byte: u8, deadline: Instant) -> std::io::Result<()> {
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ErrorKind::TimedOut.into());
            }
            self.port.set_timeout(left)?;
            match self.port.write(&[byte]) {
                Ok(0) => {}
                Ok(_) => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
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
        let error = |failure, line: &Self| SerialError::Resynchronise { port: line.name.clone(), failure };
        let mut thrown_away = std::mem::take(&mut self.pending);
        loop {
            self.receive(QUIET + self.duration(2)).map_err(|failure| error(failure, self))?;
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
        let unplugged = |error: &std::io::Error| ReplyFailure::Unplugged { cause: error.to_string() };
        let mut bytes = [0; 256];
        self.port.set_timeout(limit).map_err(|error| unplugged(&error.into()))?;
        match self.port.read(&mut bytes) {
            Ok(count) => self.pending.extend_from_slice(bytes.get(..count).unwrap_or_default()),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => return Err(unplugged(&error)),
        }
        Ok(())
    }

    fn take_line(&mut self) -> Option<Vec<u8>> {
        let end = self.pending.iter().position(|byte| *byte == b'\r')?;
        let mut line: Vec<u8> = self.pending.drain(..=end).collect();
        line.retain(|byte| !matches!(byte, b'\r' | b'\n' | 0));
        Some(line)
    }
}
