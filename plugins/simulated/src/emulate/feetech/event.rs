//! What befalls the servos besides their line.

use std::str::FromStr;

use crate::emulate::fault::{Fault, FaultError};

/// What befalls the servos. Servos are named by their numbers on the bus.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// A servo's load is too great: it lets go.
    Overload(u8),
    /// A servo has this temperature, degrees Celsius.
    Celsius(u8, u8),
    /// The supply has this voltage, V.
    Volts(f64),
    /// A servo does not hear and answer any more, or does again.
    Answers(u8, bool),
    /// Load pulls a servo so many steps short of its goal.
    Sag(u8, i32),
    /// The next answers are lost.
    Lose(u32),
    /// The next answers are cut in the middle.
    Cut(u32),
    /// The power of the servos goes or comes.
    Power(bool),
    /// A byte to come will be damaged.
    Damage(Fault),
    /// Every byte from now on may be damaged, with this probability.
    DamageAtRandom(f64),
    /// The adapter is pulled out.
    Unplug,
    /// It is put back.
    Plug,
}

/// A line that gives no event.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EventError {
    /// Not one of the words there are.
    #[error(
        "`{0}` is nothing that can befall the servos; write one of: overload ID, celsius ID C, volts V, silent ID, answers ID, sag ID STEPS, lose N, cut N, power on, power off, fault KIND WAY N, faults PROBABILITY, unplug, plug"
    )]
    Unknown(String),
    /// A fault that is none.
    #[error(transparent)]
    Fault(#[from] FaultError),
}

impl FromStr for Event {
    type Err = EventError;

    fn from_str(line: &str) -> Result<Event, EventError> {
        let unknown = || EventError::Unknown(line.trim().to_owned());
        let words: Vec<&str> = line.split_whitespace().collect();
        if let ["fault", rest @ ..] = words.as_slice() {
            return Ok(Event::Damage(rest.join(" ").parse()?));
        }
        event(&words).ok_or_else(unknown)
    }
}

fn event(words: &[&str]) -> Option<Event> {
    Some(match words {
        ["overload", id] => Event::Overload(id.parse().ok()?),
        ["celsius", id, degrees] => Event::Celsius(id.parse().ok()?, degrees.parse().ok()?),
        ["volts", volts] => Event::Volts(volts.parse().ok().filter(|volts| (0.0..=25.0).contains(volts))?),
        ["silent", id] => Event::Answers(id.parse().ok()?, false),
        ["answers", id] => Event::Answers(id.parse().ok()?, true),
        ["sag", id, steps] => {
            Event::Sag(id.parse().ok()?, steps.parse().ok().filter(|steps: &i32| steps.abs() <= 1000)?)
        }
        ["lose", count] => Event::Lose(count.parse().ok()?),
        ["cut", count] => Event::Cut(count.parse().ok()?),
        ["power", "on"] => Event::Power(true),
        ["power", "off"] => Event::Power(false),
        ["faults", chance] => {
            Event::DamageAtRandom(chance.parse().ok().filter(|chance| (0.0..=1.0).contains(chance))?)
        }
        ["unplug"] => Event::Unplug,
        ["plug"] => Event::Plug,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_event_can_be_typed_and_others_are_answered_with_what_can() {
        for (line, event) in [
            ("overload 3", Event::Overload(3)),
            ("celsius 2 75", Event::Celsius(2, 75)),
            ("volts 3.2", Event::Volts(3.2)),
            ("silent 4", Event::Answers(4, false)),
            (" answers 4 ", Event::Answers(4, true)),
            ("sag 2 -12", Event::Sag(2, -12)),
            ("lose 2", Event::Lose(2)),
            ("cut 1", Event::Cut(1)),
            ("power off", Event::Power(false)),
            ("unplug", Event::Unplug),
        ] {
            assert_eq!(line.parse(), Ok(event), "{line}");
        }
        for line in ["", "overload", "volts 90", "sag 2 5000", "explode"] {
            let error = line.parse::<Event>().unwrap_err().to_string();
            assert!(
                error.contains("nothing that can befall the servos; write one of: overload ID"),
                "{error}"
            );
        }
    }
}
