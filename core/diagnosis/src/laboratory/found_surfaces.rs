//! Where planes, balls, edges and points that were fitted along were found, and how sure that is.

use plumb_calibration::arm_model::SurfaceShape;
use plumb_calibration::fit::{Fit, ResidualModel, Slot};
use serde::Serialize;

/// One number of a surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundNumber {
    /// What it is: `offset`, `x`, `tilt`.
    pub name: &'static str,
    /// mm or deg, as its name says; nothing of a tilt or a turn, which have a standard error alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// One standard error; nothing where it cannot be told.
    pub se: Option<f64>,
    /// `mm` or `deg`.
    pub unit: &'static str,
}

/// A surface that was fitted, frame of the measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundSurface {
    /// Its name.
    pub name: String,
    /// `plane`, `ball`, `edge` or `point`.
    pub shape: &'static str,
    /// Normal of a plane, direction of an edge; nothing of others.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// A point of an edge, the centre of a ball, mm; nothing of a plane.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xyz_mm: Option<[f64; 3]>,
    /// Its fitted numbers.
    pub numbers: Vec<FoundNumber>,
}

/// The surfaces of the model that were fitted and that the table reads.
pub(super) fn found_surfaces(machine: &ResidualModel<'_>, fit: &Fit) -> Vec<FoundSurface> {
    let error = |index: usize, which: usize| {
        let place = machine.slots().iter().position(|known| *known == Slot::Surface(index, which))?;
        let variance = fit.covariance.get((place, place))?;
        (!fit.factor.dependent.contains(&place)).then(|| variance.max(0.0).sqrt())
    };
    let table = machine.table;
    let is_read = |name: &String| table.on.names.contains(name) || table.distance_to.names.contains(name);
    let each = machine.model.surfaces.iter().zip(&fit.state.surfaces).enumerate();
    each.filter(|(_, (known, _))| known.free && is_read(&known.name))
        .map(|(index, (known, shape))| surface(&known.name, shape, |which| error(index, which)))
        .collect()
}

fn surface(name: &str, shape: &SurfaceShape, error: impl Fn(usize) -> Option<f64>) -> FoundSurface {
    let length = |name, value, which| FoundNumber { name, value, se: error(which), unit: "mm" };
    let turn =
        |name, which| FoundNumber { name, value: None, se: error(which).map(f64::to_degrees), unit: "deg" };
    let centred = |at: &[f64; 3]| {
        ["x", "y", "z"]
            .into_iter()
            .zip(at)
            .enumerate()
            .map(|(axis, (name, value))| length(name, Some(*value), axis))
            .collect()
    };
    let (shape, direction, xyz_mm, numbers) = match shape {
        SurfaceShape::Plane { normal, offset } => (
            "plane",
            Some((*normal).into()),
            None,
            vec![length("offset", Some(*offset), 0), turn("tilt", 1), turn("tilt across", 2)],
        ),
        SurfaceShape::Line { point, direction } => (
            "edge",
            Some((*direction).into()),
            Some((*point).into()),
            vec![
                length("left", None, 0),
                length("over", None, 2),
                turn("turn to the left", 1),
                turn("tilt", 3),
            ],
        ),
        SurfaceShape::Sphere { centre, .. } => {
            let at: [f64; 3] = (*centre).into();
            ("ball", None, Some(at), centred(&at))
        }
        SurfaceShape::Point { point } => {
            let at: [f64; 3] = (*point).into();
            ("point", None, Some(at), centred(&at))
        }
    };
    FoundSurface { name: name.to_owned(), shape, direction, xyz_mm, numbers }
}
