//! Zeros and directions from poses that are declared. One pose gives a joint's zero. A second one, the joint turned by ten degrees and more, determines
//! which way its servo counts: the declared angle then grew as its steps did, or the other way.

use crate::motion::Direction;
use crate::servo::{STEP_DEG, STEPS_A_TURN};

/// A joint that turned by less between two declared poses says nothing of its direction, deg.
const DIRECTION_FROM: f64 = 10.0;
/// How far the declared turn may be from that of the servo, as a fraction of it: instruments and eyes are no encoders.
const FITS_WITHIN: f64 = 0.25;

/// A joint at a declared pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// What the encoder shows, whatever the homing offset, steps.
    pub(crate) encoder: i32,
    /// What was declared, deg.
    pub(crate) degrees: f64,
    /// Whether the joint was then given a new angle, and did not just keep its own.
    pub(crate) stated: bool,
}

/// What two poses say of a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Verdict {
    /// It is as it was taken, or they do not say.
    Same,
    /// It is the other one.
    Reversed,
    /// The servo turned by so much, the declared pose by so much, deg: neither direction fits.
    Neither(f64, f64),
}

/// Holds a newly declared pose against the one before.
pub(crate) fn judge(direction: Direction, before: &Pose, now: &Pose) -> Verdict {
    let steps = (now.encoder - before.encoder + STEPS_A_TURN / 2).rem_euclid(STEPS_A_TURN) - STEPS_A_TURN / 2;
    let turned = f64::from(steps) * STEP_DEG;
    let by_servo = if direction == Direction::Same { turned } else { -turned };
    let declared = now.degrees - before.degrees;
    if turned.abs() < DIRECTION_FROM {
        return Verdict::Same;
    }
    let fits = |by_servo: f64| (declared - by_servo).abs() <= FITS_WITHIN * turned.abs();
    match (fits(by_servo), fits(-by_servo)) {
        (true, _) => Verdict::Same,
        (false, true) => Verdict::Reversed,
        // A joint that kept its own angle then may have been wrong by anything.
        (false, false) if !before.stated => Verdict::Same,
        (false, false) => Verdict::Neither(by_servo, declared),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(encoder: i32, degrees: f64, stated: bool) -> Pose {
        Pose { encoder, degrees, stated }
    }

    #[test]
    fn two_poses_determine_the_direction() {
        let first = pose(2048, 5.0, true);
        assert_eq!(judge(Direction::Same, &first, &pose(2048 + 228, 25.0, true)), Verdict::Same);
        assert_eq!(judge(Direction::Same, &first, &pose(2048 + 228, -15.0, true)), Verdict::Reversed);
        assert_eq!(judge(Direction::Reversed, &first, &pose(2048 + 228, -15.2, true)), Verdict::Same);
        assert_eq!(judge(Direction::Reversed, &first, &pose(2048 + 228, 25.0, true)), Verdict::Reversed);
    }

    #[test]
    fn a_turn_is_seen_across_the_end_of_the_count() {
        assert_eq!(judge(Direction::Same, &pose(4000, 0.0, true), &pose(132, 20.0, true)), Verdict::Same);
    }

    #[test]
    fn what_says_nothing_changes_nothing() {
        let first = pose(2048, 5.0, true);
        assert_eq!(judge(Direction::Same, &first, &pose(2048 + 50, 0.0, true)), Verdict::Same);
        assert!(matches!(
            judge(Direction::Same, &first, &pose(2048 + 228, 45.0, true)),
            Verdict::Neither(..)
        ));
        // Its zero was off by 14 degrees and nobody had said so: no word on its direction, which is right.
        let kept = pose(2048, 0.0, false);
        assert_eq!(judge(Direction::Same, &kept, &pose(2048 + 228, 34.0, true)), Verdict::Same);
        assert_eq!(judge(Direction::Same, &kept, &pose(2048 + 228, -20.0, true)), Verdict::Reversed);
    }
}
