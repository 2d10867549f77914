//! How old a state is, by the controller's own times.

use std::time::Instant;

/// How much faster or slower the controller's clock may run than this computer's: ten times what quartzes differ by.
const DRIFT: f64 = 1e-3;

/// What the controller's clock shows when this computer's shows what: the least time a state was ever on its way, forgotten as fast as clocks drift apart.
#[derive(Debug)]
pub(crate) struct ClockOffset {
    origin: Instant,
    /// What is added to a time of the controller's, s; none before the first state.
    offset: Option<f64>,
    last_timestamp: f64,
}

/// A state that came with a time before the one before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WentBack {
    /// s.
    pub(crate) by: f64,
}

impl ClockOffset {
    pub(crate) fn new(origin: Instant) -> Self {
        Self { origin, offset: None, last_timestamp: f64::NEG_INFINITY }
    }

    /// A state of this time has arrived: when it was true, in s since the origin.
    ///
    /// # Errors
    /// [`WentBack`]: the controller was started anew.
    pub(crate) fn arrived(&mut self, timestamp: f64, at: Instant) -> Result<f64, WentBack> {
        let arrival = at.saturating_duration_since(self.origin).as_secs_f64();
        if timestamp < self.last_timestamp {
            return Err(WentBack { by: self.last_timestamp - timestamp });
        }
        let passed = (timestamp - self.last_timestamp).min(arrival);
        let seen = arrival - timestamp;
        let offset = self.offset.map_or(seen, |offset| (offset + DRIFT * passed).min(seen));
        self.offset = Some(offset);
        self.last_timestamp = timestamp;
        Ok(timestamp + offset)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn age(clock: &mut ClockOffset, origin: Instant, timestamp: f64, arrival: f64) -> f64 {
        let true_at = clock.arrived(timestamp, origin + Duration::from_secs_f64(arrival)).unwrap();
        arrival - true_at
    }

    #[test]
    fn what_comes_late_or_repeats_is_as_old_as_it_is() {
        let origin = Instant::now();
        let mut clock = ClockOffset::new(origin);
        assert!(age(&mut clock, origin, 100.0, 1.0).abs() < 1e-9);
        assert!(age(&mut clock, origin, 100.008, 1.0081).abs() < 2e-4);
        // Late by 0.8 s, then the same time over and over.
        assert!((age(&mut clock, origin, 100.016, 1.816) - 0.8).abs() < 2e-3);
        assert!((age(&mut clock, origin, 100.016, 2.816) - 1.8).abs() < 2e-3);
        // In time again.
        assert!(age(&mut clock, origin, 102.0, 3.0).abs() < 4e-3);
    }

    #[test]
    fn clocks_that_drift_apart_do_not_make_states_old() {
        let origin = Instant::now();
        let mut clock = ClockOffset::new(origin);
        let oldest = (1..2000).map(|second| {
            let second = f64::from(second);
            // The controller's clock loses 100 ms in 1000 s.
            age(&mut clock, origin, second * 0.9999, second)
        });
        assert!(oldest.fold(0.0, f64::max) < 1e-3);
    }

    #[test]
    fn a_controller_that_was_started_anew_is_noticed() {
        let origin = Instant::now();
        let mut clock = ClockOffset::new(origin);
        clock.arrived(50.0, origin).unwrap();
        assert_eq!(clock.arrived(2.0, origin), Err(WentBack { by: 48.0 }));
    }
}
