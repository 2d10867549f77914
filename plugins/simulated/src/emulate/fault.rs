//! Faults of the line: bytes that get lost, come twice, come as another, or come late.

use std::str::FromStr;
use std::time::Duration;

/// What happens to a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// It is lost.
    Drop,
    /// It comes twice.
    Double,
    /// One of its bits is turned over.
    Garble,
    /// It comes late.
    Late(Duration),
}

/// Which way a byte goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// From the host to the arm.
    ToArm,
    /// From the arm to the host.
    FromArm,
}

/// A byte to come that will be damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fault {
    /// How.
    pub kind: FaultKind,
    /// On which way.
    pub way: Way,
    /// Which of the bytes to come, from 1.
    pub byte: u64,
}

/// A text that gives no fault.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is no fault of a line; write `KIND WAY N` with KIND drop, double, garble or late:MS, WAY to-arm or from-arm, and N the byte from 1, such as `drop to-arm 3`"
)]
pub struct FaultError(String);

impl FromStr for Fault {
    type Err = FaultError;

    fn from_str(text: &str) -> Result<Fault, FaultError> {
        let wrong = || FaultError(text.trim().to_owned());
        let words: Vec<&str> = text.split_whitespace().collect();
        let [kind, way, byte] = words.as_slice() else { return Err(wrong()) };
        let kind = match (*kind, kind.strip_prefix("late:")) {
            ("drop", _) => FaultKind::Drop,
            ("double", _) => FaultKind::Double,
            ("garble", _) => FaultKind::Garble,
            (_, Some(ms)) => FaultKind::Late(Duration::from_millis(ms.parse().map_err(|_| wrong())?)),
            _ => return Err(wrong()),
        };
        let way = match *way {
            "to-arm" => Way::ToArm,
            "from-arm" => Way::FromArm,
            _ => return Err(wrong()),
        };
        let byte = byte.parse().ok().filter(|byte| *byte > 0).ok_or_else(wrong)?;
        Ok(Fault { kind, way, byte })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_can_be_typed() {
        let late = FaultKind::Late(Duration::from_millis(250));
        assert_eq!("late:250 from-arm 2".parse(), Ok(Fault { kind: late, way: Way::FromArm, byte: 2 }));
        assert_eq!(
            "garble to-arm 10".parse(),
            Ok(Fault { kind: FaultKind::Garble, way: Way::ToArm, byte: 10 })
        );
    }

    #[test]
    fn a_fault_that_is_none_is_named_with_what_would_be_right() {
        for text in ["", "drop", "drop to-arm 0", "late:x to-arm 1", "late to-arm 1", "drop sideways 1"] {
            let error = text.parse::<Fault>().unwrap_err().to_string();
            assert!(
                error.starts_with(&format!("`{text}` is no fault of a line; write `KIND WAY N`")),
                "{error}"
            );
        }
    }
}
