//! Where along a path something happens: brackets narrowed by halving, and dips found between two samples.

/// The fraction of a path, just past the change, at which `changed` turns from false (at `low`) to true (at `high`).
///
/// Halves the bracket until it is narrower than `width` or no number lies between its ends; `changed` holds at the result,
/// and does not hold `width` before it.
pub(super) fn first_change(low: f64, high: f64, width: f64, mut changed: impl FnMut(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low, high);
    while high - low > width {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            break;
        }
        if changed(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

/// The fraction between 0 and 1 at which `value` is greatest, if it is greater somewhere inside than at both ends.
///
/// Meant for paths so short that `value` has one summit at most; found by golden sections down to `width`.
pub(super) fn summit(width: f64, value: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    const GOLDEN: f64 = 0.618_033_988_749_894_8;
    const NUDGE: f64 = 1e-4;
    let (start, end) = (value(0.0), value(1.0));
    if value(NUDGE) <= start || value(1.0 - NUDGE) <= end {
        return None;
    }
    let (mut low, mut high) = (0.0, 1.0);
    let mut left = high - GOLDEN * (high - low);
    let mut right = low + GOLDEN * (high - low);
    let (mut at_left, mut at_right) = (value(left), value(right));
    while high - low > width {
        if at_left < at_right {
            low = left;
            (left, at_left) = (right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = value(right);
        } else {
            high = right;
            (right, at_right) = (left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = value(left);
        }
    }
    let top = low + (high - low) / 2.0;
    let height = value(top);
    (height > start && height > end).then_some((top, height))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_change_is_found_to_the_width_asked_for(root in 0.001..0.999_f64) {
            let found = first_change(0.0, 1.0, 1e-13, |fraction| fraction >= root);
            prop_assert!(found >= root && found - root <= 1e-13);
        }

        #[test]
        fn a_summit_between_the_ends_is_found(top in 0.05..0.95_f64, steepness in 0.1..100.0_f64) {
            let (found, height) = summit(1e-9, |at| -steepness * (at - top) * (at - top)).unwrap();
            prop_assert!((found - top).abs() < 1e-6);
            prop_assert!(height <= 0.0 && height > -1e-9);
        }

        #[test]
        fn a_slope_has_no_summit(slope in prop::num::f64::NORMAL.prop_filter("steep", |s| s.abs() > 1e-6 && s.abs() < 1e6)) {
            prop_assert!(summit(1e-9, |at| slope * at).is_none());
        }
    }

    #[test]
    fn a_bracket_too_narrow_to_halve_ends_the_search() {
        assert_eq!(first_change(1.0, 1.0_f64.next_up(), 0.0, |_| false), 1.0_f64.next_up());
    }
}
