//! A stop with a path of its own, which no request can delay.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use plumb_bus::{Listener, OpenError, Signal};

use super::shared::Shared;
use crate::signal_names::{stop_signal, stopped_signal};

/// Stops a device, from any thread and whatever else is being asked of it. It has a signal of its own that nothing queues on; a host that does
/// not confirm in time is killed.
pub struct StopHandle {
    shared: Arc<Shared>,
    signal: Signal,
    confirmed: Mutex<Listener>,
}

/// What became of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopOutcome {
    /// The device confirmed that it is at rest.
    Stopped {
        /// How long that took.
        after: Duration,
    },
    /// It did not confirm in time: its host was killed. What the device itself does now, only its own controller knows.
    Killed,
    /// Its host had ended before.
    HostGone,
}

impl StopHandle {
    pub(super) fn open(shared: Arc<Shared>) -> Result<Self, OpenError> {
        let signal = shared.bus.signal(&stop_signal(&shared.device))?;
        let confirmed = Mutex::new(shared.bus.listener(&stopped_signal(&shared.device))?);
        Ok(Self { shared, signal, confirmed })
    }

    /// The device's name.
    pub fn device(&self) -> &str {
        &self.shared.device
    }

    /// Requests a stop without waiting. To stop several devices, request it of all of them first and then [`Self::stop`] each.
    pub fn request(&self) {
        if let Err(error) = self.signal.notify() {
            tracing::error!(device = self.device(), "the stop cannot be sent: {error}");
        }
    }

    /// Stops, waits until the device confirms that it is at rest, and kills its host when it has not within `limit`.
    pub fn stop(&self, limit: Duration) -> StopOutcome {
        let begin = Instant::now();
        let confirmed = self.confirmed.lock().unwrap_or_else(PoisonError::into_inner);
        // An old confirmation is not one of this stop.
        let _ = confirmed.drain();
        self.request();
        loop {
            if self.shared.end().is_some() {
                return StopOutcome::HostGone;
            }
            let left = limit.saturating_sub(begin.elapsed());
            if left.is_zero() {
                self.shared.kill("it did not confirm a stop in time");
                return StopOutcome::Killed;
            }
            match confirmed.wait(left.min(END_CHECK)) {
                Ok(0) => {}
                Ok(_) => return StopOutcome::Stopped { after: begin.elapsed() },
                Err(error) => {
                    tracing::error!(
                        device = self.device(),
                        "the stop's confirmation cannot be received: {error}"
                    );
                    self.shared.kill("the confirmation of a stop could not be received");
                    return StopOutcome::Killed;
                }
            }
        }
    }
}

/// How often a waiting stop looks whether the host has ended.
const END_CHECK: Duration = Duration::from_millis(20);
