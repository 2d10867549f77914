//! The controller on its line: bytes heard and answered at the times they come.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::controller::{Controller, Midway, Registers};
use super::event::Event;
use super::motors::Motors;
use crate::emulate::emulator::{Controls, EmulatorError};
use crate::emulate::line::{Line, LineOptions};

/// How often a controller looks whether its arm is still there, ns.
const CHECK_NS: u64 = 1_000_000_000;

/// The status of the controller.
#[derive(Debug, Clone, Default)]
pub struct Status {
    /// The path a host opens, as long as the plug is in.
    pub port: Option<PathBuf>,
    /// The registers.
    pub registers: Registers,
    /// Whether it is busy and hears nothing.
    pub busy: bool,
    /// When the last half-step was made.
    pub last_half_step: Option<Instant>,
    /// How long the motors have turned in all.
    pub turned: Duration,
}

/// The controller of a TeachMover at work. Ends when it is dropped.
pub type Emulator = crate::emulate::Emulator<Service>;

impl Emulator {
    /// Switches a controller of these motors on.
    ///
    /// # Errors
    /// [`EmulatorError`] when no pseudo-terminal or link can be made.
    pub fn start(line: LineOptions, motors: Box<dyn Motors>) -> Result<Emulator, EmulatorError> {
        let service = Service { controller: Controller::new(motors), checked: 0 };
        Emulator::switch_on(service, Line::new(line)?)
    }
}

/// The controller's own part.
pub struct Service {
    controller: Controller,
    checked: u64,
}

impl Controls for Service {
    type Event = Event;
    type Status = Status;

    fn due(&self, now: u64) -> u64 {
        let check = self.checked + CHECK_NS;
        self.controller.next(now).map_or(check, |due| due.min(check))
    }

    fn happen(&mut self, event: Event, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        match event {
            Event::Press(key) => self.controller.press(key, now)?,
            Event::StopAfter(half_steps) => self.controller.midway(Midway::Stop, half_steps),
            Event::UnplugAfter(half_steps) => self.controller.midway(Midway::Unplug, half_steps),
            Event::Drive { motor, half_steps } => self.controller.drive(motor, half_steps, now)?,
            Event::Line { bit, level } => {
                self.controller.motors().set_input(bit, level);
            }
            Event::Between(width_mm) => {
                self.controller.motors().put_between_fingers(width_mm)?;
            }
            Event::Read(known) => self.controller.know_read(known),
            Event::Damage(fault) => line.damage(fault),
            Event::DamageAtRandom(probability) => line.damage_at_random(probability),
            Event::Unplug => line.unplug(),
            Event::Plug => line.plug()?,
        }
        Ok(())
    }

    fn work(&mut self, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        if now >= self.checked + CHECK_NS {
            self.checked = now;
            self.controller.motors().check()?;
        }
        while let Some((arrived, byte)) = line.heard(now) {
            self.controller.run(arrived)?;
            self.speak(arrived, line);
            self.controller.hear(byte, arrived)?;
            self.speak(arrived, line);
        }
        self.controller.run(now)?;
        self.speak(now, line);
        Ok(())
    }

    fn status(&mut self, port: Option<PathBuf>, line: &Line) -> Status {
        let registers = self.controller.registers(line.now());
        let (last, turned) = self.controller.turned();
        Status {
            port,
            registers,
            busy: self.controller.is_busy(),
            last_half_step: last.map(|last| line.instant(last)),
            turned: Duration::from_nanos(turned),
        }
    }
}

impl Service {
    /// Puts what the controller says on the line, unless its plug was pulled before it said it.
    fn speak(&mut self, now: u64, line: &mut Line) {
        if self.controller.take_pull() {
            line.unplug();
        }
        let (bytes, pause) = self.controller.take_reply();
        for byte in bytes {
            line.reply(byte, pause, now);
        }
    }
}
