//! From a picture to the stripe in it: threshold, runs, connected components, the tallest of them, the way down it, and in every row its centre.
//!
//! What is found is what Agin's vision module found (Agin 1985, section 2): the tallest stripe that runs generally from top to bottom, spurs and
//! other noise thrown away, the centre and the horizontal width in every row. What that module lacked is the rest: a centre to a fraction
//! of a pixel with its uncertainty, and an error in place of points where there is no stripe or more than one could be it.

mod centre;
mod centroid;
mod chain;
mod components;
mod image;
mod point;
mod runs;
mod spot;
mod sums;
mod threshold;

pub use centre::{Centre, Noise};
pub use image::{Image, ImageError, LARGEST_SIDE};
pub use point::RowPoint;
pub use runs::{InstructionSet, Run, instruction_set};
pub use spot::{NoSpot, Spot, SpotFinder};
pub use threshold::Threshold;

use centroid::{Centroids, Stripe};
use chain::Chain;
use components::{Component, Components};
use runs::Runs;
use threshold::Levels;

/// How stripes are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// When a pixel is lit.
    pub threshold: Threshold,
    /// How the centre is found.
    pub centre: Centre,
    /// The camera's noise.
    pub noise: Noise,
    /// A stripe has at least so many rows.
    pub least_rows: u32,
    /// Whether one stripe is looked for, or all pieces of one that steps and edges break.
    pub pieces: Pieces,
}

/// How many components may be the stripe.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pieces {
    /// The tallest alone, as Agin's module had it.
    #[default]
    Tallest,
    /// Every one that is tall enough; rows that two of them share are left out.
    All,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            threshold: Threshold::Otsu { least: 20 },
            centre: Centre::default(),
            noise: Noise::default(),
            least_rows: 8,
            pieces: Pieces::default(),
        }
    }
}

/// Why no stripe was found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoStripe {
    /// Not one pixel is lit.
    #[error(
        "the picture is dark: no pixel is brighter than {threshold}; is the laser on, the filter clean, the threshold right?"
    )]
    Dark {
        /// The level.
        threshold: u8,
    },
    /// Too much is lit.
    #[error(
        "{percent:.0} % of the picture is brighter than {threshold}, a stripe lights a few: is the filter in, the room's light off?"
    )]
    Bright {
        /// How much is lit.
        percent: f32,
        /// The level.
        threshold: u8,
    },
    /// What is lit is not tall enough.
    #[error("the tallest of what is lit has {rows} rows, a stripe at least {least}")]
    Short {
        /// Rows of the tallest component.
        rows: u32,
        /// What is asked for.
        least: u32,
    },
    /// What is lit lies across the rows.
    #[error(
        "the stripe lies flat: {columns} columns wide and {rows} rows tall; it has to run from the top to the bottom of the picture"
    )]
    Flat {
        /// Its width.
        columns: u32,
        /// Its height.
        rows: u32,
    },
    /// Two could be it.
    #[error(
        "two stripes of {rows} and {other_rows} rows lie side by side: which one is the laser's cannot be decided; shade the other light, or a mirror-like surface"
    )]
    Ambiguous {
        /// Rows of the tallest.
        rows: u32,
        /// Rows of the other.
        other_rows: u32,
    },
}

/// What was found in a picture.
#[derive(Debug, Clone, Default)]
pub struct Profile {
    /// The stripe, from the top.
    pub points: Vec<RowPoint>,
    /// The level above which pixels were lit (of the first row).
    pub threshold: u8,
    /// How many other components were lit.
    pub others: u32,
    /// Other components tall enough to be a piece of the stripe, in other rows: it is broken.
    pub is_broken: bool,
}

/// Looks for stripes. Its memory is kept from picture to picture.
#[derive(Debug, Clone, Default)]
pub struct Extractor {
    instructions: InstructionSet,
    levels: Levels,
    runs: Runs,
    components: Components,
    chain: Chain,
    /// The component `chain` goes down, in the present picture.
    followed: Option<u32>,
    centroids: Centroids,
    order: Vec<Component>,
    owner: Vec<u8>,
    profile: Profile,
}

/// A picture with more of it lit shows no stripe.
const MOST_LIT: f32 = 0.4;

