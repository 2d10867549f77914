//! A run along one axis: targets, each approached several times from one side or both, as ISO 230-2 asks; read off a measurement table.

use plumb_calibration::table::Table;
use plumb_calibration::table::scalar::ScalarUnit;
use serde::Serialize;
use thiserror::Error;

/// The unit in which an axis moves and its deviations are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    /// Millimetres, of an axis that slides.
    Mm,
    /// Degrees, of an axis that turns.
    Deg,
}

impl Unit {
    /// As people write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mm => "mm",
            Self::Deg => "deg",
        }
    }

    /// A number of a table (mm or rad) in this unit.
    fn of(self, value: f64) -> f64 {
        match self {
            Self::Mm => value,
            Self::Deg => value.to_degrees(),
        }
    }
}

/// Which axis, and which reading; nothing where the table leaves no choice.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AxisChoice {
    /// The joint, from 0.
    pub joint: Option<usize>,
    /// The reading: `p1_x`, `distance`, `height`, `tilt_x`.
    pub reading: Option<String>,
}

/// One target of an axis and what was read there.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Where the axis was sent.
    pub commanded: f64,
    /// Deviations (read less commanded) of the approaches in the positive direction, in their order.
    pub positive: Vec<f64>,
    /// The same in the negative direction.
    pub negative: Vec<f64>,
    /// A row of the table for each direction that was driven.
    pub rows: Vec<usize>,
}

/// A run along one axis.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisRun {
    /// The axis: its column's header.
    pub axis: String,
    /// The joint, from 0.
    pub joint: usize,
    /// What was read: `p1_x`.
    pub reading: String,
    /// Unit of everything.
    pub unit: Unit,
    /// Whether the reading falls where the axis rises; its deviations are then given in the axis's sense.
    pub reversed: bool,
    /// The targets, in the order of their coordinates.
    pub targets: Vec<Target>,
}

/// Why a table is no run along an axis.
#[derive(Debug, Error, PartialEq)]
pub enum AxisRunError {
    /// Nothing moved.
    #[error("{table}: no joint moves: every row has the same commanded position")]
    NothingMoves {
        /// The table.
        table: String,
    },
    /// Several joints moved.
    #[error("{table}: {} move; say which is the axis, as in --axis {first}", moving.join(" and "))]
    SeveralMove {
        /// The table.
        table: String,
        /// Their columns.
        moving: Vec<String>,
        /// The first of them.
        first: String,
    },
    /// The axis that was asked for does not move.
    #[error("{table}: {axis} does not move: every row has the same commanded position")]
    AxisRests {
        /// The table.
        table: String,
        /// Its column.
        axis: String,
    },
    /// Another joint moved during the run.
    #[error(
        "{table}: line {line}: {other} moved during the run along {axis}; one run has every other joint at one place"
    )]
    OtherMoved {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// The joint that moved.
        other: String,
        /// The axis.
        axis: String,
    },
    /// No reading of the axis's unit.
    #[error("{table}: nothing was read in {unit} that could be the position of {axis}: {needed}")]
    NoReading {
        /// The table.
        table: String,
        /// The axis.
        axis: String,
        /// `mm` or `deg`.
        unit: &'static str,
        /// Columns that would do.
        needed: &'static str,
    },
    /// There is no such reading.
    #[error("{table}: no reading `{reading}` in {unit}; there are {}", known.join(", "))]
    UnknownReading {
        /// The table.
        table: String,
        /// What was asked for.
        reading: String,
        /// The axis's unit.
        unit: &'static str,
        /// The readings there are.
        known: Vec<String>,
    },
    /// Several readings follow the axis, or none does.
    #[error("{table}: say which reading is the position of {axis}, as in --reading {first}: {slopes}")]
    WhichReading {
        /// The table.
        table: String,
        /// The axis.
        axis: String,
        /// A reading.
        first: String,
        /// How much each changes.
        slopes: String,
    },
    /// A reading that does not go with the axis.
    #[error(
        "{table}: {reading} changes by {slope:.4} {unit} per {unit} of {axis}, and the position of an axis by 1 or -1: see whether both columns have their right units, \
         and whether {reading} lies along the axis"
    )]
    Slope {
        /// The table.
        table: String,
        /// The reading.
        reading: String,
        /// Its change.
        slope: f64,
        /// The unit of both.
        unit: &'static str,
        /// The axis.
        axis: String,
    },
    /// An empty cell.
    #[error("{table}: line {line}: {reading} is empty; ISO 230-2 needs a reading in every row")]
    NotRead {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// The reading.
        reading: String,
    },
    /// The table does not say from which side positions were approached.
    #[error(
        "{table}: no column `{column}`: ISO 230-2 treats the two directions of approach apart; add it with 1 where the axis arrived moving in its positive direction, and -1 where in its negative"
    )]
    NoDirection {
        /// The table.
        table: String,
        /// The column that is missing.
        column: String,
    },
    /// A row does not say it.
    #[error(
        "{table}: line {line}: `{column}` is empty or 0; write 1 where the axis arrived moving in its positive direction, and -1 where in its negative"
    )]
    RowWithoutDirection {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// The column.
        column: String,
    },
    /// Returns to one pose with different commands.
    #[error(
        "{table}: line {line}: `repeat` {id} is used for {axis} at {first} and at {second}; returns to one target have the same commanded position"
    )]
    RepeatMoves {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// The id.
        id: String,
        /// The axis.
        axis: String,
        /// One position.
        first: f64,
        /// Another.
        second: f64,
    },
    /// A target approached once.
    #[error(
        "{table}: {axis} = {at} {unit} was approached once {side}: a repeatability needs at least two approaches, and ISO 230-2 asks for five from each side"
    )]
    Once {
        /// The table.
        table: String,
        /// The axis.
        axis: String,
        /// The target.
        at: f64,
        /// The unit.
        unit: &'static str,
        /// From which side.
        side: &'static str,
    },
    /// Not the same number of approaches everywhere.
    #[error(
        "{table}: {axis} = {at} {unit} was approached {found} times {side}, and {expected} times elsewhere: ISO 230-2 takes the same number at every target and from each side"
    )]
    Unequal {
        /// The table.
        table: String,
        /// The axis.
        axis: String,
        /// The target.
        at: f64,
        /// The unit.
        unit: &'static str,
        /// Approaches there.
        found: usize,
        /// Approaches at most targets.
        expected: usize,
        /// From which side.
        side: &'static str,
    },
    /// One target.
    #[error("{table}: {axis} has one target only; ISO 230-2 asks for at least five along the axis")]
    OneTarget {
        /// The table.
        table: String,
        /// The axis.
        axis: String,
    },
}

