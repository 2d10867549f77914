//! Where the readings are linearized. What the weighing asks is linear: the readings that are left are a sum of columns, times numbers. An effect whose motion the geometry has taken
//! up for the most part is no such sum about the fit without it, where all lengths are bent: a gain that moves a point by 8 mm, of which 0.2 mm can be seen, is off by the
//! square of its angle. So the columns are those of the fit in which the likeliest effect is in, and what that does is added to what is left there.

use nalgebra::{DMatrix, DVector};

use crate::fitted::Fitted;
use crate::forward_selection::{FittedCandidate, Stage};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::thresholds::EVIDENCE_CANDIDATES;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{EffectId, kind};
use plumb_calibration::fit::{Fit, FitOptions};
use plumb_estimation::{Progress, RankRevealingCholesky};

/// A fit about which the readings are linearized.
pub(crate) enum Linearization<'a> {
    /// The stage's own.
    Stage,
    /// The stage with its likeliest effect in.
    With {
        /// The fit, its factor without that effect's own numbers.
        fitted: Box<Fitted<'a>>,
        id: EffectId,
        values: DVector<f64>,
    },
}

impl Linearization<'_> {
    /// The fit to take columns and residuals from.
    pub(super) fn fitted<'f>(&'f self, stage: &'f Stage<'_>) -> &'f Fitted<'f> {
        match self {
            Self::Stage => &stage.fitted,
            Self::With { fitted, .. } => fitted,
        }
    }

    /// The values that an effect has in the fit, and that its columns times them are missing from the residuals; nothing of one that is not in.
    pub(super) fn values_in(&self, id: &EffectId) -> Option<&DVector<f64>> {
        match self {
            Self::With { id: own, values, .. } if own == id => Some(values),
            Self::With { .. } | Self::Stage => None,
        }
    }
}

/// The factor of normal equations in which some unknowns are known.
fn factor_without(normal: &DMatrix<f64>, known: impl Iterator<Item = usize>) -> RankRevealingCholesky {
    let mut matrix = normal.clone();
    for one in known {
        matrix.row_mut(one).fill(0.0);
        matrix.column_mut(one).fill(0.0);
    }
    RankRevealingCholesky::new(&matrix)
}

/// Whether an effect may be one that a fit is linearized with: refitted, of a possible size, and no event, which takes other numbers with it.
pub(super) fn may_be_in(one: &FittedCandidate) -> bool {
    let is_event = kind(&one.id.name).is_some_and(|kind| kind.is_event);
    one.is_plausible() && one.refitted && !is_event
}

impl Laboratory {
    /// About the fit of a stage with one of its fitted candidates in; about the stage's own where that is none to be in.
    pub(super) fn linearized<'a>(
        &'a self,
        stage: &Stage<'_>,
        candidate: usize,
        progress: &Progress,
    ) -> Result<Linearization<'a>, LaboratoryError> {
        // What is not among the candidates has no column to add to what is left.
        let mut candidates = stage.fitted_candidates.iter().take(EVIDENCE_CANDIDATES);
        let best = candidates.nth(candidate).filter(|best| may_be_in(best));
        let Some(best) = best else { return Ok(Linearization::Stage) };
        let options = FitOptions { robust: false, ..self.options().fit };
        let mut more = stage.taken.clone();
        more.push(AddedEffect { id: best.id.clone(), values: best.values.clone() });
        let Fitted { problem, fit } =
            self.fit_to_compare(&more, &stage.fitted, &best.score.beside, options, progress)?;
        let values = DVector::from_vec(fit.state.effects.last().cloned().unwrap_or_default());
        let free = problem.free_parameters().len();
        let own = free.saturating_sub(values.len())..free;
        // What the rows do not determine without the effect they are not to determine with it: what bends makes parallel axes a little less so, and an offset along one of
        // them takes up, in kilometres, what the effect does.
        let known = own.chain(stage.fitted.fit.factor.dependent.iter().copied());
        let factor = factor_without(&fit.normal.matrix, known);
        let fitted = Box::new(Fitted { problem, fit: Fit { factor, ..fit } });
        Ok(Linearization::With { fitted, id: best.id.clone(), values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_unknown_leaves_the_factor_and_the_others_stay() {
        let normal = DMatrix::from_row_slice(3, 3, &[4.0, 1.0, 0.0, 1.0, 3.0, 1.0, 0.0, 1.0, 2.0]);
        let factor = factor_without(&normal, std::iter::once(1));
        assert_eq!((factor.independent.as_slice(), factor.dependent.as_slice()), (&[0, 2][..], &[1][..]));
        assert!((factor.inverse()[(0, 0)] - 0.25).abs() < 1e-12);
    }

    #[test]
    fn numbers_of_the_effect_and_those_that_the_rows_did_not_determine_without_it_are_known() {
        let lab = crate::testing::two_links(60, "joint_zero(*)", 0.05, 31, |q| [0.0, 0.01 * q[1]]);
        let watch = Progress::unwatched();
        let listed = crate::candidates::probes(&lab);
        let candidates = crate::candidates::Candidates { listed, unlisted: Vec::new() };
        let mut stage = lab.stage(Vec::new(), None, &candidates, &watch).unwrap();
        let known = |stage: &Stage<'_>| match lab.linearized(stage, 0, &watch).unwrap() {
            Linearization::With { fitted, values, .. } => {
                assert!((values[0] - 0.01).abs() < 1e-3, "{values}");
                fitted.fit.factor.dependent.clone()
            }
            Linearization::Stage => panic!("the gain was refitted"),
        };
        // Two zeros, then the gain.
        assert_eq!(known(&stage), [2]);
        // As if the rows hardly determined the shoulder's zero without the gain.
        stage.fitted.fit.factor = factor_without(&stage.fitted.fit.normal.matrix, std::iter::once(0));
        assert_eq!(known(&stage), [0, 2]);
        let is_stage = |stage: &Stage<'_>, one: usize| {
            matches!(lab.linearized(stage, one, &watch).unwrap(), Linearization::Stage)
        };
        let gain = || crate::testing::fitted_candidate("joint_gain", 1, 0.0);
        stage.fitted_candidates = (0..=EVIDENCE_CANDIDATES).map(|_| gain()).collect();
        stage.fitted_candidates.iter_mut().for_each(|one| one.refitted = true);
        assert!(!is_stage(&stage, EVIDENCE_CANDIDATES - 1));
        assert!(is_stage(&stage, EVIDENCE_CANDIDATES), "it is no candidate");
        stage.fitted_candidates[0].refitted = false;
        assert!(is_stage(&stage, 0));
    }
}
