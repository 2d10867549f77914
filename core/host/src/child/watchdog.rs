//! Ends the host when a call of the plugin is still running after its time.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use plumb_plugin::LogLevel;

use super::ending::end_at_once;
use crate::channel::exit_code;
use crate::context::Context;

/// Looks at the call under way.
pub(super) struct Watchdog {
    seen: Mutex<Seen>,
    changed: Condvar,
    grace: Duration,
}

/// What the watchdog looks at, and when it looks again unasked.
///
/// It is woken only by a call that must end before that: waking it with every call cost more than all else that a host does with a request.
struct Seen {
    running: Option<Running>,
    next_look: Instant,
}

struct Running {
    name: &'static str,
    limit: Duration,
    end: Instant,
}

impl Watchdog {
    /// Starts the thread that looks, and ends the host when a call runs for more than `grace` past its time limit.
    pub(super) fn start(context: &'static Context, grace: Duration) -> &'static Self {
        Self::start_with(grace, move |name, limit| {
            let text = format!("the plugin is still in '{name}' after its {limit:?}: the host ends");
            context.announce(LogLevel::Error, &text);
            end_at_once(context, exit_code::WATCHDOG);
        })
    }

    /// The same with something else to do about a call past its time: it is given the call's name and time limit.
    fn start_with(
        grace: Duration,
        overrun: impl Fn(&'static str, Duration) + Send + 'static,
    ) -> &'static Self {
        let seen = Seen { running: None, next_look: Instant::now() };
        let watchdog: &'static Self =
            Box::leak(Box::new(Self { seen: Mutex::new(seen), changed: Condvar::new(), grace }));
        thread::spawn(move || watchdog.look(overrun));
        watchdog
    }

    /// Does the work of one call under watch.
    pub(super) fn watch<R>(&self, name: &'static str, limit: Duration, work: impl FnOnce() -> R) -> R {
        let end = Instant::now() + longest_run(limit, self.grace);
        let mut seen = self.seen();
        seen.running = Some(Running { name, limit, end });
        let is_seen_in_time = seen.next_look <= end;
        drop(seen);
        if !is_seen_in_time {
            self.changed.notify_one();
        }
        let result = work();
        self.seen().running = None;
        result
    }

    fn look(&self, overrun: impl Fn(&'static str, Duration)) {
        let mut seen = self.seen();
        loop {
            let now = Instant::now();
            if let Some(call) = seen.running.take_if(|call| call.end <= now) {
                drop(seen);
                overrun(call.name, call.limit);
                seen = self.seen();
            }
            let end = seen.running.as_ref().map_or(now + UNASKED, |call| call.end);
            seen.next_look = end.min(now + UNASKED);
            let wait = seen.next_look - now;
            seen = self.changed.wait_timeout(seen, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How long a call of a time limit may run before the host ends itself.
fn longest_run(limit: Duration, grace: Duration) -> Duration {
    limit.min(LONGEST) + grace
}

/// How long it goes without looking when nothing asks it to.
const UNASKED: Duration = Duration::from_secs(1);

/// A time limit that never ends; longer ones cannot be added to a time.
const LONGEST: Duration = Duration::from_secs(365 * 24 * 3600);

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, channel};

    #[test]
    fn a_call_may_run_for_its_limit_and_the_grace_and_not_longer() {
        let grace = Duration::from_secs(1);
        assert_eq!(longest_run(Duration::from_millis(1500), grace), Duration::from_millis(2500));
        assert_eq!(longest_run(Duration::ZERO, grace), grace);
        assert_eq!(longest_run(Duration::MAX, grace), LONGEST + grace, "no overflow");
        assert_eq!(LONGEST, Duration::from_secs(31_536_000), "a year");
    }

    /// A watchdog that reports what it would end, and has just looked: it looks again unasked in a second.
    fn watchdog() -> (&'static Watchdog, Receiver<(&'static str, Duration)>) {
        let (report, reported) = channel();
        let report = Mutex::new(report);
        let watchdog = Watchdog::start_with(Duration::from_millis(20), move |name, limit| {
            let _ = report.lock().unwrap().send((name, limit));
        });
        thread::sleep(Duration::from_millis(50));
        (watchdog, reported)
    }

    #[test]
    fn a_call_past_its_time_is_noticed_without_waiting_for_the_next_look() {
        let (watchdog, reported) = watchdog();
        let limit = Duration::from_millis(100);
        // The call lasts until it is noticed, and less long than the time to the next look, or than ten times its limit.
        let noticed = watchdog.watch("move", limit, || reported.recv_timeout(Duration::from_millis(700)));
        assert_eq!(noticed, Ok(("move", limit)));
    }

    #[test]
    fn a_call_within_its_time_is_let_be() {
        let (watchdog, reported) = watchdog();
        let result = watchdog.watch("read", Duration::from_millis(1500), || {
            thread::sleep(Duration::from_millis(1200));
            7
        });
        assert_eq!(result, 7);
        assert_eq!(watchdog.watch("read", Duration::from_millis(10), || 8), 8);
        assert!(reported.recv_timeout(Duration::from_millis(200)).is_err());
    }
}
