//! The direction in which a target is seen from the origin of the measurements' frame, as a theodolite or total station reads it.
//!
//! Equations, for the target at `p = (x, y, z)` mm, frame of the measurements: azimuth `atan2(y, x)`, about +z from +x towards +y, and elevation
//! `atan2(z, h)` over the plane of x and y, with `h = |(x, y)|`. Gradients: `(-y, x, 0) / h^2` and `(-x z / h, -y z / h, h) / |p|^2`. The azimuth that is
//! predicted is the one of all its full turns that is nearest to what was measured, so that their difference is in (-180, 180] deg. (Whitney, Lozinski
//! and Rourke, Industrial robot forward calibration method and results, J. Dyn. Syst. Meas. Control 108, 1986.)

use std::f64::consts::{PI, TAU};

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::RowReader;
use crate::arm_model::Model;
use crate::effect::Channel;
use crate::table::Table;
use crate::table::scalar::{AZIMUTH, ELEVATION, Scalar, ScalarColumn};

/// Directions: columns `p1_azimuth_deg` and `p1_elevation_deg` of each target, of which either may be empty.
#[derive(Debug)]
pub(super) struct Direction;

/// A target whose line of sight is this close to the vertical (sine of the angle between them) has no azimuth: rounding alone would turn it.
const VERTICAL: f64 = 1e-9;

/// The numbers of a direction, each at its component.
static PARTS: [&Scalar; 2] = [&AZIMUTH, &ELEVATION];

impl MeasurementKind for Direction {
    fn name(&self) -> &'static str {
        "direction"
    }

    fn columns(&self) -> &'static str {
        "p1_azimuth_deg ..."
    }

    fn is_length(&self) -> bool {
        false
    }

    /// Each circle of an instrument has a noise of its own (ISO 17123-3).
    fn noise_key(&self, _model: &Model, what: Measurand) -> String {
        part(what).key()
    }

    fn channel(&self, what: Measurand) -> Option<Channel> {
        Channel::of(part(what))
    }

    fn check(&self, model: &Model, table: &Table) -> Result<(), ObservationsError> {
        let mut columns = columns(table);
        let unknown = columns.find(|(_, column)| target_of(model, column).is_none());
        unknown.map_or(Ok(()), |(_, column)| {
            let header = column.header();
            let target = header.split('_').next().unwrap_or_default();
            let reason = format!(
                "column `{header}` measures a target the model does not have; add `{target}` under `targets:`"
            );
            Err(ObservationsError::Incomplete { table: table.source.clone(), reason })
        })
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        for (component, column) in columns(row.table) {
            let value = column.values.get(row.row).copied().unwrap_or(f64::NAN);
            let Some(target) = target_of(row.model, column).filter(|_| value.is_finite()) else { continue };
            if component == 0 && is_on_the_vertical(row, column.target) {
                let (line, header) = (row.line(), column.header());
                return Err(row.incomplete(format!(
                    "line {line}: a target straight above or below the instrument has no azimuth; leave `{header}` empty there"
                )));
            }
            let what = Measurand { kind: &Self, index: target as u32, component };
            equations.push(Equation::new(what, value, row.model.noise.of(column.scalar)));
        }
        Ok(())
    }

    fn subject(&self, _model: &Model, what: Measurand) -> Subject {
        Subject::Target(what.index())
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let measured = measured(what, context);
        match (what.component, azimuth(&context.point)) {
            (0, Some((value, by_point))) => {
                let nearest =
                    measured.map_or(value, |measured| measured - less_revolutions(measured - value));
                Prediction::of_point(nearest, by_point)
            }
            // It has none: what was read there says nothing of where the target is.
            (0, None) => Prediction::of_point(measured.unwrap_or(0.0), Vector3::zeros()),
            _ => {
                let (value, by_point) = elevation(&context.point);
                Prediction::of_point(value, by_point)
            }
        }
    }
}

/// The number that a measurand is.
fn part(what: Measurand) -> &'static Scalar {
    PARTS[usize::from(what.component.min(1))]
}

/// A table's columns of directions, each with its component.
fn columns(table: &Table) -> impl Iterator<Item = (u8, &ScalarColumn)> {
    let component = |column: &ScalarColumn| (0_u8..).zip(PARTS).find(|(_, part)| *part == column.scalar);
    table.scalars.iter().filter_map(move |column| Some((component(column)?.0, column)))
}

/// The target that a column is of, by its index in the model.
fn target_of(model: &Model, column: &ScalarColumn) -> Option<usize> {
    model.target_position(&format!("p{}", column.target? + 1))
}

