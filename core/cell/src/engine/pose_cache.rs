//! The poses that robots reported last, for as long as they cannot have changed: over a slow line a reading costs tens of milliseconds,
//! and a step often asks several times in a row.

use std::time::{Duration, Instant};

use plumb_plugin::JointState;

/// How long a pose is taken to hold while nothing is asked of the robot. Shorter than any hand takes to reach its pendant.
const FRESH: Duration = Duration::from_millis(150);

/// The last pose at rest of each robot.
#[derive(Debug, Default)]
pub(crate) struct PoseCache(Vec<(String, JointState, Instant)>);

impl PoseCache {
    /// The pose of a robot, if it reported it a moment ago.
    pub(crate) fn fresh(&self, robot: &str) -> Option<JointState> {
        let fresh =
            |(name, _, seen): &&(String, JointState, Instant)| name == robot && seen.elapsed() < FRESH;
        self.0.iter().find(fresh).map(|(_, state, _)| *state)
    }

    /// Keeps a pose that a robot reported at rest.
    pub(crate) fn saw(&mut self, robot: &str, state: &JointState) {
        self.0.retain(|(name, ..)| name != robot);
        if !state.is_moving() {
            self.0.push((robot.to_owned(), *state, Instant::now()));
        }
    }

    /// Somebody or something else may have moved them, or made them read otherwise.
    pub(crate) fn forget(&mut self) {
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
        let mut cache = PoseCache::default();
        cache.saw("arm", &state(false));
        assert_eq!(cache.fresh("arm"), Some(state(false)));
        assert_eq!(cache.fresh("other"), None);
        cache.forget();
        assert_eq!(cache.fresh("arm"), None);
    }

    #[test]
    fn a_robot_seen_moving_is_looked_at_again() {
        let mut cache = PoseCache::default();
        cache.saw("arm", &state(false));
        cache.saw("arm", &state(true));
        assert_eq!(cache.fresh("arm"), None);
    }
}
