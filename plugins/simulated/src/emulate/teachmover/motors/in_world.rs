//! Motors of the arm that is in a world.

use std::path::Path;
use std::time::Duration;

use super::{End, Ending, Motors, MotorsError, Pendant};
use crate::client::{ClientError, WorldClient};
use crate::emulate::mover::Mover;
use crate::emulate::teachmover::event::Key;
use crate::protocol::{PendantKey, Reading, Response, WorldCommand};

/// How often a motion under way is looked at, ns.
const LOOK_NS: u64 = 1_000_000;

/// How long a motion that was stopped may take to say so.
const PATIENCE: Duration = Duration::from_secs(5);

/// Motors of the arm that is in a world.
///
/// The world counts for the controller: its registers read zero where the arm is believed to be straight out, and go on counting when the
/// controller is started anew.
///
/// Two connections: a motion keeps one of them busy until it has ended, so that a stop never queues behind it.
#[derive(Debug)]
pub struct MotorsInWorld {
    client: WorldClient,
    mover: Mover,
    moves: bool,
    last: Reading,
}

impl MotorsInWorld {
    /// Connects to the world at `socket`.
    ///
    /// # Errors
    /// [`MotorsError`] when no world listens there.
    pub fn connect(socket: &Path) -> Result<Self, MotorsError> {
        let mut client = WorldClient::connect(socket, "teachmover controller").map_err(gone)?;
        let welcome = client.welcome();
        if welcome.arm != "teachmover" {
            return Err(MotorsError(format!("there is a {} in that world, no TeachMover", welcome.model)));
        }
        let mover = Mover::connect(socket, "teachmover motors").map_err(gone)?;
        let last = client.read(WorldCommand::Read {}).map_err(gone)?;
        Ok(Self { client, mover, moves: false, last })
    }

    fn ask(&mut self, command: WorldCommand) -> Result<Reading, MotorsError> {
        self.last = self.client.read(command).map_err(gone)?;
        Ok(self.last)
    }

    fn ended(&mut self, end: Result<Reading, ClientError>, now: u64) -> Result<End, MotorsError> {
        self.moves = false;
        let ending = match end {
            Err(ClientError::Refused(_)) => Ending::Refused,
            Err(error) => return Err(gone(error)),
            Ok(reading) => {
                self.last = reading;
                if reading.stopped { Ending::CutShort } else { Ending::Made }
            }
        };
        Ok(End { at: now, ending })
    }
}

fn gone(error: ClientError) -> MotorsError {
    MotorsError(error.to_string())
}

impl Motors for MotorsInWorld {
    fn start(&mut self, half_steps: [i32; 6], rate: f64, _now: u64) -> Result<(), MotorsError> {
        let command = WorldCommand::Step { half_steps: half_steps.map(f64::from).into(), rate };
        self.mover.begin(command).map_err(gone)?;
        self.moves = true;
        Ok(())
    }

    fn end(&mut self, now: u64) -> Result<Option<End>, MotorsError> {
        if !self.moves {
            return Ok(Some(End { at: now, ending: Ending::Made }));
        }
        self.mover.ended().map(|end| self.ended(end, now)).transpose()
    }

    fn look_again(&self, now: u64) -> u64 {
        now + LOOK_NS
    }

    fn halt(&mut self, now: u64) -> Result<u64, MotorsError> {
        self.ask(WorldCommand::Stop {})?;
        if self.moves {
            let end = self.mover.end(PATIENCE);
            self.ended(end.ok_or_else(|| MotorsError("it does not stop".to_owned()))?, now)?;
        }
        Ok(now)
    }

    fn position(&self, _now: u64) -> [i32; 6] {
        // A TeachMover has six motors; a world with another arm was refused when it was connected.
        let counts: [f64; 6] = self.last.half_steps.fixed().unwrap_or_default();
        counts.map(|count| count.round() as i32)
    }

    fn reset(&mut self) -> Result<(), MotorsError> {
        self.ask(WorldCommand::SetZero { joints: [0.0; 6].into() }).map(drop)
    }

    fn inputs(&mut self) -> Result<u8, MotorsError> {
        let reading = self.ask(WorldCommand::Read {})?;
        Ok((reading.inputs & 0x7f) as u8 | u8::from(reading.grip) << 7)
    }

    fn set_outputs(&mut self, levels: u8) -> Result<(), MotorsError> {
        self.ask(WorldCommand::Outputs { bits: u64::from(levels) }).map(drop)
    }

    fn press(&mut self, key: Key) -> Result<(), MotorsError> {
        let Some(key) = pendant_key(key) else { return Ok(()) };
        self.ask(WorldCommand::Key { key }).map(drop)
    }

    fn hand_over(&mut self) -> Result<(), MotorsError> {
        self.ask(WorldCommand::Pendant { on: true }).map(drop)
    }

    fn pendant(&mut self) -> Result<Option<Pendant>, MotorsError> {
        let reading = self.ask(WorldCommand::Read {})?;
        Ok(Some(Pendant { key: u8::try_from(reading.key).unwrap_or(0), drives: reading.pendant }))
    }

    fn check(&mut self) -> Result<(), MotorsError> {
        self.ask(WorldCommand::Read {}).map(drop)
    }

    fn put_between_fingers(&mut self, width_mm: f64) -> Result<bool, MotorsError> {
        match self.client.call(WorldCommand::Hold { width_mm }, || false, |_| {}) {
            Ok(Response::Reading(reading)) => {
                self.last = reading;
                Ok(true)
            }
            Ok(_) | Err(ClientError::Refused(_)) => Ok(false),
            Err(error) => Err(gone(error)),
        }
    }
}

fn pendant_key(key: Key) -> Option<PendantKey> {
    Some(match key.0 {
        1 => PendantKey::Train,
        2 => PendantKey::Pause,
        3 => PendantKey::Grip,
        4 => PendantKey::Out,
        5 => PendantKey::Free,
        6 => PendantKey::Move,
        7 => PendantKey::Stop,
        8 => PendantKey::Step,
        9 => PendantKey::Point,
        10 => PendantKey::Jump,
        11 => PendantKey::Clear,
        12 => PendantKey::Zero,
        13 => PendantKey::Speed,
        14 => PendantKey::Run,
        _ => return None,
    })
}
