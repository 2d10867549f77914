//! Poses for a model at the floor: those at which what the rows cannot show would show, if it is there.

use nalgebra::DMatrix;

use super::choose::Chooser;
use super::design::PoseRequest;
use super::outcome::{Asked, Instead};
use super::rivals::Rival;
use super::{NextPoses, Requested, no_pose, with_returns};
use crate::forward_selection::Stage;
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::noise_floor::Floor;
use crate::not_shown::{Faint, with_weight};
use crate::thresholds::{ASKED_KINDS, ASKED_SIZE, SETTLES};
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect;
use plumb_estimation::Progress;

impl Laboratory {
    /// Poses that would show what these rows cannot; nothing if there is no such thing.
    pub(crate) fn poses_for_not_shown(
        &self,
        stage: &Stage<'_>,
        floor: &Floor,
        requested: &Requested,
        progress: &Progress,
    ) -> Result<Option<NextPoses>, LaboratoryError> {
        let mut faint = self.faint(&stage.fitted, floor)?;
        // What moves all surfaces alike no picture ever shows.
        faint.retain(|one| !(self.table().is_of_stripes() && one.any_size));
        keep_one_of_each_kind(&mut faint);
        let (Some(noise), Some(sigma)) = (floor.scale, floor.sigma_mm) else { return Ok(None) };
        if faint.is_empty() {
            return Ok(None);
        }
        progress.report(0.7, "choosing poses")?;
        let weighty = self.with_model(with_weight(self.model()));
        let mut rivals = vec![Rival::of("the model as it is".to_owned(), stage.taken.clone(), &stage.fitted)];
        rivals.extend(faint.iter().map(|one| rival(one, stage, asked_mm(sigma), self)));
        let mut chooser = Chooser::new(&weighty, rivals, noise)?;
        chooser.separate_from_first();
        let request = PoseRequest {
            count: requested.count,
            keep_out: &requested.keep_out,
            payloads: &requested.payloads,
        };
        let choice = chooser.choose(request, progress)?;
        if choice.designs.is_empty() {
            return Err(no_pose());
        }
        let next = with_returns(chooser.to_poses(&choice.designs));
        // Of the pairs, the ones with the model as it is.
        let apart = faint
            .iter()
            .enumerate()
            .map(|(index, one)| (choice.apart.get(index * (index + 1) / 2).copied().unwrap_or(0.0), one));
        let (shown, hidden): (Vec<_>, Vec<_>) = apart.partition(|(apart, _)| *apart >= SETTLES);
        let separation = shown.iter().map(|(apart, _)| *apart).fold(f64::INFINITY, f64::min);
        let [shown, still]: [Vec<String>; 2] =
            [&shown, &hidden].map(|some| some.iter().map(|(_, one)| self.model().label(&one.id)).collect());
        let instead = hidden.first().map(|(_, one)| {
            let how_to_see = effect::kind(&one.id.name).map_or("", |kind| kind.how_to_see);
            Instead::NotShownEither { hidden: still, how_to_see }
        });
        let asked = Asked::NotShown { shown, size: ASKED_SIZE };
        let between = faint.iter().map(|one| self.model().label(&one.id)).collect();
        // JSON has no infinity.
        let separation = if separation.is_finite() { separation } else { 0.0 };
        Ok(Some(NextPoses { next, between, separation, new: choice.designs.len(), asked, instead }))
    }
}

/// How far the effects that are asked about move a point, mm, where the noise along an axis is `sigma` mm: three of those make up a point.
fn asked_mm(sigma: f64) -> f64 {
    ASKED_SIZE * sigma * 3.0_f64.sqrt()
}

/// Of each kind of effect the first, which could move the tip most: poses that show it at one joint mostly show it at the others.
fn keep_one_of_each_kind(faint: &mut Vec<Faint>) {
    let mut kinds: Vec<String> = Vec::new();
    faint.retain(|one| {
        let known = kinds.contains(&one.id.name);
        kinds.push(one.id.name.clone());
        !known
    });
    faint.truncate(ASKED_KINDS);
}