/// Whether a row has an elevation of 90 deg up or down for the target of this number.
fn is_on_the_vertical(row: &RowReader<'_>, target: Option<usize>) -> bool {
    let elevations = target.and_then(|target| row.table.scalar_of(&ELEVATION, target));
    elevations.and_then(|values| values.get(row.row)).is_some_and(|elevation| elevation.cos() < VERTICAL)
}

/// What was measured, rad, where it was: predictions are also made of rows that are to come.
fn measured(what: Measurand, context: &RowContext<'_>) -> Option<f64> {
    let of_it = |column: &ScalarColumn| target_of(context.model, column) == Some(what.index());
    let (_, column) =
        columns(context.table).find(|(component, column)| *component == what.component && of_it(column))?;
    column.values.get(context.row).copied().filter(|value| value.is_finite())
}

/// The azimuth of a point, rad in (-pi, pi], and its gradient; nothing on the vertical.
fn azimuth(point: &Vector3<f64>) -> Option<(f64, Vector3<f64>)> {
    let across = point.x.hypot(point.y);
    if across <= VERTICAL * point.norm() {
        return None;
    }
    Some((point.y.atan2(point.x), Vector3::new(-point.y, point.x, 0.0) / (across * across)))
}

/// The elevation of a point, rad, and its gradient. On the vertical it is greatest or least, so that no small step changes it.
fn elevation(point: &Vector3<f64>) -> (f64, Vector3<f64>) {
    let across = point.x.hypot(point.y);
    let value = point.z.atan2(across);
    if across <= VERTICAL * point.norm() {
        return (value, Vector3::zeros());
    }
    let out = Vector3::new(point.x, point.y, 0.0) / across;
    (value, (Vector3::z() * across - out * point.z) / point.norm_squared())
}

