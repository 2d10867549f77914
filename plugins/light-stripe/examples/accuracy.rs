//! How exactly the stripe's centre is found in pictures whose stripe is known: `cargo run --release -p plumb-light-stripe --example accuracy`.
//!
//! Prints a table by signal to noise, width, saturation, speckle and clutter: the root mean square error of Agin's mode, of the centroid and of
//! the Gaussian derivative, what the centroid says of itself, and the Cramer-Rao bound for additive noise (root of 2 s / sqrt(pi), times noise
//! over amplitude) with what speckle moves the centroid of the whole line by, grains of a pixel (contrast times root of s / (4 sqrt(pi)))
//! beside it. Each case is 64 pictures of 256 rows, the lines' brightness summed over each pixel.

#![allow(clippy::print_stdout, reason = "its table is what it is for")]

#[path = "../tests/common/chance.rs"]
mod chance;

use std::f64::consts::PI;

use chance::Chance;
use plumb_light_stripe::extract::{Centre, Extractor, Image, Noise, Settings, Threshold};

const PICTURES: u64 = 64;
const SIZE: usize = 256;

/// What a picture is made of.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    /// Of the stripe's cross section, px.
    sigma: f64,
    amplitude: f64,
    noise: f64,
    level: u8,
    /// Contrast of speckle, one grain a pixel along the row.
    speckle: f64,
    clutter: bool,
}

const PLAIN: Case =
    Case { name: "", sigma: 1.6, amplitude: 200.0, noise: 2.0, level: 30, speckle: 0.0, clutter: false };

/// The threshold lies a tenth of the amplitude above the dark (10 grey levels), or four times the noise where that is more, if nothing else is said.
const CASES: [Case; 13] = [
    Case { name: "signal to noise 100, line of .7 px", sigma: 0.7, ..PLAIN },
    Case { name: "signal to noise 100, line of 1.6 px", ..PLAIN },
    Case { name: "the same, threshold at a quarter", level: 60, ..PLAIN },
    Case { name: "the same, threshold at a half", level: 110, ..PLAIN },
    Case { name: "signal to noise 40, line of 1.6 px", noise: 5.0, ..PLAIN },
    Case { name: "signal to noise 20, line of 1.6 px", amplitude: 100.0, noise: 5.0, ..PLAIN },
    Case { name: "signal to noise 8, line of 1.6 px", amplitude: 50.0, noise: 6.0, level: 34, ..PLAIN },
    Case {
        name: "signal to noise 50, line of 3.5 px",
        sigma: 3.5,
        amplitude: 150.0,
        noise: 3.0,
        level: 25,
        ..PLAIN
    },
    Case { name: "saturated twice over", amplitude: 480.0, level: 35, ..PLAIN },
    Case { name: "saturated four times over", amplitude: 960.0, level: 35, ..PLAIN },
    Case { name: "speckle of contrast .3", speckle: 0.3, amplitude: 150.0, level: 25, ..PLAIN },
    Case { name: "speckle of contrast 1", speckle: 1.0, amplitude: 80.0, level: 20, ..PLAIN },
    Case {
        name: "clutter: spurs, specks and a gap, threshold at a quarter",
        amplitude: 180.0,
        noise: 3.0,
        level: 60,
        clutter: true,
        ..PLAIN
    },
];

impl Case {
    /// The Cramer-Rao bound for its noise, px.
    fn noise_bound(&self) -> f64 {
        let noise = (self.noise * self.noise + 1.0 / 12.0).sqrt();
        noise / self.amplitude * (2.0 * self.sigma / PI.sqrt()).sqrt()
    }

    /// What speckle moves the centroid of the whole line by, px.
    fn speckle_px(&self) -> f64 {
        self.speckle * (self.sigma / (4.0 * PI.sqrt())).sqrt()
    }

    fn centre(&self, picture: u64, row: usize) -> f64 {
        let (row, picture) = (row as f64, picture as f64);
        120.0
            + 0.0371 * row
            + 0.137 * picture
            + if self.clutter { 8.0 * (row / 31.0 + picture).sin() } else { 0.0 }
    }

