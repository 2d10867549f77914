//! The rules by which the foremost of a set is a name, as far as they are numbers.

use crate::thresholds::{
    GAIN_ERRORS, JOINT_LEFT, RIVAL_SHARE, SITE_LEFT, SIZE_ERRORS, SIZE_SHARE, SMOOTH_ERRORS,
};

/// Whether something takes enough from what is left, by itself, to take the place of the foremost.
pub(super) fn is_close_to(own: f64, foremost: f64) -> bool {
    own >= RIVAL_SHARE * foremost
}

/// Whether left-out rows are predicted so much better (standard errors) that a smooth function which explains the rows seen as well is none.
pub(super) fn beats_smooth(gain: f64) -> bool {
    gain >= SMOOTH_ERRORS
}

/// Whether left-out rows are predicted better, by so many standard errors.
pub(super) fn predicts(gain: f64) -> bool {
    gain > GAIN_ERRORS
}

/// Whether so much is left at a joint, as a fraction of what an effect explains, that something else may be meant.
pub(super) fn is_crowded(left: f64, imitates: bool) -> bool {
    left > if imitates { SITE_LEFT } else { JOINT_LEFT }
}

/// Whether a size is the same beside a flexible part and without it: within its errors, or within a fraction of itself.
pub(super) fn is_steady(flexible: f64, plain: f64, error: f64) -> bool {
    (flexible - plain).abs() <= (SIZE_ERRORS * error).max(SIZE_SHARE * flexible.abs())
}

/// The probability by chance of what was chosen from so many families (Bonferroni), of one value each or of as many as its search tried: one that costs 2 ln k in the criterion has
/// tried k.
pub(super) fn chance_among(alone: f64, families: f64, search_cost: f64) -> f64 {
    alone * families * (0.5 * search_cost).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_choice_among_many_is_as_much_more_probable_by_chance() {
        let ten_values = 2.0 * 10.0_f64.ln();
        assert!((chance_among(1e-6, 4.0, 0.0) - 4e-6).abs() < 1e-18);
        assert!((chance_among(1e-6, 4.0, ten_values) - 4e-5).abs() < 1e-17);
    }

    #[test]
    fn a_rival_takes_half_of_what_the_foremost_does() {
        assert!(is_close_to(1.01 * RIVAL_SHARE * 40.0, 40.0));
        assert!(!is_close_to(0.99 * RIVAL_SHARE * 40.0, 40.0));
    }

    #[test]
    fn a_smooth_function_loses_to_clearly_better_predictions_alone() {
        assert!(beats_smooth(1.01 * SMOOTH_ERRORS) && !beats_smooth(0.99 * SMOOTH_ERRORS));
        assert!(predicts(1.01 * GAIN_ERRORS) && !predicts(0.99 * GAIN_ERRORS));
    }

    #[test]
    fn an_effect_that_imitates_others_must_explain_more_of_what_is_at_its_joint() {
        assert!(is_crowded(1.01 * SITE_LEFT, true) && !is_crowded(0.99 * SITE_LEFT, true));
        assert!(is_crowded(1.01 * JOINT_LEFT, false) && !is_crowded(0.99 * JOINT_LEFT, false));
    }

    #[test]
    fn a_size_may_move_by_its_errors_or_by_a_share_of_itself() {
        assert!(is_steady(-2.0, -2.0 * (1.0 - 0.99 * SIZE_SHARE), 0.0));
        assert!(!is_steady(-2.0, -2.0 * (1.0 - 1.01 * SIZE_SHARE), 0.0));
        assert!(is_steady(2.0, 2.0 + 0.99 * SIZE_ERRORS * 3.0, 3.0));
        assert!(!is_steady(2.0, 2.0 + 1.01 * SIZE_ERRORS * 3.0, 3.0));
    }
}
