//! Runs: the stretches of lit pixels of every row.

use bytemuck::{Pod, Zeroable};

use super::Image;
use super::threshold::Levels;

mod scan;

#[cfg(test)]
pub(super) use scan::available;
pub use scan::{InstructionSet, instruction_set};

/// A stretch of lit pixels in one row: `start` is lit, `end` is the first that is not.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Pod, Zeroable)]
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
    /// Where pixels become lit and dark again, in turns: two edges are a run. Those of earlier pictures may lie behind.
    edges: Vec<u16>,
    /// How many edges there are when a row begins, and one more.
    row_begins: Vec<u32>,
}

impl Runs {
    /// Finds the runs of pixels above the `levels`. `set` is one the processor has.
    pub(super) fn find(&mut self, set: InstructionSet, image: &Image<'_>, levels: &Levels) {
        self.row_begins.clear();
        self.row_begins.push(0);
        let (pixels, width) = (image.pixels(), image.width());
        scan::picture(set, pixels, width, levels, &mut self.edges, &mut self.row_begins);
    }

    /// All runs, from the top row on.
    pub(super) fn all(&self) -> &[Run] {
        let count = self.row_begins.last().copied().unwrap_or_default() as usize;
        bytemuck::cast_slice(self.edges.get(..count).unwrap_or_default())
    }

    /// Each row's runs.
    pub(super) fn of_rows(&self) -> impl Iterator<Item = &[Run]> {
        let all = self.all();
        self.row_begins
            .array_windows()
            .map(|[begin, end]| all.get(*begin as usize / 2..*end as usize / 2).unwrap_or_default())
    }

    /// How many rows were looked at.
    pub(super) fn rows(&self) -> usize {
        self.row_begins.len().saturating_sub(1)
    }

    /// The indices in [`Runs::all`] of a row's runs.
    pub(super) fn of_row(&self, row: usize) -> std::ops::Range<usize> {
        let at = |row: usize| self.row_begins.get(row).copied().unwrap_or_default() as usize / 2;
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

    fn picture() -> impl Strategy<Value = (usize, Vec<u8>)> {
        (1_usize..700, 1_usize..6).prop_flat_map(|(width, rows)| {
            let pixel = prop_oneof![Just(0_u8), Just(255), 50..70_u8];
            (Just(width), prop::collection::vec(pixel, width * rows))
        })
    }

    proptest! {
        #[test]
        fn every_instruction_set_finds_the_runs_a_plain_loop_finds(
            (width, pixels) in picture(),
            threshold in prop_oneof![Just(0_u8), 55..65_u8, Just(254), Just(255)],
        ) {
            let image = Image::new(width, pixels.len() / width, &pixels).unwrap();
            let levels = Levels::of_rows((0..image.height()).map(|row| threshold.saturating_add(row as u8)));
            for set in scan::available() {
                let mut runs = Runs::default();
                runs.find(set, &image, &levels);
                prop_assert_eq!(runs.rows(), image.height());
                for row in 0..image.height() {
                    let found = &runs.all()[runs.of_row(row)];
                    prop_assert_eq!(found, plainly(image.row(row), levels.of_row(row)), "{:?}, row {}", set, row);
                }
            }
        }
    }
}