/// How far a reading's slope may be from 1: a nominal axis is far better, another unit far worse.
const SLOPE_AGREES: f64 = 0.1;

/// Commanded positions closer than this are one target, mm or degrees: below what any drive resolves.
const SAME_TARGET: f64 = 1e-6;

impl AxisRun {
    /// Reads a run off a table.
    ///
    /// # Errors
    /// [`AxisRunError`].
    pub fn of(table: &Table, choice: &AxisChoice) -> Result<Self, AxisRunError> {
        let joint = axis(table, choice.joint)?;
        let (axis, unit) = (column(table, joint), unit_of(table, joint));
        others_rest(table, joint, &axis)?;
        let commanded: Vec<f64> =
            (0..table.len()).map(|row| unit.of(coordinate(table, row, joint))).collect();
        let (reading, values, slope) = reading(table, &axis, unit, &commanded, choice.reading.as_deref())?;
        if (slope.abs() - 1.0).abs() > SLOPE_AGREES {
            return Err(AxisRunError::Slope {
                table: table.source.clone(),
                reading,
                slope,
                unit: unit.name(),
                axis,
            });
        }
        let sides = sides(table, joint, &axis)?;
        repeats_rest(table, &axis, &commanded)?;
        let sense = slope.signum();
        let mut targets: Vec<Target> = Vec::new();
        for row in table.order() {
            let at = commanded.get(row).copied().unwrap_or(f64::NAN);
            let deviation = sense * values.get(row).copied().unwrap_or(f64::NAN) - at;
            let known = targets.iter().position(|target| (target.commanded - at).abs() <= SAME_TARGET);
            let index = known.unwrap_or_else(|| {
                targets.push(Target {
                    commanded: at,
                    positive: Vec::new(),
                    negative: Vec::new(),
                    rows: Vec::new(),
                });
                targets.len() - 1
            });
            let Some(target) = targets.get_mut(index) else { continue };
            let side = match sides.get(row) {
                Some(-1) => &mut target.negative,
                _ => &mut target.positive,
            };
            if side.is_empty() {
                target.rows.push(row);
            }
            side.push(deviation);
        }
        targets.sort_by(|one, other| one.commanded.total_cmp(&other.commanded));
        let run = Self { axis, joint, reading, unit, reversed: slope < 0.0, targets };
        run.check(table)?;
        Ok(run)
    }

