//! The pose at which a line of this computer changed: between the two states of the joints that the robot reported before and after.

use std::collections::VecDeque;

use plumb_plugin::{DigitalInputs, JointState, JointVector};

use crate::gpio::LineEdge;

/// The changes that wait for the robot to report where it was, and where it was last.
#[derive(Debug)]
pub(crate) struct PoseOfEdge {
    before: Option<JointState>,
    waiting: VecDeque<LineEdge>,
    level: bool,
}

impl PoseOfEdge {
    /// Of a line that has this level.
    pub(crate) fn new(level: bool) -> Self {
        Self { before: None, waiting: VecDeque::new(), level }
    }

    /// A change, in the order of their times.
    pub(crate) fn changed(&mut self, edge: LineEdge) {
        self.waiting.push_back(edge);
    }

    /// Takes in where the joints were, and gives the changes up to then with their poses, and at last the level there.
    ///
    /// All changes up to the time of `state` must have been reported. A change before the first state has no pose: it only sets the level.
    pub(crate) fn joints(&mut self, state: &JointState) -> Vec<DigitalInputs> {
        let mut messages = Vec::new();
        while let Some(edge) = self.waiting.pop_front_if(|edge| edge.time_ns <= state.time_ns) {
            // The line was at that level already when it was first looked at.
            if edge.level == self.level {
                continue;
            }
            self.level = edge.level;
            if let Some(before) = &self.before {
                let (joints, joints_half_width) = middle(&before.joints, &state.joints);
                messages.push(DigitalInputs {
                    time_ns: edge.time_ns,
                    levels: u64::from(edge.level),
                    changed: 1,
                    joints,
                    joints_half_width,
                    ..DigitalInputs::default()
                });
            }
        }
        messages.push(DigitalInputs {
            time_ns: state.time_ns,
            levels: u64::from(self.level),
            joints: state.joints,
            joints_half_width: JointVector::zeros(state.joints.len()),
            ..DigitalInputs::default()
        });
        self.before = Some(*state);
        messages
    }

    /// Messages of the robot were lost: where it was last is not known.
    pub(crate) fn forget(&mut self) {
        self.before = None;
    }
}

/// The middle between two poses, and how far it may be from any pose between them.
fn middle(from: &JointVector, to: &JointVector) -> (JointVector, JointVector) {
    let (mut middle, mut half_width) = (*to, *to);
    for joint in 0..to.len() {
        let (from, to) = (from.get(joint).unwrap_or_default(), to.get(joint).unwrap_or_default());
        middle.set(joint, (from + to) / 2.0);
        half_width.set(joint, (to - from).abs() / 2.0);
    }
    (middle, half_width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(time_ns: u64, joint: f64) -> JointState {
        JointState::new(time_ns, JointVector::from_slice(&[joint]).unwrap(), true)
    }

    fn fields_of(messages: &[DigitalInputs]) -> Vec<(u64, u64, u64, f64, f64)> {
        let one = |vector: &JointVector| vector.get(0).unwrap();
        messages
            .iter()
            .map(|message| {
                (
                    message.time_ns,
                    message.levels,
                    message.changed,
                    one(&message.joints),
                    one(&message.joints_half_width),
                )
            })
            .collect()
    }

    #[test]
    fn a_change_happened_between_the_states_before_and_after_it() {
        let mut poses = PoseOfEdge::new(false);
        assert_eq!(fields_of(&poses.joints(&state(10, 1.0))), [(10, 0, 0, 1.0, 0.0)]);
        poses.changed(LineEdge { time_ns: 14, level: true });
        poses.changed(LineEdge { time_ns: 25, level: false });
        assert_eq!(fields_of(&poses.joints(&state(20, 2.0))), [(14, 1, 1, 1.5, 0.5), (20, 1, 0, 2.0, 0.0)]);
        assert_eq!(
            fields_of(&poses.joints(&state(30, 2.2))),
            [(25, 0, 1, 2.1, 0.100_000_000_000_000_09), (30, 0, 0, 2.2, 0.0)]
        );
    }

    #[test]
    fn a_change_before_the_robot_was_heard_of_only_sets_the_level() {
        let mut poses = PoseOfEdge::new(false);
        poses.changed(LineEdge { time_ns: 5, level: true });
        assert_eq!(fields_of(&poses.joints(&state(10, 1.0))), [(10, 1, 0, 1.0, 0.0)]);
    }

    #[test]
    fn a_change_to_the_level_it_has_is_none() {
        let mut poses = PoseOfEdge::new(true);
        poses.joints(&state(10, 1.0));
        poses.changed(LineEdge { time_ns: 12, level: true });
        assert_eq!(fields_of(&poses.joints(&state(20, 2.0))), [(20, 1, 0, 2.0, 0.0)]);
    }
}
