//! The stripe's centre in one row.

use super::point::RowPoint;
use super::runs::Run;

/// How the centre is found inside the chosen component.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Centre {
    /// The middle of the lit pixels, as Agin's vision module had it.
    Binary,
    /// The centroid of what exceeds the threshold: within a fifth of the best possible, and the best of all where the stripe is saturated.
    #[default]
    Centroid,
    /// Where the derivative of the row, smoothed by a Gaussian of this standard deviation (pixels), crosses zero: for little light.
    GaussianDerivative {
        /// Standard deviation of the stripe's cross section, pixels.
        line_sigma_px: f32,
    },
}

/// The camera's noise.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Standard deviation in the dark, grey levels.
    #[serde(default = "Noise::usual_dark")]
    pub dark: f32,
    /// Variance added by each grey level of light.
    #[serde(default)]
    pub per_level: f32,
    /// What the surface's speckle moves the centre by, pixels; 0 where lens and line are coarse against it.
    #[serde(default)]
    pub speckle_px: f32,
}

impl Noise {
    fn usual_dark() -> f32 {
        2.0
    }

    /// Variance at a grey level. The rounding to whole levels is a twelfth.
    #[inline]
    pub(super) fn variance(&self, level: f32) -> f32 {
        self.dark * self.dark + self.per_level * level + 1.0 / 12.0
    }
}

impl Default for Noise {
    fn default() -> Self {
        Self { dark: Self::usual_dark(), per_level: 0.0, speckle_px: 0.0 }
    }
}

/// Two edges, each somewhere in a pixel.
pub(super) const BINARY_SIGMA: f32 = 0.204_124_15;

/// The middle of the lit pixels, in place of their centroid.
pub(super) fn binary(centroid: RowPoint, run: Run) -> RowPoint {
    let centre = (f32::from(run.start) + f32::from(run.end) - 1.0) / 2.0;
    RowPoint { centre, sigma: BINARY_SIGMA, ..centroid }
}

/// The zero of the smoothed row's derivative nearest to the centroid; the centroid itself where there is none.
pub(super) fn gaussian_derivative(
    start: RowPoint,
    pixels: &[u8],
    line_sigma: f32,
    noise: &Noise,
) -> RowPoint {
    let reach = (4.0 * line_sigma).ceil() as i64;
    let level = |index: i64| {
        let last = pixels.len() as i64 - 1;
        pixels.get(index.clamp(0, last) as usize).map_or(0.0, |pixel| f32::from(*pixel))
    };
    // Slope, curvature, and the slope's variance at a position.
    let derivatives = |centre: f32| {
        let middle = centre.round() as i64;
        let (mut slope, mut curvature, mut variance) = (0.0_f32, 0.0_f32, 0.0_f32);
        for index in middle - reach..=middle + reach {
            let away = (index as f32 - centre) / line_sigma;
            let bell = (-0.5 * away * away).exp();
            let weight = away * bell;
            slope += weight * level(index);
            curvature += (away * away - 1.0) * bell / line_sigma * level(index);
            variance += weight * weight * noise.variance(level(index));
        }
        (slope, curvature, variance)
    };
    let mut centre = start.centre;
    let speckle = noise.speckle_px;
    for _ in 0..20 {
        let (slope, curvature, variance) = derivatives(centre);
        if curvature >= 0.0 {
            return start;
        }
        let step = (-slope / curvature).clamp(-0.5, 0.5);
        centre += step;
        if (centre - start.centre).abs() > start.width.max(2.0) {
            return start;
        }
        if step.abs() < 1e-4 {
            let sigma = (variance / (curvature * curvature) + speckle * speckle).sqrt();
            return RowPoint { centre, sigma, ..start };
        }
    }
    start
}
