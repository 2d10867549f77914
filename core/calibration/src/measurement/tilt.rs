//! The tilt of a level's frame about its x or y, as a spirit level or inclinometer reads it.
//!
//! Equation: with the frame's axes `x, y, z` (unit vectors, frame of the measurements) and `k` upwards,
//! `z_x = atan2(y . k, z . k)` about x and `z_y = atan2(-x . k, z . k)` about y. A small turn `w` changes an axis `a` by
//! `w x a`, hence `a . k` by `w . (a x k)`: with `A` the numerator and `C` the denominator the gradient by the turn is
//! `((a_s x k) s C - (z x k) A) / (A^2 + C^2)`.

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::RowReader;
use crate::arm_model::{Frame, Model};
use crate::effect::Channel;

/// Tilts: columns `tilt_x_deg` and `tilt_y_deg`, of the level named in `level`.
#[derive(Debug)]
pub(super) struct Tilt;

/// Squared length below which a level hangs so that its tilt is undefined; only keeps the quotient finite.
const UNDEFINED: f64 = 1e-30;

impl MeasurementKind for Tilt {
    fn name(&self) -> &'static str {
        "tilt"
    }

    fn channel(&self, what: Measurand) -> Option<Channel> {
        Some(if what.component == 0 { Channel::TiltX } else { Channel::TiltY })
    }

    fn columns(&self) -> &'static str {
        "tilt_x_deg"
    }

    fn is_length(&self) -> bool {
        false
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        let tilts = row.table.tilt.as_ref().and_then(|tilt| tilt.get(row.row)).copied();
        for (component, tilt) in (0_u8..).zip(tilts.into_iter().flatten()) {
            if tilt.is_finite() {
                let what = Measurand { kind: &Self, index: level(row)? as u32, component };
                equations.push(Equation::new(what, tilt, row.model.noise.tilt));
            }
        }
        Ok(())
    }

    fn subject(&self, model: &Model, what: Measurand) -> Subject {
        Subject::Frame(model.levels.get(what.index()).map_or(Frame::Base, |level| level.frame))
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let Some(level) = context.model.levels.get(what.index()) else {
            return Prediction::of_point(0.0, Vector3::zeros());
        };
        let attitude = context.attitude(level.frame) * level.rotation.into_inner();
        let axes = [0, 1, 2].map(|index| attitude.column(index).into_owned());
        let [x, y, z] = &axes;
        // About x the level's y rises; about y its x falls.
        let (side, sense) = if what.component == 0 { (y, 1.0) } else { (x, -1.0) };
        let up = &context.up;
        let (across, along) = (sense * side.dot(up), z.dot(up));
        let scale = (across * across + along * along).max(UNDEFINED);
        let by_rotation = (side.cross(up) * (sense * along) - z.cross(up) * across) / scale;
        Prediction { value: across.atan2(along), by_point: Vector3::zeros(), by_rotation }
    }
}

/// Where the level lay in a row, by its index in the model.
fn level(row: &RowReader<'_>) -> Result<usize, ObservationsError> {
    let named = row.table.level.name(row.row);
    if let Some(level) = row.model.level_position(named) {
        return Ok(level);
    }
    let names: Vec<&str> = row.model.levels.iter().filter_map(|level| level.name.as_deref()).collect();
    let line = row.line();
    Err(row.incomplete(match named {
        _ if row.model.levels.is_empty() => {
            "columns `tilt_*` need `level:` in the model, or `levels:` for several".to_owned()
        }
        Some(name) => format!(
            "line {line}: `{name}` in column `level` is not in the model's `levels:`{}",
            crate::suggestion::suggestion(name, names.iter().copied())
        ),
        None => format!(
            "line {line}: say in column `level` which of the model's levels it is: {}",
            names.join(", ")
        ),
    }))
}