/// A second component this tall, as a fraction of the tallest, could be the stripe as well.
const RIVAL: f32 = 0.9;

impl Extractor {
    /// One that has seen nothing.
    pub fn new() -> Self {
        Self::default()
    }

    /// Looks for the stripe.
    ///
    /// # Errors
    /// [`NoStripe`], saying what is seen instead.
    pub fn extract(&mut self, image: &Image<'_>, settings: &Settings) -> Result<&Profile, NoStripe> {
        self.profile.points.clear();
        self.followed = None;
        self.levels.choose(settings.threshold, image);
        self.profile.threshold = self.levels.of_row(0);
        self.runs.find(self.instructions, image, &self.levels);
        self.components.find(&self.runs);
        self.require_some_light(image)?;
        let tallest = self.tallest(settings)?;
        let chosen = match settings.pieces {
            Pieces::Tallest => self.alone(tallest, settings)?,
            Pieces::All => self.all_pieces(settings),
        };
        for component in chosen {
            self.take(&component, image, settings);
        }
        if settings.pieces == Pieces::All {
            self.drop_shared_rows();
        }
        Ok(&self.profile)
    }

    fn require_some_light(&self, image: &Image<'_>) -> Result<(), NoStripe> {
        let threshold = self.profile.threshold;
        let lit: u32 = self.components.all().iter().map(|component| component.pixels).sum();
        if lit == 0 {
            return Err(NoStripe::Dark { threshold });
        }
        let fraction = lit as f32 / image.pixels().len() as f32;
        if fraction > MOST_LIT {
            Err(NoStripe::Bright { percent: fraction * 100.0, threshold })
        } else {
            Ok(())
        }
    }

    fn tallest(&mut self, settings: &Settings) -> Result<Component, NoStripe> {
        let all = self.components.all();
        self.profile.others = all.len() as u32 - 1;
        let least = settings.least_rows;
        let tallest = all.iter().max_by_key(|component| (component.height(), component.pixels)).copied();
        let Some(tallest) = tallest else {
            return Err(NoStripe::Dark { threshold: self.profile.threshold });
        };
        self.follow(&tallest);
        let widest = u32::from(self.chain.greatest_width);
        if tallest.height() < least || self.chain.runs.len() < least as usize {
            let rows = tallest.height().min(self.chain.runs.len() as u32);
            return Err(match widest >= least.max(3 * rows) {
                true => NoStripe::Flat { columns: widest, rows },
                false => NoStripe::Short { rows, least },
            });
        }
        let median = self.chain.median_width;
        if median >= self.chain.runs.len() as f32 {
            return Err(NoStripe::Flat { columns: median as u32, rows: tallest.height() });
        }
        Ok(tallest)
    }

    fn follow(&mut self, component: &Component) {
        if self.followed != Some(component.name) {
            self.chain.follow(component, &self.components, &self.runs);
            self.followed = Some(component.name);
        }
    }

    /// The tallest, if no other could be the stripe in its place.
    fn alone(&mut self, tallest: Component, settings: &Settings) -> Result<Vec<Component>, NoStripe> {
        self.profile.is_broken = false;
        for other in self.components.all() {
            if other.name == tallest.name || other.height() < settings.least_rows {
                continue;
            }
            let beside = other.top <= tallest.bottom && tallest.top <= other.bottom;
            if !beside {
                self.profile.is_broken = true;
            } else if other.height() as f32 >= RIVAL * tallest.height() as f32 {
                let (rows, other_rows) = (tallest.height(), other.height());
                return Err(NoStripe::Ambiguous { rows, other_rows });
            }
        }
        Ok(vec![tallest])
    }

    /// Every component tall enough, from the tallest.
    fn all_pieces(&mut self, settings: &Settings) -> Vec<Component> {
        let tall = |component: &&Component| component.height() >= settings.least_rows;
        self.order.clear();
        self.order.extend(self.components.all().iter().filter(tall));
        self.order.sort_by_key(|component| std::cmp::Reverse((component.height(), component.pixels)));
        self.profile.is_broken = self.order.len() > 1;
        self.order.clone()
    }

