//! Which times can be those of a cell's clock, and how long calls may take.

use std::time::{Duration, Instant};

use crate::PluginError;

/// The cell's clock counts from a start of the machine or of a simulated world. It passes this after 31 years; the time of day, counted from 1970,
/// passed it in 2001.
const TIME_OF_DAY_NS: u64 = 1_000_000_000_000_000_000;

/// How long a call of a plugin may take that moves nothing, unless its manifest gives its readings more.
pub const CALL_WITHIN: Duration = Duration::from_secs(5);

/// What is wrong with a time, as the end of a sentence.
pub(super) fn wrong_time(time_ns: u64) -> Option<String> {
    match time_ns {
        0 => Some("is 0: take it from the host's clock (now_ns) when the value is measured".to_owned()),
        TIME_OF_DAY_NS.. => Some(format!(
            "is {time_ns} ns, the time of day: take it from the host's clock (now_ns, CLOCK_MONOTONIC)"
        )),
        _ => None,
    }
}

/// Does one call; an error when it took longer than it may.
pub(super) fn within<T>(
    limit: Duration,
    what: &str,
    call: impl FnOnce() -> Result<T, PluginError>,
) -> Result<T, PluginError> {
    let begin = Instant::now();
    let result = call();
    let took = begin.elapsed();
    if took > limit {
        return Err(PluginError::TimedOut(format!(
            "'{what}' took {:.1} s; it may take {:.1} s, and its host would have been ended",
            took.as_secs_f64(),
            limit.as_secs_f64()
        )));
    }
    result
}
