//! Bringing the arm into a row's pose: what the effects do there, and gravity in balance with what it bends.

use plumb_kinematics::LinkFrames;

use super::arm_pose::{ArmPose, Changes};
use super::residual_model::ResidualModel;
use super::scratch::Scratch;
use super::state::State;
use crate::effect::{Contribution, LooksAt, Sample};

/// Rounds in which a bending arm comes to balance at most. What bends under its own weight changes the moments that bend it by a fraction that is of the order of the deflection itself
/// (1e-3 rad), so that three rounds leave 1e-9 of it; what would need more than this many has no balance that a machine could have.
const ROUNDS: usize = 20;

/// Change of a deflection (rad, mm) in one round from which on an arm is in balance: a millionth of what any instrument reads at a reach of metres.
const BALANCED: f64 = 1e-11;

impl ResidualModel<'_> {
    /// Brings the arm into a row's pose: deviations of all effects in, gravity in balance with what it bends.
    pub(super) fn assume(&self, row: usize, scratch: &mut Scratch<'_>) {
        let Scratch { state, constant, pose, contributions, .. } = scratch;
        pose.changes.begin_with(constant);
        if let Some(Some(mapped)) = self.mapped.get(row) {
            pose.changes.add_map(mapped, &self.model.chain, &state.base.rotation);
        }
        self.add_conditions(state, row, contributions, &mut pose.changes);
        if self.parts.iter().any(|part| part.looks_at == LooksAt::Gravity) {
            self.balance(state, row, contributions, pose);
        }
        let rig = self.model.stripe_rig.as_ref();
        pose.rig = rig.map(|rig| rig.with(&pose.changes.rig));
        self.place(row, state, pose);
        pose.place_base(&state.base);
    }

    /// Adds what effects do that look at commanded coordinates and conditions.
    fn add_conditions(
        &self,
        state: &State,
        row: usize,
        contributions: &mut Vec<Contribution>,
        changes: &mut Changes,
    ) {
        if self.parts.iter().all(|part| part.looks_at != LooksAt::Conditions) {
            return;
        }
        // Of these effects none asks for the frames.
        let idle = LinkFrames::default();
        let sample = self.sample(state, row, &idle, &[], None);
        self.add_those_that_look_at(LooksAt::Conditions, state, &sample, contributions, changes);
    }

    /// Frames and moments for the changes that are known so far.
    fn place(&self, row: usize, state: &State, pose: &mut ArmPose) {
        pose.link_frames.update(&self.model.chain, self.table.q_of(row), &pose.changes.deviations);
        self.weights(state, row).moments(&pose.link_frames, &mut pose.moments);
    }

    /// What bends under its own weight changes the moments that bend it: a few rounds settle it.
    fn balance(&self, state: &State, row: usize, contributions: &mut Vec<Contribution>, pose: &mut ArmPose) {
        let stiff = pose.changes.deviations.clone();
        for _ in 0..ROUNDS {
            let before = pose.changes.clone();
            self.place(row, state, pose);
            let ArmPose { link_frames, moments, changes, .. } = pose;
            // Each round begins from the stiff arm: what bends is no sum over the rounds.
            changes.deviations.clone_from(&stiff);
            changes.clear_bending();
            let sample = self.sample(state, row, link_frames, moments, None);
            self.add_those_that_look_at(LooksAt::Gravity, state, &sample, contributions, changes);
            if changes.bends_as(&before, BALANCED) {
                return;
            }
        }
    }

    /// Adds what the effects that look at this change in a sample.
    fn add_those_that_look_at(
        &self,
        looks_at: LooksAt,
        state: &State,
        sample: &Sample<'_>,
        contributions: &mut Vec<Contribution>,
        changes: &mut Changes,
    ) {
        for (part, values) in self.parts.iter().zip(&state.effects) {
            if part.looks_at == looks_at {
                changes.add(sample.contributions_of(part.effect.as_ref(), contributions), values);
            }
        }
    }
}