    /// Adds the centres of a component's stripe.
    fn take(&mut self, component: &Component, image: &Image<'_>, settings: &Settings) {
        self.follow(component);
        self.chain.find_spurs(settings.centre != Centre::Binary);
        let before = self.profile.points.len();
        let stripe = Stripe { image, chain: &self.chain, levels: &self.levels };
        self.centroids.find(self.instructions, stripe, &settings.noise, &mut self.profile.points);
        let points = self.profile.points.get_mut(before..).unwrap_or_default();
        match settings.centre {
            Centre::Centroid => {}
            Centre::Binary => {
                for (point, run) in points.iter_mut().zip(&self.chain.runs) {
                    *point = centre::binary(*point, *run);
                }
            }
            Centre::GaussianDerivative { line_sigma_px } => {
                for (point, pixels) in points.iter_mut().zip(image.rows_from(self.chain.top)) {
                    *point = centre::gaussian_derivative(*point, pixels, line_sigma_px, &settings.noise);
                }
            }
        }
        self.flag_spurs(before);
    }

    /// Flags the rows of the last stripe that a spur is joined to, and leaves out those of which nothing is left without it. Its points
    /// lie from `before` on.
    fn flag_spurs(&mut self, before: usize) {
        if self.chain.spurs.is_empty() {
            return;
        }
        for index in &self.chain.spurs {
            if let Some(point) = self.profile.points.get_mut(before + index) {
                point.flags |= RowPoint::SPUR;
            }
        }
        self.profile.points.retain(|point| point.width > 0.0);
    }

    /// Of rows in which two pieces lie, none can be known to be right.
    fn drop_shared_rows(&mut self) {
        self.owner.clear();
        self.owner.resize(self.runs.rows(), 0);
        for point in &self.profile.points {
            if let Some(owners) = self.owner.get_mut(point.row as usize) {
                *owners = owners.saturating_add(1);
            }
        }
        let owner = &self.owner;
        self.profile.points.retain(|point| owner.get(point.row as usize).is_some_and(|owners| *owners == 1));
        self.profile.points.sort_by_key(|point| point.row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A stripe that wanders, with what is lit beside it and joined to it.
    fn picture() -> impl Strategy<Value = (usize, Vec<u8>)> {
        (8_usize..300, 8_usize..60, any::<u64>(), 0_u8..8).prop_map(|(width, height, seed, clutter)| {
            let mut chance = seed | 1;
            let mut below = move |limit: u8| {
                chance =
                    chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                ((chance >> 40) % u64::from(limit)) as u8
            };
            let mut pixels: Vec<u8> = (0..width * height).map(|_| 40 + below(20 + clutter / 7)).collect();
            let mut start = width / 2;
            for row in pixels.chunks_mut(width) {
                start = (start + usize::from(below(3))).clamp(1, width) - 1;
                let length = if below(16) < clutter { 30 } else { 2 + below(8) };
                row.iter_mut().skip(start).take(length.into()).for_each(|pixel| *pixel = 61 + below(195));
            }
            (width, pixels)
        })
    }

    fn settings() -> impl Strategy<Value = Settings> {
        let derivative = Centre::GaussianDerivative { line_sigma_px: 1.6 };
        let centre = prop_oneof![Just(Centre::Centroid), Just(Centre::Binary), Just(derivative)];
        let pieces = prop_oneof![Just(Pieces::Tallest), Just(Pieces::All)];
        (centre, pieces, 0.0_f32..0.5).prop_map(|(centre, pieces, per_level)| Settings {
            threshold: Threshold::Fixed(60),
            centre,
            pieces,
            noise: Noise { per_level, speckle_px: per_level, ..Noise::default() },
            least_rows: 4,
        })
    }

    proptest! {
        #[test]
        fn every_instruction_set_finds_the_very_same_points((width, pixels) in picture(), settings in settings()) {
            let image = Image::new(width, pixels.len() / width, &pixels).unwrap();
            let mut found = runs::available().map(|instructions| {
                let mut extractor = Extractor { instructions, ..Extractor::default() };
                extractor.extract(&image, &settings).map(|profile| profile.points.clone())
            });
            let first = found.next();
            for other in found {
                prop_assert_eq!(first.as_ref(), Some(&other));
            }
        }
    }
}
