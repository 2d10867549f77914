//! Visits to a few poses, each reached many times, as ISO 9283 asks; read off a measurement table.

use nalgebra::{Rotation3, Vector3};
use plumb_calibration::table::{PositionColumns, Table};
use serde::Serialize;
use thiserror::Error;

use crate::row_orientations::{OrientationError, Predicted, RowOrientations};

/// Where the commanded positions are from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CommandedFrom {
    /// Columns `commanded_x_mm`, `commanded_y_mm`, `commanded_z_mm` of the table.
    Table,
    /// A model: where it has the target in each row.
    Model,
    /// Nobody says.
    Unknown,
}

/// One visit to a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Visit {
    /// Row of the table.
    pub row: usize,
    /// What was reached, mm.
    pub attained: Vector3<f64>,
    /// What was commanded, mm.
    pub commanded: Option<Vector3<f64>>,
    /// How what was reached is turned; nothing where that was not read.
    pub rotation: Option<Rotation3<f64>>,
    /// How it was to be turned.
    pub commanded_rotation: Option<Rotation3<f64>>,
    /// s; nothing where not logged.
    pub time: Option<f64>,
}

/// All visits to one pose by one way.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseVisits {
    /// The pose: its id under `repeat`, else the line of its first visit.
    pub pose: String,
    /// Side from which each joint arrived; nothing where that was not logged.
    pub sides: Option<Vec<i8>>,
    /// In the order of time.
    pub visits: Vec<Visit>,
}

/// Visits to several poses.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseRun {
    /// The target whose position was read.
    pub target: String,
    /// Where the commanded positions are from.
    pub commanded_from: CommandedFrom,
    /// The axes that were read: of x, y and z.
    pub axes: [bool; 3],
    /// Pose by pose.
    pub poses: Vec<PoseVisits>,
    /// Rows that are returns to no pose.
    pub single_rows: usize,
}

/// Why a table holds no returns to poses.
#[derive(Debug, Error, PartialEq)]
pub enum PoseRunError {
    /// No positions.
    #[error(
        "{0}: no position was read: ISO 9283 compares positions; give them as p1_x_mm, p1_y_mm and p1_z_mm"
    )]
    NoPositions(String),
    /// There is no such target.
    #[error("{table}: nothing was read of a target `{target}`; there are {}", known.join(", "))]
    UnknownTarget {
        /// The table.
        table: String,
        /// What was asked for.
        target: String,
        /// Targets there are.
        known: Vec<String>,
    },
    /// An empty cell.
    #[error(
        "{table}: line {line}: {reading} is empty, and other rows have it; a return needs every axis that was read"
    )]
    NotRead {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// The reading.
        reading: String,
    },
    /// Returns to one pose with different commands.
    #[error(
        "{table}: line {line}: `repeat` {id} is used for two poses: q{joint} differs from line {first}; returns to one pose have the same commanded joints"
    )]
    RepeatMoves {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// The id.
        id: String,
        /// The joint, from 1.
        joint: usize,
        /// Line of the first return.
        first: u32,
    },
    /// Returns to one pose with different commanded positions.
    #[error(
        "{table}: line {line}: pose {pose} was commanded to another {what} than in line {first}; returns to one pose have the same commanded place"
    )]
    CommandMoves {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// The pose.
        pose: String,
        /// Position or orientation.
        what: &'static str,
        /// Line of the first return.
        first: u32,
    },
    /// No pose was reached twice.
    #[error(
        "{0}: no pose was reached twice: a repeatability needs at least two returns, and ISO 9283 asks for thirty; give returns to one pose the same id in a column `repeat`"
    )]
    NoReturns(String),
    /// One pose was reached once.
    #[error(
        "{table}: line {line}: pose {pose} was reached once by this way: a repeatability needs at least two returns, and ISO 9283 asks for thirty"
    )]
    Once {
        /// The table.
        table: String,
        /// Line of the file.
        line: u32,
        /// The pose.
        pose: String,
    },
    /// Only some axes of the commanded position.
    #[error(
        "{table}: there is `{found}` and no column for commanded {missing}: give all axes that were read, as commanded_x_mm, or none"
    )]
    CommandedPart {
        /// The table.
        table: String,
        /// A column there is.
        found: String,
        /// The axis that is missing.
        missing: &'static str,
    },
    /// A commanded position that is no number or has no unit.
    #[error("{table}: {what}")]
    Commanded {
        /// The table.
        table: String,
        /// What is wrong.
        what: String,
    },
    /// A commanded orientation that is none.
    #[error("{table}: {what}")]
    CommandedOrientation {
        /// The table.
        table: String,
        /// What is wrong.
        what: String,
    },
}

impl From<OrientationError> for PoseRunError {
    fn from(OrientationError { table, what }: OrientationError) -> Self {
        Self::CommandedOrientation { table, what }
    }
}

const AXES: [&str; 3] = ["x", "y", "z"];

/// Units of a commanded position, and mm in each.
const UNITS: [(&str, f64); 3] = [("mm", 1.0), ("m", 1000.0), ("in", 25.4)];

