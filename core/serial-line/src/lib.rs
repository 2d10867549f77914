//! A serial line as the drivers of serial devices use it: bytes with deadlines, and errors that say what to check.
//!
//! What the bytes mean is the driver's. Nothing here waits without end, whatever the adapter or the far end does.

mod error;

pub use error::{OpenFailure, Unplugged, WriteError, WriteFailure};

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, DataBits, FlowControl, Parity, SerialPort, StopBits, TTYPort};

/// A port that is open, 8 data bits, no parity, 1 stop bit, no handshake.
#[derive(Debug)]
pub struct SerialLine {
    port: TTYPort,
    name: String,
    baud: u32,
}

impl SerialLine {
    /// Opens the port, which nobody else then can, and throws away what waits in it.
    ///
    /// # Errors
    /// [`OpenFailure`], saying what to check.
    pub fn open(name: &str, baud: u32) -> Result<Self, OpenFailure> {
        let failure = |error| OpenFailure::of(name, error);
        let mut port = serialport::new(name, baud)
            .data_bits(DataBits::Eight)
            .parity(Parity::None)
            .stop_bits(StopBits::One)
            .flow_control(FlowControl::None)
            .timeout(Duration::from_millis(10))
            .open_native()
            .map_err(failure)?;
        // What the settings read back as is not looked at: pseudo-terminals and some adapters report others than they use.
        port.clear(ClearBuffer::All).map_err(failure)?;
        port.set_timeout(Duration::from_millis(10)).map_err(failure)?;
        Ok(Self { port, name: name.to_owned(), baud })
    }

    /// The port's name, such as `/dev/ttyUSB0`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How long `characters` take on the line: each is ten bits.
    pub fn duration(&self, characters: usize) -> Duration {
        Duration::from_secs_f64(characters as f64 * 10.0 / f64::from(self.baud.max(1)))
    }

    /// Hands bytes to the line.
    ///
    /// One at a time, each when the system has room for it: a longer write may find less room than it needs and then waits without end,
    /// whatever time-out is set.
    ///
    /// # Errors
    /// [`WriteError`] when the line has not taken all within `limit`, or is gone, with how many it took.
    pub fn write(&mut self, bytes: &[u8], limit: Duration) -> Result<(), WriteError> {
        let deadline = Instant::now() + limit;
        for (sent, byte) in bytes.iter().enumerate() {
            self.write_byte(*byte, deadline)
                .map_err(|error| WriteError { sent, failure: WriteFailure::of(&error, limit) })?;
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

    /// What comes within `limit`; it returns as soon as something has come, with nothing when nothing comes.
    ///
    /// # Errors
    /// [`Unplugged`].
    pub fn read(&mut self, limit: Duration) -> Result<Vec<u8>, Unplugged> {
        let mut bytes = [0; 256];
        self.port.set_timeout(limit).map_err(|error| Unplugged { cause: error.to_string() })?;
        match self.port.read(&mut bytes) {
            Ok(count) => Ok(bytes.get(..count).unwrap_or_default().to_vec()),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                Ok(Vec::new())
            }
            Err(error) => Err(Unplugged { cause: error.to_string() }),
        }
    }
}
