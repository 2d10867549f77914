//! Explanations by epoch that the rows cannot tell apart.
//!
//! Two models that are not nested are compared by how their squared errors differ from row to row (Vuong, Likelihood ratio tests
//! for model selection and non-nested hypotheses, Econometrica 57, 1989); neighbouring rows err alike, so that the variance is
//! that of a series (Newey and West 1987). Schwarz's criterion alone takes every difference for evidence, also one that comes
//! from what both models lack.

use super::search::long_run_variance_ratio;
use crate::forward_selection::{Contender, Stage};
use crate::thresholds::RIVAL_ERRORS;
use plumb_calibration::effect::{EffectId, Family, Spot, acts_by_epoch, kind};

/// Something that happened at some row.
fn is_event(id: &EffectId) -> bool {
    kind(&id.name).is_some_and(|kind| kind.is_event)
}

/// Whether an effect by epoch is one of the instrument: a reading, or where the instrument stands.
fn is_of_instrument(id: &EffectId) -> bool {
    let by_epoch = kind(&id.name).is_some_and(|kind| kind.family == Family::Epoch);
    by_epoch && matches!(id.spot, Spot::Reading(_) | Spot::Axis(_) | Spot::Base)
}

/// The contenders close to the best, with those beside them that explain a jump as well; nothing is added where the best is
/// no event.
pub(crate) fn with_rivals(stage: &Stage<'_>, mut close: Vec<usize>) -> Vec<usize> {
    let contenders = &stage.contenders;
    let best = close.first().and_then(|index| contenders.get(*index)).filter(|best| is_event(&best.id));
    let Some(best) = best else { return close };
    let by_epoch = contenders.iter().any(|other| acts_by_epoch(&other.id.name));
    let plausible = contenders.iter().enumerate();
    let plausible = plausible.filter(|(_, one)| by_epoch && one.is_plausible() && is_event(&one.id));
    let plausible: Vec<(usize, &Contender)> = plausible.collect();
    for (index, other) in &plausible {
        if !close.contains(index) && is_rival(other, best) {
            close.push(*index);
        }
    }
    // Of several that cannot be told apart the instrument may always be one: a re-set instrument and a re-set joint look alike from where few rows are.
    let mut told = close.iter().filter_map(|index| contenders.get(*index));
    let has_instrument = told.any(|one| is_of_instrument(&one.id));
    if close.len() > 1 && !has_instrument {
        let instrument = plausible.iter().find(|(_, one)| is_of_instrument(&one.id));
        close.extend(instrument.map(|(index, _)| *index));
    }
    close.sort_unstable();
    close
}

/// Whether the rows cannot tell one event from a better one.
fn is_rival(other: &Contender, best: &Contender) -> bool {
    let (own, least) = (&other.row_squares, &best.row_squares);
    !own.is_empty() && own.len() == least.len() && !differs(own, least)
}

/// Whether squared errors differ by more than [`RIVAL_ERRORS`] standard errors of their sum.
fn differs(own: &[f64], least: &[f64]) -> bool {
    let count = own.len() as f64;
    let differences: Vec<f64> = own.iter().zip(least).map(|(own, least)| own - least).collect();
    let total: f64 = differences.iter().sum();
    let about_mean: Vec<f64> = differences.iter().map(|one| one - total / count).collect();
    let variance: f64 = about_mean.iter().map(|one| one * one).sum();
    total > RIVAL_ERRORS * (variance * long_run_variance_ratio(&about_mean)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::contender;
    use plumb_estimation::Random;

    #[test]
    fn what_is_re_set_at_a_reading_an_axis_or_the_base_is_of_the_instrument() {
        let at = |spot: Spot| is_of_instrument(&EffectId::at("reading_reset", spot));
        assert!(at(Spot::Axis(0)) && at(Spot::Base) && !at(Spot::Joint(1)));
        assert!(!is_of_instrument(&EffectId::at("base_position", Spot::Base)), "not by epoch");
        assert!(is_event(&EffectId::at("joint_step", Spot::Joint(0))));
        assert!(!is_event(&EffectId::at("joint_gain", Spot::Joint(0))));
    }

    #[test]
    fn a_rival_has_row_squares_of_the_same_rows_that_do_not_differ() {
        let with = |row_squares: Vec<f64>| Contender { row_squares, ..contender("joint_step", 0, 0.0) };
        let best = with((0..100).map(|row| f64::from(row % 3)).collect());
        assert!(is_rival(&with(best.row_squares.clone()), &best));
        let worse: Vec<f64> = best
            .row_squares
            .iter()
            .zip(0..)
            .map(|(square, row)| square + 1.0 + 0.1 * f64::from(row % 2))
            .collect();
        assert!(!is_rival(&with(worse), &best));
        assert!(!is_rival(&with(Vec::new()), &with(Vec::new())), "nothing was compared");
        assert!(!is_rival(&with(vec![1.0; 99]), &best), "other rows");
    }

    #[test]
    fn squared_errors_differ_when_every_row_says_so_and_not_when_a_few_do() {
        let mut random = Random::seeded(3);
        let least: Vec<f64> = (0..200).map(|_| random.normal().powi(2)).collect();
        let everywhere: Vec<f64> = least.iter().map(|square| square + 1.0 + 0.2 * random.normal()).collect();
        assert!(differs(&everywhere, &least));
        let here_and_there: Vec<f64> = least
            .iter()
            .enumerate()
            .map(|(row, square)| square + if row % 40 == 7 { 20.0 } else { 0.0 })
            .collect();
        assert!(!differs(&here_and_there, &least));
        assert!(!differs(&least, &least));
    }
}
