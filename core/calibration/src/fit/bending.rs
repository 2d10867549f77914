//! How what gravity bends in a row changes with each number of the joints' rows and with turns of the base, by differences.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use plumb_kinematics::{Posture, Weights};

use super::arm_pose::{ArmPose, Changes};
use super::residual_model::ResidualModel;
use super::scratch::Scratch;
use super::state::State;
use super::yielding::{CARRIED, KNOBS, TURNS, Yielding};
use crate::effect::{Drive, LooksAt, Situation};

/// Changes with which derivatives are taken, rad and mm: their squares are below rounding beside a bend, and they are far above it.
const SMALL_TURN: f64 = 1e-6;
const SMALL_SHIFT: f64 = 1e-3;

/// What gravity bends, as one column: numbers of joints' rows, shift and turn of what bent links carry.
fn as_column(bent: &Changes, column: &mut [f64]) {
    let joints = bent.deviations.iter().flat_map(|row| [row.theta, row.alpha, row.beta, row.d, row.a]);
    let (shift, turn) = bent.carried();
    let all = joints.chain(shift.iter().copied()).chain(turn.iter().copied());
    column.iter_mut().zip(all).for_each(|(entry, value)| *entry = value);
}

impl ResidualModel<'_> {
    /// Works out how the arm of a row whose pose is known answers to small changes.
    pub(super) fn yielding(&self, state: &State, row: usize, scratch: &mut Scratch) {
        let Scratch { pose, drives, .. } = scratch;
        let bends = self.parts.iter().zip(&state.effects).any(|(part, values)| {
            part.effect.looks_at() == LooksAt::Gravity && values.iter().any(|value| *value != 0.0)
        });
        pose.yielding = match bends {
            true => Yielding::of(&self.bends_alone(state, row, pose, drives)),
            false => Yielding::default(),
        };
    }

    /// What gravity bends in a situation, as one column.
    fn bend(
        &self,
        state: &State,
        situation: &Situation<'_>,
        (bent, drives): (&mut Changes, &mut Vec<Drive>),
        column: &mut [f64],
    ) {
        bent.clear(self.model.chain.len(), state.targets.len());
        for (part, values) in self.parts.iter().zip(&state.effects) {
            if part.effect.looks_at() == LooksAt::Gravity {
                drives.clear();
                part.effect.drive(situation, drives);
                bent.add(drives, values);
            }
        }
        as_column(bent, column);
    }

    /// How what gravity bends changes with each source while all else of the posture stays.
    fn bends_alone(
        &self,
        state: &State,
        row: usize,
        pose: &ArmPose,
        drives: &mut Vec<Drive>,
    ) -> DMatrix<f64> {
        let numbers = KNOBS.len() * self.model.chain.len();
        let weights = self.weights(state, row);
        let mut bent = Changes::default();
        let mut bend = |posture: &Posture, moments: &[f64], weights: Weights<'_>, column: &mut [f64]| {
            let situation = self.situation(state, row, posture, moments, None);
            self.bend(state, &Situation { weights, ..situation }, (&mut bent, drives), column);
        };
        let mut here = DVector::zeros(numbers + CARRIED);
        bend(&pose.posture, &pose.moments, weights, here.as_mut_slice());
        let mut alone = DMatrix::zeros(numbers + CARRIED, numbers + 3);
        let (mut posture, mut moments) = (Posture::default(), pose.moments.clone());
        let mut deviations = pose.changes.deviations.clone();
        let is_weighed = pose.moments.iter().any(|moment| *moment != 0.0);
        for number in 0..numbers {
            let (joint, place) = (number / KNOBS.len(), number % KNOBS.len());
            if place >= TURNS && !is_weighed {
                continue;
            }
            let small = if place < TURNS { SMALL_TURN } else { SMALL_SHIFT };
            let whole = deviations.get(joint).copied();
            if let (Some(row), Some(knob)) = (deviations.get_mut(joint), KNOBS.get(place)) {
                row.add(*knob, small);
            }
            posture.update(&self.model.chain, self.table.q_of(row), &deviations);
            if let (Some(row), Some(whole)) = (deviations.get_mut(joint), whole) {
                *row = whole;
            }
            if is_weighed {
                weights.moments(&posture, &mut moments);
            }
            let mut column = alone.column_mut(number);
            bend(&posture, &moments, weights, column.as_mut_slice());
            column.zip_apply(&here, |ahead, here| *ahead = (*ahead - here) / small);
        }
        for axis in 0..3 {
            let turn = Rotation3::new(Vector3::ith(axis, SMALL_TURN));
            let down = self.model.down(&(turn * state.base.rotation));
            let tilted = Weights { down, ..weights };
            tilted.moments(&pose.posture, &mut moments);
            let mut column = alone.column_mut(numbers + axis);
            bend(&pose.posture, &moments, tilted, column.as_mut_slice());
            column.zip_apply(&here, |ahead, here| *ahead = (*ahead - here) / SMALL_TURN);
        }
        alone
    }
}
