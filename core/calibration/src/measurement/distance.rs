//! The distance of p1 to a point, as a wire-draw sensor or a ball bar reads it.
//!
//! Equation: `z = |p - c|`. Gradient: the unit vector from the point `c` to p1; its negative by `c`, where that is free.
//! (Driels and Swayze, Automated partial pose measurement system for manipulator calibration experiments, 1994.)

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext};
use super::row::{Named, RowReader};
use crate::arm_model::SurfaceShape;
use crate::effect::Channel;
use crate::fit::FreeParameter;
use crate::table::scalar::DISTANCE;

/// Distances: column `distance_mm`, to the point named in `distance_to`.
#[derive(Debug)]
pub(super) struct Distance;

impl MeasurementKind for Distance {
    fn name(&self) -> &'static str {
        "distance"
    }

    fn channel(&self, _what: Measurand) -> Option<Channel> {
        Channel::of(&DISTANCE)
    }

    fn columns(&self) -> &'static str {
        "distance_mm"
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        let distance = row.scalar(&DISTANCE);
        if !distance.is_finite() {
            return Ok(());
        }
        let Some(point) = row.surface(Named::DistanceTo)? else {
            let line = row.line();
            return Err(
                row.incomplete(format!("line {line}: a distance needs `distance_to`, the name of a point"))
            );
        };
        let what = Measurand { kind: &Self, index: point as u32, component: 0 };
        equations.push(Equation::new(what, distance, row.model.noise.of(&DISTANCE)));
        Ok(())
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let from = context.surface(what).map_or_else(Vector3::zeros, SurfaceShape::reference_point);
        let (value, away) = SurfaceShape::Point { point: from }.distance(&context.point, &context.up);
        Prediction::of_point(value, away)
    }

    fn own_derivatives(
        &self,
        what: Measurand,
        context: &RowContext<'_>,
        set: &mut dyn FnMut(FreeParameter, f64),
    ) {
        // Of a plane or a line the point that is measured from is a convention, which their free numbers do not move.
        if context.free_surface(what).is_some_and(SurfaceShape::is_located_by_its_reference_point) {
            context.surface_derivatives(what, set);
        }
    }
}
