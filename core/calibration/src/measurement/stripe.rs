//! Light stripes: a pixel of a picture is a ray, the ray meets the sheet of light in a point, and the point lies on a known kind of surface at an unknown place.
//!
//! Equation, of a stretch of `n` points on one surface: `0 = sum_i w_i d(B F(q) s(u_i, v_i))`. `s` is the point of the sheet that a pixel shows, in the flange's
//! frame (Agin 1985, section 4: the collineation K, here by what camera and sheet are), `d` the distance from the surface, and `w` the mean, the slope or the bend
//! along the stretch ([`Stretch::weights`]): a stripe has many points, which determine three things at most, for an effect of the arm moves it as one piece.
//!
//! Gradients: with the normals `n_i` at the points `p_i`, `sum w_i n_i` by the mean point `m` that moves with the flange, `sum w_i (p_i - m) x n_i` by a turn about
//! it, `sum w_i n_i . dp_i` by a number of the rig that moves each point by `dp_i`, and those of each surface by its own numbers.

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::RowReader;
use crate::arm_model::{Model, SurfaceShape};
use crate::fit::FreeParameter;
use crate::table::Stretch;

/// Stretches of stripes: they come with the table, in none of its columns.
#[derive(Debug)]
pub(super) struct Stripe;

/// A stretch with the surface it lies on and the weight of each of its points in one reading.
struct Reading<'a> {
    stretch: &'a Stretch,
    shape: &'a SurfaceShape,
    weights: &'a [f64],
    seen: &'a [Vector3<f64>],
    up: Vector3<f64>,
}

impl<'a> Reading<'a> {
    fn of(what: Measurand, context: &RowContext<'a>) -> Option<Self> {
        let stretch = context.table.stretches.get(what.index())?;
        let shape = context.state.surfaces.get(stretch.surface)?;
        let weights = stretch.weights(usize::from(what.component));
        Some(Self { stretch, shape, weights, seen: context.seen, up: context.up })
    }

    /// The sum of the weights, and the weighted sum of some vectors, one a point.
    fn sums(&self, vectors: &[Vector3<f64>]) -> (f64, Vector3<f64>) {
        let each = self.weights.iter().zip(vectors);
        each.fold((0.0, Vector3::zeros()), |(sum, total), (weight, vector)| {
            (sum + weight, total + vector * *weight)
        })
    }

    /// The weighted distance from a surface that is no plane, and its gradients by a shift of all points and by a turn about `middle`.
    fn against_curved(&self, middle: &Vector3<f64>) -> Prediction {
        let mut prediction = Prediction::of_point(0.0, Vector3::zeros());
        for (point, weight) in self.seen.iter().zip(self.weights) {
            let (distance, normal) = self.shape.distance(point, &self.up);
            prediction.value += weight * distance;
            prediction.by_point += normal * *weight;
            prediction.by_rotation += (point - middle).cross(&normal) * *weight;
        }
        prediction
    }

    /// How the weighted distance changes with a free number of the surface.
    fn by_surface(&self, which: usize) -> f64 {
        if let SurfaceShape::Plane { .. } = self.shape {
            // Linear in the point, but for the offset, which does not depend on it.
            let (sum, point) = self.sums(self.seen);
            return self.shape.derivative(which, &point, &self.up) * if which == 0 { sum } else { 1.0 };
        }
        let each = self.seen.iter().zip(self.weights);
        each.map(|(point, weight)| weight * self.shape.derivative(which, point, &self.up)).sum()
    }
}

impl MeasurementKind for Stripe {
    fn name(&self) -> &'static str {
        "stripe"
    }

    fn columns(&self) -> &'static str {
        ""
    }

    fn check(&self, model: &Model, table: &crate::table::Table) -> Result<(), ObservationsError> {
        if table.stretches.is_empty() || model.stripe_rig.is_some() {
            return Ok(());
        }
        let reason = "its stripes need the rig of the light stripe, which the model lacks".to_owned();
        Err(ObservationsError::Incomplete { table: table.source.clone(), reason })
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        for index in row.table.stretches_of(row.row) {
            let Some(stretch) = row.table.stretches.get(index) else { continue };
            for component in 0..stretch.readings() {
                let what = Measurand { kind: &Self, index: index as u32, component: component as u8 };
                equations.push(Equation::new(what, 0.0, Some(stretch.sigma)));
            }
        }
        Ok(())
    }

    fn subject(&self, _model: &Model, what: Measurand) -> Subject {
        Subject::Stretch(what.index())
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let Some(reading) = Reading::of(what, context) else {
            return Prediction::of_point(0.0, Vector3::zeros());
        };
        let SurfaceShape::Plane { normal, offset } = reading.shape else {
            return reading.against_curved(&context.point);
        };
        let (sum, point) = reading.sums(reading.seen);
        Prediction {
            value: normal.dot(&point) - offset * sum,
            by_point: normal * sum,
            by_rotation: (point - context.point * sum).cross(normal),
        }
    }

    fn by_seen_points(&self, what: Measurand, context: &RowContext<'_>, moved: &[Vector3<f64>]) -> f64 {
        let Some(reading) = Reading::of(what, context) else { return 0.0 };
        if let SurfaceShape::Plane { normal, .. } = reading.shape {
            return normal.dot(&context.rotated_from_flange(reading.sums(moved).1));
        }
        let points = reading.seen.iter().zip(moved).zip(reading.weights);
        let each = points.map(|((point, by), weight)| {
            let (_, normal) = reading.shape.distance(point, &reading.up);
            weight * normal.dot(&context.rotated_from_flange(*by))
        });
        each.sum()
    }

    fn own_derivatives(
        &self,
        what: Measurand,
        context: &RowContext<'_>,
        set: &mut dyn FnMut(FreeParameter, f64),
    ) {
        let Some(reading) = Reading::of(what, context) else { return };
        let surface = reading.stretch.surface;
        if !context.model.surfaces.get(surface).is_some_and(|known| known.free) {
            return;
        }
        for which in 0..reading.shape.freedoms() {
            set(FreeParameter::Surface(surface, which), reading.by_surface(which));
        }
    }
}
