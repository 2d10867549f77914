//! The effects in question, each fitted with all else that was found.

use nalgebra::DMatrix;

use crate::fitted::Fitted;
use crate::forward_selection::FittedCandidate;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::noise_floor::Floor;
use crate::thresholds::RIVALS;
use crate::verdict::Finding;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::fit::State;
use plumb_estimation::Progress;

/// One effect in question, fitted.
pub(super) struct Rival {
    pub(super) label: String,
    pub(super) effects: Vec<AddedEffect>,
    pub(super) state: State,
    pub(super) covariance: DMatrix<f64>,
}

impl Rival {
    pub(super) fn of(label: String, effects: Vec<AddedEffect>, fitted: &Fitted<'_>) -> Self {
        Self { label, effects, state: fitted.fit.state.clone(), covariance: fitted.fit.covariance.clone() }
    }
}

impl Laboratory {
    /// The effects in question, each fitted with all else that was found, and the noise of an equation in sigmas.
    pub(super) fn rivals_of(
        &self,
        finding: &Finding<'_>,
        floor: &Floor,
        progress: &Progress,
    ) -> Result<(Vec<Rival>, f64), LaboratoryError> {
        let noise = floor.scale.unwrap_or(finding.stage.fitted.fit.scale).max(1e-9);
        let mut chosen: Vec<usize> = finding.close.clone();
        // A name is best tested against what came next.
        for (index, fitted_candidate) in finding.stage.fitted_candidates.iter().enumerate() {
            if chosen.len() < 2
                && !chosen.contains(&index)
                && fitted_candidate.refitted
                && fitted_candidate.score.plausible
            {
                chosen.push(index);
            }
        }
        chosen.extend(adjacent_orders(&finding.stage.fitted_candidates, &chosen));
        let mut rivals = Vec::new();
        for index in chosen.into_iter().take(RIVALS) {
            let Some(fitted_candidate) = finding.stage.fitted_candidates.get(index) else { continue };
            let mut effects = finding.stage.taken.clone();
            effects.push(AddedEffect {
                id: fitted_candidate.id.clone(),
                values: fitted_candidate.values.clone(),
            });
            let fitted = self.fit_with(&effects, Some(&finding.stage.fitted), progress)?;
            rivals.push(Rival::of(self.model().label(&fitted_candidate.id), effects, &fitted));
        }
        if rivals.is_empty() {
            rivals.push(Rival::of(
                "the model as it is".to_owned(),
                finding.stage.taken.clone(),
                &finding.stage.fitted,
            ));
        }
        Ok((rivals, noise))
    }
}

/// Waves of the orders next to those in question, at the same joints: where the range of a joint was seen in part only, they
/// come forward once more of it is seen.
fn adjacent_orders(fitted_candidates: &[FittedCandidate], chosen: &[usize]) -> Vec<usize> {
    let others = fitted_candidates.iter().enumerate().filter(|(index, _)| !chosen.contains(index));
    let adjacent = others.filter(|(_, fitted_candidate)| {
        let mut asked = chosen.iter().filter_map(|index| fitted_candidates.get(*index));
        asked.any(|other| is_adjacent(fitted_candidate, other))
    });
    adjacent.map(|(index, _)| index).collect()
}

/// Whether two candidates are waves of neighbouring orders at one joint.
fn is_adjacent(one: &FittedCandidate, other: &FittedCandidate) -> bool {
    let orders = one.id.order.zip(other.id.order);
    one.id.joint() == other.id.joint() && orders.is_some_and(|(one, other)| (one - other).abs() == 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::fitted_candidate;

    #[test]
    fn waves_of_the_orders_beside_those_in_question_are_asked_too() {
        let wave = |joint: usize, order: f64| {
            let mut wave = fitted_candidate("joint_harmonic", joint, 0.0);
            wave.id.order = Some(order);
            wave
        };
        let all = [
            wave(0, 3.0),
            wave(0, 4.0),
            wave(0, 2.0),
            wave(0, 5.0),
            wave(1, 4.0),
            fitted_candidate("joint_gain", 0, 0.0),
        ];
        assert_eq!(adjacent_orders(&all, &[0]), [1, 2], "not two orders away, not at another joint");
        assert_eq!(adjacent_orders(&all, &[0, 1]), [2, 3]);
        assert_eq!(adjacent_orders(&all, &[5]), Vec::<usize>::new());
    }
}
