//! A target that touches a place which is fixed but need not be known: a cone, a ball nest, a mark.
//!
//! Equation: `0 = e_axis . (p - c)`, with the place `c` fitted along. Gradients: the axis by the point, minus the axis by
//! the place. Every place takes three equations a visit for three unknowns, so only repeated visits inform. (Meggiolaro,
//! Scriffignano and Dubowsky, Manipulator calibration using a single endpoint contact constraint, 2000.)

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::RowReader;
use crate::arm_model::Model;
use crate::fit::FreeParameter;

/// Touched places: column `touch`.
#[derive(Debug)]
pub(super) struct Touch;

/// The target that touches where the model does not say.
const USUAL_TARGET: &str = "p1";

/// The target that touches, by its index in the model.
fn touching_target(model: &Model) -> Option<usize> {
    let name = model.touch.as_ref().map_or(USUAL_TARGET, |touch| touch.target.as_str());
    model.target_position(name)
}

impl MeasurementKind for Touch {
    fn name(&self) -> &'static str {
        "touch"
    }

    fn columns(&self) -> &'static str {
        "touch"
    }

    fn coordinate(&self, what: Measurand) -> Option<usize> {
        Some(what.axis())
    }

    fn touched_place(&self, what: Measurand) -> Option<usize> {
        Some(what.index())
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        let Some(place) = row.table.touch.of_row.get(row.row).copied().flatten() else { return Ok(()) };
        if touching_target(row.model).is_none() {
            return Err(row.incomplete("column `touch` needs a target p1 in the model".to_owned()));
        }
        for component in 0..3 {
            let what = Measurand { kind: &Self, index: place, component };
            equations.push(Equation::new(what, 0.0, row.model.noise.touch));
        }
        Ok(())
    }

    fn subject(&self, model: &Model, _what: Measurand) -> Subject {
        // Rows without a touching target are refused when they are read.
        Subject::Target(touching_target(model).unwrap_or(0))
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let axis = Vector3::ith(what.axis(), 1.0);
        let place = context.state.places.get(what.index()).copied().unwrap_or_else(Vector3::zeros);
        Prediction::of_point((context.point - place).dot(&axis), axis)
    }

    fn own_derivatives(
        &self,
        what: Measurand,
        _context: &RowContext<'_>,
        set: &mut dyn FnMut(FreeParameter, f64),
    ) {
        set(FreeParameter::Place(what.index(), what.axis()), -1.0);
    }
}
