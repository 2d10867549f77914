//! The time in which the emulated controller ran.

use std::time::{Duration, Instant};

/// A cycle that takes longer than this was held up: a real controller's never does, a busy computer's may. Ten cycles.
const HELD_UP: Duration = Duration::from_millis(20);

/// The time in which the controller ran. A pause of the whole computer does not count: a real controller would have heard its client all the while.
#[derive(Debug, Default)]
pub(super) struct RunningTime {
    seconds: f64,
    last_cycle: Option<Instant>,
}

impl RunningTime {
    /// A cycle begins.
    pub(super) fn cycle(&mut self, now: Instant) {
        let passed = self.last_cycle.map_or(Duration::ZERO, |last| now.saturating_duration_since(last));
        self.seconds += passed.min(HELD_UP).as_secs_f64();
        self.last_cycle = Some(now);
    }

    /// How long it has run, s.
    pub(super) fn seconds(&self) -> f64 {
        self.seconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pause_of_the_computer_counts_as_one_cycle_that_was_held_up() {
        let begin = Instant::now();
        let mut time = RunningTime::default();
        for milliseconds in [0, 2, 4, 10, 1010, 1012] {
            time.cycle(begin + Duration::from_millis(milliseconds));
        }
        assert!((time.seconds() - 0.032).abs() < 1e-9, "{}", time.seconds());
    }
}
