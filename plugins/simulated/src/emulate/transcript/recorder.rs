//! Between a program and a device: every byte is passed on and written down.

use std::convert::Infallible;
use std::path::PathBuf;

use super::file::{Entry, Sender};
use crate::emulate::emulator::{Controls, Emulator, EmulatorError};
use crate::emulate::line::{Line, LineOptions};

/// How often the device is asked for bytes, ns.
const LOOK_NS: u64 = 1_000_000;

/// The device at the far end.
pub trait Device: Send {
    /// What has come; it does not wait.
    ///
    /// # Errors
    /// When the device is gone.
    fn receive(&mut self) -> std::io::Result<Vec<u8>>;

    /// Sends bytes.
    ///
    /// # Errors
    /// When the device is gone, or takes nothing.
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()>;
}

/// Is informed of every turn.
pub type Note = Box<dyn FnMut(&Entry) -> std::io::Result<()> + Send>;

/// The status of a recording.
#[derive(Debug, Clone, Default)]
pub struct Recording {
    /// The path a program opens.
    pub port: Option<PathBuf>,
    /// Bytes of the program, and of the device.
    pub bytes: [u64; 2],
}

/// A recorder at work. Ends when it is dropped.
pub type Recorder = Emulator<Service>;

impl Recorder {
    /// Passes bytes on between anyone who opens the port and a device; `note` is informed of every turn when the other side begins to send, or the recording ends.
    ///
    /// # Errors
    /// [`EmulatorError`] when no pseudo-terminal or link can be made.
    pub fn start(device: Box<dyn Device>, note: Note, line: LineOptions) -> Result<Self, EmulatorError> {
        Self::switch_on(Service { device, note, turn: None, bytes: [0; 2] }, Line::new(line)?)
    }
}

/// The recorder between its lines.
pub struct Service {
    device: Box<dyn Device>,
    note: Note,
    /// What the side that sends now has sent.
    turn: Option<Entry>,
    bytes: [u64; 2],
}

impl Service {
    fn add(&mut self, sender: Sender, bytes: Vec<u8>, now: u64) -> std::io::Result<()> {
        if bytes.is_empty() {
            return Ok(());
        }
        if let Some(count) = self.bytes.get_mut(usize::from(sender == Sender::Device)) {
            *count += bytes.len() as u64;
        }
        match &mut self.turn {
            Some(turn) if turn.sender == sender => turn.bytes.extend(bytes),
            _ => {
                self.end_turn()?;
                self.turn = Some(Entry { time_s: Some(now as f64 * 1e-9), sender, bytes, line: 0 });
            }
        }
        Ok(())
    }

    fn end_turn(&mut self) -> std::io::Result<()> {
        self.turn.take().map_or(Ok(()), |turn| (self.note)(&turn))
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        // Anyone who reads the transcript finds it one turn short.
        let _ = self.end_turn();
    }
}

impl Controls for Service {
    type Event = Infallible;
    type Status = Recording;

    fn due(&self, now: u64) -> u64 {
        now + LOOK_NS
    }

    fn happen(&mut self, event: Infallible, _line: &mut Line) -> Result<(), EmulatorError> {
        match event {}
    }

    fn work(&mut self, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        let mut sent = Vec::new();
        while let Some((_, byte)) = line.heard(now) {
            sent.push(byte);
        }
        if !sent.is_empty() {
            self.device.send(&sent)?;
            self.add(Sender::Program, sent, now)?;
        }
        let received = self.device.receive()?;
        for byte in &received {
            line.reply(*byte, 0, now);
        }
        Ok(self.add(Sender::Device, received, now)?)
    }

    fn status(&mut self, port: Option<PathBuf>, _line: &Line) -> Recording {
        Recording { port, bytes: self.bytes }
    }
}
