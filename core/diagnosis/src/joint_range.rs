//! Where a joint works: between its limits, and where those say nothing, where it was measured and a little around.

use plumb_kinematics::Motion;

use crate::laboratory::Laboratory;
use crate::thresholds::{LONGEST_SLIDE, RANGE_MARGIN, TURNS_LIMITED};

/// Where a joint works.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JointRange {
    /// Least and greatest coordinate, rad, or mm of a joint that slides.
    pub(crate) ends: (f64, f64),
    /// Whether the ends are the joint's limits, and not only where it was measured.
    pub(crate) limited: bool,
}

/// Where a joint of a laboratory's model works.
pub(crate) fn joint_range(lab: &Laboratory, joint: usize) -> JointRange {
    let measured = lab.summary().ranges.get(joint).copied().unwrap_or((-1.0, 1.0));
    let row = lab.model().chain.joints.get(joint);
    row.map_or(JointRange { ends: measured, limited: false }, |row| {
        range_within(row.motion, row.limits, measured)
    })
}

/// Where a joint works, from its limits and from the range it was measured in, both in rad, or mm of a joint that slides.
fn range_within(motion: Motion, (low, high): (f64, f64), measured: (f64, f64)) -> JointRange {
    if high - low < longest_limited(motion) {
        return JointRange { ends: (low, high), limited: true };
    }
    let margin = RANGE_MARGIN * (measured.1 - measured.0);
    let ends = ((measured.0 - margin).max(low), (measured.1 + margin).min(high));
    JointRange { ends, limited: false }
}

/// Limits as far apart as this say nothing of where a joint works, rad, or mm of a joint that slides.
fn longest_limited(motion: Motion) -> f64 {
    match motion {
        Motion::Turns => TURNS_LIMITED * std::f64::consts::TAU,
        Motion::Slides => LONGEST_SLIDE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_where_a_joint_works() {
        let turning = range_within(Motion::Turns, (-1.0, 1.0), (-0.2, 0.3));
        assert_eq!(turning, JointRange { ends: (-1.0, 1.0), limited: true });
    }

    #[test]
    fn a_slides_limits_are_millimetres_and_no_turns() {
        let slide = range_within(Motion::Slides, (0.0, 50.0), (0.0, 20.0));
        assert_eq!(slide, JointRange { ends: (0.0, 50.0), limited: true });
        // A travelling axis of 30 m in a hall.
        let track = range_within(Motion::Slides, (0.0, 30_000.0), (100.0, 200.0));
        assert_eq!(track, JointRange { ends: (0.0, 30_000.0), limited: true });
        // What a model file says of a slide whose limits it does not give.
        let unknown = range_within(Motion::Slides, (-1e6, 1e6), (100.0, 200.0));
        let margin = RANGE_MARGIN * 100.0;
        assert_eq!(unknown, JointRange { ends: (100.0 - margin, 200.0 + margin), limited: false });
    }

    #[test]
    fn without_limits_a_joint_works_near_where_it_was_measured() {
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        let ends = range_within(Motion::Turns, free, (-1.0, 1.0)).ends;
        assert_eq!(ends, (-1.0 - 2.0 * RANGE_MARGIN, 1.0 + 2.0 * RANGE_MARGIN));
        let two_turns = (-std::f64::consts::TAU, std::f64::consts::TAU);
        let ends = range_within(Motion::Turns, two_turns, (0.0, 1.0)).ends;
        assert_eq!(ends, (-RANGE_MARGIN, 1.0 + RANGE_MARGIN));
        let ends = range_within(Motion::Turns, (-0.05, 2.0 * std::f64::consts::TAU), (0.0, 1.0)).ends;
        assert_eq!(ends, (-0.05, 1.0 + RANGE_MARGIN), "where a limit comes first it holds");
    }

    #[test]
    fn limits_exactly_as_far_apart_as_the_longest_say_nothing_and_nearer_ones_hold() {
        for (motion, longest) in
            [(Motion::Turns, TURNS_LIMITED * std::f64::consts::TAU), (Motion::Slides, LONGEST_SLIDE)]
        {
            assert!(!range_within(motion, (0.0, longest), (1.0, 2.0)).limited);
            assert!(range_within(motion, (0.0, 0.999 * longest), (1.0, 2.0)).limited);
        }
    }
}
