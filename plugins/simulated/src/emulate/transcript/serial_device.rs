//! The device at the far end of a real port.

use std::io;
use std::time::Duration;

use plumb_serial_line::{OpenFailure, SerialLine};

use super::recorder::Device;

/// How long the device may take no bytes.
const SENT_WITHIN: Duration = Duration::from_secs(2);

/// A device on a serial port.
#[derive(Debug)]
pub struct SerialDevice {
    line: SerialLine,
}

impl SerialDevice {
    /// Opens the port.
    ///
    /// # Errors
    /// [`OpenFailure`], saying what to check.
    pub fn open(port: &str, baud: u32) -> Result<Self, OpenFailure> {
        Ok(Self { line: SerialLine::open(port, baud)? })
    }
}

impl Device for SerialDevice {
    fn receive(&mut self) -> io::Result<Vec<u8>> {
        self.line.read(Duration::ZERO).map_err(io::Error::other)
    }

    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.line.write(bytes, SENT_WITHIN).map_err(io::Error::other)
    }
}
