//! What befalls the controller and its arm besides the line.

use std::str::FromStr;

use crate::emulate::fault::{Fault, FaultError};

/// What befalls the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// An alarm goes on, by its number; the arm stops.
    Alarm(u8),
    /// The arm runs into something that its controller does not notice: it stops, and its move ends as if it had arrived.
    Block,
    /// The arm is held: its move does not end.
    Hold,
    /// The next answers are lost.
    Lose(u32),
    /// The next answers are cut in the middle.
    Cut(u32),
    /// The next answers have a wrong checksum.
    Corrupt(u32),
    /// The power goes or comes.
    Power(bool),
    /// A byte to come will be damaged.
    Damage(Fault),
    /// Every byte from now on may be damaged, with this probability.
    DamageAtRandom(f64),
    /// The plug is pulled.
    Unplug,
    /// It is put back.
    Plug,
}

/// A line that gives no event.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EventError {
    /// Not one of the words there are.
    #[error(
        "`{0}` is nothing that can befall a Dobot; write one of: alarm 0xHH, block, hold, lose N, cut N, corrupt N, power on, power off, fault KIND WAY N, faults PROBABILITY, unplug, plug"
    )]
    Unknown(String),
    /// A fault that is none.
    #[error(transparent)]
    Fault(#[from] FaultError),
}

impl FromStr for Event {
    type Err = EventError;

    fn from_str(line: &str) -> Result<Event, EventError> {
        let words: Vec<&str> = line.split_whitespace().collect();
        if let ["fault", rest @ ..] = words.as_slice() {
            return Ok(Event::Damage(rest.join(" ").parse()?));
        }
        event(&words).ok_or_else(|| EventError::Unknown(line.trim().to_owned()))
    }
}

fn event(words: &[&str]) -> Option<Event> {
    Some(match words {
        ["alarm", code] => {
            let code = u8::from_str_radix(code.strip_prefix("0x")?, 16).ok();
            Event::Alarm(code.filter(|code| *code < 0x80)?)
        }
        ["block"] => Event::Block,
        ["hold"] => Event::Hold,
        ["lose", count] => Event::Lose(count.parse().ok()?),
        ["cut", count] => Event::Cut(count.parse().ok()?),
        ["corrupt", count] => Event::Corrupt(count.parse().ok()?),
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
            ("alarm 0x52", Event::Alarm(0x52)),
            (" block ", Event::Block),
            ("hold", Event::Hold),
            ("lose 2", Event::Lose(2)),
            ("cut 1", Event::Cut(1)),
            ("corrupt 3", Event::Corrupt(3)),
            ("power off", Event::Power(false)),
            ("unplug", Event::Unplug),
        ] {
            assert_eq!(line.parse(), Ok(event), "{line}");
        }
        for line in ["", "alarm", "alarm 52", "alarm 0x80", "explode"] {
            let error = line.parse::<Event>().unwrap_err().to_string();
            assert!(error.contains("nothing that can befall a Dobot; write one of: alarm 0xHH"), "{error}");
        }
    }
}
