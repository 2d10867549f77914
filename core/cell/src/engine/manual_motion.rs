//! What is seen of a robot's joints while a person moves them.

use plumb_plugin::JointVector;

/// Two readings of a joint that stands still differ by no more than this, rad or mm, where its drive has no steps.
const STILL: f64 = 1e-9;

/// The readings of the joints since a person was given the robot, in the drive's order and its numbers, rad or mm.
#[derive(Debug)]
pub(crate) struct ManualMotion {
    last: JointVector,
    least: JointVector,
    most: JointVector,
}

impl ManualMotion {
    /// A person is given a robot that stands at `here`.
    pub(crate) fn from(here: &JointVector) -> Self {
        Self { last: *here, least: *here, most: *here }
    }

    /// Whether a joint stands elsewhere than it was seen last. `step` is the smallest of its drive.
    pub(crate) fn has_left(&self, column: usize, here: &JointVector, step: f64) -> bool {
        match (self.last.get(column), here.get(column)) {
            (Some(last), Some(now)) => (now - last).abs() > step / 2.0 + STILL,
            _ => false,
        }
    }

    /// Takes in where the joints stand now.
    pub(crate) fn saw(&mut self, here: &JointVector) {
        for (column, now) in here.as_slice().iter().enumerate() {
            if let Some(least) = self.least.get(column) {
                self.least.set(column, least.min(*now));
            }
            if let Some(most) = self.most.get(column) {
                self.most.set(column, most.max(*now));
            }
        }
        self.last = *here;
    }

    /// Whether a joint that stands at `here` was seen below it (`side` 1) or above it (-1), by more than half a step.
    pub(crate) fn was_beyond(&self, column: usize, here: &JointVector, side: i8, step: f64) -> bool {
        let Some(now) = here.get(column) else { return false };
        let beyond = if side > 0 {
            self.least.get(column).map(|least| now - least)
        } else {
            self.most.get(column).map(|most| most - now)
        };
        beyond.is_some_and(|by| by > step / 2.0 + STILL)
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
        let mut manual = ManualMotion::from(&joints(&[1.0, 2.0]));
        let end = joints(&[1.5, 2.0]);
        assert!(manual.has_left(0, &end, 0.1) && !manual.has_left(1, &end, 0.1));
        manual.saw(&joints(&[1.7, 2.0]));
        manual.saw(&end);
        assert!(!manual.has_left(0, &end, 0.1), "it was seen there");
        assert!(manual.was_beyond(0, &end, 1, 0.1), "it began below");
        assert!(manual.was_beyond(0, &end, -1, 0.1), "it was seen above");
        assert!(!manual.was_beyond(1, &end, 1, 0.1) && !manual.was_beyond(1, &end, -1, 0.1), "it stayed");
        assert!(!manual.was_beyond(0, &end, -1, 0.5), "half a step is no side");
        assert!(!manual.was_beyond(9, &end, 1, 0.1), "there is no such joint");
    }
}
