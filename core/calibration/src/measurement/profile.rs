//! Line profiles in mm: a laser line sensor on the hand sees points of a plane, a ball or an edge, as x and z in its own plane.
//!
//! Equation, of a plane or a ball: `0 = d(p)`, `p = c + C (x, 0, z)'`, with the sensor at `c` and its axes `C = B F T` (base, flange, sensor in the flange), all in
//! the frame of the measurements, and `d` the distance from the surface. The sensor's x lies along its line, its z points away from it. Gradients: the surface's
//! unit normal `n` by the sensor's place, `(p - c) x n` by a turn of the sensor about itself, and those of the surface by its own numbers.
//!
//! Of an edge (a straight line in space): two equations, the distances of `p` to the left of it and over it ([`SurfaceShape::beside_line`]).
//!
//! (Zhuang, Motaghedi and Roth, Robot calibration with planar constraints, ICRA 1999, have the plane.)

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::{Named, RowReader};
use crate::arm_model::{Model, SurfaceShape};
use crate::fit::FreeParameter;
use crate::table::Table;
use crate::table::scalar::HEIGHT;

/// Points of profiles: columns `profile_x_mm`, `profile_z_mm`, or `profile1_x_mm` ... for several in a row.
#[derive(Debug)]
pub(super) struct Profile;

/// Points that a row can hold: what distinguishes them is a byte, and an edge takes two of its numbers for a point.
const MOST_POINTS: usize = 120;

/// Equations of one point: an edge has two, a plane or a ball the first of them.
const PER_POINT: usize = 2;

/// The sensor, by its index among the targets.
fn sensor(model: &Model) -> usize {
    model.profile_sensor.unwrap_or(0)
}

/// A point of a row in the sensor's frame, mm.
fn in_sensor(what: Measurand, table: &Table, row: usize) -> Option<Vector3<f64>> {
    let columns = table.profiles.get(usize::from(what.component) / PER_POINT)?;
    let [x, z] = columns.xz.get(row).copied()?;
    Some(Vector3::new(x, 0.0, z))
}

/// Where a point is, and from where the sensor saw it, mm, frame of the measurements; and what it lies on.
struct Seen<'a> {
    point: Vector3<f64>,
    from_sensor: Vector3<f64>,
    shape: &'a SurfaceShape,
    up: Vector3<f64>,
}

impl<'a> Seen<'a> {
    fn of(what: Measurand, context: &RowContext<'a>) -> Option<Self> {
        let shape = context.state.surfaces.get(what.index())?;
        let from_sensor = context.body(sensor(context.model)) * in_sensor(what, context.table, context.row)?;
        Some(Self { point: context.point + from_sensor, from_sensor, shape, up: context.up })
    }

    /// The distance that is zero, and its gradient by the point.
    fn distance(&self, what: Measurand) -> (f64, Vector3<f64>) {
        let part = usize::from(what.component) % PER_POINT;
        match self.shape.beside_line(&self.point, &self.up) {
            Some(parts) => parts[part],
            None => self.shape.distance(&self.point, &self.up),
        }
    }

    fn by_surface(&self, what: Measurand, which: usize) -> f64 {
        let part = usize::from(what.component) % PER_POINT;
        match self.shape.line_derivative(part, which, &self.point, &self.up) {
            Some(slope) => slope,
            None => self.shape.derivative(which, &self.point, &self.up),
        }
    }
}

