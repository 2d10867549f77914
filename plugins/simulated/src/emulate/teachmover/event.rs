//! What happens to the controller besides its line: keys, lines, things between the fingers, faults.

use std::str::FromStr;

use crate::emulate::fault::{Fault, FaultError};

/// A key of the teach pendant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key(
    /// Its number, as the controller reports it: 1 to 14.
    pub u8,
);

impl Key {
    /// The red one.
    pub const STOP: Key = Key(7);

    const PRINTED: [&str; 14] = [
        "train", "pause", "grip", "out", "free", "move", "stop", "step", "point", "jump", "clear", "zero",
        "speed", "run",
    ];

    fn named(text: &str) -> Option<Key> {
        let by_name = Key::PRINTED.iter().position(|name| *name == text.to_ascii_lowercase());
        let number = by_name.map_or_else(|| text.parse().ok(), |index| Some(index + 1))?;
        u8::try_from(number).ok().filter(|number| (1..=14).contains(number)).map(Key)
    }
}

/// What happens to the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The operator presses a key of the pendant.
    Press(Key),
    /// The operator will press STOP when the next move has made this many half-steps.
    StopAfter(u32),
    /// The plug will be pulled when the next move has made this many half-steps; the arm moves on.
    UnplugAfter(u32),
    /// The operator drives a motor (0 to 5) by hand; only under hand control.
    Drive {
        /// Which motor.
        motor: usize,
        /// By how much.
        half_steps: i32,
    },
    /// A user input line takes a level.
    Line {
        /// Which, 0 to 6.
        bit: u32,
        /// Its level.
        level: bool,
    },
    /// Something lies between the fingers: its width, mm.
    Between(f64),
    /// A byte to come will be damaged.
    Damage(Fault),
    /// Every byte from now on may be damaged, with this probability.
    DamageAtRandom(f64),
    /// From now on the controller knows `@READ`, or does not.
    Read(bool),
    /// The plug is pulled.
    Unplug,
    /// The plug is put back.
    Plug,
}

/// A line that gives no event.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EventError {
    /// Not one of the words there are.
    #[error(
        "`{0}` is nothing that can happen to the arm; write one of: key NAME, stop-after N, unplug-after N, drive MOTOR N, input BIT on|off, between MM, read on|off, fault KIND WAY N, faults PROBABILITY, unplug, plug"
    )]
    Unknown(String),
    /// What follows the word is wrong.
    #[error("`{line}`: {right}")]
    Argument {
        /// The line.
        line: String,
        /// What would be right.
        right: &'static str,
    },
    /// A fault that is none.
    #[error(transparent)]
    Fault(#[from] FaultError),
}

impl FromStr for Event {
    type Err = EventError;

    fn from_str(line: &str) -> Result<Event, EventError> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let wrong = |right| EventError::Argument { line: line.trim().to_owned(), right };
        match words.as_slice() {
            ["key", name] => {
                let right = "name a key of the pendant, such as `key stop`, or its number from 1 to 14";
                Key::named(name).map(Event::Press).ok_or_else(|| wrong(right))
            }
            ["stop-after", count] => {
                let right = "give a number of half-steps, such as `stop-after 5`";
                count.parse().map(Event::StopAfter).map_err(|_| wrong(right))
            }
            ["unplug-after", count] => {
                let right = "give a number of half-steps, such as `unplug-after 5`";
                count.parse().map(Event::UnplugAfter).map_err(|_| wrong(right))
            }
            ["drive", motor, half_steps] => drive(motor, half_steps)
                .ok_or_else(|| wrong("write `drive MOTOR HALF-STEPS`, such as `drive base -100`; motors: base, shoulder, elbow, right, left, gripper")),
            ["input", bit, level] => {
                input(bit, level).ok_or_else(|| wrong("write `input BIT on` or `input BIT off`, BIT from 0 to 6"))
            }
            ["between", width] => {
                let width = width.parse().ok().filter(|width: &f64| (0.0..=100.0).contains(width));
                width.map(Event::Between).ok_or_else(|| wrong("give the width of what lies between the fingers, 0 to 100 mm"))
            }
            ["fault", rest @ ..] => Ok(Event::Damage(rest.join(" ").parse()?)),
            ["faults", probability] => {
                let probability = probability.parse().ok().filter(|probability| (0.0..=1.0).contains(probability));
                probability.map(Event::DamageAtRandom).ok_or_else(|| wrong("give a probability from 0 to 1"))
            }
            ["read", "on"] => Ok(Event::Read(true)),
            ["read", "off"] => Ok(Event::Read(false)),
            ["unplug"] => Ok(Event::Unplug),
            ["plug"] => Ok(Event::Plug),
            _ => Err(EventError::Unknown(line.trim().to_owned())),
        }
    }
}

fn drive(motor: &str, half_steps: &str) -> Option<Event> {
    const MOTORS: [&str; 6] = ["base", "shoulder", "elbow", "right", "left", "gripper"];
    let motor = MOTORS.iter().position(|name| *name == motor)?;
    let half_steps: i16 = half_steps.parse().ok()?;
    Some(Event::Drive { motor, half_steps: i32::from(half_steps) })
}

fn input(bit: &str, level: &str) -> Option<Event> {
    let bit = bit.parse().ok().filter(|bit| *bit < 7)?;
    let level = match level {
        "on" => true,
        "off" => false,
        _ => return None,
    };
    Some(Event::Line { bit, level })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::emulate::teachmover::{FaultKind, Way};

    #[test]
    fn every_event_can_be_typed() {
        for (line, event) in [
            ("key stop", Event::Press(Key::STOP)),
            ("key STOP", Event::Press(Key::STOP)),
            ("key 14", Event::Press(Key(14))),
            (" stop-after 5 ", Event::StopAfter(5)),
            ("unplug-after 5", Event::UnplugAfter(5)),
            ("drive elbow -70", Event::Drive { motor: 2, half_steps: -70 }),
            ("input 3 on", Event::Line { bit: 3, level: true }),
            ("between 12.5", Event::Between(12.5)),
            ("fault drop to-arm 3", Event::Damage(Fault { kind: FaultKind::Drop, way: Way::ToArm, byte: 3 })),
            ("faults 0.01", Event::DamageAtRandom(0.01)),
            ("read off", Event::Read(false)),
            ("unplug", Event::Unplug),
            ("plug", Event::Plug),
        ] {
            assert_eq!(line.parse(), Ok(event), "{line}");
        }
    }

    #[test]
    fn what_cannot_happen_is_named_with_what_can() {
        let says = |line: &str| line.parse::<Event>().unwrap_err().to_string();
        assert!(
            says("explode")
                .starts_with("`explode` is nothing that can happen to the arm; write one of: key NAME")
        );
        assert_eq!(
            says("input 7 on"),
            "`input 7 on`: write `input BIT on` or `input BIT off`, BIT from 0 to 6"
        );
        assert_eq!(
            says("unplug-after soon"),
            "`unplug-after soon`: give a number of half-steps, such as `unplug-after 5`"
        );
        assert_eq!(
            says("key 15"),
            "`key 15`: name a key of the pendant, such as `key stop`, or its number from 1 to 14"
        );
    }
}
