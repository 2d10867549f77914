//! A transcript at a pseudo-terminal, in place of the device.

use std::convert::Infallible;
use std::path::PathBuf;

use super::file::Transcript;
use super::player::{Player, Progress};
use crate::emulate::emulator::{Controls, Emulator, EmulatorError};
use crate::emulate::line::{Line, LineOptions};

/// A player with nothing to do looks up so seldom, ns.
const SELDOM_NS: u64 = 1_000_000_000;

/// How a transcript is played.
#[derive(Debug, Clone, Default)]
pub struct Replayed {
    /// The path a program opens.
    pub port: Option<PathBuf>,
    /// How far it is.
    pub progress: Progress,
}

/// A transcript being played. Ends when it is dropped.
pub type Replay = Emulator<Service>;

impl Replay {
    /// Plays a transcript to anyone who opens the port.
    ///
    /// # Errors
    /// [`EmulatorError`] when no pseudo-terminal or link can be made.
    pub fn start(transcript: Transcript, line: LineOptions) -> Result<Self, EmulatorError> {
        Self::switch_on(Service { player: Player::new(transcript), begun: false }, Line::new(line)?)
    }
}

/// The player on its line.
pub struct Service {
    player: Player,
    begun: bool,
}

impl Controls for Service {
    type Event = Infallible;
    type Status = Replayed;

    fn due(&self, now: u64) -> u64 {
        now + SELDOM_NS
    }

    fn happen(&mut self, event: Infallible, _line: &mut Line) -> Result<(), EmulatorError> {
        match event {}
    }

    fn work(&mut self, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        let mut answers = Vec::new();
        while let Some((_, byte)) = line.heard(now) {
            // What the device said first waits for somebody to be there: a port that is opened throws away what has come before.
            if !self.begun {
                self.begun = true;
                answers.extend(self.player.begin());
            }
            answers.extend(self.player.hear(byte));
        }
        for byte in answers {
            line.reply(byte, 0, now);
        }
        Ok(())
    }

    fn status(&mut self, port: Option<PathBuf>, _line: &Line) -> Replayed {
        Replayed { port, progress: self.player.progress().clone() }
    }
}
