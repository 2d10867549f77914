//! A contrasting spot: the largest blob, and its middle.

use super::components::Components;
use super::runs::{Runs, instruction_set};
use super::threshold::Levels;
use super::{Image, Noise, Threshold};

/// A spot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Column of its middle, pixels.
    pub u_px: f64,
    /// Row of its middle, pixels.
    pub v_px: f64,
    /// Standard uncertainty of either, pixels.
    pub sigma_px: f64,
    /// Its pixels.
    pub pixels: u32,
}

/// Why there is no spot.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoSpot {
    /// Nothing is conspicuous.
    #[error(
        "nothing as large as a spot rises above level {threshold}: is the filter out, the threshold right?"
    )]
    None {
        /// The level.
        threshold: u8,
    },
    /// The largest is cut by the picture's edge.
    #[error("the spot lies at the picture's edge: its middle cannot be found")]
    AtEdge,
}

/// Fewer pixels are no spot.
const LEAST_PIXELS: u32 = 9;

/// Looks for spots. Its memory is kept from picture to picture.
#[derive(Debug, Clone, Default)]
pub struct SpotFinder {
    levels: Levels,
    runs: Runs,
    components: Components,
    inverted: Vec<u8>,
}

impl SpotFinder {
    /// Looks for the largest spot that is brighter than the threshold, or with `dark` darker.
    ///
    /// # Errors
    /// [`NoSpot`]
    pub fn find(
        &mut self,
        image: &Image<'_>,
        threshold: Threshold,
        dark: bool,
        noise: &Noise,
    ) -> Result<Spot, NoSpot> {
        self.levels.choose(threshold, image);
        let level = self.levels.of_row(0);
        // What is dark is bright in the negative.
        let bright_above = if dark { 255 - level } else { level };
        self.inverted.clear();
        self.inverted.extend(image.pixels().iter().map(|pixel| if dark { !pixel } else { *pixel }));
        let Ok(image) = Image::new(image.width(), image.height(), &self.inverted) else {
            return Err(NoSpot::None { threshold: level });
        };
        self.runs.find(instruction_set(), &image, &Levels::everywhere(bright_above));
        self.components.find(&self.runs);
        let largest = self.components.all().iter().max_by_key(|component| component.pixels);
        // What fills most of the picture is no spot but the ground, in a light that is too weak or too strong.
        let fits = |pixels: u32| pixels >= LEAST_PIXELS && (pixels as usize) < image.pixels().len() / 2;
        let Some(largest) = largest.filter(|component| fits(component.pixels)) else {
            return Err(NoSpot::None { threshold: level });
        };
        let (mut sum, mut across, mut down, mut spread) = (0.0, 0.0, 0.0, 0.0);
        for row in largest.top as usize..=largest.bottom as usize {
            for index in self.runs.of_row(row) {
                let Some(run) = self.runs.all().get(index).copied() else { continue };
                if self.components.of_run(index) != largest.name {
                    continue;
                }
                if run.start == 0
                    || usize::from(run.end) == image.width()
                    || row == 0
                    || row + 1 == image.height()
                {
                    return Err(NoSpot::AtEdge);
                }
                for (column, pixel) in
                    (run.start..run.end).zip(image.row(row).iter().skip(usize::from(run.start)))
                {
                    let weight = f64::from(pixel.saturating_sub(bright_above));
                    sum += weight;
                    across += weight * f64::from(column);
                    down += weight * row as f64;
                    spread += 1.0;
                }
            }
        }
        let sum = f64::max(sum, 1.0);
        // Of n pixels over a disc, each with the same noise, the middle moves by noise * sqrt(n) * radius / 2 / sum.
        let radius = (spread / std::f64::consts::PI).sqrt();
        let dark_noise = (f64::from(noise.dark).powi(2) + 1.0 / 12.0).sqrt();
        let sigma_px = dark_noise * spread.sqrt() * radius / 2.0 / sum;
        Ok(Spot { u_px: across / sum, v_px: down / sum, sigma_px, pixels: largest.pixels })
    }
}
