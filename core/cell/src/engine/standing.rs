//! Where robots stand, for as long as that cannot have changed: over a slow line a reading costs tens of milliseconds, and a step often asks
//! several times in a row.

use std::time::{Duration, Instant};

use plumb_plugin::JointState;

/// How long a robot that nothing was asked of is taken to stand as it was seen. Shorter than any hand is at its pendant.
const STILL_SO: Duration = Duration::from_millis(150);

/// Where robots were last seen to stand.
#[derive(Debug, Default)]
pub(super) struct Standing(Vec<(String, JointState, Instant)>);

impl Standing {
    /// Where the robot stands, if it was seen to a moment ago.
    pub(super) fn of(&self, robot: &str) -> Option<JointState> {
        let fresh =
            |(name, _, seen): &&(String, JointState, Instant)| name == robot && seen.elapsed() < STILL_SO;
        self.0.iter().find(fresh).map(|(_, state, _)| *state)
    }

    /// Takes in where the robot was seen.
    pub(super) fn saw(&mut self, robot: &str, state: &JointState) {
        self.0.retain(|(name, ..)| name != robot);
        if !state.is_moving() {
            self.0.push((robot.to_owned(), *state, Instant::now()));
        }
    }

    /// Somebody or something else may have moved them, or made them read otherwise.
    pub(super) fn forget(&mut self) {
        self.0.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::JointVector;

    fn state(moving: bool) -> JointState {
        JointState::new(1, JointVector::zeros(1), moving)
    }

    #[test]
    fn a_robot_just_seen_at_rest_is_where_it_was_until_that_is_forgotten() {
        let mut standing = Standing::default();
        standing.saw("arm", &state(false));
        assert_eq!(standing.of("arm"), Some(state(false)));
        assert_eq!(standing.of("other"), None);
        standing.forget();
        assert_eq!(standing.of("arm"), None);
    }

    #[test]
    fn a_robot_seen_moving_is_looked_at_again() {
        let mut standing = Standing::default();
        standing.saw("arm", &state(false));
        standing.saw("arm", &state(true));
        assert_eq!(standing.of("arm"), None);
    }
}
