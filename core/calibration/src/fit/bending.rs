//! How what gravity bends in a row changes with each number of the joints' rows and with turns of the base, by differences.

use nalgebra::{DMatrix, DVector, Rotation3, Vector3};
use plumb_kinematics::{LinkFrames, Weights};

use super::arm_pose::{ArmPose, Changes};
use super::residual_model::ResidualModel;
use super::response::{CARRIED, DH_PARAMETERS, Response, TURNS};
use super::scratch::Scratch;
use super::state::State;
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
    /// Works out how the arm of a row whose pose is known responds to small changes.
    pub(super) fn response(&self, state: &State, row: usize, scratch: &mut Scratch) {
        let Scratch { pose, drives, .. } = scratch;
        let bends = self.parts.iter().zip(&state.effects).any(|(part, values)| {
            part.effect.looks_at() == LooksAt::Gravity && values.iter().any(|value| *value != 0.0)
        });
        pose.response = match bends {
            true => Response::of(&self.bends_alone(state, row, pose, drives)),
            false => Response::default(),
        };
    }

    /// How what gravity bends changes with each source while all else of the configuration stays.
    fn bends_alone(
        &self,
        state: &State,
        row: usize,
        pose: &ArmPose,
        drives: &mut Vec<Drive>,
    ) -> DMatrix<f64> {
        let numbers = DH_PARAMETERS.len() * self.model.chain.len();
        let weights = self.weights(state, row);
        let mut bent = Changes::default();
        let mut bend =
            |link_frames: &LinkFrames, moments: &[f64], weights: Weights<'_>, column: &mut [f64]| {
                let situation = self.situation(state, row, link_frames, moments, None);
                bent.clear(self.model.chain.len(), state.targets.len());
                self.add_bends(state, &Situation { weights, ..situation }, drives, &mut bent);
                as_column(&bent, column);
            };
        let mut here = DVector::zeros(numbers + CARRIED);
        bend(&pose.link_frames, &pose.moments, weights, here.as_mut_slice());
        let mut alone = DMatrix::zeros(numbers + CARRIED, numbers + 3);
        let (mut link_frames, mut moments) = (LinkFrames::default(), pose.moments.clone());
        let mut deviations = pose.changes.deviations.clone();
        // Where no link has a known weight, moments play no part: only directions of gravity do.
        let is_weighed = pose.moments.iter().any(|moment| *moment != 0.0);
        let shifts_matter = is_weighed || here.rows(numbers, CARRIED).amax() > 0.0;
        for number in 0..numbers {
            let (joint, place) = (number / DH_PARAMETERS.len(), number % DH_PARAMETERS.len());
            if place >= TURNS && !shifts_matter {
                continue;
            }
            let small = if place < TURNS { SMALL_TURN } else { SMALL_SHIFT };
            let whole = deviations.get(joint).copied();
            if let (Some(row), Some(dh_parameter)) = (deviations.get_mut(joint), DH_PARAMETERS.get(place)) {
                row.add(*dh_parameter, small);
            }
            link_frames.update(&self.model.chain, self.table.q_of(row), &deviations);
            if let (Some(row), Some(whole)) = (deviations.get_mut(joint), whole) {
                *row = whole;
            }
            if is_weighed {
                weights.moments(&link_frames, &mut moments);
            }
            let mut column = alone.column_mut(number);
            bend(&link_frames, &moments, weights, column.as_mut_slice());
            column.zip_apply(&here, |ahead, here| *ahead = (*ahead - here) / small);
        }
        // The base turns against gravity, which is the same as gravity turning the other way.
        for axis in 0..3 {
            let turn = Rotation3::new(Vector3::ith(axis, SMALL_TURN));
            let down = self.model.down(&(turn * state.base.rotation));
            let tilted = Weights { down, ..weights };
            tilted.moments(&pose.link_frames, &mut moments);
            let mut column = alone.column_mut(numbers + axis);
            bend(&pose.link_frames, &moments, tilted, column.as_mut_slice());
            column.zip_apply(&here, |ahead, here| *ahead = (*ahead - here) / SMALL_TURN);
        }
        alone
    }
}
