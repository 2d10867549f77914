//! Ends the host when a call of the plugin is still running after its time.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use plumb_plugin::LogLevel;

use super::Context;
use super::serve::end_at_once;
use crate::channel::exit_code;

/// Looks at the call under way.
pub(super) struct Watchdog {
    running: Mutex<Option<Running>>,
    changed: Condvar,
    grace: Duration,
}

struct Running {
    name: &'static str,
    limit: Duration,
    end: Instant,
}

impl Watchdog {
    /// Starts the thread that looks. A call may run for `grace` past its time limit.
    pub(super) fn start(context: &'static Context, grace: Duration) -> &'static Self {
        let watchdog: &'static Self =
            Box::leak(Box::new(Self { running: Mutex::new(None), changed: Condvar::new(), grace }));
        thread::spawn(move || watchdog.look(context));
        watchdog
    }

    /// Does the work of one call under watch.
    pub(super) fn watch<R>(&self, name: &'static str, limit: Duration, work: impl FnOnce() -> R) -> R {
        let end = Instant::now() + limit.min(LONGEST) + self.grace;
        *self.running() = Some(Running { name, limit, end });
        self.changed.notify_one();
        let result = work();
        *self.running() = None;
        result
    }

    fn look(&self, context: &'static Context) {
        let mut running = self.running();
        loop {
            let left = running.as_ref().map(|call| call.end.saturating_duration_since(Instant::now()));
            running = match (left, &*running) {
                (Some(Duration::ZERO), Some(call)) => {
                    let (name, limit) = (call.name, call.limit);
                    let text = format!("the plugin is still in '{name}' after its {limit:?}: the host ends");
                    drop(running);
                    context.report(LogLevel::Error, &text);
                    end_at_once(context, exit_code::WATCHDOG);
                }
                (Some(left), _) => {
                    self.changed.wait_timeout(running, left).unwrap_or_else(PoisonError::into_inner).0
                }
                (None, _) => self.changed.wait(running).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    fn running(&self) -> MutexGuard<'_, Option<Running>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A time limit that never ends; longer ones cannot be added to a time.
const LONGEST: Duration = Duration::from_secs(365 * 24 * 3600);