/// An angle less its full turns: in (-pi, pi], rad.
fn less_revolutions(angle: f64) -> f64 {
    let turned = angle.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::ResidualModel;
    use crate::measurement::{NoiseSource, Observations, ReadingUnit};

    /// Two links in the plane, 400 and 300 mm, and the instrument 1000 mm to the right of their first axis and 500 mm below.
    const FLAT: &str = "
arm: flat
convention: distal
joints:
  - {name: shoulder, a_mm: 400}
  - {name: elbow, a_mm: 300}
base: {xyz_mm: [0, 1000, 500], free: false}
targets: {p1: {free: false}, p2: {xyz_mm: [0, 0, 500], free: false}}
noise: {azimuth_deg: 0.01, elevation_deg: 0.02}
";

    fn residuals(model: &str, columns: &str, cells: &str) -> Result<Vec<f64>, String> {
        let model = Model::parse("m.yaml", model).unwrap();
        let table = Table::parse("t.csv", &format!("q1_deg,q2_deg,{columns}\n{cells}\n"))
            .map_err(|error| error.to_string())?;
        let observations = Observations::new(&model, &table).map_err(|error| error.to_string())?;
        let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
        Ok(problem.residuals(&problem.start()).into_iter().map(f64::to_degrees).collect())
    }

    fn close(found: &[f64], expected: &[f64]) {
        let same =
            found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(same, "{found:?} instead of {expected:?}");
    }

    #[test]
    fn an_azimuth_is_about_z_from_x_and_an_elevation_over_the_horizontal_plane() {
        // Stretched out, p1 is at (700, 1000, 500) and p2 500 mm over it.
        let across = 700_f64.hypot(1000.0);
        let expected = [
            -(1000.0_f64 / 700.0).atan().to_degrees(),
            -(500.0 / across).atan().to_degrees(),
            -(1000.0_f64 / 700.0).atan().to_degrees(),
            -(1000.0 / across).atan().to_degrees(),
        ];
        let columns = "p1_azimuth_deg,p1_elevation_deg,p2_azimuth_deg,p2_elevation_deg";
        close(&residuals(FLAT, columns, "0,0,0,0,0,0").unwrap(), &expected);
        // Either may be empty, and radians mean the same.
        close(&residuals(FLAT, "p2_elevation_rad,p1_azimuth_rad", "0,0,,0").unwrap(), &expected[..1]);
    }

    #[test]
    fn full_turns_make_no_difference_to_an_azimuth() {
        // Folded back over x, the target is straight behind: at 180 deg.
        let behind = FLAT.replace("[0, 1000, 500]", "[0, 0, 500]");
        for (measured, left) in
            [(180.0, 0.0), (-180.0, 0.0), (-179.9, 0.1), (179.9, -0.1), (181.0, 1.0), (0.0, 180.0)]
        {
            close(&residuals(&behind, "p1_azimuth_deg", &format!("180,0,{measured}")).unwrap(), &[left]);
        }
        close(
            &[270.0, -270.0, 180.0, -180.0, 720.0]
                .map(|angle: f64| less_revolutions(angle.to_radians()).to_degrees()),
            &[-90.0, 90.0, 180.0, 180.0, 0.0],
        );
    }

    #[test]
    fn a_target_on_the_vertical_has_no_azimuth() {
        // Believed there, the azimuth that was read says nothing; the elevation does.
        let above = FLAT.replace("[0, 1000, 500]", "[-700, 0, 500]");
        close(&residuals(&above, "p1_azimuth_deg,p1_elevation_deg", "0,0,35,80").unwrap(), &[0.0, -10.0]);
        assert_eq!(azimuth(&Vector3::new(0.0, 1e-7, 500.0)), None);
        assert!(azimuth(&Vector3::new(0.0, 1e-6, 500.0)).is_some() && azimuth(&Vector3::zeros()).is_none());
        assert_eq!(elevation(&Vector3::new(0.0, 0.0, -5.0)).1, Vector3::zeros());
        // Measured there, an azimuth cannot be.
        let message = residuals(FLAT, "p1_azimuth_deg,p1_elevation_deg", "0,0,10,-90").unwrap_err();
        assert_eq!(
            message,
            "t.csv: line 2: a target straight above or below the instrument has no azimuth; leave `p1_azimuth_deg` empty there"
        );
        assert_eq!(residuals(FLAT, "p1_azimuth_deg,p1_elevation_deg", "0,0,,-90").unwrap().len(), 1);
        assert_eq!(residuals(FLAT, "p1_azimuth_deg,p1_elevation_deg", "0,0,10,-89.999999").unwrap().len(), 2);
    }

    #[test]
    fn gradients_agree_with_differences() {
        let point = Vector3::new(300.0, -700.0, 450.0);
        let slopes = |value: &dyn Fn(&Vector3<f64>) -> f64| {
            Vector3::from_fn(|axis, _| {
                let step = Vector3::ith(axis, 1e-4);
                (value(&(point + step)) - value(&(point - step))) / 2e-4
            })
        };
        let (_, by_azimuth) = azimuth(&point).unwrap();
        assert!((by_azimuth - slopes(&|at| azimuth(at).unwrap().0)).norm() < 1e-10);
        assert!((elevation(&point).1 - slopes(&|at| elevation(at).0)).norm() < 1e-10);
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_its_place() {
        for (columns, cells, part) in [
            (
                "p1_azimuth_deg,p1_elevation_deg",
                "0,0,10,95",
                "t.csv: line 2, column 4 (`p1_elevation_deg`): an elevation of 95 deg cannot be: it is from -90 to 90",
            ),
            ("p1_elevation_rad", "0,0,1.6", "line 2, column 3 (`p1_elevation_rad`): an elevation of 91.67"),
            (
                "p1_azimuth_deg",
                "0,0,399",
                "line 2, column 3 (`p1_azimuth_deg`): an azimuth of 399 deg cannot be",
            ),
            (
                "p3_azimuth_deg",
                "0,0,10",
                "column `p3_azimuth_deg` measures a target the model does not have; add `p3`",
            ),
            ("p1_azimuth", "0,0,10", "the unit is missing: write p1_azimuth_deg, p1_azimuth_rad"),
            (
                "p1_elevation_mm",
                "0,0,10",
                "`p1_elevation_mm` has no unit this quantity can have; units are deg, rad",
            ),
            ("p1_azimuth_deg,p1_azimuth_rad", "0,0,10,1", "it says the same as `p1_azimuth_deg`"),
        ] {
            let message = residuals(FLAT, columns, cells).unwrap_err();
            assert!(message.contains(part), "{columns}: {message}");
        }
    }

    #[test]
    fn each_circle_has_a_noise_of_its_own_and_both_are_read_and_written_in_degrees() {
        let model = Model::parse("m.yaml", FLAT).unwrap();
        let text = "q1_deg,q2_deg,p1_azimuth_deg,p1_elevation_deg,p2_azimuth_deg\n0,0,10,20,30\n";
        let table = Table::parse("t.csv", text).unwrap();
        let noise = Observations::new(&model, &table).unwrap().noise(&model);
        let found: Vec<_> = noise.iter().map(|one| (one.reading.as_str(), one.unit, one.source)).collect();
        let of = |key| (key, ReadingUnit::Deg, NoiseSource::Declared);
        assert_eq!(found, [of("azimuth_deg"), of("elevation_deg")]);
        assert!((noise[0].sigma - 0.01).abs() < 1e-12 && (noise[1].sigma - 0.02).abs() < 1e-12, "{noise:?}");
        let written = crate::table::table_text(&table);
        assert!(
            written.starts_with("q1_deg,q2_deg,p1_azimuth_deg,p2_azimuth_deg,p1_elevation_deg\n0,0,"),
            "{written}"
        );
    }
}
