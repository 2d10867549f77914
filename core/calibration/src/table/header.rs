//! What a column's header says it holds, and in which unit.

use plumb_document::nearest;

use super::orientation::{Body, OrientationForm};
use super::profile;
use super::scalar::{SCALARS, Scalar, ScalarUnit};

/// What one column holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Meaning {
    Coordinate { joint: usize, scale: f64 },
    Position { target: usize, axis: usize, scale: f64 },
    Turn { body: Body, form: OrientationForm, part: usize, scale: f64 },
    Board { axis: usize, scale: f64 },
    Flange { axis: usize, scale: f64 },
    Profile { number: usize, part: usize, scale: f64 },
    Std { axis: usize, scale: f64 },
    Scalar { scalar: &'static Scalar, target: Option<usize>, scale: f64 },
    On,
    Signal,
    Tilt { axis: usize, scale: f64 },
    Level,
    BoardSeen,
    DistanceTo,
    Touch,
    Time,
    Temperature,
    Payload,
    Session,
    Approach { joint: usize },
    Repeat,
    Covariate,
}

impl Meaning {
    /// Two columns with the same slot say the same thing twice, whatever their units.
    pub(super) fn slot(&self) -> Option<(u8, usize, usize)> {
        Some(match self {
            Self::Coordinate { joint, .. } => (0, *joint, 0),
            Self::Position { target, axis, .. } => (1, *target, *axis),
            Self::Std { axis, .. } => (2, *axis, 0),
            Self::Scalar { scalar, target, .. } => {
                (3, SCALARS.iter().position(|known| known == scalar)?, target.map_or(0, |target| target + 1))
            }
            Self::On => (4, 0, 0),
            Self::Tilt { axis, .. } => (5, *axis, 0),
            Self::DistanceTo => (7, 0, 0),
            Self::Touch => (8, 0, 0),
            Self::Time => (9, 0, 0),
            Self::Temperature => (10, 0, 0),
            Self::Payload => (11, 0, 0),
            Self::Session => (12, 0, 0),
            Self::Approach { joint } => (13, *joint, 0),
            Self::Repeat => (14, 0, 0),
            Self::Level => (15, 0, 0),
            Self::BoardSeen => (15, 1, 0),
            Self::Signal => (16, 0, 0),
            Self::Turn { body: Body::Target(number), form, part, .. } => {
                (17, *number, part + 4 * usize::from(*form == OrientationForm::RotationVector))
            }
            Self::Turn { body: Body::Flange, form, part, .. } => {
                (21, 0, part + 4 * usize::from(*form == OrientationForm::RotationVector))
            }
            Self::Flange { axis, .. } => (20, *axis, 0),
            Self::Turn { body: Body::Board, form, part, .. } => {
                (18, 0, part + 4 * usize::from(*form == OrientationForm::RotationVector))
            }
            Self::Board { axis, .. } => (19, *axis, 0),
            Self::Profile { number, part, .. } => (22, *number, *part),
            Self::Covariate => return None,
        })
    }
}

const LENGTHS: [(&str, f64); 3] = [("mm", 1.0), ("m", 1000.0), ("in", 25.4)];
const ANGLES: [(&str, f64); 2] = [("deg", std::f64::consts::PI / 180.0), ("rad", 1.0)];

fn unit(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    units.iter().find(|(name, _)| *name == text).map(|(_, scale)| *scale)
}

fn length(text: &str) -> Option<f64> {
    unit(text, &LENGTHS)
}

fn axis(text: &str) -> Option<usize> {
    ["x", "y", "z"].iter().position(|name| *name == text)
}

/// A number from 1 counted from 0, after a letter: `q3` -> 2.
fn numbered(text: &str, letter: char) -> Option<usize> {
    let digits = text.strip_prefix(letter)?;
    if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    // From 1, as people count; a number of four digits is no joint.
    digits.parse::<usize>().ok()?.checked_sub(1).filter(|index| *index < 1000)
}

fn needs_unit(name: &str, units: &[(&str, f64)]) -> String {
    let choices: Vec<String> = units.iter().map(|(unit, _)| format!("{name}_{unit}")).collect();
    format!("the unit is missing: write {}", choices.join(", "))
}

