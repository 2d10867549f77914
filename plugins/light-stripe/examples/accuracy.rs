//! How exactly the stripe's centre is found in pictures whose stripe is known: `cargo run --release -p plumb-light-stripe --example accuracy`.
//!
//! Prints a table by signal to noise, width, saturation, speckle and clutter: the root mean square error of Agin's mode, of the centroid and of the Gaussian derivative, beside the
//! Cramer-Rao bound for additive noise (root of 2 s / sqrt(pi), times noise over amplitude), and what the centroid says of itself. Each case is 64 pictures of 256 rows.

#![allow(clippy::print_stdout, reason = "its table is what it is for")]

#[path = "../tests/common/chance.rs"]
mod chance;

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
    Case { name: "", sigma: 1.6, amplitude: 200.0, noise: 2.0, level: 60, speckle: 0.0, clutter: false };

const CASES: [Case; 11] = [
    Case { name: "signal to noise 100, width .7 px", sigma: 0.7, ..PLAIN },
    Case { name: "signal to noise 100, width 1.6 px", ..PLAIN },
    Case { name: "signal to noise 40, width 1.6 px", noise: 5.0, ..PLAIN },
    Case { name: "signal to noise 20, width 1.6 px", amplitude: 100.0, noise: 5.0, level: 35, ..PLAIN },
    Case { name: "signal to noise 8, width 1.6 px", amplitude: 50.0, noise: 6.0, level: 32, ..PLAIN },
    Case { name: "signal to noise 50, width 3.5 px", sigma: 3.5, amplitude: 150.0, noise: 3.0, ..PLAIN },
    Case { name: "saturated twice over", amplitude: 480.0, ..PLAIN },
    Case { name: "saturated four times over", amplitude: 960.0, ..PLAIN },
    Case { name: "speckle of contrast .3", speckle: 0.3, amplitude: 150.0, ..PLAIN },
    Case { name: "speckle of contrast 1", speckle: 1.0, amplitude: 80.0, level: 30, ..PLAIN },
    Case { name: "clutter: spurs, specks and a gap", amplitude: 180.0, noise: 3.0, clutter: true, ..PLAIN },
];

impl Case {
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
            let place = chance.between(0, SIZE * SIZE);
            if let Some(pixel) = light.get_mut(place) {
                *pixel += 100.0;
            }
        }
    }
}

/// What a mode made of a case.
#[derive(Default)]
struct Found {
    square: f64,
    said: f64,
    rows: f64,
    far: usize,
}

fn find(case: &Case, centre: Centre) -> Found {
    let noise = Noise { dark: case.noise as f32, ..Noise::default() };
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
            found.said += f64::from(point.sigma).powi(2);
            found.rows += 1.0;
        }
    }
    found
}

fn main() {
    println!(
        "| pictures | Agin's mode | centroid | says | Gaussian derivative | bound | rows found | off by > 2 px: Agin's, centroid, derivative |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for case in CASES {
        let line_sigma_px = case.sigma as f32;
        let modes = [Centre::Binary, Centre::Centroid, Centre::GaussianDerivative { line_sigma_px }];
        let [binary, centroid, derivative] = modes.map(|mode| find(&case, mode));
        let rms = |sum: f64, of: &Found| (sum / of.rows.max(1.0)).sqrt();
        let total = (case.noise * case.noise + 1.0 / 12.0).sqrt();
        let bound = total / case.amplitude * (2.0 * case.sigma / std::f64::consts::PI.sqrt()).sqrt();
        println!(
            "| {} | {:.3} | {:.4} | {:.4} | {:.4} | {bound:.4} | {:.1} % | {}, {}, {} |",
            case.name,
            rms(binary.square, &binary),
            rms(centroid.square, &centroid),
            rms(centroid.said, &centroid),
            rms(derivative.square, &derivative),
            100.0 * centroid.rows / (PICTURES as f64 * SIZE as f64),
            binary.far,
            centroid.far,
            derivative.far
        );
    }
}
