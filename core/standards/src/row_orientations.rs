//! How the target was turned in each row of a table, and how it was to be turned.

use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use plumb_calibration::table::{Body, Covariate, Table, UNIT_TOLERANCE};

/// Where a model has the target in each row, and how it is turned there, frame of the measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// mm.
    pub points: Vec<Vector3<f64>>,
    /// From the target's axes.
    pub rotations: Vec<Rotation3<f64>>,
}

/// A commanded orientation that is none.
#[derive(Debug)]
pub(crate) struct OrientationError {
    pub(crate) table: String,
    pub(crate) what: String,
}

/// What was read of orientations, and what was commanded; one a row.
pub(crate) struct RowOrientations<'t> {
    pub(crate) attained: Option<&'t [Option<Rotation3<f64>>]>,
    pub(crate) commanded: Option<Vec<Rotation3<f64>>>,
}

impl<'t> RowOrientations<'t> {
    /// Of a target by its number; commanded by a model, else by the table's columns.
    pub(crate) fn of(
        table: &'t Table,
        target: usize,
        predicted: Option<&Predicted>,
    ) -> Result<Self, OrientationError> {
        let attained = table.orientations_as(Body::Target(target)).map(|known| known.rotations.as_slice());
        let commanded = match (predicted, attained) {
            (_, None) => None,
            (Some(predicted), _) => Some(predicted.rotations.clone()),
            (None, Some(_)) => commanded(table)?,
        };
        Ok(Self { attained, commanded })
    }
}

/// The forms of a commanded orientation: a quaternion, or a rotation vector in rad or deg.
const FORMS: [(&[&str], f64); 3] = [
    (&["commanded_qw", "commanded_qx", "commanded_qy", "commanded_qz"], 1.0),
    (&["commanded_rx_rad", "commanded_ry_rad", "commanded_rz_rad"], 1.0),
    (&["commanded_rx_deg", "commanded_ry_deg", "commanded_rz_deg"], std::f64::consts::PI / 180.0),
];

/// What the columns begin with that are meant for one.
const BEGINNINGS: [&str; 4] = ["commanded_r", "commanded_q", "commanded_yaw", "commanded_pitch"];

/// The commanded orientations by their columns; nothing where the table has none.
fn commanded(table: &Table) -> Result<Option<Vec<Rotation3<f64>>>, OrientationError> {
    let named = |name: &str| table.covariates.iter().find(|column| column.name == name);
    let bad = |what: String| OrientationError { table: table.source.clone(), what };
    for (names, scale) in FORMS {
        let columns: Vec<&Covariate> = names.iter().filter_map(|name| named(name)).collect();
        let Some(first) = columns.first() else { continue };
        if let Some(lost) = names.iter().find(|name| named(name).is_none()) {
            let all = names.join(", ");
            return Err(bad(format!(
                "there is `{}` and no column `{lost}`: an orientation has all of {all}",
                first.name
            )));
        }
        let each = (0..table.len()).map(|row| {
            rotation(&columns, scale, row)
                .map_err(|what| bad(format!("line {}: {what}", table.lines.get(row).copied().unwrap_or(0))))
        });
        return each.collect::<Result<Vec<_>, _>>().map(Some);
    }
    let begun = |column: &&Covariate| BEGINNINGS.iter().any(|begin| column.name.starts_with(begin));
    match table.covariates.iter().find(begun) {
        Some(column) => Err(bad(format!(
            "`{}` is no part of a commanded orientation: write commanded_qw, commanded_qx, commanded_qy, commanded_qz, or commanded_rx_deg, commanded_ry_deg, \
             commanded_rz_deg (a rotation vector; or _rad)",
            column.name
        ))),
        None => Ok(None),
    }
}

/// The commanded orientation of a row, or what is wrong with it.
fn rotation(columns: &[&Covariate], scale: f64, row: usize) -> Result<Rotation3<f64>, String> {
    let is_lost = |column: &&&Covariate| !column.levels().is_empty() || !column.number(row).is_finite();
    if let Some(column) = columns.iter().find(is_lost) {
        return Err(format!("`{}` is empty or no number", column.name));
    }
    let cells: Vec<f64> = columns.iter().map(|column| column.number(row) * scale).collect();
    match cells[..] {
        [w, x, y, z] => {
            let quaternion = Quaternion::new(w, x, y, z);
            let length = quaternion.norm();
            match (length - 1.0).abs() > UNIT_TOLERANCE {
                true => Err(format!(
                    "the commanded quaternion has length {length:.4}; that of an orientation has length 1"
                )),
                false => Ok(UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix()),
            }
        }
        [x, y, z] => Ok(Rotation3::new(Vector3::new(x, y, z))),
        _ => Err("an orientation has three or four numbers".to_owned()),
    }
}