/// Reads a header.
///
/// # Errors
/// What is wrong with it, in words: a known quantity without its unit, or with one it cannot have.
pub(super) fn parse(name: &str) -> Result<Meaning, String> {
    let simple = match name {
        "on" => Some(Meaning::On),
        "signal" => Some(Meaning::Signal),
        "distance_to" => Some(Meaning::DistanceTo),
        "touch" => Some(Meaning::Touch),
        "level" => Some(Meaning::Level),
        "board" => Some(Meaning::BoardSeen),
        "time_s" => Some(Meaning::Time),
        "temperature_c" => Some(Meaning::Temperature),
        "payload_kg" => Some(Meaning::Payload),
        "session" => Some(Meaning::Session),
        "repeat" => Some(Meaning::Repeat),
        _ => None,
    };
    if let Some(meaning) = simple {
        return Ok(meaning);
    }
    if let Some(found) = SCALARS.iter().find_map(|scalar| of_scalar(name, scalar)) {
        return found;
    }
    let parts: Vec<&str> = name.split('_').collect();
    match parts.as_slice() {
        [joint, rest @ ..] if numbered(joint, 'q').is_some() => {
            coordinate(name, numbered(joint, 'q').unwrap_or(0), rest)
        }
        [target, rest @ ..] if numbered(target, 'p').is_some() => {
            position(name, numbered(target, 'p').unwrap_or(0), rest)
        }
        ["board", rest @ ..] => of_board(name, rest),
        ["flange", rest @ ..] => of_flange(name, rest),
        [point, rest @ ..] if profile::number_of(point).is_some() => {
            of_profile(name, profile::number_of(point).unwrap_or(0), rest)
        }
        ["tvec", rest @ ..] => board_position(name, rest),
        ["rvec", rest @ ..] => match rest {
            [name_of_axis, angle] => rotation_vector(name, Body::Board, axis(name_of_axis), Some(angle)),
            [name_of_axis] => rotation_vector(name, Body::Board, axis(name_of_axis), None),
            _ => Ok(Meaning::Covariate),
        },
        ["std", name_of_axis, unit] if axis(name_of_axis).is_some() => {
            scaled(name, length(unit), &LENGTHS, |scale| Meaning::Std {
                axis: axis(name_of_axis).unwrap_or(0),
                scale,
            })
        }
        ["std", name_of_axis] if axis(name_of_axis).is_some() => Err(needs_unit(name, &LENGTHS)),
        ["approach", joint] if numbered(joint, 'q').is_some() => {
            Ok(Meaning::Approach { joint: numbered(joint, 'q').unwrap_or(0) })
        }
        ["tilt", name_of_axis @ ("x" | "y"), angle] => scaled(name, unit(angle, &ANGLES), &ANGLES, |scale| {
            Meaning::Tilt { axis: axis(name_of_axis).unwrap_or(0), scale }
        }),
        ["tilt", "x" | "y"] => Err(needs_unit(name, &ANGLES)),
        ["time"] => Err("the unit is missing: write time_s".to_owned()),
        ["temperature"] => Err("the unit is missing: write temperature_c".to_owned()),
        ["payload"] => Err("the unit is missing: write payload_kg".to_owned()),
        _ => Ok(Meaning::Covariate),
    }
}

/// A column of one number, its name with its unit; nothing where another is meant.
fn of_scalar(name: &str, scalar: &'static Scalar) -> Option<Result<Meaning, String>> {
    let units: &[(&str, f64)] = match scalar.unit {
        ScalarUnit::Length => &LENGTHS,
        ScalarUnit::Angle => &ANGLES,
    };
    let (target, own) = match scalar.is_of_target {
        true => name.split_once('_').and_then(|(target, own)| Some((Some(numbered(target, 'p')?), own)))?,
        false => (None, name),
    };
    let rest = own.strip_prefix(scalar.name)?;
    if rest.is_empty() {
        return Some(Err(needs_unit(name, units)));
    }
    let given = rest.strip_prefix('_').filter(|given| !given.contains('_'))?;
    Some(scaled(name, unit(given, units), units, |scale| Meaning::Scalar { scalar, target, scale }))
}

