//! The time a step takes, by the clock of the cell: a simulated world's runs ahead of the wall's while nobody watches.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// The clock of the cell as one step has seen it go: the times robots reported with their states.
#[derive(Debug, Default)]
pub(crate) struct StepClock {
    /// The first time reported in the step, 0 before any was, ns.
    first: AtomicU64,
    /// The latest, ns.
    latest: AtomicU64,
}

impl StepClock {
    /// A step begins.
    pub(crate) fn restart(&self) {
        self.first.store(0, Ordering::Relaxed);
        self.latest.store(0, Ordering::Relaxed);
    }

    /// Takes in a time a robot reported.
    pub(crate) fn saw(&self, time_ns: u64) {
        // Only the engine's thread writes.
        if self.first.load(Ordering::Relaxed) == 0 {
            self.first.store(time_ns, Ordering::Relaxed);
        }
        self.latest.fetch_max(time_ns, Ordering::Relaxed);
    }

    /// How long the step has taken, as far as robots reported.
    pub(crate) fn elapsed(&self) -> Duration {
        let (first, latest) = (self.first.load(Ordering::Relaxed), self.latest.load(Ordering::Relaxed));
        Duration::from_nanos(latest.saturating_sub(first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_takes_the_time_between_the_states_it_saw() {
        let clock = StepClock::default();
        assert_eq!(clock.elapsed(), Duration::ZERO);
        clock.saw(5_000_000_000);
        clock.saw(7_500_000_000);
        assert_eq!(clock.elapsed(), Duration::from_millis(2500));
        clock.restart();
        assert_eq!(clock.elapsed(), Duration::ZERO);
    }
}
