//! What happens to the controller besides its line: the panel's buttons, servo errors, faults.

use std::str::FromStr;

use crate::emulate::fault::{Fault, FaultError};

/// What happens to the controller.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The ARM POWER button: on or off.
    Power(bool),
    /// The PANIC button of the pendant.
    Panic,
    /// The servo of a joint (from 1) loses its arm.
    Envelope(usize),
    /// The mains fail and come back.
    Reboot,
    /// Somebody starts a program at the panel, which moves nothing. A control C does not end it, and ABORT asks whether one is sure.
    Program,
    /// A byte to come will be damaged.
    Damage(Fault),
    /// Every byte from now on may be damaged, with this probability.
    DamageAtRandom(f64),
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
        "`{0}` is nothing that can happen to the controller; write one of: power on, power off, panic, envelope JOINT, reboot, program, fault KIND WAY N, faults PROBABILITY, unplug, plug"
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
        match line.split_whitespace().collect::<Vec<_>>().as_slice() {
            ["power", "on"] => Ok(Event::Power(true)),
            ["power", "off"] => Ok(Event::Power(false)),
            ["panic"] => Ok(Event::Panic),
            ["envelope", joint] => {
                let joint = joint.parse().ok().filter(|joint| (1..=6).contains(joint));
                joint.map(Event::Envelope).ok_or_else(unknown)
            }
            ["reboot"] => Ok(Event::Reboot),
            ["program"] => Ok(Event::Program),
            ["fault", rest @ ..] => Ok(Event::Damage(rest.join(" ").parse()?)),
            ["faults", probability] => {
                let probability =
                    probability.parse().ok().filter(|probability| (0.0..=1.0).contains(probability));
                probability.map(Event::DamageAtRandom).ok_or_else(unknown)
            }
            ["unplug"] => Ok(Event::Unplug),
            ["plug"] => Ok(Event::Plug),
            _ => Err(unknown()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_event_can_be_typed_and_others_are_named() {
        assert_eq!("power off".parse(), Ok(Event::Power(false)));
        assert_eq!("envelope 3".parse(), Ok(Event::Envelope(3)));
        assert_eq!(" program ".parse(), Ok(Event::Program));
        assert_eq!("faults 0.01".parse(), Ok(Event::DamageAtRandom(0.01)));
        let error = "envelope 9".parse::<Event>().unwrap_err().to_string();
        assert!(error.starts_with(
            "`envelope 9` is nothing that can happen to the controller; write one of: power on"
        ));
    }
}