/// The points of a row by their indices among the columns.
fn points(row: &RowReader<'_>) -> Result<Vec<usize>, ObservationsError> {
    let mut found = Vec::new();
    for (index, columns) in row.table.profiles.iter().enumerate() {
        let [x, z] = columns.xz.get(row.row).copied().unwrap_or([f64::NAN; 2]);
        match (x.is_finite(), z.is_finite()) {
            (true, true) => found.push(index),
            (false, false) => {}
            // Half a point would be measured along the other axis only, which no sensor does: it is a slip in the file.
            (has_x, _) => {
                let (there, lost) = if has_x { ("x", "z") } else { ("z", "x") };
                let (line, name) = (row.line(), columns.name());
                return Err(row.incomplete(format!(
                    "line {line}: a point of a profile has an x and a z; `{name}` has its {there} and no `{name}_{lost}_mm`"
                )));
            }
        }
    }
    if found.len() > MOST_POINTS {
        let reason = format!(
            "line {}: {} points in one row; {MOST_POINTS} are read at most: `plumb model profile` thins profiles out",
            row.line(),
            found.len()
        );
        return Err(row.incomplete(reason));
    }
    Ok(found)
}

impl MeasurementKind for Profile {
    fn name(&self) -> &'static str {
        "profile"
    }

    fn columns(&self) -> &'static str {
        "profile_x_mm, profile_z_mm"
    }

    fn check(&self, model: &Model, table: &Table) -> Result<(), ObservationsError> {
        let reason = match (table.profiles.len(), model.profile_sensor) {
            (0, _) | (1..=MOST_POINTS, Some(_)) => return Ok(()),
            (_, None) => "columns `profile_*` are of a laser line sensor on the hand: the model needs that sensor under `targets:` and \
                          `profile: {seen_by: p1}`"
                .to_owned(),
            (count, Some(_)) => format!(
                "{count} points in a row; at most {MOST_POINTS} are read: `plumb model profile` thins profiles out"
            ),
        };
        Err(ObservationsError::Incomplete { table: table.source.clone(), reason })
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        if row.table.profiles.is_empty() {
            return Ok(());
        }
        let (points, line) = (points(row)?, row.line());
        let surface = row.surface(Named::On)?;
        let reads_height = row.scalar(&HEIGHT).is_finite();
        let surface = match (surface, points.is_empty()) {
            (None, true) => return Ok(()),
            // `on` serves the height of the same row.
            (Some(_), true) if reads_height => return Ok(()),
            (Some(_), true) => {
                return Err(row.incomplete(format!(
                    "line {line}: `on` says what the profile lies on, and the row has no point of it"
                )));
            }
            (None, false) => {
                return Err(row.incomplete(format!(
                    "line {line}: a profile needs `on`, the name of the surface it lies on"
                )));
            }
            (Some(surface), false) => surface,
        };
        let Some(known) = row.model.surfaces.get(surface) else { return Ok(()) };
        let equations_of_point: u8 = match known.shape {
            // A surface is met at one distance, a line in space at two: to its left and above it.
            SurfaceShape::Plane { .. } | SurfaceShape::Sphere { .. } => 1,
            SurfaceShape::Line { .. } => 2,
            SurfaceShape::Point { .. } => {
                return Err(row.incomplete(format!(
                    "line {line}: a profile lies on a `plane`, a ball (`sphere`) or an edge (`line`); `{}` is a point",
                    known.name
                )));
            }
        };
        for point in points {
            for part in 0..equations_of_point {
                let component = (point * PER_POINT) as u8 + part;
                let what = Measurand { kind: &Self, index: surface as u32, component };
                equations.push(Equation::new(what, 0.0, row.model.noise.profile));
            }
        }
        Ok(())
    }

    fn subject(&self, model: &Model, _what: Measurand) -> Subject {
        Subject::Camera(sensor(model))
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let Some(seen) = Seen::of(what, context) else { return Prediction::of_point(0.0, Vector3::zeros()) };
        let (value, normal) = seen.distance(what);
        Prediction { value, by_point: normal, by_rotation: seen.from_sensor.cross(&normal) }
    }

    fn own_derivatives(
        &self,
        what: Measurand,
        context: &RowContext<'_>,
        set: &mut dyn FnMut(FreeParameter, f64),
    ) {
        let (Some(seen), Some(shape)) = (Seen::of(what, context), context.free_surface(what)) else { return };
        for which in 0..shape.freedoms_in_space() {
            set(FreeParameter::Surface(what.index(), which), seen.by_surface(what, which));
        }
    }
}
