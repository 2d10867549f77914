//! The cell's clock, as this host reads it, and the check that what the plugin dates is dated by it.

use std::io;
use std::path::Path;
use std::time::Duration;

use plumb_plugin::cell_clock::{CellTime, ClockReader};

use super::log_line::monotonic_ns;

/// So much later than now nothing that has happened is dated; less is the jitter of a device that keeps its own clock.
const AHEAD: Duration = Duration::from_secs(1);
/// A device reports what it saw when a long move has ended at the latest. What is older than this is dated by another clock.
const BEHIND: Duration = Duration::from_secs(600);
/// The same in a world whose time jumps over what moves or waits: it jumps an hour at most, and the message is sent after it.
const BEHIND_A_JUMP: Duration = Duration::from_secs(2 * 3600);

/// The cell's clock.
#[derive(Debug, Default)]
pub(crate) struct Clock {
    /// Where a simulated world writes its time; none where the cell's clock is `CLOCK_MONOTONIC`.
    world: Option<ClockReader>,
}

impl Clock {
    /// The clock that a world keeps in this file, or `CLOCK_MONOTONIC`.
    pub(crate) fn of(file: Option<&Path>) -> io::Result<Self> {
        Ok(Self { world: file.map(ClockReader::open).transpose()? })
    }

    /// The time, ns.
    pub(crate) fn now_ns(&self) -> u64 {
        self.time().at(monotonic_ns())
    }

    /// The state of the clock. The file stays open: reading it fails only where the system does, and then the wall's time is the best there is.
    fn time(&self) -> CellTime {
        self.world.as_ref().and_then(|world| world.read().ok()).unwrap_or(CellTime::MONOTONIC)
    }

    /// Why what the device dates so (ns) was evidently not dated by the cell's clock.
    pub(crate) fn mismatch(&self, device: &str, what: &str, time_ns: u64) -> Option<String> {
        let time = self.time();
        mismatch(device, what, time_ns, time, time.at(monotonic_ns()))
    }
}

fn mismatch(device: &str, what: &str, time_ns: u64, time: CellTime, now_ns: u64) -> Option<String> {
    let behind = if matches!(time, CellTime::Stopped { .. }) { BEHIND_A_JUMP } else { BEHIND };
    let (later, earlier) = (time_ns.saturating_sub(now_ns), now_ns.saturating_sub(time_ns));
    let away = if Duration::from_nanos(later) > AHEAD {
        format!("{:.1} s ahead of", later as f64 * 1e-9)
    } else if Duration::from_nanos(earlier) > behind {
        format!("{:.1} s behind", earlier as f64 * 1e-9)
    } else {
        return None;
    };
    Some(format!(
        "the clock of {device} is {away} the clock of the cell: {what} is dated {:.3} s, and now is {:.3} s. Its plugin has to date with its host's `now_ns`",
        time_ns as f64 * 1e-9,
        now_ns as f64 * 1e-9
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000_000;
    const RUNS: CellTime = CellTime::MONOTONIC;
    const STOPPED: CellTime = CellTime::Stopped { at_ns: 0 };

    #[test]
    fn what_was_seen_a_while_ago_is_believed_and_what_another_clock_dates_is_not() {
        let now = 100_000 * SECOND;
        let is_refused =
            |time_ns: u64, time: CellTime| mismatch("eye", "a reading", time_ns, time, now).is_some();
        assert!(!is_refused(now, RUNS));
        assert!(!is_refused(now + SECOND, RUNS));
        assert!(is_refused(now + SECOND + 1, RUNS));
        assert!(!is_refused(now - 600 * SECOND, RUNS));
        assert!(is_refused(now - 601 * SECOND, RUNS));
        // A long motion is over at once in such a world, and its edges are reported afterwards.
        assert!(!is_refused(now - 3600 * SECOND, STOPPED));
        assert!(is_refused(now - 7201 * SECOND, STOPPED));
    }

    #[test]
    fn both_clocks_and_how_far_they_are_apart_are_reported() {
        let message = mismatch("camera", "`frames`", SECOND, RUNS, 90_001 * SECOND).unwrap();
        assert!(
            message.starts_with("the clock of camera is 90000.0 s behind the clock of the cell"),
            "{message}"
        );
        assert!(message.contains("`frames` is dated 1.000 s, and now is 90001.000 s"), "{message}");
    }
}