/// Commanded coordinates closer than this are the same, rad or mm.
const SAME_COORDINATE: f64 = 1e-9;

/// Commanded positions are the same to so much, mm and rad: what is lost in reading a number, far below what any robot repeats.
const SAME_COMMAND_MM: f64 = 1e-6;
const SAME_COMMAND_RAD: f64 = 1e-7;

impl PoseRun {
    /// Reads the returns to poses off a table; `predicted` is where a model has the target in each row.
    ///
    /// # Errors
    /// [`PoseRunError`].
    pub fn of(
        table: &Table,
        target: Option<&str>,
        predicted: Option<&Predicted>,
    ) -> Result<Self, PoseRunError> {
        let source = || table.source.clone();
        let columns = match target {
            None => table.positions.first().ok_or_else(|| PoseRunError::NoPositions(source()))?,
            Some(name) => table.positions.iter().find(|columns| columns.target == name).ok_or_else(|| {
                PoseRunError::UnknownTarget {
                    table: source(),
                    target: name.to_owned(),
                    known: table.positions.iter().map(|columns| columns.target.clone()).collect(),
                }
            })?,
        };
        let axes = [0, 1, 2].map(|axis| columns.xyz.iter().any(|xyz| xyz[axis].is_finite()));
        if axes == [false; 3] {
            return Err(PoseRunError::NoPositions(source()));
        }
        let (commanded_from, commanded) = match predicted {
            Some(predicted) => (CommandedFrom::Model, Some(predicted.points.clone())),
            None => match commanded_columns(table, axes)? {
                Some(points) => (CommandedFrom::Table, Some(points)),
                None => (CommandedFrom::Unknown, None),
            },
        };
        let rotations = RowOrientations::of(table, columns.number, predicted)?;
        let groups = groups(table)?;
        let mut run = Self {
            target: columns.target.clone(),
            commanded_from,
            axes,
            poses: Vec::new(),
            single_rows: table.len() - groups.iter().map(|(_, rows)| rows.len()).sum::<usize>(),
        };
        for (pose, rows) in groups {
            for row in rows {
                let visit = run.visit(table, columns, commanded.as_deref(), &rotations, row)?;
                run.take(&pose, sides(table, row), visit);
            }
        }
        run.check(table)?;
        Ok(run)
    }

    /// One return.
    fn visit(
        &self,
        table: &Table,
        columns: &PositionColumns,
        commanded: Option<&[Vector3<f64>]>,
        rotations: &RowOrientations<'_>,
        row: usize,
    ) -> Result<Visit, PoseRunError> {
        let not_read = |reading: String| {
            let line = line(table, row);
            PoseRunError::NotRead { table: table.source.clone(), line, reading }
        };
        let xyz = columns.xyz.get(row).copied().unwrap_or([f64::NAN; 3]);
        let read = |point: &[f64; 3]| {
            Vector3::from([0, 1, 2].map(|axis| if self.axes[axis] { point[axis] } else { 0.0 }))
        };
        if let Some(axis) = (0..3).find(|axis| self.axes[*axis] && !xyz[*axis].is_finite()) {
            return Err(not_read(format!("{}_{}", self.target, AXES[axis])));
        }
        let rotation = rotations.attained.and_then(|rotations| rotations.get(row)).copied().flatten();
        if rotations.attained.is_some() && rotation.is_none() {
            return Err(not_read(format!("the orientation of {}", self.target)));
        }
        let time = table.time.as_ref().and_then(|time| time.get(row)).copied();
        Ok(Visit {
            row,
            attained: read(&xyz),
            commanded: commanded.and_then(|points| points.get(row)).map(|point| read(&(*point).into())),
            rotation,
            commanded_rotation: rotations
                .commanded
                .as_ref()
                .and_then(|rotations| rotations.get(row))
                .copied(),
            time: time.filter(|time| time.is_finite()),
        })
    }

    fn take(&mut self, pose: &str, sides: Option<Vec<i8>>, visit: Visit) {
        let known = self.poses.iter_mut().find(|known| known.pose == pose && known.sides == sides);
        match known {
            Some(known) => known.visits.push(visit),
            None => self.poses.push(PoseVisits { pose: pose.to_owned(), sides, visits: vec![visit] }),
        }
    }

    /// One pose has one commanded position, by whatever way it is reached. A model has equal joints at one position anyway.
    fn check_commands(&self, table: &Table) -> Result<(), PoseRunError> {
        if self.commanded_from != CommandedFrom::Table {
            return Ok(());
        }
        for known in &self.poses {
            let of_the_pose = self.poses.iter().find(|pose| pose.pose == known.pose);
            let Some(first) = of_the_pose.and_then(|pose| pose.visits.first()) else { continue };
            for visit in &known.visits {
                if let Some(what) = commanded_elsewhere(first, visit) {
                    return Err(PoseRunError::CommandMoves {
                        table: table.source.clone(),
                        line: line(table, visit.row),
                        pose: known.pose.clone(),
                        what,
                        first: line(table, first.row),
                    });
                }
            }
        }
        Ok(())
    }

