//! The controller on its line.

use std::path::PathBuf;

use super::arm::{Angles, Arm};
use super::controller::Controller;
use super::event::Event;
use super::framing::{Incoming, answer};
use crate::emulate::emulator::{Controls, EmulatorError};
use crate::emulate::line::{Line, LineOptions};

/// How often it looks after a move, and whether its arm is still there, ns.
const BUSY_NS: u64 = 2_000_000;
const IDLE_NS: u64 = 1_000_000_000;
/// How long it thinks before it answers, ns.
const THINKS_NS: u64 = 1_000_000;

/// How an emulated controller is.
#[derive(Debug, Clone, Default)]
pub struct EmulatorOptions {
    /// The socket of the world whose arm it moves; left out, it moves an arm of air.
    pub world: Option<PathBuf>,
    /// By how much each motor's angle says more than is so, deg: a world's arm then is elsewhere than the controller says.
    pub sensors_off: [f64; 4],
    /// Its line. Without a rate an arm of air moves in no time either.
    pub line: LineOptions,
}

/// The status of the controller.
#[derive(Debug, Clone, Default)]
pub struct Status {
    /// The path a host opens, as long as the plug is in.
    pub port: Option<PathBuf>,
    /// What its sensors say, deg.
    pub angles: Angles,
    /// Whether the arm moves.
    pub moving: bool,
    /// The command it carried out last.
    pub index: u64,
    /// The alarms that are on.
    pub alarms: Vec<u8>,
}

/// A controller at work. Ends when this is dropped.
pub type Emulator = crate::emulate::Emulator<Service>;

impl Emulator {
    /// Switches a controller on.
    ///
    /// # Errors
    /// [`EmulatorError`] when there is no such world, or no pseudo-terminal or link can be made.
    pub fn start(options: EmulatorOptions) -> Result<Emulator, EmulatorError> {
        let at_once = options.line.baud.is_none();
        let arm = Arm::connect(options.world.as_deref(), options.sensors_off, at_once)?;
        let mut controller = Controller::new(arm);
        let seen = Some(controller.look(0)?);
        let service = Service {
            controller,
            incoming: Incoming::default(),
            mishaps: Mishaps::default(),
            looked_ns: 0,
            seen,
        };
        Emulator::switch_on(service, Line::new(options.line)?)
    }
}

/// What becomes of the next answers.
#[derive(Debug, Default)]
struct Mishaps {
    lose: u32,
    cut: u32,
    corrupt: u32,
}

impl Mishaps {
    /// An answer as it arrives.
    fn befall(&mut self, mut bytes: Vec<u8>) -> Vec<u8> {
        let happens = |left: &mut u32| {
            let does = *left > 0;
            *left = left.saturating_sub(1);
            does
        };
        if happens(&mut self.lose) {
            return Vec::new();
        }
        if happens(&mut self.cut) {
            bytes.truncate(bytes.len() / 2);
        } else if happens(&mut self.corrupt)
            && let Some(last) = bytes.last_mut()
        {
            *last = last.wrapping_add(1);
        }
        bytes
    }
}

/// The controller's own part.
pub struct Service {
    controller: Controller,
    incoming: Incoming,
    mishaps: Mishaps,
    looked_ns: u64,
    seen: Option<(Angles, bool)>,
}

impl Controls for Service {
    type Event = Event;
    type Status = Status;

    fn due(&self, now: u64) -> u64 {
        if self.controller.is_busy() { now + BUSY_NS } else { self.looked_ns + IDLE_NS }
    }

    fn happen(&mut self, event: Event, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        match event {
            Event::Alarm(code) => self.controller.alarm(code, now)?,
            Event::Block => self.controller.block(now)?,
            Event::Hold => {
                self.controller.held = true;
                self.controller.block(now)?;
            }
            Event::Lose(count) => self.mishaps.lose = count,
            Event::Cut(count) => self.mishaps.cut = count,
            Event::Corrupt(count) => self.mishaps.corrupt = count,
            Event::Power(on) => self.controller.power(on, now)?,
            Event::Damage(fault) => line.damage(fault),
            Event::DamageAtRandom(probability) => line.damage_at_random(probability),
            Event::Unplug => line.unplug(),
            Event::Plug => line.plug()?,
        }
        self.seen = None;
        Ok(())
    }

    fn work(&mut self, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        self.controller.work(now)?;
        while let Some((_, byte)) = line.heard(now) {
            let Some(command) = self.incoming.push(byte) else { continue };
            if !self.controller.powered {
                continue;
            }
            let Some(body) = self.controller.take(&command, now)? else { continue };
            for (index, byte) in self.mishaps.befall(answer(&command, &body)).into_iter().enumerate() {
                line.reply(byte, if index == 0 { THINKS_NS } else { 0 }, now);
            }
        }
        self.controller.work(now)?;
        if self.controller.is_busy() || now >= self.looked_ns + IDLE_NS || self.seen.is_none_or(|seen| seen.1)
        {
            self.looked_ns = now;
            self.seen = Some(self.controller.look(now)?);
        }
        Ok(())
    }

    fn status(&mut self, port: Option<PathBuf>, _line: &Line) -> Status {
        let (angles, moving) = self.seen.unwrap_or_default();
        Status { port, angles, moving, index: self.controller.done, alarms: self.controller.alarms_on() }
    }
}
