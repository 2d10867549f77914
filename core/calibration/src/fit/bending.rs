//! How what gravity bends in a row changes with each number of the joints' rows and with turns of the base, by differences.

use nalgebra::{DMatrix, Rotation3, Vector3};
use plumb_kinematics::Weights;

use super::arm_pose::ArmPose;
use super::bend_slopes::{Rates, Slopes};
use super::residual_model::ResidualModel;
use super::response::{Alone, DH_PARAMETERS, Response, TURNS};
use super::scratch::Scratch;
use super::state::State;
use crate::effect::{Contribution, LooksAt, Sample};

/// Changes with which derivatives are taken, rad and mm: their squares are below rounding beside a bend, and they are far above it.
const SMALL_ROTATION: f64 = 1e-6;
const SMALL_SHIFT: f64 = 1e-3;

impl ResidualModel<'_> {
    /// Works out how the arm of a row whose pose is known responds to small changes.
    pub(super) fn response(&self, row: usize, scratch: &mut Scratch<'_>) {
        let Scratch { state, pose, contributions, .. } = scratch;
        let bends = self.parts.iter().zip(&state.effects).any(|(part, values)| {
            part.looks_at == LooksAt::Gravity && values.iter().any(|value| *value != 0.0)
        });
        pose.response = match bends {
            true => Response::of(self.bends_alone(state, row, pose, contributions)),
            false => Response::default(),
        };
    }

    /// How what gravity bends changes with each source while all else of the configuration stays.
    fn bends_alone(
        &self,
        state: &State,
        row: usize,
        pose: &ArmPose,
        contributions: &mut Vec<Contribution>,
    ) -> Alone {
        let numbers = DH_PARAMETERS.len() * self.model.chain.len();
        let Some(mut kept) = self.kept_slopes.of_row(row) else {
            return self.slopes(state, row, pose, contributions).alone(&state.effects, numbers);
        };
        let down = self.down(state);
        if let Some(slopes) = kept.as_ref().filter(|slopes| slopes.hold_at(&down, &pose.changes.deviations)) {
            return slopes.alone(&state.effects, numbers);
        }
        let here = (&down, pose.changes.deviations.as_slice());
        if let Some(alone) =
            self.kept_slopes.earlier(row, here, |slopes| slopes.alone(&state.effects, numbers))
        {
            return alone;
        }
        let slopes = self.slopes(state, row, pose, contributions);
        let alone = slopes.alone(&state.effects, numbers);
        *kept = self.kept_slopes.have_room_for(&slopes).then(|| Box::new(slopes));
        alone
    }

    /// How the rates at which gravity bends the arm of a row change with each source, by differences.
    fn slopes(
        &self,
        state: &State,
        row: usize,
        pose: &ArmPose,
        contributions: &mut Vec<Contribution>,
    ) -> Slopes {
        let numbers = DH_PARAMETERS.len() * self.model.chain.len();
        let sample = self.sample(state, row, &pose.link_frames, &pose.moments, None);
        let weights = sample.weights;
        let mut rates = Rates::default();
        self.work_out_rates(&sample, contributions, &mut rates);
        let here = rates.rates.clone();
        let mut by_source = DMatrix::zeros(numbers + 3, here.len());
        let mut set = |source: usize, rates: &Rates, small: f64| {
            let ahead = rates.rates.iter().zip(&here).map(|(ahead, here)| (ahead - here) / small);
            by_source.row_mut(source).iter_mut().zip(ahead).for_each(|(slope, value)| *slope = value);
        };
        let (mut link_frames, mut moments) = (pose.link_frames.clone(), pose.moments.clone());
        let mut deviations = pose.changes.deviations.clone();
        // Where no link has a known weight, moments play no part: only directions of gravity do.
        let is_weighed = pose.moments.iter().any(|moment| *moment != 0.0);
        let shifts_matter = is_weighed || rates.bends.iter().any(|bend| bend.target >= numbers);
        // From the flange inwards: frames before a joint are those of the pose still.
        for number in (0..numbers).rev() {
            let (joint, index) = (number / DH_PARAMETERS.len(), number % DH_PARAMETERS.len());
            if index >= TURNS && !shifts_matter {
                continue;
            }
            let small = if index < TURNS { SMALL_ROTATION } else { SMALL_SHIFT };
            let whole = deviations.get(joint).copied();
            if let (Some(row), Some(dh_parameter)) = (deviations.get_mut(joint), DH_PARAMETERS.get(index)) {
                row.add(*dh_parameter, small);
            }
            link_frames.update_from(joint, &self.model.chain, self.table.q_of(row), &deviations);
            if let (Some(row), Some(whole)) = (deviations.get_mut(joint), whole) {
                *row = whole;
            }
            if is_weighed {
                weights.moments(&link_frames, &mut moments);
            }
            let changed = Sample { link_frames: &link_frames, moments: &moments, ..sample };
            self.work_out_rates(&changed, contributions, &mut rates);
            set(number, &rates, small);
        }
        // The base turns against gravity, which is the same as gravity turning the other way.
        for axis in 0..3 {
            let rotation = Rotation3::new(Vector3::ith(axis, SMALL_ROTATION));
            let down = self.model.down(&(rotation * state.base.rotation));
            let tilted = Weights { down, ..weights };
            tilted.moments(&pose.link_frames, &mut moments);
            let changed = Sample { weights: tilted, moments: &moments, ..sample };
            self.work_out_rates(&changed, contributions, &mut rates);
            set(numbers + axis, &rates, SMALL_ROTATION);
        }
        let bends = rates.bends.into_iter().take(here.len()).collect();
        Slopes { down: weights.down, deviations: pose.changes.deviations.clone(), bends, by_source }
    }

    /// Works out the rates at which gravity bends the arm in a sample, in place of what `rates` held.
    fn work_out_rates(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>, rates: &mut Rates) {
        rates.begin();
        let numbers = DH_PARAMETERS.len() * self.model.chain.len();
        for (index, part) in self.parts.iter().enumerate() {
            if part.looks_at == LooksAt::Gravity {
                let all = sample.contributions_of(part.effect.as_ref(), contributions);
                rates.add_contributions(index, all, numbers);
            }
        }
    }
}
