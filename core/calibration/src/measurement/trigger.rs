//! The arm's own sensor triggered over a plane, a ball or a point.
//!
//! Equation: `0 = d(p) - h - a`: the point p1, where the sensor fires over standard white, lies on the surface, or above it
//! by the height `h` that effects give (`trigger_height`, `reflectance`) and `a` that the sensor's data sheet gives
//! (hysteresis). Gradient: the surface's unit normal; `-1` by the trigger height.

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext};
use super::row::{Named, RowReader};
use crate::arm_model::Model;
use crate::arm_model::SurfaceShape;
use crate::effect::Dof;
use crate::fit::FreeParameter;
use crate::table::scalar::HEIGHT;

/// Triggers over a surface: column `on` without a height.
#[derive(Debug)]
pub(super) struct Trigger;

impl MeasurementKind for Trigger {
    fn name(&self) -> &'static str {
        "trigger"
    }

    fn columns(&self) -> &'static str {
        "on"
    }

    fn noise_key(&self, _model: &Model, _what: Measurand) -> String {
        "height_mm".to_owned()
    }

    fn is_trigger(&self) -> bool {
        true
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        if let Some(surface) = triggered_over(row)?.filter(|surface| !is_edge(row.model, *surface)) {
            let what = Measurand { kind: &Self, index: surface as u32, component: 0 };
            equations.push(Equation::new(what, 0.0, row.model.noise.of(&HEIGHT)));
        }
        Ok(())
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let (distance, normal) = context.distance_from(what, &context.point);
        let value = match self.sensor_dof(context.model, what) {
            Some(_) => distance - context.pose.trigger_height() - context.sensor.above,
            None => distance,
        };
        Prediction::of_point(value, normal)
    }

    fn sensor_dof(&self, model: &Model, what: Measurand) -> Option<Dof> {
        // On a mere point nothing reflects: there p1 lies on it, whatever the sensor does.
        match model.surfaces.get(what.index())?.shape {
            SurfaceShape::Plane { .. } | SurfaceShape::Sphere { .. } => Some(Dof::Trigger),
            SurfaceShape::Line { .. } | SurfaceShape::Point { .. } => None,
        }
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

/// The surface a sensor triggered over or at in a row that holds no height.
pub(super) fn triggered_over(row: &RowReader<'_>) -> Result<Option<usize>, ObservationsError> {
    // In a table of profiles `on` says what a profile lies on.
    match row.scalar(&HEIGHT).is_finite() || !row.table.profiles.is_empty() {
        // A height over the surface was read, or a profile: that row is no trigger.
        true => Ok(None),
        false => row.surface(Named::On),
    }
}

/// Whether a surface of the model is an edge.
pub(super) fn is_edge(model: &Model, surface: usize) -> bool {
    model.surfaces.get(surface).is_some_and(|surface| surface.shape.is_edge())
}