fn scaled(
    name: &str,
    scale: Option<f64>,
    units: &[(&str, f64)],
    meaning: impl FnOnce(f64) -> Meaning,
) -> Result<Meaning, String> {
    scale.map(meaning).ok_or_else(|| {
        let choices: Vec<&str> = units.iter().map(|(unit, _)| *unit).collect();
        format!("`{name}` has no unit this quantity can have; units are {}", choices.join(", "))
    })
}

fn coordinate(name: &str, joint: usize, rest: &[&str]) -> Result<Meaning, String> {
    match rest {
        [angle] => unit(angle, &ANGLES)
            .or_else(|| length(angle))
            .map(|scale| Meaning::Coordinate { joint, scale })
            .ok_or_else(|| {
                format!("`{name}` has no unit a joint can have; units are deg, rad (mm, m, in if it slides)")
            }),
        [] => Err(needs_unit(name, &ANGLES)),
        _ => Ok(Meaning::Covariate),
    }
}

fn position(name: &str, target: usize, rest: &[&str]) -> Result<Meaning, String> {
    match rest {
        [name_of_axis, unit] if axis(name_of_axis).is_some() => {
            scaled(name, length(unit), &LENGTHS, |scale| Meaning::Position {
                target,
                axis: axis(name_of_axis).unwrap_or(0),
                scale,
            })
        }
        [name_of_axis] if axis(name_of_axis).is_some() => Err(needs_unit(name, &LENGTHS)),
        _ => turn(name, Body::Target(target), rest),
    }
}

/// What a camera on the arm sees of a board: where it is, and how it is turned.
fn of_board(name: &str, rest: &[&str]) -> Result<Meaning, String> {
    match rest {
        [name_of_axis, ..] if axis(name_of_axis).is_some() => board_position(name, rest),
        _ => turn(name, Body::Board, rest),
    }
}

/// A point of a profile, in the plane of the sensor.
fn of_profile(name: &str, number: usize, rest: &[&str]) -> Result<Meaning, String> {
    let part =
        rest.first().and_then(|name_of_axis| ["x", "z"].iter().position(|known| known == name_of_axis));
    match (part, rest) {
        (Some(part), [_, unit]) => {
            scaled(name, length(unit), &LENGTHS, |scale| Meaning::Profile { number, part, scale })
        }
        (Some(_), [_]) => Err(needs_unit(name, &LENGTHS)),
        (None, ["y", ..]) => {
            Err("a profile has x, along the sensor's line, and z, away from the sensor; across its plane it measures nothing"
                .to_owned())
        }
        _ => Ok(Meaning::Covariate),
    }
}

/// The pose of the flange in the base, where a table has that in place of joints.
fn of_flange(name: &str, rest: &[&str]) -> Result<Meaning, String> {
    match (rest.first().and_then(|name_of_axis| axis(name_of_axis)), rest) {
        (Some(axis), [_, unit]) => {
            scaled(name, length(unit), &LENGTHS, |scale| Meaning::Flange { axis, scale })
        }
        (Some(_), [_]) => Err(needs_unit(name, &LENGTHS)),
        _ => turn(name, Body::Flange, rest),
    }
}

fn board_position(name: &str, rest: &[&str]) -> Result<Meaning, String> {
    let along = rest.first().and_then(|name_of_axis| axis(name_of_axis));
    match (along, rest) {
        (Some(axis), [_, unit]) => {
            scaled(name, length(unit), &LENGTHS, |scale| Meaning::Board { axis, scale })
        }
        (Some(_), [_]) => Err(needs_unit(name, &LENGTHS)),
        _ => Ok(Meaning::Covariate),
    }
}