    fn check(&self, table: &Table) -> Result<(), PoseRunError> {
        let source = || table.source.clone();
        if self.poses.is_empty() {
            return Err(PoseRunError::NoReturns(source()));
        }
        self.check_commands(table)?;
        match self.poses.iter().find(|pose| pose.visits.len() < 2) {
            Some(pose) => Err(PoseRunError::Once {
                table: source(),
                line: pose.visits.first().map_or(0, |visit| line(table, visit.row)),
                pose: pose.pose.clone(),
            }),
            None => Ok(()),
        }
    }
}

/// What differs between the commanded positions of two returns, as the table has them.
fn commanded_elsewhere(one: &Visit, other: &Visit) -> Option<&'static str> {
    let apart = one.commanded.zip(other.commanded).map_or(0.0, |(one, other)| (one - other).norm());
    let rotated =
        one.commanded_rotation.zip(other.commanded_rotation).map_or(0.0, |(one, other)| one.angle_to(&other));
    if apart > SAME_COMMAND_MM {
        return Some("position");
    }
    (rotated > SAME_COMMAND_RAD).then_some("orientation")
}

fn line(table: &Table, row: usize) -> u32 {
    table.lines.get(row).copied().unwrap_or(0)
}

/// The sides from which the joints arrived; nothing where none is known.
fn sides(table: &Table, row: usize) -> Option<Vec<i8>> {
    let sides: Vec<i8> = (0..table.joints).map(|joint| table.approach_of(row, joint)).collect();
    sides.iter().any(|side| *side != 0).then_some(sides)
}

/// The rows of each pose that was reached more than once, in the order of time: by the column `repeat`, else by equal commanded joints.
fn groups(table: &Table) -> Result<Vec<(String, Vec<usize>)>, PoseRunError> {
    let same = |one: usize, other: usize| {
        table.q_of(one).iter().zip(table.q_of(other)).position(|(a, b)| (a - b).abs() > SAME_COORDINATE)
    };
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    let by_name = !table.repeat.names.is_empty();
    for row in table.order() {
        let group = match by_name {
            true => match table.repeat.name(row) {
                Some(name) => groups.iter().position(|(pose, _)| pose == name).ok_or_else(|| name.to_owned()),
                None => continue,
            },
            false => groups
                .iter()
                .position(|(_, rows)| rows.first().is_some_and(|first| same(*first, row).is_none()))
                .ok_or_else(|| format!("line {}", line(table, row))),
        };
        let index = group.unwrap_or_else(|name| {
            groups.push((name, Vec::new()));
            groups.len() - 1
        });
        let Some((pose, rows)) = groups.get_mut(index) else { continue };
        if let Some(first) = rows.first().copied()
            && let Some(joint) = same(first, row)
        {
            return Err(PoseRunError::RepeatMoves {
                table: table.source.clone(),
                line: line(table, row),
                id: pose.clone(),
                joint: joint + 1,
                first: line(table, first),
            });
        }
        rows.push(row);
    }
    if !by_name {
        groups.retain(|(_, rows)| rows.len() > 1);
    }
    Ok(groups)
}

/// The commanded positions by their columns, mm; nothing where the table has none.
fn commanded_columns(table: &Table, axes: [bool; 3]) -> Result<Option<Vec<Vector3<f64>>>, PoseRunError> {
    let begins = |axis: &str| format!("commanded_{axis}");
    // `commanded_yaw_deg` is of no axis y.
    let is_of = |name: &str, axis: &str| {
        name.strip_prefix(&begins(axis)).is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
    };
    let named = |axis: &str| table.covariates.iter().find(|column| is_of(&column.name, axis));
    let Some(first) = AXES.iter().find_map(|axis| named(axis)) else { return Ok(None) };
    let mut points = vec![Vector3::zeros(); table.len()];
    for (axis, name) in AXES.iter().enumerate().filter(|(axis, _)| axes[*axis]) {
        let Some(column) = named(name) else {
            let found = first.name.clone();
            return Err(PoseRunError::CommandedPart { table: table.source.clone(), found, missing: name });
        };
        let bad = |what: String| PoseRunError::Commanded { table: table.source.clone(), what };
        let ending = column.name.strip_prefix(&begins(name)).unwrap_or_default().trim_start_matches('_');
        let Some((_, scale)) = UNITS.iter().find(|(unit, _)| *unit == ending) else {
            return Err(bad(format!(
                "`{}` has no unit of a length: write commanded_{name}_mm, commanded_{name}_m or commanded_{name}_in",
                column.name
            )));
        };
        if let Some(word) = column.levels().first() {
            return Err(bad(format!("column `{}` holds `{word}`, which is no number", column.name)));
        }
        for (row, point) in points.iter_mut().enumerate() {
            let value = column.number(row);
            if !value.is_finite() {
                return Err(bad(format!("line {}: `{}` is empty", line(table, row), column.name)));
            }
            point[axis] = value * scale;
        }
    }
    Ok(Some(points))
}