    fn picture(&self, number: u64) -> Vec<u8> {
        let mut chance = Chance(1000 * number + 7);
        let mut light = vec![10.0; SIZE * SIZE];
        let end = if self.clutter { SIZE * 9 / 10 } else { SIZE };
        for (row, pixels) in light.chunks_exact_mut(SIZE).enumerate().take(end) {
            let middle = self.centre(number, row);
            for (column, pixel) in pixels.iter_mut().enumerate() {
                let parts = (0..8).map(|part| {
                    let away = (column as f64 - 0.4375 + 0.125 * f64::from(part) - middle) / self.sigma;
                    (-0.5 * away * away).exp()
                });
                // Intensities of developed speckle fall off exponentially.
                let grain = 1.0 - self.speckle + self.speckle * -(1.0 - chance.uniform()).ln();
                *pixel +=
                    self.amplitude * parts.sum::<f64>() / 8.0 * if self.speckle > 0.0 { grain } else { 1.0 };
            }
        }
        if self.clutter {
            self.add_clutter(number, &mut light, &mut chance);
        }
        light
            .iter()
            .map(|level| (level + chance.normal() * self.noise).round().clamp(0.0, 255.0) as u8)
            .collect()
    }

    fn add_clutter(&self, number: u64, light: &mut [f64], chance: &mut Chance) {
        for _ in 0..12 {
            let (row, column) = (chance.between(0, SIZE - 8), chance.between(0, SIZE - 12));
            if (column as f64 + 4.0 - self.centre(number, row)).abs() >= 20.0 {
                let (tall, wide) = (chance.between(2, 6), chance.between(3, 10));
                for pixels in light.chunks_exact_mut(SIZE).skip(row).take(tall) {
                    pixels.iter_mut().skip(column).take(wide).for_each(|pixel| *pixel = 150.0);
                }
            }
        }
        for _ in 0..40 {
            let index = chance.between(0, SIZE * SIZE);
            if let Some(pixel) = light.get_mut(index) {
                *pixel += 100.0;
            }
        }
    }
}

/// What a mode made of a case.
#[derive(Default)]
struct Found {
    square: f64,
    stated: f64,
    rows: f64,
    far: usize,
}

fn find(case: &Case, centre: Centre) -> Found {
    let noise = Noise { dark: case.noise as f32, speckle_px: case.speckle_px() as f32, ..Noise::default() };
    let settings = Settings { threshold: Threshold::Fixed(case.level), centre, noise, ..Settings::default() };
    let (mut extractor, mut found) = (Extractor::new(), Found::default());
    for number in 0..PICTURES {
        let pixels = case.picture(number);
        let Ok(image) = Image::new(SIZE, SIZE, &pixels) else { continue };
        let Ok(profile) = extractor.extract(&image, &settings) else { continue };
        for point in &profile.points {
            let away = f64::from(point.centre) - case.centre(number, point.row as usize);
            found.far += usize::from(away.abs() > 2.0);
            found.square += away * away;
            found.stated += f64::from(point.sigma).powi(2);
            found.rows += 1.0;
        }
    }
    found
}

fn main() {
    println!(
        "| pictures | Agin's mode | centroid | says | Gaussian derivative | bound of noise | speckle | rows found | off by > 2 px: Agin's, centroid, derivative |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for case in CASES {
        let line_sigma_px = case.sigma as f32;
        let modes = [Centre::Binary, Centre::Centroid, Centre::GaussianDerivative { line_sigma_px }];
        let [binary, centroid, derivative] = modes.map(|mode| find(&case, mode));
        let rms = |sum: f64, of: &Found| (sum / of.rows.max(1.0)).sqrt();
        let (bound, speckle) = (case.noise_bound(), case.speckle_px());
        println!(
            "| {} | {:.3} | {:.4} | {:.4} | {:.4} | {bound:.4} | {speckle:.3} | {:.1} % | {}, {}, {} |",
            case.name,
            rms(binary.square, &binary),
            rms(centroid.square, &centroid),
            rms(centroid.stated, &centroid),
            rms(derivative.square, &derivative),
            100.0 * centroid.rows / (PICTURES as f64 * SIZE as f64),
            binary.far,
            centroid.far,
            derivative.far
        );
    }
}
