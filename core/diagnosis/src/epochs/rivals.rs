//! Explanations by epoch that the rows cannot distinguish.
//!
//! Two models that are not nested are compared by how their squared errors differ, beside the standard error of that difference
//! (Vuong, Likelihood ratio tests for model selection and non-nested hypotheses, Econometrica 57, 1989). The standard error is that
//! under the better of the two (Cox 1962, Further results on tests of separate families of hypotheses): of a difference `d` between
//! two predictions and a residual `r` of the better one, the squares differ by `d^2 + 2 d r`, and only `2 d r` is chance. The scatter of
//! the whole difference about its mean would grow with `d`, so that what happened at one row could hardly be distinguished however badly the other
//! explains it. Neighbouring rows err alike, so that the variance is that of a series (Newey and West 1987). Schwarz's criterion alone
//! takes every difference for evidence, also one that comes from what both models lack; of that one may take a part by accident, so that the difference must also be a
//! part of what is left.

use super::search::long_run_variance_ratio;
use crate::forward_selection::{FittedCandidate, Stage};
use crate::thresholds::{RIVAL_ERRORS, RIVAL_LEAVES};
use plumb_calibration::effect::{EffectId, Family, Site, acts_by_epoch, kind};

/// Something that happened at some row.
pub(super) fn is_event(id: &EffectId) -> bool {
    kind(&id.name).is_some_and(|kind| kind.is_event)
}

/// Whether an effect by epoch is one of the instrument: a reading, or where the instrument is.
fn is_of_instrument(id: &EffectId) -> bool {
    let by_epoch = kind(&id.name).is_some_and(|kind| kind.family == Family::Epoch);
    by_epoch && matches!(id.site, Site::Reading(_) | Site::Axis(_) | Site::Base)
}

/// The fitted candidates close to the best, with those beside them that explain a jump as well; nothing is added where the best is
/// no event. Of two events of one joint the first stands for both: that its zero is another since one jump is that it may be another since each.
pub(crate) fn with_rivals(stage: &Stage<'_>, mut close: Vec<usize>) -> Vec<usize> {
    let fitted_candidates = &stage.fitted_candidates;
    let best =
        close.first().and_then(|index| fitted_candidates.get(*index)).filter(|best| is_event(&best.id));
    let Some(best) = best else { return close };
    let by_epoch = fitted_candidates.iter().any(|other| acts_by_epoch(&other.id.name));
    let plausible = fitted_candidates.iter().enumerate();
    let plausible = plausible.filter(|(_, one)| by_epoch && one.is_plausible() && is_event(&one.id));
    let plausible: Vec<(usize, &FittedCandidate)> = plausible.collect();
    for (index, other) in &plausible {
        if !close.contains(index) && is_rival(other, best) {
            close.push(*index);
        }
    }
    keep_one_of_a_joint(fitted_candidates, &mut close);
    // Of several that cannot be distinguished the instrument may always be one: a re-set instrument and a re-set joint look alike from where few rows are.
    let mut candidates = close.iter().filter_map(|index| fitted_candidates.get(*index));
    let has_instrument = candidates.any(|one| is_of_instrument(&one.id));
    if close.len() > 1 && !has_instrument {
        let instrument = plausible.iter().find(|(_, one)| is_of_instrument(&one.id));
        close.extend(instrument.map(|(index, _)| *index));
    }
    close.sort_unstable();
    close
}

/// Of several events of one joint keeps the first.
fn keep_one_of_a_joint(fitted_candidates: &[FittedCandidate], close: &mut Vec<usize>) {
    let mut joints: Vec<usize> = Vec::new();
    close.retain(|index| {
        let event = fitted_candidates.get(*index).filter(|one| is_event(&one.id));
        let Some(joint) = event.and_then(|one| one.id.joint()) else { return true };
        let is_first = !joints.contains(&joint);
        joints.push(joint);
        is_first
    });
}