    /// The same number of approaches, more than one, at every target and from each side that was driven.
    fn check(&self, table: &Table) -> Result<(), AxisRunError> {
        let source = || table.source.clone();
        if self.targets.len() < 2 {
            return Err(AxisRunError::OneTarget { table: source(), axis: self.axis.clone() });
        }
        let counts = |target: &Target| [target.positive.len(), target.negative.len()];
        let driven = [0, 1].map(|side| self.targets.iter().any(|target| counts(target)[side] > 0));
        let expected = self.targets.iter().flat_map(counts).max().unwrap_or(0);
        for target in &self.targets {
            for (side, name) in [(0, "in the positive direction"), (1, "in the negative direction")] {
                let found = counts(target)[side];
                let (at, unit, axis) = (target.commanded, self.unit.name(), self.axis.clone());
                if !driven[side] || found == expected && found > 1 {
                    continue;
                }
                return Err(if expected == 1 {
                    AxisRunError::Once { table: source(), axis, at, unit, side: name }
                } else {
                    AxisRunError::Unequal { table: source(), axis, at, unit, found, expected, side: name }
                });
            }
        }
        Ok(())
    }

    /// Approaches of each target from each side.
    pub fn approaches(&self) -> usize {
        self.targets.iter().map(|target| target.positive.len().max(target.negative.len())).max().unwrap_or(0)
    }
}

/// A joint's column as the file has it.
fn column(table: &Table, joint: usize) -> String {
    let named = table.coordinate_columns.get(joint).map(|(name, _)| name.clone());
    named.filter(|name| !name.is_empty()).unwrap_or_else(|| format!("q{}", joint + 1))
}

fn unit_of(table: &Table, joint: usize) -> Unit {
    match table.coordinate_columns.get(joint) {
        Some((_, true)) => Unit::Mm,
        _ => Unit::Deg,
    }
}

fn coordinate(table: &Table, row: usize, joint: usize) -> f64 {
    table.q_of(row).get(joint).copied().unwrap_or(f64::NAN)
}

fn line(table: &Table, row: usize) -> u32 {
    table.lines.get(row).copied().unwrap_or(0)
}

fn moves(table: &Table, joint: usize) -> bool {
    let unit = unit_of(table, joint);
    let first = coordinate(table, 0, joint);
    (0..table.len()).any(|row| unit.of(coordinate(table, row, joint) - first).abs() > SAME_TARGET)
}

/// The joint that is the axis: the one that was asked for, or the only one that moves.
fn axis(table: &Table, requested: Option<usize>) -> Result<usize, AxisRunError> {
    let source = || table.source.clone();
    if let Some(joint) = requested {
        return match moves(table, joint) {
            true => Ok(joint),
            false => Err(AxisRunError::AxisRests { table: source(), axis: column(table, joint) }),
        };
    }
    let moving: Vec<usize> = (0..table.joints).filter(|joint| moves(table, *joint)).collect();
    match moving.as_slice() {
        [] => Err(AxisRunError::NothingMoves { table: source() }),
        [one] => Ok(*one),
        [first, ..] => Err(AxisRunError::SeveralMove {
            table: source(),
            moving: moving.iter().map(|joint| column(table, *joint)).collect(),
            first: format!("q{}", first + 1),
        }),
    }
}

fn others_rest(table: &Table, axis: usize, name: &str) -> Result<(), AxisRunError> {
    for joint in (0..table.joints).filter(|joint| *joint != axis) {
        let unit = unit_of(table, joint);
        let first = coordinate(table, 0, joint);
        let moved = |row: &usize| unit.of(coordinate(table, *row, joint) - first).abs() > SAME_TARGET;
        if let Some(row) = (0..table.len()).find(moved) {
            return Err(AxisRunError::OtherMoved {
                table: table.source.clone(),
                line: line(table, row),
                other: column(table, joint),
                axis: name.to_owned(),
            });
        }
    }
    Ok(())
}

/// Everything that was read in a unit, by name.
fn readings(table: &Table, unit: Unit) -> Vec<(String, Vec<f64>)> {
    let mut found = Vec::new();
    match unit {
        Unit::Mm => {
            for columns in &table.positions {
                for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
                    let values =
                        columns.xyz.iter().map(|xyz| xyz.get(axis).copied().unwrap_or(f64::NAN)).collect();
                    found.push((format!("{}_{name}", columns.target), values));
                }
            }
            let lengths = table.scalars.iter().filter(|column| column.scalar.unit == ScalarUnit::Length);
            found.extend(lengths.map(|column| (column.scalar.name.to_owned(), column.values.clone())));
        }
        Unit::Deg => {
            for (axis, name) in ["tilt_x", "tilt_y"].into_iter().enumerate() {
                if let Some(tilt) = &table.tilt {
                    let values = tilt.iter().map(|tilt| unit.of(tilt.get(axis).copied().unwrap_or(f64::NAN)));
                    found.push((name.to_owned(), values.collect()));
                }
            }
        }
    }
    found.retain(|(_, values)| values.iter().any(|value| value.is_finite()));
    found
}

