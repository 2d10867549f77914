//! The values of everything a fit may move.

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use crate::arm_model::Model;
use crate::arm_model::SurfaceShape;

/// One free parameter: a number that a fit may change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FreeParameter {
    /// Shift of the base along an axis of the measurements' frame, mm.
    BaseShift(usize),
    /// Rotation of the base about an axis of the measurements' frame, rad.
    BaseRotation(usize),
    /// A target's coordinate (target, axis), mm.
    Target(usize, usize),
    /// Rotation of a target about an axis of the flange (target, axis), rad.
    TargetRotation(usize, usize),
    /// Shift of a board along an axis of the measurements' frame (board, axis), mm.
    BoardShift(usize, usize),
    /// Rotation of a board about an axis of the measurements' frame (board, axis), rad.
    BoardRotation(usize, usize),
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
    /// From the targets' axes to those of the flange.
    pub rotations: Vec<Rotation3<f64>>,
    /// The boards in the measurements' frame, mm.
    pub boards: Vec<IsometryMatrix3<f64>>,
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
            rotations: model.targets.iter().map(|target| target.rotation).collect(),
            boards: model.boards.iter().map(|board| board.pose).collect(),
            places: vec![Vector3::zeros(); places],
            surfaces: model.surfaces.iter().map(|surface| surface.shape.clone()).collect(),
            effects,
        }
    }

    /// The state after a step: one amount a free parameter.
    pub fn stepped(&self, free_parameters: &[FreeParameter], step: &[f64]) -> Self {
        let mut next = self.clone();
        // The three numbers of a turn make one rotation vector: applied one after the other they would depend on their order.
        let mut turns = Turns {
            targets: vec![Vector3::zeros(); next.rotations.len()],
            boards: vec![Vector3::zeros(); next.boards.len()],
            ..Turns::default()
        };
        let up = Vector3::z();
        for (free_parameter, amount) in free_parameters.iter().zip(step) {
            if let FreeParameter::Surface(surface, which) = *free_parameter {
                if let Some(shape) = next.surfaces.get_mut(surface) {
                    shape.shift(which, *amount, &up);
                }
            } else if let Some(part) = next.part(*free_parameter, &mut turns) {
                *part += amount;
            }
        }
        next.base = turned(&next.base, turns.base);
        for (board, rotation) in next.boards.iter_mut().zip(&turns.boards) {
            *board = turned(board, *rotation);
        }
        // From the left: about the axes of the flange.
        for (known, rotation) in next.rotations.iter_mut().zip(turns.targets) {
            *known = Rotation3::new(rotation) * *known;
        }
        next
    }

    /// The number that a free parameter is: of a turn, that of the rotation vector which is applied in the end. A surface's numbers are its own matter.
    fn part<'p>(&'p mut self, free_parameter: FreeParameter, turns: &'p mut Turns) -> Option<&'p mut f64> {
        match free_parameter {
            FreeParameter::BaseShift(axis) => self.base.translation.vector.get_mut(axis),
            FreeParameter::BaseRotation(axis) => turns.base.get_mut(axis),
            FreeParameter::Target(target, axis) => self.targets.get_mut(target)?.get_mut(axis),
            FreeParameter::TargetRotation(target, axis) => turns.targets.get_mut(target)?.get_mut(axis),
            FreeParameter::BoardShift(board, axis) => {
                self.boards.get_mut(board)?.translation.vector.get_mut(axis)
            }
            FreeParameter::BoardRotation(board, axis) => turns.boards.get_mut(board)?.get_mut(axis),
            FreeParameter::Place(place, axis) => self.places.get_mut(place)?.get_mut(axis),
            FreeParameter::Surface(..) => None,
            FreeParameter::Effect(effect, parameter) => self.effects.get_mut(effect)?.get_mut(parameter),
        }
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        let vectors = self.targets.iter().chain(&self.places).flat_map(|vector| vector.iter());
        vectors.chain(self.effects.iter().flatten()).all(|value| value.is_finite())
            && [&self.base].into_iter().chain(&self.boards).all(is_finite)
            && self.rotations.iter().all(|rotation| rotation.matrix().iter().all(|value| value.is_finite()))
    }
}

/// Rotation vectors of a step, rad.
#[derive(Default)]
struct Turns {
    base: Vector3<f64>,
    boards: Vec<Vector3<f64>>,
    targets: Vec<Vector3<f64>>,
}

/// A pose turned about its own origin.
fn turned(pose: &IsometryMatrix3<f64>, turn: Vector3<f64>) -> IsometryMatrix3<f64> {
    let rotation = Rotation3::new(turn) * pose.rotation;
    IsometryMatrix3::from_parts(Translation3::from(pose.translation.vector), rotation)
}

fn is_finite(pose: &IsometryMatrix3<f64>) -> bool {
    let parts = pose.translation.vector.iter().chain(pose.rotation.matrix().iter());
    parts.into_iter().all(|value| value.is_finite())
}