/// Whether the rows cannot distinguish one event from a better one. What has more numbers fits better by them alone: each pays as in Schwarz's criterion, as Vuong (1989) proposes.
fn is_rival(other: &FittedCandidate, best: &FittedCandidate) -> bool {
    let (own, least) = (&other.row_residuals, &best.row_residuals);
    if own.is_empty() || own.len() != least.len() {
        return false;
    }
    let (squares, freedom) = best.left;
    let more_numbers = other.score.freedom as f64 - best.score.freedom as f64;
    let equations: usize = least.iter().map(Vec::len).sum();
    let charge = more_numbers * (equations.max(1) as f64).ln() * squares / freedom.max(1.0);
    // Numbers that the better one has beyond the other's also take up what both lack: how it fits is no measure of chance.
    let chance = if more_numbers < 0.0 { about_mean(own, least) } else { under_the_better(own, least) };
    let worse = difference(own, least) + charge;
    !differs(worse, &chance) || worse <= RIVAL_LEAVES * squares
}

/// Whether a difference of squared errors is more than [`RIVAL_ERRORS`] standard errors, of which each row gives its part by `chance`.
fn differs(difference: f64, chance: &[f64]) -> bool {
    difference > RIVAL_ERRORS * (squares(chance) * long_run_variance_ratio(chance)).sqrt()
}

/// By how much the squared errors of two models differ. Residuals in sigmas: rows by their equations.
fn difference(own: &[Vec<f64>], least: &[Vec<f64>]) -> f64 {
    own.iter().zip(least).map(|(own, least)| squares(own) - squares(least)).sum()
}

/// What chance does to the difference row by row if the second model, the better one, is right.
fn under_the_better(own: &[Vec<f64>], least: &[Vec<f64>]) -> Vec<f64> {
    own.iter().zip(least).map(|(own, least)| 2.0 * product_with_difference(own, least)).collect()
}

/// The difference row by row about its mean, as Vuong (1989) has it.
fn about_mean(own: &[Vec<f64>], least: &[Vec<f64>]) -> Vec<f64> {
    let mean = difference(own, least) / own.len().max(1) as f64;
    own.iter().zip(least).map(|(own, least)| squares(own) - squares(least) - mean).collect()
}

fn squares(row: &[f64]) -> f64 {
    row.iter().map(|one| one * one).sum()
}

