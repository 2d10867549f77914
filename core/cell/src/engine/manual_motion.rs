//! What is seen of a robot's joints while a person moves them.

use plumb_plugin::JointVector;

use super::joint_index::JointIndex;

/// Two readings of a joint that is at rest differ by no more than this, rad or mm, where its drive has no steps.
const STILL: f64 = 1e-9;

/// The readings of the joints since a person was given the robot, in the drive's order and its numbers, rad or mm.
#[derive(Debug)]
pub(crate) struct ManualMotion {
    last: JointVector,
    least: JointVector,
    most: JointVector,
}

impl ManualMotion {
    /// A person is given a robot that is at `here`.
    pub(crate) fn from(here: &JointVector) -> Self {
        Self { last: *here, least: *here, most: *here }
    }

    /// Whether a joint is elsewhere than it was seen last. `step` is the smallest of its drive.
    /// One that is not reported has left, for all anybody knows.
    pub(crate) fn has_left(&self, joint: JointIndex, here: &JointVector, step: f64) -> bool {
        match (joint.value(&self.last), joint.value(here)) {
            (Ok(last), Ok(now)) => (now - last).abs() > step / 2.0 + STILL,
            _ => true,
        }
    }

    /// Takes in where the joints are now.
    pub(crate) fn saw(&mut self, here: &JointVector) {
        let bounds = self.least.as_mut_slice().iter_mut().zip(self.most.as_mut_slice());
        for ((least, most), now) in bounds.zip(here.as_slice()) {
            *least = least.min(*now);
            *most = most.max(*now);
        }
        self.last = *here;
    }

    /// Whether a joint that is at `here` was seen below it (`side` 1) or above it (-1), by more than half a step.
    pub(crate) fn was_beyond(&self, joint: JointIndex, here: &JointVector, side: i8, step: f64) -> bool {
        let Ok(now) = joint.value(here) else { return false };
        let beyond = if side > 0 {
            joint.value(&self.least).map(|least| now - least)
        } else {
            joint.value(&self.most).map(|most| most - now)
        };
        beyond.is_ok_and(|by| by > step / 2.0 + STILL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joints(values: &[f64]) -> JointVector {
        JointVector::from_slice(values).unwrap()
    }

    #[test]
    fn a_joint_was_seen_on_a_side_or_it_was_not() {
        let all: Vec<JointIndex> = JointIndex::all(3).collect();
        let [first, second, third] = all.as_slice() else { panic!("three joints") };
        let (first, second, third) = (*first, *second, *third);
        let mut manual = ManualMotion::from(&joints(&[1.0, 2.0]));
        let end = joints(&[1.5, 2.0]);
        assert!(manual.has_left(first, &end, 0.1) && !manual.has_left(second, &end, 0.1));
        manual.saw(&joints(&[1.7, 2.0]));
        manual.saw(&end);
        assert!(!manual.has_left(first, &end, 0.1), "it was seen there");
        assert!(manual.was_beyond(first, &end, 1, 0.1), "it began below");
        assert!(manual.was_beyond(first, &end, -1, 0.1), "it was seen above");
        assert!(
            !manual.was_beyond(second, &end, 1, 0.1) && !manual.was_beyond(second, &end, -1, 0.1),
            "it stayed"
        );
        assert!(!manual.was_beyond(first, &end, -1, 0.5), "half a step is no side");
        assert!(!manual.was_beyond(third, &end, 1, 0.1), "nothing is known of it");
        assert!(manual.has_left(third, &end, 0.1), "nothing is known of it");
    }

    #[test]
    fn half_a_step_and_what_a_reading_loses_is_no_way() {
        let joint = JointIndex::all(1).next().unwrap();
        let manual = ManualMotion::from(&joints(&[0.0]));
        for sign in [1.0, -1.0] {
            let left = |by: f64| manual.has_left(joint, &joints(&[sign * by]), 1.0);
            assert!(!left(0.5 + STILL) && left(0.5 + 3.0 * STILL));
            let still = |by: f64| !manual.has_left(joint, &joints(&[sign * by]), 0.0);
            assert!(still(STILL) && !still(3.0 * STILL));
        }
        let beyond = |by: f64, side| manual.was_beyond(joint, &joints(&[by]), side, 1.0);
        assert!(!beyond(0.5 + STILL, 1) && beyond(0.5 + 3.0 * STILL, 1));
        assert!(!beyond(-0.5 - STILL, -1) && beyond(-0.5 - 3.0 * STILL, -1));
    }
}
