//! The world's time as the cell's clock: worlds count from their beginning, cells date by `CLOCK_MONOTONIC` or ahead of it.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};
use plumb_plugin::cell_clock::{CellTime, ClockWriter};

use crate::protocol::Pace;

/// The file beside a world's socket in which it gives the cell's time ([`plumb_plugin::cell_clock`]).
pub fn clock_file(socket: &Path) -> PathBuf {
    let mut name = socket.as_os_str().to_owned();
    name.push(".clock");
    PathBuf::from(name)
}

/// The cell's clock, as its world drives it.
///
/// In `real` pace it runs with `CLOCK_MONOTONIC`; kernels date pictures and edges with that. In `fast` pace it is stopped, and jumps with the world.
#[derive(Debug)]
pub(super) struct WorldClock {
    file: ClockWriter,
    reported: CellTime,
    /// What is added to the world's own time, ns: set at its beginning and never changed.
    shift_ns: u64,
}

impl WorldClock {
    /// A clock that is `CLOCK_MONOTONIC` now, when the world's own time is `world_ns`.
    ///
    /// # Errors
    /// What the system says of the file.
    pub(super) fn start(file: &Path, world_ns: u64) -> io::Result<Self> {
        let reported = CellTime::MONOTONIC;
        let shift_ns = monotonic_ns().saturating_sub(world_ns);
        Ok(Self { file: ClockWriter::create(file, reported)?, reported, shift_ns })
    }

    /// A moment of the world's own time as the cell dates it, ns.
    pub(super) fn dated(&self, world_ns: u64) -> u64 {
        world_ns.saturating_add(self.shift_ns)
    }

    /// The world's own time now where the clock runs with the wall, ns; none where it is stopped.
    pub(super) fn world_ns(&self) -> Option<u64> {
        match self.reported {
            CellTime::Runs { .. } => Some(self.reported.at(monotonic_ns()).saturating_sub(self.shift_ns)),
            CellTime::Stopped { .. } => None,
        }
    }

    /// Goes on at another pace from where the world's own time is `world_ns`.
    pub(super) fn set(&mut self, pace: Pace, world_ns: u64) {
        let at_ns = self.dated(world_ns);
        let time = match (pace, self.reported) {
            (Pace::Fast, _) => CellTime::Stopped { at_ns },
            (Pace::Real, runs @ CellTime::Runs { .. }) => runs,
            (Pace::Real, CellTime::Stopped { .. }) => {
                CellTime::Runs { ahead_ns: at_ns.wrapping_sub(monotonic_ns()).cast_signed() }
            }
        };
        self.publish(time);
    }

    /// Reports that the world's own time is `world_ns`, where that is not known from the wall's.
    pub(super) fn stopped_at(&mut self, world_ns: u64) {
        if matches!(self.reported, CellTime::Stopped { .. }) {
            self.publish(CellTime::Stopped { at_ns: self.dated(world_ns) });
        }
    }

    fn publish(&mut self, time: CellTime) {
        if time == self.reported {
            return;
        }
        self.reported = time;
        if let Err(error) = self.file.write(time) {
            // Devices go on dating with the time reported last; what comes of that is noticed where their times are compared.
            eprintln!("the cell's time cannot be written: {error}");
        }
    }
}

/// `CLOCK_MONOTONIC`, ns; 0 where the system has no such clock.
fn monotonic_ns() -> u64 {
    clock_gettime(ClockId::CLOCK_MONOTONIC)
        .map_or(0, |time| Duration::from(time).as_nanos().try_into().unwrap_or(u64::MAX))
}
