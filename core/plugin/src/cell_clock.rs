//! The one clock of a cell, as its hosts and a simulated world share it.
//!
//! Everything in a cell is dated by one clock. Usually that is `CLOCK_MONOTONIC`. A simulated world that runs faster than the wall has a time of its own;
//! it keeps that time in a small file, from which the hosts of the cell's devices read what [`Host::now_ns`](crate::Host::now_ns) says. So a driver of
//! a real controller, an emulated controller behind it and a simulated sensor agree, whatever the pace.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt as _;
use std::path::Path;

/// The relation of the cell's clock to `CLOCK_MONOTONIC`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellTime {
    /// It runs with `CLOCK_MONOTONIC`, ahead of it by so many ns.
    Runs {
        /// ns; below 0 where it is behind.
        ahead_ns: i64,
    },
    /// It is there until something in the world moves.
    Stopped {
        /// ns.
        at_ns: u64,
    },
}

impl CellTime {
    /// `CLOCK_MONOTONIC` itself: the clock of a cell without a simulated world.
    pub const MONOTONIC: Self = Self::Runs { ahead_ns: 0 };

    /// The cell's time, ns, at a moment of `CLOCK_MONOTONIC`, ns.
    pub fn at(self, monotonic_ns: u64) -> u64 {
        match self {
            Self::Runs { ahead_ns } => monotonic_ns.saturating_add_signed(ahead_ns),
            Self::Stopped { at_ns } => at_ns,
        }
    }

    fn words(self) -> [u64; 2] {
        match self {
            Self::Runs { ahead_ns } => [RUNS, ahead_ns.cast_unsigned()],
            Self::Stopped { at_ns } => [STOPPED, at_ns],
        }
    }
}

/// First word of a file whose clock runs, `plumbrun`.
const RUNS: u64 = u64::from_le_bytes(*b"plumbrun");
/// First word of a file whose clock is stopped, `plumbat:`.
const STOPPED: u64 = u64::from_le_bytes(*b"plumbat:");

/// Two words and a third one by which a reader notices a text that is being written.
const LENGTH: usize = 24;

/// How often a reader looks again at a file that is being written.
const LOOKS: usize = 10_000;

/// The world's end of the file.
#[derive(Debug)]
pub struct ClockWriter {
    file: File,
}

impl ClockWriter {
    /// A file at `path`, in place of one that lies there, that says `time`.
    ///
    /// # Errors
    /// What the system says.
    pub fn create(path: &Path, time: CellTime) -> io::Result<Self> {
        let writer = Self { file: File::create(path)? };
        writer.write(time)?;
        Ok(writer)
    }

    /// Says the state of the clock from now on.
    ///
    /// # Errors
    /// What the system says.
    pub fn write(&self, time: CellTime) -> io::Result<()> {
        let [kind, value] = time.words();
        let mut text = [0; LENGTH];
        for (bytes, word) in text.chunks_exact_mut(8).zip([kind, value, check_word(kind, value)]) {
            bytes.copy_from_slice(&word.to_le_bytes());
        }
        self.file.write_all_at(&text, 0)
    }
}

/// A host's end of the file.
#[derive(Debug)]
pub struct ClockReader {
    file: File,
}

impl ClockReader {
    /// Opens the file that the world keeps.
    ///
    /// # Errors
    /// What the system says, or that the file is none of a clock.
    pub fn open(path: &Path) -> io::Result<Self> {
        let reader = Self { file: File::open(path)? };
        reader.read()?;
        Ok(reader)
    }

    /// The state of the clock now.
    ///
    /// # Errors
    /// What the system says, or that the file is none of a clock.
    pub fn read(&self) -> io::Result<CellTime> {
        for _ in 0..LOOKS {
            let mut text = [0; LENGTH];
            self.file.read_exact_at(&mut text, 0)?;
            let mut words = text.chunks_exact(8).map(|word| word.try_into().map_or(0, u64::from_le_bytes));
            let (kind, value, check) =
                (words.next().unwrap_or(0), words.next().unwrap_or(0), words.next().unwrap_or(0));
            match kind {
                _ if check != check_word(kind, value) => {}
                RUNS => return Ok(CellTime::Runs { ahead_ns: value.cast_signed() }),
                STOPPED => return Ok(CellTime::Stopped { at_ns: value }),
                _ => break,
            }
        }
        Err(io::Error::new(io::ErrorKind::InvalidData, "this file does not tell a cell's time"))
    }
}

fn check_word(kind: u64, value: u64) -> u64 {
    !(kind ^ value.rotate_left(17))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_runs_and_one_that_is_stopped_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clock");
        let writer = ClockWriter::create(&path, CellTime::MONOTONIC).unwrap();
        let reader = ClockReader::open(&path).unwrap();
        assert_eq!(reader.read().unwrap().at(70), 70);
        for time in [CellTime::Runs { ahead_ns: -30 }, CellTime::Stopped { at_ns: 5 }] {
            writer.write(time).unwrap();
            assert_eq!(reader.read().unwrap(), time);
        }
        assert_eq!(CellTime::Runs { ahead_ns: -30 }.at(70), 40);
        assert_eq!(CellTime::Stopped { at_ns: 5 }.at(70), 5);
    }

    #[test]
    fn a_file_that_is_no_clock_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clock");
        std::fs::write(&path, "short").unwrap();
        assert!(ClockReader::open(&path).is_err());
        std::fs::write(&path, [7; 64]).unwrap();
        assert!(ClockReader::open(&path).unwrap_err().to_string().contains("does not tell a cell's time"));
    }

    #[test]
    fn a_reader_never_sees_half_of_what_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("clock");
        let writer = ClockWriter::create(&path, CellTime::Stopped { at_ns: 0 }).unwrap();
        let reader = ClockReader::open(&path).unwrap();
        std::thread::scope(|scope| {
            scope.spawn(|| {
                for step in 0..20_000_u64 {
                    // Both halves of the value change at once.
                    writer.write(CellTime::Stopped { at_ns: (step << 32) | step }).unwrap();
                }
            });
            for _ in 0..20_000 {
                let at_ns = reader.read().unwrap().at(0);
                assert_eq!(at_ns >> 32, at_ns & 0xffff_ffff);
            }
        });
    }
}
