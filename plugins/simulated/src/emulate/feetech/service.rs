//! The servos on their line.

use std::path::PathBuf;

use super::bus::ServoBus;
use super::event::Event;
use super::framing::Incoming;
use super::servo::Servo;
use super::shafts::Shafts;
use crate::emulate::emulator::{Controls, EmulatorError};
use crate::emulate::line::{Line, LineOptions};

/// How often servos look whether their arm is still there, ns.
const CHECK_NS: u64 = 1_000_000_000;

/// How emulated servos are.
#[derive(Debug, Clone, Default)]
pub struct EmulatorOptions {
    /// The socket of the world whose arm they drive; left out, they turn nothing.
    pub world: Option<PathBuf>,
    /// How many there are, numbered from 1; those beyond the arm's joints turn nothing.
    pub servos: u8,
    /// The servos whose horns sit the other way round.
    pub reversed: Vec<u8>,
    /// Whether the adapter brings back what the host sends.
    pub echo: bool,
    /// Their line. Without a rate, shafts that turn nothing take no time either.
    pub line: LineOptions,
}

/// The status of the servos.
#[derive(Debug, Clone, Default)]
pub struct Status {
    /// The path a host opens, as long as the adapter is in.
    pub port: Option<PathBuf>,
    /// What each encoder shows, homing offsets left out.
    pub encoders: Vec<i32>,
    /// Each homing offset.
    pub offsets: Vec<i32>,
    /// Whether each holds.
    pub holds: Vec<bool>,
    /// Whether any shaft moves.
    pub moving: bool,
}

/// Servos at work. They end when this is dropped.
pub type Emulator = crate::emulate::Emulator<Service>;

impl Emulator {
    /// Switches servos on.
    ///
    /// # Errors
    /// [`EmulatorError`] when there is no such world, or no pseudo-terminal or link can be made.
    pub fn start(options: EmulatorOptions) -> Result<Emulator, EmulatorError> {
        let at_once = options.line.baud.is_none();
        let shafts = Shafts::connect(options.world.as_deref(), usize::from(options.servos), at_once)?;
        let servo = |id: u8| Servo::new(id, options.reversed.contains(&id));
        let bus = ServoBus::new((1..=options.servos).map(servo).collect(), shafts);
        Emulator::switch_on(
            Service { bus, echo: options.echo, incoming: Incoming::default(), checked: 0, seen: Vec::new() },
            Line::new(options.line)?,
        )
    }
}

/// The servos' own part.
pub struct Service {
    bus: ServoBus,
    echo: bool,
    incoming: Incoming,
    checked: u64,
    seen: Vec<(i32, bool)>,
}

impl Service {
    fn servo(&mut self, id: u8) -> Option<&mut Servo> {
        self.bus.servos.iter_mut().find(|servo| servo.id() == id)
    }
}

impl Controls for Service {
    type Event = Event;
    type Status = Status;

    fn due(&self, _now: u64) -> u64 {
        self.checked + CHECK_NS
    }

    fn happen(&mut self, event: Event, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        match event {
            Event::Overload(id) => {
                if let Some(servo) = self.servo(id) {
                    servo.overload();
                }
                self.bus.drive(now)?;
            }
            Event::Celsius(id, degrees) => {
                if let Some(servo) = self.servo(id) {
                    servo.set_celsius(degrees);
                }
                self.bus.drive(now)?;
            }
            Event::Volts(volts) => {
                let decivolts = (volts * 10.0).round() as u8;
                self.bus.servos.iter_mut().for_each(|servo| servo.set_decivolts(decivolts));
            }
            Event::Answers(id, answers) => {
                if let Some(servo) = self.servo(id) {
                    servo.answers = answers;
                }
            }
            Event::Sag(id, steps) => {
                if let Some(servo) = self.servo(id) {
                    servo.sag = steps;
                }
                self.bus.drive(now)?;
            }
            Event::Lose(count) => self.bus.lose = count,
            Event::Cut(count) => self.bus.cut = count,
            Event::Power(on) => self.bus.power(on, now)?,
            Event::Damage(fault) => line.damage(fault),
            Event::DamageAtRandom(probability) => line.damage_at_random(probability),
            Event::Unplug => line.unplug(),
            Event::Plug => line.plug()?,
        }
        // The servos are looked at anew: what has happened shows in the status.
        self.seen.clear();
        Ok(())
    }

    fn work(&mut self, line: &mut Line) -> Result<(), EmulatorError> {
        let now = line.now();
        while let Some((arrived, byte)) = line.heard(now) {
            if self.echo {
                line.reply(byte, 0, arrived);
            }
            let Some(request) = self.incoming.push(byte, arrived) else { continue };
            for (delay, bytes) in self.bus.hear(&request, now)? {
                for (index, byte) in bytes.into_iter().enumerate() {
                    line.reply(byte, if index == 0 { delay } else { 0 }, now);
                }
            }
        }
        if now >= self.checked + CHECK_NS || self.seen.is_empty() {
            self.checked = now;
            self.seen = self.bus.look(now)?;
        }
        Ok(())
    }

    fn status(&mut self, port: Option<PathBuf>, _line: &Line) -> Status {
        Status {
            port,
            encoders: self.seen.iter().map(|(encoder, _)| *encoder).collect(),
            offsets: self.bus.servos.iter().map(Servo::offset).collect(),
            holds: self.bus.servos.iter().map(Servo::holds).collect(),
            moving: self.seen.iter().any(|(_, moves)| *moves),
        }
    }
}
