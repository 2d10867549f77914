//! What a table says, as equations: one for every number that was measured.

use plumb_kinematics::Motion;

use super::error::ObservationsError;
use super::kind::Equation;
use super::library::kinds;
use super::row::RowReader;
use super::unit::unit_of;
use crate::arm_model::{Model, TouchDistance};
use crate::reading_unit::ReadingUnit;
use crate::suggestion;
use crate::table::{self, Table};

/// A known distance between two touched places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlaceDistance {
    pub(crate) first: usize,
    pub(crate) second: usize,
    pub(crate) length: f64,
    pub(crate) sigma: f64,
}

/// Sigma of a known distance between places, as a fraction of the sigma of touching: it was measured with better means.
const KNOWN_DISTANCE: f64 = 0.1;

/// All equations of a table, row by row.
#[derive(Debug, Clone, Default)]
pub struct Observations {
    /// First equation of each row, and one past the last at the end.
    pub(crate) starts: Vec<u32>,
    /// All equations, by rows of the table.
    pub equations: Vec<Equation>,
    pub(crate) place_distances: Vec<PlaceDistance>,
    /// Names of touched places, as in the table.
    pub(crate) places: Vec<String>,
    /// Whether every equation's sigma was declared.
    pub declared: bool,
    /// The unit in which errors of these readings are shown.
    pub(crate) unit: ReadingUnit,
}

impl Observations {
    /// Reads the equations off a table.
    ///
    /// # Errors
    /// See [`ObservationsError`].
    pub fn new(model: &Model, table: &Table) -> Result<Self, ObservationsError> {
        check_joint_count(model, table)?;
        check_joint_units(model, table)?;
        for kind in kinds() {
            kind.check(model, table)?;
        }
        let (mut equations, mut starts) = (Vec::new(), vec![0]);
        for row in 0..table.len() {
            let reader = RowReader { model, table, row };
            for kind in kinds() {
                kind.read(&reader, &mut equations)?;
            }
            // One more than rows: a row's equations end where those of the next begin.
            starts.push(equations.len() as u32);
        }
        if equations.is_empty() {
            let covariates = table.covariates.iter().map(|covariate| covariate.name.as_str());
            let hint =
                table::suggestion(covariates).map(|option| format!("\n  {option}")).unwrap_or_default();
            return Err(ObservationsError::Nothing {
                table: table.source.clone(),
                columns: known_columns(),
                hint,
            });
        }
        for equation in equations.iter_mut().filter(|equation| !equation.is_declared) {
            let key = equation.measurand.kind.noise_key(model, equation.measurand);
            // What a fit showed weighs the readings; they are not declared by that.
            equation.sigma = model.noise.estimated_of(&key).unwrap_or(equation.sigma);
        }
        Ok(Self {
            starts,
            declared: equations.iter().all(|equation| equation.is_declared),
            unit: unit_of(&equations),
            equations,
            place_distances: place_distances(model, table)?,
            places: table.touch.names.clone(),
        })
    }

    /// Of so many rows in which nothing was measured yet.
    pub fn without_readings(rows: usize) -> Self {
        Self { starts: vec![0; rows + 1], ..Self::default() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Where a row's equations are in the list.
    pub fn range(&self, row: usize) -> std::ops::Range<usize> {
        let start = self.starts.get(row).map_or(0, |start| *start as usize);
        let end = self.starts.get(row + 1).map_or(0, |end| *end as usize);
        start..end
    }

    /// A row's equations.
    pub fn of_row(&self, row: usize) -> &[Equation] {
        self.equations.get(self.range(row)).unwrap_or(&[])
    }

    /// The unit in which errors of these readings are shown: mm where any length was read, degrees of angles alone.
    pub fn unit(&self) -> ReadingUnit {
        self.unit
    }

    /// All equations.
    pub fn equations(&self) -> &[Equation] {
        &self.equations
    }
}

/// The columns that hold measurements: `p1_x_mm ..., touch or distance_mm`.
fn known_columns() -> String {
    let mut columns: Vec<&str> = kinds().iter().map(|kind| kind.columns()).collect();
    columns.dedup();
    columns.retain(|columns| !columns.is_empty());
    match columns.split_last() {
        Some((last, others)) => format!("{} or {last}", others.join(", ")),
        None => String::new(),
    }
}

fn check_joint_count(model: &Model, table: &Table) -> Result<(), ObservationsError> {
    if table.joints == model.chain.len() {
        return Ok(());
    }
    Err(ObservationsError::JointCount {
        table: table.source.clone(),
        found: table.joints,
        arm: model.arm.clone(),
        expected: model.chain.len(),
    })
}

/// A slide's column in degrees, or a turning joint's in millimetres, would be taken for another place without a word.
fn check_joint_units(model: &Model, table: &Table) -> Result<(), ObservationsError> {
    for (number, (joint, (column, is_length))) in
        model.chain.joints.iter().zip(&table.coordinate_columns).enumerate()
    {
        let slides = joint.motion == Motion::Slides;
        if slides == *is_length {
            continue;
        }
        return Err(ObservationsError::JointUnit {
            table: table.source.clone(),
            column: column.clone(),
            arm: model.arm.clone(),
            joint: joint.name.clone(),
            number: number + 1,
            slides,
        });
    }
    Ok(())
}

/// The known distances between places that the table touches.
fn place_distances(model: &Model, table: &Table) -> Result<Vec<PlaceDistance>, ObservationsError> {
    let Some(touch) = &model.touch else { return Ok(Vec::new()) };
    let known = touch.distances.iter().filter_map(|distance| place_distance(model, table, distance));
    known.collect()
}

/// Known distances that are left out of a fit, one sentence each, with the places whose names come nearest: the table touches
/// places, but not both their ends. A misspelt place looks just like one that was not touched.
pub fn unused_distances(model: &Model, table: &Table) -> Vec<String> {
    let names = &table.touch.names;
    let distances = model.touch.as_ref().map_or(&[][..], |touch| &touch.distances);
    let mut unused = Vec::new();
    for TouchDistance { between, length } in distances {
        let missing = between.iter().find(|place| !names.contains(place));
        if let Some(place) = missing.filter(|_| !names.is_empty()) {
            let [one, other] = between;
            let hint = suggestion::suggestion(place, names.iter().map(String::as_str));
            unused.push(format!(
                "the known distance of {length} mm between `{one}` and `{other}` is not used: no row touches `{place}`{hint}"
            ));
        }
    }
    unused
}

/// One known distance; nothing where the table does not touch both its ends.
fn place_distance(
    model: &Model,
    table: &Table,
    distance: &TouchDistance,
) -> Option<Result<PlaceDistance, ObservationsError>> {
    let [one, other] = &distance.between;
    let indices = [one, other].map(|name| table.touch.names.iter().position(|known| known == name));
    let (first, second) = (indices[0]?, indices[1]?);
    if first == second {
        let reason = format!("touch distance between `{one}` and itself");
        return Some(Err(ObservationsError::Incomplete { table: table.source.clone(), reason }));
    }
    let touching = model.noise.touch.or_else(|| model.noise.estimated_of("touch_mm"));
    let sigma = touching.unwrap_or(1.0) * KNOWN_DISTANCE;
    Some(Ok(PlaceDistance { first, second, length: distance.length, sigma }))
}