/// The slope of a reading over the commanded position, by least squares over the rows in which it was read.
fn slope(commanded: &[f64], values: &[f64]) -> f64 {
    let pairs = || commanded.iter().zip(values).filter(|(_, value)| value.is_finite());
    let count = pairs().count().max(1) as f64;
    let (mean_q, mean) = pairs().fold((0.0, 0.0), |(q, v), (at, value)| (q + at / count, v + value / count));
    let (cross, square) = pairs().fold((0.0, 0.0), |(cross, square), (at, value)| {
        (cross + (at - mean_q) * (value - mean), square + (at - mean_q).powi(2))
    });
    cross / square
}

/// The reading that is the axis's position, with its slope.
fn reading(
    table: &Table,
    axis: &str,
    unit: Unit,
    commanded: &[f64],
    requested: Option<&str>,
) -> Result<(String, Vec<f64>, f64), AxisRunError> {
    let source = || table.source.clone();
    let known: Vec<(String, Vec<f64>, f64)> = readings(table, unit)
        .into_iter()
        .map(|(name, values)| {
            let slope = slope(commanded, &values);
            (name, values, slope)
        })
        .collect();
    let names: Vec<String> = known.iter().map(|(name, ..)| name.clone()).collect();
    let Some(first) = names.first().cloned() else {
        let needed = match unit {
            Unit::Mm => "give it as p1_x_mm, distance_mm or height_mm",
            Unit::Deg => "give it as tilt_x_deg or tilt_y_deg",
        };
        return Err(AxisRunError::NoReading {
            table: source(),
            axis: axis.to_owned(),
            unit: unit.name(),
            needed,
        });
    };
    let along: Vec<usize> = (0..known.len())
        .filter(|index| {
            known.get(*index).is_some_and(|(_, _, slope)| (slope.abs() - 1.0).abs() <= SLOPE_AGREES)
        })
        .collect();
    let chosen = match (requested, along.as_slice(), names.as_slice()) {
        (Some(requested), ..) => {
            names.iter().position(|name| name == requested).ok_or_else(|| AxisRunError::UnknownReading {
                table: source(),
                reading: requested.to_owned(),
                unit: unit.name(),
                known: names.clone(),
            })?
        }
        (None, [one], _) => *one,
        (None, _, [_]) => 0,
        _ => {
            let slopes: Vec<String> =
                known.iter().map(|(name, _, slope)| format!("{name} changes by {slope:.4}")).collect();
            let slopes = format!("per {} of it {}", unit.name(), slopes.join(", "));
            return Err(AxisRunError::WhichReading { table: source(), axis: axis.to_owned(), first, slopes });
        }
    };
    let (name, values, slope) = known.into_iter().nth(chosen).unwrap_or_default();
    match values.iter().position(|value| !value.is_finite()) {
        Some(row) => Err(AxisRunError::NotRead { table: source(), line: line(table, row), reading: name }),
        None => Ok((name, values, slope)),
    }
}

/// The direction in which the axis arrived, row by row.
fn sides(table: &Table, joint: usize, axis: &str) -> Result<Vec<i8>, AxisRunError> {
    let sides: Vec<i8> = (0..table.len()).map(|row| table.approach_of(row, joint)).collect();
    let plain = axis.rsplit_once('_').map_or(axis, |(name, _)| name);
    let column = format!("approach_{plain}");
    if sides.iter().all(|side| *side == 0) {
        return Err(AxisRunError::NoDirection { table: table.source.clone(), column });
    }
    match sides.iter().position(|side| *side == 0) {
        Some(row) => Err(AxisRunError::RowWithoutDirection {
            table: table.source.clone(),
            line: line(table, row),
            column,
        }),
        None => Ok(sides),
    }
}

/// Rows that fraction an id under `repeat` were sent to one position.
fn repeats_rest(table: &Table, axis: &str, commanded: &[f64]) -> Result<(), AxisRunError> {
    let at = |row: usize| commanded.get(row).copied().unwrap_or(f64::NAN);
    for group in table.returns() {
        let Some(first) = group.first().copied() else { continue };
        let moved = group.iter().copied().find(|row| (at(*row) - at(first)).abs() > SAME_TARGET);
        if let Some(row) = moved {
            return Err(AxisRunError::RepeatMoves {
                table: table.source.clone(),
                line: line(table, row),
                id: table.repeat.name(row).unwrap_or_default().to_owned(),
                axis: axis.to_owned(),
                first: at(first),
                second: at(row),
            });
        }
    }
    Ok(())
}
