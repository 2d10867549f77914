//! The centroids of a stripe's rows, eight at a time.
//!
//! First what every row's centroid is made of, column by column, then the centroids: the second loop asks no question, so that it is made of
//! vector instructions without being written in them.

#![allow(unsafe_code, reason = "vector instructions, called only where the processor was seen to have them")]

use super::centre::{BINARY_SIGMA, Noise};
use super::chain::Chain;
use super::image::Image;
use super::point::RowPoint;
use super::runs::{InstructionSet, Run};
use super::sums::{self, Sums};
use super::threshold::Levels;

/// A stripe in a picture.
#[derive(Clone, Copy)]
pub(super) struct Stripe<'a> {
    pub(super) image: &'a Image<'a>,
    pub(super) chain: &'a Chain,
    pub(super) levels: &'a Levels,
}

/// Finds centroids. Its memory is kept from picture to picture.
#[derive(Debug, Clone, Default)]
pub(super) struct Centroids {
    eights: Vec<Eight>,
}

impl Centroids {
    /// Adds a point for every row of a stripe, its centre the centroid of what exceeds the threshold. `set` is one the processor has.
    pub(super) fn find(
        &mut self,
        set: InstructionSet,
        stripe: Stripe<'_>,
        noise: &Noise,
        points: &mut Vec<RowPoint>,
    ) {
        let end = points.len() + stripe.chain.runs.len();
        match set {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has these instructions, as the caller says.
            InstructionSet::Avx512 => unsafe { find_avx512(&mut self.eights, stripe, noise, points) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: the processor has these instructions, as the caller says.
            InstructionSet::Avx2 => unsafe { find_avx2(&mut self.eights, stripe, noise, points) },
            _ => find_by(sums::of_any, &mut self.eights, stripe, noise, points),
        }
        points.truncate(end);
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx2")]
fn find_avx512(eights: &mut Vec<Eight>, stripe: Stripe<'_>, noise: &Noise, points: &mut Vec<RowPoint>) {
    find_by(|run, pixels| sums::of_short(run, pixels), eights, stripe, noise, points);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn find_avx2(eights: &mut Vec<Eight>, stripe: Stripe<'_>, noise: &Noise, points: &mut Vec<RowPoint>) {
    find_by(|run, pixels| sums::of_short(run, pixels), eights, stripe, noise, points);
}

/// Part of its caller, so that it is made of the caller's instructions.
#[inline(always)]
fn find_by(
    sums: impl Fn(Run, &[u8]) -> Sums,
    eights: &mut Vec<Eight>,
    Stripe { image, chain, levels }: Stripe<'_>,
    noise: &Noise,
    points: &mut Vec<RowPoint>,
) {
    eights.clear();
    let mut rows = (chain.top..).zip(image.rows_from(chain.top));
    for runs in chain.runs.chunks(8) {
        let mut eight = Eight::default();
        for ((index, run), (row, pixels)) in runs.iter().enumerate().zip(&mut rows) {
            eight.set(index, *run, &sums(*run, pixels), levels.of_row(row));
        }
        eights.push(eight);
    }
    for (row, eight) in (chain.top as u32..).step_by(8).zip(eights) {
        points.extend_from_slice(&eight.points(row, image.width(), noise));
    }
}

/// What the centroids of eight rows are made of.
#[derive(Debug, Clone, Copy, Default)]
struct Eight {
    starts: [i32; 8],
    ends: [i32; 8],
    thresholds: [i32; 8],
    levels: [f64; 8],
    firsts: [f64; 8],
    seconds: [f64; 8],
    peaks: [f64; 8],
}

/// The grey level of a saturated pixel.
const SATURATION: f64 = 255.0;

impl Eight {
    /// Sets one of the rows.
    #[inline(always)]
    fn set(&mut self, index: usize, run: Run, sums: &Sums, threshold: u8) {
        self.starts[index] = run.start.into();
        self.ends[index] = run.end.into();
        self.thresholds[index] = threshold.into();
        self.levels[index] = sums.levels;
        self.firsts[index] = sums.first;
        self.seconds[index] = sums.second;
        self.peaks[index] = sums.peak;
    }

    /// The points; of rows that were not set they mean nothing.
    #[inline(always)]
    fn points(&self, row: u32, picture_width: usize, noise: &Noise) -> [RowPoint; 8] {
        let (mut centres, mut sigmas, mut flags) = ([0.0; 8], [0.0; 8], [0; 8]);
        for lane in 0..8 {
            let (from_start, sigma) = self.centroid(lane, noise);
            centres[lane] = self.starts[lane] as f32 + from_start;
            sigmas[lane] = sigma;
            flags[lane] = self.flags(lane, picture_width as i32);
        }
        std::array::from_fn(|lane| RowPoint {
            row: row + lane as u32,
            flags: flags[lane],
            centre: centres[lane],
            sigma: sigmas[lane],
            width: (self.ends[lane] - self.starts[lane]) as f32,
            peak: self.peaks[lane] as f32,
        })
    }

    /// The centroid of what exceeds the threshold, from the run's start, and its standard uncertainty.
    #[inline(always)]
    fn centroid(&self, index: usize, noise: &Noise) -> (f32, f32) {
        let (levels, first, second) = (self.levels[index], self.firsts[index], self.seconds[index]);
        let floor = f64::from(self.thresholds[index]);
        let count = f64::from(self.ends[index] - self.starts[index]);
        let position_sum = count * (count - 1.0) / 2.0;
        let squares = position_sum * (2.0 * count - 1.0) / 3.0;
        // Every pixel of a run is above the threshold, so that nothing here is below zero.
        let inverse = 1.0 / (levels - floor * count).max(1.0);
        let from_start = (first - floor * position_sum) * inverse;
        // A pixel's noise moves the centroid by its distance from it. Saturated pixels have no noise that could be seen, but hide as much.
        let spread = |zeroth: f64, first: f64, second: f64| {
            second - 2.0 * from_start * first + from_start * from_start * zeroth
        };
        let variance = f64::from(noise.variance(0.0)) * spread(count, position_sum, squares)
            + f64::from(noise.per_level) * spread(levels, first, second);
        let speckle = f64::from(noise.speckle_px);
        // One pixel alone does not say where in it the middle lies.
        let one_pixel = f64::from(BINARY_SIGMA);
        let noise_square = if count > 1.0 { variance * inverse * inverse } else { one_pixel * one_pixel };
        (from_start as f32, ((noise_square + speckle * speckle) as f32).sqrt())
    }

    /// What is special about a row.
    #[inline(always)]
    fn flags(&self, index: usize, picture_width: i32) -> u32 {
        let is_at_edge = (self.starts[index] == 0) | (self.ends[index] == picture_width);
        let is_saturated = self.peaks[index] >= SATURATION;
        u32::from(is_saturated) * RowPoint::SATURATED + u32::from(is_at_edge) * RowPoint::AT_EDGE
    }
}
