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
    let table = machine.table;
    let each = machine.model.surfaces.iter().zip(&fit.state.surfaces).enumerate();
    let found = each.filter_map(|(index, (known, shape))| {
        let is_read = table.on.names.contains(&known.name) || table.distance_to.names.contains(&known.name);
        (known.free && is_read).then(|| surface(&known.name, shape, &Errors { machine, fit, index }))
    });
    found.collect()
}

/// Standard errors of the numbers of one surface, as a fit has them.
struct Errors<'a> {
    machine: &'a ResidualModel<'a>,
    fit: &'a Fit,
    /// Which of the model's surfaces.
    index: usize,
}

impl Errors<'_> {
    /// Of one number, mm or rad; nothing where it was held, for the rows cannot tell it.
    fn of(&self, which: usize) -> Option<f64> {
        let slots = self.machine.slots();
        let place = slots.iter().position(|known| *known == Slot::Surface(self.index, which))?;
        let variance = self.fit.covariance.get((place, place))?;
        (!self.fit.factor.dependent.contains(&place)).then(|| variance.max(0.0).sqrt())
    }

    fn length(&self, name: &'static str, value: Option<f64>, which: usize) -> FoundNumber {
        FoundNumber { name, value, se: self.of(which), unit: "mm" }
    }

    /// A direction has no number of its own that a person could read, only an error about each axis across it.
    fn turn(&self, name: &'static str, which: usize) -> FoundNumber {
        FoundNumber { name, value: None, se: self.of(which).map(f64::to_degrees), unit: "deg" }
    }

    fn place(&self, at: &[f64; 3]) -> Vec<FoundNumber> {
        let axes = ["x", "y", "z"].into_iter().zip(at).enumerate();
        axes.map(|(axis, (name, value))| self.length(name, Some(*value), axis)).collect()
    }
}

fn surface(name: &str, shape: &SurfaceShape, errors: &Errors<'_>) -> FoundSurface {
    let (shape, direction, xyz_mm, numbers) = match shape {
        SurfaceShape::Plane { normal, offset } => (
            "plane",
            Some((*normal).into()),
            None,
            vec![
                errors.length("offset", Some(*offset), 0),
                errors.turn("tilt", 1),
                errors.turn("tilt across", 2),
            ],
        ),
        SurfaceShape::Line { point, direction } => (
            "edge",
            Some((*direction).into()),
            Some((*point).into()),
            vec![
                errors.length("left", None, 0),
                errors.length("over", None, 2),
                errors.turn("turn to the left", 1),
                errors.turn("tilt", 3),
            ],
        ),
        SurfaceShape::Sphere { centre, .. } => {
            let at: [f64; 3] = (*centre).into();
            ("ball", None, Some(at), errors.place(&at))
        }
        SurfaceShape::Point { point } => {
            let at: [f64; 3] = (*point).into();
            ("point", None, Some(at), errors.place(&at))
        }
    };
    FoundSurface { name: name.to_owned(), shape, direction, xyz_mm, numbers }
}
