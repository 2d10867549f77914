//! The monitor on its line: one character held while another is echoed.

use std::path::PathBuf;
use std::time::Instant;

use super::arm::DrivenArm;
use super::dialect::Dialect;
use super::event::Event;
use super::monitor::Monitor;
use crate::emulate::emulator::{Controls, EmulatorError};
use crate::emulate::line::{Line, LineOptions};

/// How soon a character is echoed, ns.
const ECHO_NS: u64 = 200_000;
/// How long the monitor is busy with a character, ns: longer than the next one takes to come at 9600 baud.
const CHARACTER_NS: u64 = 1_500_000;
/// The same for a controller that keeps up with its line, ns.
const QUICK_CHARACTER_NS: u64 = 300_000;
/// How often a moving arm is looked at, ns.
const LOOK_NS: u64 = 2_000_000;
/// How often a controller at rest looks whether its arm is still there, ns.
const CHECK_NS: u64 = 1_000_000_000;

/// How an emulated controller is.
#[derive(Debug, Clone, Default)]
pub struct EmulatorOptions {
    /// The socket of the world whose arm it drives.
    pub world: PathBuf,
    /// How its monitor speaks.
    pub dialect: Dialect,
    /// Whether it keeps up with its line. Otherwise it holds one character while it echoes another, and loses a third.
    pub keeps_up: bool,
    /// Its line. Without a rate the monitor takes no time either.
    pub line: LineOptions,
}

/// The status of the controller.
#[derive(Debug, Clone, Default)]
pub struct Status {
    /// The path a host opens, as long as the plug is in.
    pub port: Option<PathBuf>,
    /// Whether the arm is moved.
    pub moving: bool,
    /// Whether characters of its own are still on their way to the host.
    pub talking: bool,
    /// Characters that came while it could take no more.
    pub lost: u64,
    /// When a control C was heard last.
    pub last_cancel: Option<Instant>,
}

/// The controller of a PUMA at work. Ends when it is dropped.
pub type Emulator = crate::emulate::Emulator<Service>;

impl Emulator {
    /// Switches a controller on.
    ///
    /// # Errors
    /// [`EmulatorError`] when there is no world, or no pseudo-terminal or link can be made.
    pub fn start(options: EmulatorOptions) -> Result<Emulator, EmulatorError> {
        let arm = DrivenArm::connect(&options.world)?;
        let service = Service {
            character_ns: match (options.line.baud, options.keeps_up) {
                (None, _) => 0,
                (Some(_), true) => QUICK_CHARACTER_NS,
                (Some(_), false) => CHARACTER_NS,
            },
            monitor: Monitor::new(options.dialect, arm),
            held: None,
            busy_until: 0,
            looked: 0,
            lost: 0,
            last_cancel: None,
        };
        Emulator::switch_on(service, Line::new(options.line)?)
    }
}

/// The controller's own part.
pub struct Service {
    /// How long the monitor is busy with a character, ns.
    character_ns: u64,
    monitor: Monitor,
    /// The one character the input buffer holds.
    held: Option<u8>,
    busy_until: u64,
    looked: u64,
    lost: u64,
    last_cancel: Option<Instant>,
}

impl Controls for Service {
    type Event = Event;
    type Status = Status;

    fn due(&self, _now: u64) -> u64 {
        let look = self.looked + self.rhythm();
        self.held.map_or(look, |_| look.min(self.busy_until))
    }

    fn happen(&mut self, event: Event, line: &mut Line) -> Result<(), EmulatorError> {
        match event {
            Event::Damage(fault) => line.damage(fault),
            Event::DamageAtRandom(probability) => line.damage_at_random(probability),
            Event::Unplug => line.unplug(),
            Event::Plug => line.plug()?,
            event => self.monitor.happen(&event)?,
        }
        Ok(())
    }

    fn work(&mut self, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        while let Some((arrived, byte)) = line.heard(now) {
            self.take_held(arrived, line)?;
            if arrived >= self.busy_until && self.held.is_none() && self.monitor.listens_to(byte) {
                self.hear(byte, arrived, line)?;
            } else if self.held.is_none() {
                self.held = Some(byte);
            } else {
                self.lost += 1;
            }
        }
        self.take_held(now, line)?;
        if now >= self.looked + self.rhythm() {
            self.looked = now;
            self.monitor.look()?;
        }
        self.speak(now, line);
        Ok(())
    }

    fn status(&mut self, port: Option<PathBuf>, line: &Line) -> Status {
        Status {
            port,
            moving: self.monitor.is_moving(),
            talking: line.is_busy(),
            lost: self.lost,
            last_cancel: self.last_cancel,
        }
    }
}

impl Service {
    /// How often the arm is looked at, ns.
    fn rhythm(&self) -> u64 {
        if self.monitor.is_moving() { LOOK_NS } else { CHECK_NS }
    }

    fn take_held(&mut self, now: u64, line: &mut Line) -> Result<(), EmulatorError> {
        if let Some(byte) = self.held.filter(|byte| now >= self.busy_until && self.monitor.listens_to(*byte))
        {
            self.held = None;
            self.hear(byte, self.busy_until.max(self.looked), line)?;
        }
        Ok(())
    }

    fn hear(&mut self, byte: u8, at: u64, line: &mut Line) -> Result<(), EmulatorError> {
        self.busy_until = at + self.character_ns;
        if byte == 3 {
            self.last_cancel = Some(Instant::now());
        }
        self.monitor.hear(byte)?;
        self.speak(if self.character_ns == 0 { at } else { at + ECHO_NS }, line);
        Ok(())
    }

    /// Puts what the monitor says on the line.
    fn speak(&mut self, at: u64, line: &mut Line) {
        for byte in self.monitor.take_said() {
            line.reply(byte, 0, at);
        }
    }
}
