//! Whether a stop is asked for: set at any time by another thread, done by the one that calls the plugin.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Whether a stop has been asked for, and whether it has been done.
///
/// It stays asked for until the device is activated again: what was queued behind it is refused, not done late.
#[derive(Default)]
pub(crate) struct StopFlag {
    asked: AtomicBool,
    rounds: Mutex<Rounds>,
}

#[derive(Default)]
struct Rounds {
    asked: u64,
    done: u64,
}

impl StopFlag {
    /// Asks for a stop.
    pub(crate) fn ask(&self) {
        let mut rounds = self.rounds();
        rounds.asked += 1;
        self.asked.store(true, Ordering::Release);
    }

    /// Whether one has been asked for and not been taken back by an activation: what the plugin's `should_stop` reads.
    pub(crate) fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Acquire)
    }

    /// The stop that is still to be done.
    pub(crate) fn pending(&self) -> Option<u64> {
        let rounds = self.rounds();
        (rounds.asked != rounds.done).then_some(rounds.asked)
    }

    /// A stop has been done, and with it all asked for before.
    pub(crate) fn done(&self, round: u64) {
        self.rounds().done = round;
    }

    /// Takes the stop back, unless one is still to be done: then it stays, and this is false.
    pub(crate) fn take_back(&self) -> bool {
        let rounds = self.rounds();
        let done = rounds.asked == rounds.done;
        if done {
            self.asked.store(false, Ordering::Release);
        }
        done
    }

    fn rounds(&self) -> MutexGuard<'_, Rounds> {
        self.rounds.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_stays_asked_for_until_it_was_done_and_taken_back() {
        let stop = StopFlag::default();
        assert!(!stop.is_asked());
        stop.ask();
        assert!(stop.is_asked());
        assert!(!stop.take_back());
        assert!(stop.is_asked());
        stop.done(stop.pending().unwrap());
        assert!(stop.is_asked());
        assert!(stop.take_back());
        assert!(!stop.is_asked());
    }

    #[test]
    fn a_stop_asked_for_while_another_is_done_is_not_forgotten() {
        let stop = StopFlag::default();
        stop.ask();
        let round = stop.pending().unwrap();
        stop.ask();
        stop.done(round);
        assert!(stop.pending().is_some());
        assert!(!stop.take_back());
    }
}
