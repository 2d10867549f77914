//! The arm's own sensor triggered at a straight edge between light and dark.
//!
//! Equation: `0 = l(g) - s`. The sensor looks from p1 along the flange's z (`u`) and meets the table's plane at
//! `g = p + u f`, `f = -h / (n . u)`, where `h` is p1's height over the table and `n` its normal; `l` is the distance of `g`
//! to the left of the edge, and `s` how far left of it the sensor switches (width of the spot, hysteresis, effects), which
//! itself grows with the height by `s'`.
//!
//! Gradients: with `m` the horizontal normal of the edge, `b = m - n (m . u)/(n . u)` is how `l(g)` moves with p, so
//! `b - n s'` by the point; a turn `w` of the hand moves g by `f (w x u)`, so `f u x (b - n s')` by the turn.

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext};
use super::row::RowReader;
use super::trigger::{is_edge, triggered_over};
use crate::arm_model::Model;
use crate::effect::Dof;
use crate::fit::{FreeParameter, ViewOfTable};
use crate::table::scalar::HEIGHT;

/// Triggers at an edge: column `on` without a height, where it names a line.
#[derive(Debug)]
pub(super) struct Edge;

impl MeasurementKind for Edge {
    fn name(&self) -> &'static str {
        "edge"
    }

    fn columns(&self) -> &'static str {
        "on"
    }

    fn instrument(&self) -> &'static str {
        "trigger"
    }

    fn noise_key(&self, _model: &Model, _what: Measurand) -> String {
        "height_mm".to_owned()
    }

    fn is_trigger(&self) -> bool {
        true
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        if let Some(surface) = triggered_over(row)?.filter(|surface| is_edge(row.model, *surface)) {
            let what = Measurand { kind: &Self, index: surface as u32, component: 0 };
            equations.push(Equation::new(what, 0.0, row.model.noise.of(&HEIGHT)));
        }
        Ok(())
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        if context.model.sensor.is_none() {
            let (value, normal) = context.distance_from(what, &context.point);
            return Prediction::of_point(value, normal);
        }
        // A hand that tilts looks aside: what counts is the place on the table at which the sensor looks.
        let look: Vector3<f64> = context.pose.look();
        let view = ViewOfTable::new(context.state);
        let (far, table) = (view.ahead(&context.point, &look), view.normal);
        let (value, left) = context.distance_from(what, &(context.point + look * far));
        // The further it looks, the earlier or later a spot of some width meets the edge.
        let by_height = table * context.sensor.left_by_height;
        let beside = left - table * (left.dot(&look) / view.steepness(&look));
        Prediction {
            value: value - context.sensor.left,
            by_point: beside - by_height,
            by_rotation: look.cross(&(beside - by_height)) * far,
        }
    }

    fn sensor_dof(&self, _model: &Model, _what: Measurand) -> Option<Dof> {
        Some(Dof::Edge)
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
