//! Runs: the stretches of lit pixels of every row.

use super::Image;

mod scan;

pub use scan::{InstructionSet, instruction_set};

/// A stretch of lit pixels in one row: `start` is lit, `end` is the first that is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// The first lit pixel.
    pub start: u16,
    /// The first pixel past it.
    pub end: u16,
}

impl Run {
    /// Its length, pixels.
    pub fn length(self) -> u16 {
        self.end - self.start
    }

    /// Whether runs of adjacent rows touch, corners included.
    pub fn touches(self, other: Run) -> bool {
        self.start <= other.end && other.start <= self.end
    }
}

/// The runs of a picture, row after row. Its memory is kept from picture to picture.
#[derive(Debug, Clone, Default)]
pub(super) struct Runs {
    runs: Vec<Run>,
    /// Where each row's runs begin, and one more.
    row_begins: Vec<u32>,
}

impl Runs {
    /// Finds the runs of pixels above `threshold_of_row`.
    pub(super) fn find(&mut self, image: &Image<'_>, threshold_of_row: impl Fn(usize) -> u8) {
        self.runs.clear();
        self.row_begins.clear();
        self.row_begins.push(0);
        let (pixels, width) = (image.pixels(), image.width());
        scan::picture(
            instruction_set(),
            pixels,
            width,
            threshold_of_row,
            &mut self.runs,
            &mut self.row_begins,
        );
    }

    /// All runs, from the top row on.
    pub(super) fn all(&self) -> &[Run] {
        &self.runs
    }

    /// How many rows were looked at.
    pub(super) fn rows(&self) -> usize {
        self.row_begins.len().saturating_sub(1)
    }

    /// The places in [`Runs::all`] of a row's runs.
    pub(super) fn of_row(&self, row: usize) -> std::ops::Range<usize> {
        let at = |row: usize| self.row_begins.get(row).copied().unwrap_or_default() as usize;
        at(row)..at(row + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn plainly(row: &[u8], threshold: u8) -> Vec<Run> {
        let mut runs = Vec::new();
        let mut start = None;
        for (at, pixel) in row.iter().chain([&0]).enumerate() {
            let lit = at < row.len() && *pixel > threshold;
            match (start, lit) {
                (None, true) => start = Some(at),
                (Some(from), false) => {
                    runs.push(Run { start: from as u16, end: at as u16 });
                    start = None;
                }
                _ => {}
            }
        }
        runs
    }

    proptest! {
        #[test]
        fn every_instruction_set_finds_the_runs_a_plain_loop_finds(
            row in prop::collection::vec(prop_oneof![Just(0_u8), Just(255), 50..70_u8], 1..700),
            threshold in prop_oneof![Just(0_u8), 55..65_u8, Just(254), Just(255)],
        ) {
            for set in scan::available() {
                let (mut runs, mut row_ends) = (Vec::new(), Vec::new());
                scan::picture(set, &row, row.len(), |_| threshold, &mut runs, &mut row_ends);
                prop_assert_eq!(&runs, &plainly(&row, threshold), "{:?}", set);
                prop_assert_eq!(row_ends, vec![runs.len() as u32]);
            }
        }
    }
}
