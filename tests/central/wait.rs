//! Waiting for a condition, with a limit.

use std::time::{Duration, Instant};

pub(crate) fn wait_until(what: &str, longest: Duration, mut holds: impl FnMut() -> bool) -> Duration {
    let begin = Instant::now();
    while !holds() {
        assert!(begin.elapsed() < longest, "not within {longest:?}: {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
    begin.elapsed()
}
