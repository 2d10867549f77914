//! Whether a wave of a known period can be distinguished from slower ones at the positions where it was measured.
//!
//! The spectral window of the positions (Deeming 1975, Astrophysics and Space Science 36, 137), `W(f) = |sum exp(2 pi i f x)| / n`, says how alike two waves look
//! whose
//! frequencies differ by `f`: 1 where they are the same at every position. Targets that are whole pitches apart have `W(1 / pitch) = 1`: there a wave of that
//! pitch is a constant.

use std::f64::consts::TAU;

/// Positions closer than this are one, mm: returns to one target.
const SAME: f64 = 1e-3;

/// Fewest positions at which a wave can be determined: it has two numbers, and a zero, a gain and one more position to check them go with it.
const FEWEST: usize = 5;

/// Two waves are taken for one where the window is above this: less than a fifth of the wave's squares (1 - 0.9^2) is then its own.
const ALIKE: f64 = 0.9;

/// Windows that differ by less are the same: as much as a peak falls between two frequencies that are looked at.
const AS_ALIKE: f64 = 0.01;

/// Frequencies looked at a peak's width (one over the range of the positions): peaks are not missed, nor lowered by more than a few hundredths.
const STEPS: f64 = 8.0;

/// Frequencies looked at, at most: time.
const MOST_FREQUENCIES: f64 = 20_000.0;

/// What positions of measurement say of a wave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Sampling {
    /// It can be distinguished from slower ones.
    Separable,
    /// There are too few positions.
    TooFew {
        /// How many there are.
        positions: usize,
        /// How many it takes.
        fewest: usize,
    },
    /// It looks like a slower wave, of this period, mm (infinite: like a constant).
    LooksLike {
        /// The period, mm.
        period: f64,
    },
}

/// Coordinates in order, each once.
pub(super) fn distinct(mut coordinates: Vec<f64>) -> Vec<f64> {
    coordinates.retain(|coordinate| coordinate.is_finite());
    coordinates.sort_by(f64::total_cmp);
    coordinates.dedup_by(|one, kept| (*one - *kept).abs() < SAME);
    coordinates
}

fn window(positions: &[f64], frequency: f64) -> f64 {
    let (sine, cosine) = positions.iter().fold((0.0, 0.0), |(sine, cosine), position| {
        let (s, c) = (TAU * frequency * position).sin_cos();
        (sine + s, cosine + c)
    });
    f64::hypot(sine, cosine) / positions.len().max(1) as f64
}

/// Whether a wave of this period (mm) can be distinguished from any of twice the period and more at these positions (mm, each once, in order).
pub(super) fn sampling(positions: &[f64], period: f64) -> Sampling {
    if positions.len() < FEWEST {
        return Sampling::TooFew { positions: positions.len(), fewest: FEWEST };
    }
    let extent = positions.last().unwrap_or(&0.0) - positions.first().unwrap_or(&0.0);
    // At least two windows' widths are looked at, however short the travel.
    let steps = (STEPS * extent / period).clamp(2.0 * STEPS, MOST_FREQUENCIES);
    // From half to three halves of the wave's own frequency: the difference to all waves of at least twice its period, of either sign.
    let frequencies = (0..=steps as usize).map(|step| (0.5 + step as f64 / steps.floor()) / period);
    let all: Vec<(f64, f64)> = frequencies
        .map(|frequency| (window(positions, frequency), (1.0 / period - frequency).abs()))
        .collect();
    let highest = all.iter().map(|(window, _)| *window).fold(0.0, f64::max);
    if highest < ALIKE {
        return Sampling::Separable;
    }
    // Of waves that look as much like it, the slowest is reported: positions at whole pitches show a constant, and a wave of twice the pitch too.
    let as_alike = all.iter().filter(|(window, _)| *window >= highest - AS_ALIKE);
    let apart = as_alike.map(|(_, apart)| *apart).fold(f64::INFINITY, f64::min);
    let period = if apart * extent < 0.5 { f64::INFINITY } else { 1.0 / apart };
    Sampling::LooksLike { period }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(spacing: f64, count: usize) -> Vec<f64> {
        (0..count).map(|index| spacing * index as f64).collect()
    }

    #[test]
    fn places_that_are_whole_pitches_apart_make_a_constant_of_the_wave() {
        for whole in [5.0, 10.0, 20.0] {
            let found = sampling(&grid(whole, 20), 5.0);
            assert_eq!(found, Sampling::LooksLike { period: f64::INFINITY }, "every {whole} mm");
        }
    }

    #[test]
    fn a_regular_grid_wider_than_a_pitch_makes_a_slow_wave_of_it() {
        // Every 6 mm a wave of 5 mm advances by a fifth of a turn: it looks like one of 30 mm.
        let Sampling::LooksLike { period } = sampling(&grid(6.0, 30), 5.0) else { panic!("it is separable") };
        assert!((period - 30.0).abs() < 1.0, "{period}");
    }

    #[test]
    fn places_close_together_or_of_no_rhythm_determine_it() {
        assert_eq!(sampling(&grid(1.25, 17), 5.0), Sampling::Separable);
        let uneven: Vec<f64> =
            (0..20).map(|index| 20.0 * index as f64 + (index as f64 * 2.3).sin() * 4.0).collect();
        assert_eq!(sampling(&uneven, 5.0), Sampling::Separable);
    }

    #[test]
    fn few_places_or_less_than_half_a_pitch_determine_nothing() {
        assert_eq!(sampling(&grid(1.3, 4), 5.0), Sampling::TooFew { positions: 4, fewest: 5 });
        assert!(matches!(sampling(&grid(0.1, 10), 5.0), Sampling::LooksLike { .. }));
        assert_eq!(distinct(vec![3.0, 1.0, 3.000_1, f64::NAN, 1.0]), [1.0, 3.0], "returns are one position");
    }
}
