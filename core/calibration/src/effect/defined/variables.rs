//! What a formula may speak of.

use crate::effect::{LooksAt, Sample};

/// A quantity of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Variable {
    /// Commanded coordinate, rad (mm if it slides): `q2`.
    Coordinate(usize),
    /// Moment of gravity about a joint's axis, N m: `m2`.
    Moment(usize),
    /// Side a joint arrived from, -1, 0, 1: `side2`.
    Side(usize),
    /// Last move of a joint, rad or mm: `move2`.
    Move(usize),
    /// Seconds since the first row: `t_s`.
    Time,
    /// deg C.
    Temperature,
    /// Load carried, kg.
    Payload,
    /// The predicted point, mm, frame of the measurements: `x`, `y`, `z`.
    Point(usize),
}

impl Variable {
    /// A variable by its name, for an arm of so many joints.
    pub(super) fn named(name: &str, joints: usize) -> Option<Self> {
        match name {
            "t_s" => return Some(Self::Time),
            "temperature_c" => return Some(Self::Temperature),
            "payload_kg" => return Some(Self::Payload),
            "x" => return Some(Self::Point(0)),
            "y" => return Some(Self::Point(1)),
            "z" => return Some(Self::Point(2)),
            _ => {}
        }
        // `move` begins with the letter of the moments: what follows the letters has to be a number.
        numbered(name, "q", joints)
            .map(Self::Coordinate)
            .or_else(|| numbered(name, "m", joints).map(Self::Moment))
            .or_else(|| numbered(name, "side", joints).map(Self::Side))
            .or_else(|| numbered(name, "move", joints).map(Self::Move))
    }

    /// All names, for messages.
    pub(super) fn names(joints: usize) -> Vec<String> {
        let numbered = ["q", "m", "side", "move"];
        let mut names: Vec<String> = numbered
            .iter()
            .flat_map(|letters| (1..=joints).map(move |number| format!("{letters}{number}")))
            .collect();
        names.extend(["t_s", "temperature_c", "payload_kg", "x", "y", "z"].map(str::to_owned));
        names
    }

    /// What must be known before it can be determined.
    pub(super) fn looks_at(self) -> LooksAt {
        match self {
            Self::Moment(_) => LooksAt::Gravity,
            Self::Point(_) => LooksAt::Point,
            _ => LooksAt::Conditions,
        }
    }

    /// Its value in a row; zero where it was not logged.
    pub(super) fn value(self, sample: &Sample<'_>) -> f64 {
        match self {
            Self::Coordinate(joint) => sample.coordinate(joint),
            Self::Moment(joint) => sample.moment(joint),
            Self::Side(joint) => sample.side(joint),
            Self::Move(joint) => sample.last_move(joint),
            Self::Time => or_zero(sample.time),
            Self::Temperature => or_zero(sample.temperature),
            Self::Payload => sample.weights.payload,
            Self::Point(axis) => sample.point.get(axis).copied().unwrap_or(0.0),
        }
    }
}

/// The index of a joint after some letters, `q2` -> 1; nothing of what is no joint of so many.
fn numbered(name: &str, letters: &str, joints: usize) -> Option<usize> {
    let digits = name.strip_prefix(letters)?;
    let number: usize = digits.bytes().all(|byte| byte.is_ascii_digit()).then(|| digits.parse().ok())??;
    number.checked_sub(1).filter(|index| *index < joints)
}

/// A number that was logged; 0 where it was not.
fn or_zero(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}
