//! The height of p1 over a surface, as a gauge or a probe reads it.
//!
//! Equation: `z = d(p)`, the signed distance of the point from the surface; for a plane `n . p - c`. Gradient: the
//! surface's unit normal at the point.

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext};
use super::row::{Named, RowReader};
use crate::arm_model::Model;
use crate::arm_model::SurfaceShape;
use crate::effect::Channel;
use crate::fit::FreeParameter;
use crate::table::scalar::HEIGHT;

/// Heights: column `height_mm`, over the surface in column `on`, else over the model's first plane.
#[derive(Debug)]
pub(super) struct Height;

impl MeasurementKind for Height {
    fn name(&self) -> &'static str {
        "height"
    }

    fn channel(&self, _what: Measurand) -> Option<Channel> {
        Channel::of(&HEIGHT)
    }

    fn columns(&self) -> &'static str {
        "height_mm"
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        let height = row.scalar(&HEIGHT);
        if !height.is_finite() {
            return Ok(());
        }
        let surface = match row.surface(Named::On)? {
            Some(surface) => surface,
            None => first_plane(row.model).ok_or_else(|| {
                let reason =
                    "column `height_mm` needs a plane in the model's `surfaces:` and its name in column `on`";
                row.incomplete(reason.to_owned())
            })?,
        };
        let what = Measurand { kind: &Self, index: surface as u32, component: 0 };
        equations.push(Equation::new(what, height, row.model.noise.of(&HEIGHT)));
        Ok(())
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let (value, normal) = context.distance_from(what, &context.point);
        Prediction::of_point(value, normal)
    }

    fn own_derivatives(
        &self,
        what: Measurand,
        context: &RowContext<'_>,
        set: &mut dyn FnMut(FreeParameter, f64),
    ) {
        context.surface_derivatives(what, set);
    }
}

fn first_plane(model: &Model) -> Option<usize> {
    model.surfaces.iter().position(|surface| matches!(surface.shape, SurfaceShape::Plane { .. }))
}
