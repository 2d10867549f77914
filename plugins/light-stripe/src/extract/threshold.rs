//! From which grey level on a pixel is lit.

use super::Image;

/// How the level above which a pixel is lit is chosen.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Threshold {
    /// A grey level, 0 to 254.
    Fixed(u8),
    /// For each picture the level that parts its grey levels best (Otsu 1979), but never below `least`.
    Otsu {
        /// The lowest level it may choose: a picture without a stripe has no two kinds of pixels.
        least: u8,
    },
    /// For each row so many grey levels above the row's own dark, its median: for uneven ambient light.
    RowFloor {
        /// Grey levels above the median.
        above: u8,
    },
}

/// The levels chosen for one picture.
#[derive(Debug, Clone, Default)]
pub(super) struct Levels {
    of_row: Vec<u8>,
    everywhere: u8,
}

/// Rows between two that Otsu's histogram takes in: a stripe runs from top to bottom, so that a part of the rows shows all.
const OTSU_ROWS: usize = 4;

impl Levels {
    /// One level for all rows.
    pub(super) fn everywhere(level: u8) -> Self {
        Self { of_row: Vec::new(), everywhere: level }
    }

    #[cfg(test)]
    pub(super) fn of_rows(levels: impl Iterator<Item = u8>) -> Self {
        Self { of_row: levels.collect(), everywhere: 0 }
    }

    pub(super) fn choose(&mut self, threshold: Threshold, image: &Image<'_>) {
        self.of_row.clear();
        match threshold {
            Threshold::Fixed(level) => self.everywhere = level,
            Threshold::Otsu { least } => self.everywhere = otsu(image).max(least).min(254),
            Threshold::RowFloor { above } => {
                self.of_row.extend(
                    (0..image.height()).map(|row| median(image.row(row)).saturating_add(above).min(254)),
                );
            }
        }
    }

    #[inline]
    pub(super) fn of_row(&self, row: usize) -> u8 {
        self.of_row.get(row).copied().unwrap_or(self.everywhere)
    }
}

fn histogram<'a>(rows: impl Iterator<Item = &'a [u8]>) -> [u32; 256] {
    // Four counts side by side: equal neighbours would wait for one another.
    let mut counts = [[0_u32; 256]; 4];
    for row in rows {
        let quads = row.chunks_exact(4);
        for pixel in quads.remainder() {
            counts[0][usize::from(*pixel)] += 1;
        }
        for quad in quads {
            for (count, pixel) in counts.iter_mut().zip(quad) {
                count[usize::from(*pixel)] += 1;
            }
        }
    }
    std::array::from_fn(|level| counts.iter().map(|count| count[level]).sum())
}

fn otsu(image: &Image<'_>) -> u8 {
    let step = if image.height() >= 4 * OTSU_ROWS { OTSU_ROWS } else { 1 };
    let counts = histogram(image.pixels().chunks_exact(image.width()).step_by(step));
    let total: f64 = counts.iter().map(|count| f64::from(*count)).sum();
    let sum: f64 = counts.iter().enumerate().map(|(level, count)| level as f64 * f64::from(*count)).sum();
    let (mut below, mut sum_below) = (0.0, 0.0);
    let (mut best, mut best_level) = (0.0, 0);
    for (level, count) in counts.iter().enumerate() {
        below += f64::from(*count);
        sum_below += level as f64 * f64::from(*count);
        let above = total - below;
        if below > 0.0 && above > 0.0 {
            let apart = sum_below / below - (sum - sum_below) / above;
            let between = below * above * apart * apart;
            if between > best {
                (best, best_level) = (between, level);
            }
        }
    }
    best_level as u8
}

fn median(row: &[u8]) -> u8 {
    let counts = histogram([row].into_iter());
    let mut seen = 0;
    let half = row.len() as u32 / 2;
    let level = counts.iter().position(|count| {
        seen += count;
        seen > half
    });
    level.unwrap_or_default() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn otsu_parts_a_stripe_from_the_dark() {
        let pixels: Vec<u8> =
            (0..64 * 64).map(|at| if at % 64 == 20 { 200 } else { 8 + (at % 5) as u8 }).collect();
        let mut levels = Levels::default();
        levels.choose(Threshold::Otsu { least: 5 }, &Image::new(64, 64, &pixels).unwrap());
        assert!((12..200).contains(&levels.of_row(3)), "{}", levels.of_row(3));
    }

    #[test]
    fn a_rows_floor_follows_uneven_light() {
        let pixels: Vec<u8> =
            (0..64 * 64).map(|at| (at / 64) as u8 * 2 + if at % 64 == 20 { 60 } else { 0 }).collect();
        let image = Image::new(64, 64, &pixels).unwrap();
        let mut levels = Levels::default();
        levels.choose(Threshold::RowFloor { above: 20 }, &image);
        assert_eq!((levels.of_row(0), levels.of_row(60)), (20, 140));
    }
}
