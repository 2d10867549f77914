//! The values of everything a fit may move.

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use crate::arm_model::Model;
use crate::arm_model::SurfaceShape;

/// One free number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    /// Shift of the base along an axis of the measurements' frame, mm.
    BaseShift(usize),
    /// Turn of the base about an axis of the measurements' frame, rad.
    BaseTurn(usize),
    /// A target's coordinate (target, axis), mm.
    Target(usize, usize),
    /// A touched place's coordinate (place, axis), mm.
    Place(usize, usize),
    /// A free number of a surface (surface, which).
    Surface(usize, usize),
    /// An effect's parameter (effect, parameter).
    Effect(usize, usize),
}

/// Values of everything that can be fitted, free or not.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The base in the measurements' frame, mm.
    pub base: IsometryMatrix3<f64>,
    /// Targets in the flange's frame, mm.
    pub targets: Vec<Vector3<f64>>,
    /// Touched places in the measurements' frame, mm.
    pub places: Vec<Vector3<f64>>,
    /// Surfaces.
    pub surfaces: Vec<SurfaceShape>,
    /// Values of the fitted effects.
    pub effects: Vec<Vec<f64>>,
}

impl State {
    /// The nominal state of a model with `places` touched places and effects of these values.
    pub fn nominal(model: &Model, places: usize, effects: Vec<Vec<f64>>) -> Self {
        Self {
            base: model.base.pose,
            targets: model.targets.iter().map(|target| target.xyz).collect(),
            places: vec![Vector3::zeros(); places],
            surfaces: model.surfaces.iter().map(|surface| surface.shape.clone()).collect(),
            effects,
        }
    }

    /// The state after a step: one amount a slot.
    pub fn stepped(&self, slots: &[Slot], step: &[f64]) -> Self {
        let mut next = self.clone();
        let mut turn = Vector3::zeros();
        let up = Vector3::z();
        for (slot, amount) in slots.iter().zip(step) {
            match *slot {
                Slot::BaseShift(axis) => {
                    if let Some(part) = next.base.translation.vector.get_mut(axis) {
                        *part += amount;
                    }
                }
                Slot::BaseTurn(axis) => {
                    if let Some(part) = turn.get_mut(axis) {
                        *part += amount;
                    }
                }
                Slot::Target(target, axis) => {
                    if let Some(part) = next.targets.get_mut(target).and_then(|target| target.get_mut(axis)) {
                        *part += amount;
                    }
                }
                Slot::Place(place, axis) => {
                    if let Some(part) = next.places.get_mut(place).and_then(|place| place.get_mut(axis)) {
                        *part += amount;
                    }
                }
                Slot::Surface(surface, which) => {
                    if let Some(shape) = next.surfaces.get_mut(surface) {
                        shape.shift(which, *amount, &up);
                    }
                }
                Slot::Effect(effect, parameter) => {
                    if let Some(value) =
                        next.effects.get_mut(effect).and_then(|values| values.get_mut(parameter))
                    {
                        *value += amount;
                    }
                }
            }
        }
        let rotation = Rotation3::new(turn) * next.base.rotation;
        next.base = IsometryMatrix3::from_parts(Translation3::from(next.base.translation.vector), rotation);
        next
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let vectors = self.targets.iter().chain(&self.places).flat_map(|vector| vector.iter());
        vectors.chain(self.effects.iter().flatten()).all(|value| value.is_finite())
            && self.base.translation.vector.iter().all(|value| value.is_finite())
            && self.base.rotation.matrix().iter().all(|value| value.is_finite())
    }
}