/// The model with an effect in that the rows do not show, everything fitted where it would stand then.
fn rival(faint: &Faint, stage: &Stage<'_>, most_mm: f64, lab: &Laboratory) -> Rival {
    let (problem, fit) = (&stage.fitted.problem, &stage.fitted.fit);
    // Of the size that the question asks about, and no more than the rows leave room for.
    let fraction = (most_mm / faint.error_mm).min(1.0);
    let values: Vec<f64> = faint.values.iter().map(|value| value * fraction).collect();
    let beside = &faint.beside * fraction;
    let mut state = fit.state.stepped(problem.free_parameters(), beside.as_slice());
    state.effects.push(values.clone());
    let known = fit.covariance.nrows();
    let mut covariance = DMatrix::zeros(known + values.len(), known + values.len());
    covariance.view_mut((0, 0), (known, known)).copy_from(&fit.covariance);
    let mut effects = stage.taken.clone();
    effects.push(AddedEffect { id: faint.id.clone(), values });
    Rival { label: lab.model().label(&faint.id), effects, state, covariance }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::next_poses::Candidates;
    use crate::testing::two_links_with;
    use crate::{candidates, unlisted};

    /// Twelve poses of an arm of which everything is right.
    fn narrow() -> Laboratory {
        two_links_with("free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}", 12, 0.05, 3, |_| [0.0; 2])
    }

    #[test]
    fn a_point_of_three_axes_moves_by_the_root_of_three_times_the_noise_of_one() {
        assert!((asked_mm(0.2) - ASKED_SIZE * 0.2 * 1.732_050_807_568_877_2).abs() < 1e-12);
    }

    #[test]
    fn an_effect_that_is_not_shown_is_put_in_at_the_size_that_is_asked_and_at_no_more_than_the_rows_allow() {
        let (lab, progress) = (narrow(), Progress::unwatched());
        let fitted = lab.fit_with(&[], None, &progress).unwrap();
        let floor = Floor::of(&fitted.problem, &fitted.fit, &lab.context());
        let asked = Candidates { listed: candidates::probes(&lab), unlisted: unlisted::probes(&lab) };
        let finding = lab.find(&floor, &asked, &progress).unwrap();
        let faint = lab.faint(&finding.stage.fitted, &floor).unwrap();
        // Of each kind the first, in the order they come.
        let (mut first, mut kept) = (Vec::new(), lab.faint(&finding.stage.fitted, &floor).unwrap());
        for one in &faint {
            if first.iter().all(|known: &&Faint| known.id.name != one.id.name) {
                first.push(one);
            }
        }
        keep_one_of_each_kind(&mut kept);
        let ids = |some: Vec<&Faint>| some.into_iter().map(|one| one.id.clone()).collect::<Vec<_>>();
        assert!(faint.len() > first.len(), "some kind is hidden at two joints");
        first.truncate(ASKED_KINDS);
        assert_eq!(ids(kept.iter().collect()), ids(first));
        let (one, stage) = (faint.first().unwrap(), &finding.stage);
        let (problem, fit) = (&stage.fitted.problem, &stage.fitted.fit);
        for (most_mm, fraction) in [(0.5 * one.error_mm, 0.5), (one.error_mm, 1.0), (3.0 * one.error_mm, 1.0)]
        {
            let put_in = rival(one, stage, most_mm, &lab);
            let values: Vec<f64> = one.values.iter().map(|value| fraction * value).collect();
            assert_eq!(put_in.state.effects.last(), Some(&values));
            assert_eq!(
                put_in.effects.last().map(|added| (&added.id, &added.values)),
                Some((&one.id, &values))
            );
            assert_eq!(put_in.effects.len(), stage.taken.len() + 1);
            let beside = fit.state.stepped(problem.free_parameters(), (&one.beside * fraction).as_slice());
            assert_eq!(put_in.state.effects[..beside.effects.len()], beside.effects);
            let known = fit.covariance.nrows();
            assert_eq!(put_in.covariance.nrows(), known + values.len());
            assert_eq!(put_in.covariance.view((0, 0), (known, known)), fit.covariance);
            // Its own size is what is asked: nothing is known of it beforehand.
            assert_eq!(put_in.covariance.columns(known, values.len()).norm(), 0.0);
        }
    }

    #[test]
    fn one_effect_of_each_kind_is_asked_about_and_poses_that_show_it_put_it_clear_of_the_noise() {
        let (lab, progress) = (narrow(), Progress::unwatched());
        let requested = Requested { count: 3, keep_out: Vec::new(), payloads: Vec::new() };
        let found = lab.next_poses(&requested, &progress).unwrap();
        let Asked::NotShown { shown, size } = &found.asked else { panic!("{:?}", found.asked) };
        assert_eq!((*size, found.new), (ASKED_SIZE, 3));
        let mut kinds: Vec<&str> = found.between.iter().filter_map(|label| label.split('(').next()).collect();
        assert!(!kinds.is_empty() && kinds.len() <= ASKED_KINDS, "{kinds:?}");
        kinds.sort_unstable();
        kinds.dedup();
        assert_eq!(kinds.len(), found.between.len(), "{:?}", found.between);
        assert!(!shown.is_empty() && found.separation >= SETTLES, "{shown:?} {}", found.separation);
        if let Some(Instead::NotShownEither { hidden, .. }) = &found.instead {
            assert_eq!(shown.len() + hidden.len(), found.between.len());
        }
    }
}