/// One number of an orientation: `qw`, `rx_rad`.
fn turn(name: &str, body: Body, rest: &[&str]) -> Result<Meaning, String> {
    let Some(first) = rest.first() else { return Ok(Meaning::Covariate) };
    let quaternion = ["qw", "qx", "qy", "qz"].iter().position(|known| known == first);
    let vector = ["rx", "ry", "rz"].iter().position(|known| known == first);
    match (rest, quaternion) {
        ([_], Some(part)) => Ok(Meaning::Turn { body, form: OrientationForm::Quaternion, part, scale: 1.0 }),
        ([_], None) => rotation_vector(name, body, vector, None),
        ([_, angle], None) => rotation_vector(name, body, vector, Some(angle)),
        _ => Ok(Meaning::Covariate),
    }
}

/// One number of a rotation vector; no number of one is a covariate.
fn rotation_vector(
    name: &str,
    body: Body,
    part: Option<usize>,
    angle: Option<&str>,
) -> Result<Meaning, String> {
    let Some(part) = part else { return Ok(Meaning::Covariate) };
    let form = OrientationForm::RotationVector;
    match angle {
        Some(angle) => {
            scaled(name, unit(angle, &ANGLES), &ANGLES, |scale| Meaning::Turn { body, form, part, scale })
        }
        None => Err(format!(
            "the unit is missing: write {name}_rad or {name}_deg (a rotation vector: the axis times the angle)"
        )),
    }
}

/// Whether a joint's column is given in a unit of length.
pub(super) fn is_in_length(name: &str) -> bool {
    name.rsplit_once('_').is_some_and(|(_, unit)| length(unit).is_some())
}

/// Headers that are known, one of each kind, without those of joints.
pub(super) fn known_headers() -> Vec<String> {
    let mut known: Vec<String> = [
        "on",
        "distance_to",
        "touch",
        "time_s",
        "temperature_c",
        "payload_kg",
        "session",
        "repeat",
        "tilt_x_deg",
        "tilt_y_deg",
        "p1_x_mm",
        "p1_y_mm",
        "p1_z_mm",
        "p1_qw",
        "p1_rx_rad",
        "level",
        "board",
        "board_x_mm",
        "board_y_mm",
        "board_z_mm",
        "board_rx_rad",
        "profile_x_mm",
        "profile_z_mm",
        "std_x_mm",
        "std_y_mm",
        "std_z_mm",
    ]
    .map(str::to_owned)
    .to_vec();
    known.extend(SCALARS.iter().map(|scalar| scalar.header()));
    known
}

/// A known header close to one that is not known: a slip of the pen worth a word.
pub(super) fn near_miss(name: &str, joints: usize) -> Option<String> {
    let mut known = known_headers();
    known.extend((1..=joints).map(|joint| format!("approach_q{joint}")));
    // Spreadsheets begin every cell with a capital.
    let lower = name.to_lowercase();
    let known: Vec<&str> = known.iter().map(String::as_str).collect();
    nearest(&lower, &known).filter(|_| name.len() > 3).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_in_headers_become_mm_and_rad() {
        assert_eq!(parse("p2_y_in"), Ok(Meaning::Position { target: 1, axis: 1, scale: 25.4 }));
        assert_eq!(parse("q3_rad"), Ok(Meaning::Coordinate { joint: 2, scale: 1.0 }));
        assert_eq!(parse("tilt_y_rad"), Ok(Meaning::Tilt { axis: 1, scale: 1.0 }));
        assert_eq!(parse("std_z_m"), Ok(Meaning::Std { axis: 2, scale: 1000.0 }));
    }

    #[test]
    fn a_known_quantity_without_its_unit_is_refused() {
        assert_eq!(parse("p1_x"), Err("the unit is missing: write p1_x_mm, p1_x_m, p1_x_in".to_owned()));
        assert_eq!(parse("q1"), Err("the unit is missing: write q1_deg, q1_rad".to_owned()));
        assert!(parse("height_deg").unwrap_err().contains("units are mm, m, in"));
    }

    #[test]
    fn unknown_columns_are_covariates_and_slips_are_pointed_out() {
        assert_eq!(parse("humidity"), Ok(Meaning::Covariate));
        assert_eq!(near_miss("aproach_q2", 6), Some("approach_q2".to_owned()));
        assert_eq!(near_miss("humidity", 6), None);
    }
}