/// By how much a row's predictions differ, times its residuals under the better model.
fn product_with_difference(own: &[f64], least: &[f64]) -> f64 {
    own.iter().zip(least).map(|(own, least)| (own - least) * least).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::fitted_candidate;
    use plumb_estimation::Random;

    #[test]
    fn what_is_re_set_at_a_reading_an_axis_or_the_base_is_of_the_instrument() {
        let at = |site: Site| is_of_instrument(&EffectId::at("reading_reset", site));
        assert!(at(Site::Axis(0)) && at(Site::Base) && !at(Site::Joint(1)));
        assert!(!is_of_instrument(&EffectId::at("base_position", Site::Base)), "not by epoch");
        assert!(is_event(&EffectId::at("joint_step", Site::Joint(0))));
        assert!(!is_event(&EffectId::at("joint_gain", Site::Joint(0))));
    }

    #[test]
    fn a_rival_has_residuals_of_the_same_rows_that_do_not_differ() {
        let with = |row_residuals: Vec<Vec<f64>>| FittedCandidate {
            row_residuals,
            ..fitted_candidate("joint_step", 0, 0.0)
        };
        let best = with(noise(100, 5));
        assert!(is_rival(&with(best.row_residuals.clone()), &best));
        let worse = best.row_residuals.iter().map(|row| vec![row[0] + 1.0]).collect();
        assert!(!is_rival(&with(worse), &best));
        assert!(!is_rival(&with(Vec::new()), &with(Vec::new())), "nothing was compared");
        assert!(!is_rival(&with(noise(99, 5)), &best), "other rows");
    }

    #[test]
    fn of_two_events_the_one_with_more_numbers_pays_for_them() {
        let with = |row_residuals: Vec<Vec<f64>>, freedom: usize| {
            let mut one = FittedCandidate {
                row_residuals,
                left: (100.0, 100.0),
                ..fitted_candidate("joint_step", 0, 0.0)
            };
            one.score.freedom = freedom;
            one
        };
        // Off by 1.5 sigmas in 50 of 100 rows: the squares differ by 112 or so, five standard errors of 21. Twenty numbers more cost 92.
        let best = noise(100, 6);
        let other = off_from(50, 1.5, &best);
        assert!(!is_rival(&with(other.clone(), 1), &with(best.clone(), 1)));
        assert!(is_rival(&with(other, 1), &with(best.clone(), 21)));
        // However far off, what happened at three rows is then hardly distinguished; what is off in half of them is.
        assert!(is_rival(&with(off_from(97, 8.0, &best), 1), &with(best.clone(), 6)));
        assert!(!is_rival(&with(off_from(97, 8.0, &best), 1), &with(best.clone(), 1)));
        assert!(!is_rival(&with(off_from(50, 8.0, &best), 1), &with(best.clone(), 6)));
        assert!(!is_rival(&with(off_from(50, 8.0, &best), 1), &with(best.clone(), 1)));
        // Off by 0.4 they differ by 8 or so, 1.4 standard errors of 6.
        let near = off_from(50, 0.4, &best);
        assert!(is_rival(&with(near.clone(), 1), &with(best.clone(), 1)));
        assert!(!is_rival(&with(near, 21), &with(best, 1)));
    }

    #[test]
    fn a_difference_must_be_a_part_of_what_is_left() {
        // Off by 0.5 in all of 400 rows of noise: 100 more of 400, ten standard errors. Of twice as much that is left it is less than 15 %.
        let least = noise(400, 7);
        let with = |row_residuals: Vec<Vec<f64>>, left: f64| FittedCandidate {
            row_residuals,
            left: (left, 400.0),
            ..fitted_candidate("joint_step", 0, 0.0)
        };
        let other = off_from(0, 0.5, &least);
        assert!(!is_rival(&with(other.clone(), 400.0), &with(least.clone(), 400.0)));
        assert!(is_rival(&with(other, 800.0), &with(least, 800.0)));
    }

    /// Whether models with as many numbers differ.
    fn apart(own: &[Vec<f64>], least: &[Vec<f64>]) -> bool {
        differs(difference(own, least), &under_the_better(own, least))
    }

    /// Rows of one equation with noise of one sigma.
    fn noise(rows: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut random = Random::seeded(seed);
        (0..rows).map(|_| vec![random.normal()]).collect()
    }

    /// The same with predictions that are off by so much from a row on.
    fn off_from(row: usize, by: f64, least: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let rows = least.iter().enumerate();
        rows.map(|(at, own)| vec![own[0] + if at >= row { by } else { 0.0 }]).collect()
    }

    #[test]
    fn what_is_off_since_a_row_differs_the_more_the_farther_it_is_off() {
        // Off by d in n rows of noise s the squares differ by n d^2, with a standard error of 2 s d sqrt(n): sqrt(n) d / 2 s of them.
        let least = noise(400, 3);
        for (rows, by, expected) in
            [(60, 0.6, false), (60, 2.0, true), (60, 8.0, true), (300, 0.25, false), (300, 0.9, true)]
        {
            assert_eq!(apart(&off_from(400 - rows, by, &least), &least), expected, "{rows} rows off by {by}");
        }
        assert!(!apart(&least, &least));
        assert!(!apart(&least, &off_from(340, 2.0, &least)), "the better one is no worse than the other");
    }

    #[test]
    fn what_both_models_lack_is_no_evidence_for_one_of_them() {
        // Off by one sigma in half of 200 rows: five standard errors of independent rows. Where both lack a slow drift of two sigmas neighbours err alike, and count as few.
        let drifting: Vec<Vec<f64>> = noise(200, 4)
            .iter()
            .zip(0..)
            .map(|(row, at)| vec![row[0] + 2.0 * (f64::from(at) / 12.0).sin()])
            .collect();
        let independent = noise(200, 4);
        assert!(apart(&off_from(100, 1.0, &independent), &independent));
        assert!(!apart(&off_from(100, 1.0, &drifting), &drifting));
    }

    #[test]
    fn rivals_of_an_event_join_it_where_anything_by_epoch_is_asked_and_an_instrument_may_always_be_one() {
        let lab = crate::testing::two_links(20, "joint_zero(*)", 0.05, 31, |_| [0.0; 2]);
        let none = crate::candidates::Candidates { listed: Vec::new(), unlisted: Vec::new() };
        let watch = plumb_estimation::Progress::unwatched();
        let mut stage = lab.stage(Vec::new(), None, &none, &watch).unwrap();
        let rows = noise(100, 5);
        let with = |name: &str, site: Site, row_residuals: &[Vec<f64>]| FittedCandidate {
            id: EffectId::at(name, site),
            row_residuals: row_residuals.to_vec(),
            ..fitted_candidate(name, 0, 0.0)
        };
        let worse: Vec<Vec<f64>> = rows.iter().map(|row| vec![row[0] + 1.0]).collect();
        let mut mad = with("joint_zero_reset", Site::Joint(1), &rows);
        mad.score.plausible = false;
        stage.fitted_candidates = vec![
            with("joint_zero_reset", Site::Joint(0), &rows),
            with("joint_zero_reset", Site::Joint(1), &worse),
            with("base_reset", Site::Base, &worse),
            with("joint_step", Site::Joint(1), &rows),
            mad,
            with("joint_gain", Site::Joint(1), &rows),
        ];
        assert_eq!(with_rivals(&stage, vec![0, 1]), [0, 1, 2], "one of several may be the instrument");
        assert_eq!(with_rivals(&stage, vec![3, 1]), [0, 2, 3], "two events of one joint are one explanation");
        assert_eq!(with_rivals(&stage, vec![0, 3]), [0, 2, 3], "a known one is no second");
        assert_eq!(with_rivals(&stage, vec![0, 2]), [0, 2, 3], "the instrument is among them");
        assert_eq!(with_rivals(&stage, vec![5, 0]), [5, 0], "the best is no event");
        assert_eq!(with_rivals(&stage, Vec::new()), Vec::<usize>::new());
        stage.fitted_candidates[3].row_residuals = worse;
        assert_eq!(with_rivals(&stage, vec![0]), [0], "alone it is what it is");
        // Without anything by epoch events have no rivals.
        let step = |joint: usize| with("joint_step", Site::Joint(joint), &rows);
        stage.fitted_candidates = vec![step(0), step(1)];
        assert_eq!(with_rivals(&stage, vec![0]), [0]);
    }

    #[test]
    fn chance_is_the_difference_of_squares_row_by_row_about_its_mean_or_what_the_better_one_predicts() {
        let (own, least) = ([vec![3.0, 1.0], vec![2.0], vec![0.0]], [vec![1.0, 2.0], vec![1.0], vec![4.0]]);
        // Squares 10, 4, 0 less 5, 1, 16: 5, 3, -16, of which the mean is -8 / 3.
        assert!((difference(&own, &least) + 8.0).abs() < 1e-12);
        let expected = [5.0, 3.0, -16.0].map(|one| one + 8.0 / 3.0);
        let parts = about_mean(&own, &least);
        assert!(parts.iter().zip(expected).all(|(part, expected)| (part - expected).abs() < 1e-12));
        // Twice the residuals of the better one times by how much the two differ: 2 (2 - 2), 2 (1), 2 (-16).
        assert_eq!(under_the_better(&own, &least), [0.0, 2.0, -32.0]);
    }

    #[test]
    fn a_number_more_costs_the_logarithm_of_the_equations_times_the_variance_that_is_left() {
        let with = |freedom: usize| {
            let mut one = FittedCandidate {
                row_residuals: vec![vec![1.0]; 100],
                left: (400.0, 100.0),
                ..fitted_candidate("joint_step", 0, 0.0)
            };
            one.score.freedom = freedom;
            one
        };
        // 400 squares on 100 degrees: each number costs 4 ln 100 = 18.4, and 0.15 of 400 are 60. Nothing else differs.
        assert!(is_rival(&with(4), &with(1)), "three numbers more");
        assert!(!is_rival(&with(5), &with(1)), "four numbers more");
        let without_freedom = |freedom: usize| FittedCandidate { left: (4.0, 0.0), ..with(freedom) };
        // Without any freedom one degree is assumed: a number costs 4 ln 100 where 0.6 are allowed.
        assert!(!is_rival(&without_freedom(2), &without_freedom(1)));
    }
}
