//! What is found in pictures whose stripe is known: against the Cramer-Rao bound, in clutter, and where there is none.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "common/chance.rs"]
mod chance;

use chance::Chance;
use plumb_light_stripe::extract::{
    Centre, Extractor, Image, NoStripe, Noise, Pieces, RowPoint, Settings, Threshold,
};

struct Scene {
    width: usize,
    height: usize,
    light: Vec<f64>,
    noise: f64,
    shot: f64,
    chance: Chance,
}

impl Scene {
    fn dark(width: usize, height: usize, level: f64, noise: f64, seed: u64) -> Self {
        Self { width, height, light: vec![level; width * height], noise, shot: 0.0, chance: Chance(seed) }
    }

    /// A line of Gaussian cross section, integrated over the pixels.
    fn stripe(
        &mut self,
        rows: std::ops::Range<usize>,
        sigma: f64,
        amplitude: f64,
        centre: impl Fn(usize) -> f64,
    ) {
        for row in rows {
            let middle = centre(row);
            for column in 0..self.width {
                let parts = (0..8).map(|part| {
                    let away = (column as f64 - 0.4375 + 0.125 * f64::from(part) - middle) / sigma;
                    (-0.5 * away * away).exp()
                });
                self.light[row * self.width + column] += amplitude * parts.sum::<f64>() / 8.0;
            }
        }
    }

    fn block(&mut self, rows: std::ops::Range<usize>, columns: std::ops::Range<usize>, level: f64) {
        for row in rows {
            self.light[row * self.width + columns.start..row * self.width + columns.end].fill(level);
        }
    }

    fn shoot(&mut self) -> Vec<u8> {
        let Self { light, noise, shot, chance, .. } = self;
        let grey = |level: &f64| level + chance.normal() * (*noise * *noise + *shot * level).sqrt();
        light.iter().map(grey).map(|level| level.round().clamp(0.0, 255.0) as u8).collect()
    }

    fn found(&mut self, settings: &Settings) -> Result<Vec<RowPoint>, NoStripe> {
        let pixels = self.shoot();
        let image = Image::new(self.width, self.height, &pixels).unwrap();
        Extractor::new().extract(&image, settings).map(|profile| profile.points.clone())
    }
}

fn fixed(level: u8) -> Settings {
    Settings { threshold: Threshold::Fixed(level), ..Settings::default() }
}

/// Rms error, rms of what the points say of themselves, and the Cramer-Rao bound for additive noise, px.
fn accuracy(sigma: f64, amplitude: f64, noise: f64, level: u8, centre: Centre) -> (f64, f64, f64) {
    let (mut errors, mut message, mut count) = (0.0, 0.0, 0.0);
    for seed in 0..12 {
        let mut scene = Scene::dark(64, 256, 10.0, noise, seed);
        let stripe_column = move |row: usize| 30.0 + 0.0371 * row as f64 - 4.0;
        scene.stripe(0..256, sigma, amplitude, stripe_column);
        let settings =
            Settings { centre, noise: Noise { dark: noise as f32, ..Noise::default() }, ..fixed(level) };
        for point in scene.found(&settings).unwrap() {
            errors += (f64::from(point.centre) - stripe_column(point.row as usize)).powi(2);
            message += f64::from(point.sigma).powi(2);
            count += 1.0;
        }
    }
    let total = (noise * noise + 1.0 / 12.0).sqrt();
    let bound = total / amplitude * (2.0 * sigma / std::f64::consts::PI.sqrt()).sqrt();
    ((errors / count).sqrt(), (message / count).sqrt(), bound)
}

#[test]
fn the_centroid_comes_near_the_cramer_rao_bound_and_knows_its_own_uncertainty() {
    for (sigma, amplitude, noise, level) in
        [(1.6, 200.0, 2.0, 30), (0.9, 200.0, 2.0, 30), (1.6, 100.0, 5.0, 30), (3.5, 150.0, 3.0, 30)]
    {
        let (rms, message, bound) = accuracy(sigma, amplitude, noise, level, Centre::Centroid);
        println!(
            "width {sigma} px, signal to noise {:.0}: centroid {rms:.4} px, says {message:.4}, bound {bound:.4}",
            amplitude / noise
        );
        assert!(rms < 1.5 * bound + 0.008, "{rms} px against a bound of {bound}");
        assert!((0.7..1.4).contains(&(message / rms)), "says {message}, is {rms}");
    }
}

#[test]
fn the_gaussian_derivative_is_the_better_one_where_light_is_low() {
    let (sigma, amplitude, noise) = (1.6, 50.0, 6.0);
    let derivative = Centre::GaussianDerivative { line_sigma_px: 1.6 };
    let (centroid, ..) = accuracy(sigma, amplitude, noise, 32, Centre::Centroid);
    let (rms, message, bound) = accuracy(sigma, amplitude, noise, 32, derivative);
    println!(
        "signal to noise 8: derivative {rms:.4} px, says {message:.4}, bound {bound:.4}; centroid {centroid:.4}"
    );
    assert!(rms < 0.95 * centroid, "{rms} against {centroid}");
    assert!((0.7..1.4).contains(&(message / rms)), "says {message}, is {rms}");
}

#[test]
fn agins_mode_gives_the_middle_and_width_of_the_lit_pixels() {
    let mut scene = Scene::dark(64, 40, 0.0, 0.0, 1);
    scene.block(0..40, 20..25, 200.0);
    let found = scene.found(&Settings { centre: Centre::Binary, ..fixed(60) }).unwrap();
    assert_eq!(found.len(), 40);
    assert!(found.iter().all(|point| point.centre == 22.0 && point.width == 5.0));
    let (binary, ..) = accuracy(1.6, 200.0, 2.0, 80, Centre::Binary);
    let (centroid, ..) = accuracy(1.6, 200.0, 2.0, 80, Centre::Centroid);
    println!("the same frames: Agin's mode {binary:.3} px, centroid {centroid:.3} px");
    assert!(centroid * 3.0 < binary);
}

#[test]
fn saturation_is_flagged_and_costs_little() {
    let mut scene = Scene::dark(64, 256, 10.0, 2.0, 5);
    let stripe_column = |row: usize| 30.0 + 0.01 * row as f64;
    scene.stripe(0..256, 1.6, 480.0, stripe_column);
    let found = scene.found(&fixed(40)).unwrap();
    assert!(found.iter().all(|point| point.is(RowPoint::SATURATED)));
    let square = |point: &RowPoint| (f64::from(point.centre) - stripe_column(point.row as usize)).powi(2);
    let rms = (found.iter().map(square).sum::<f64>() / found.len() as f64).sqrt();
    assert!(rms < 0.04, "{rms} px");
}

#[test]
fn of_cluttered_frames_not_one_row_is_wrong() {
    for seed in 0..32 {
        let (width, height) = (256, 256);
        let mut scene = Scene::dark(width, height, 8.0, 3.0, seed);
        let phase = scene.chance.uniform() * 6.0;
        let end = height * 9 / 10;
        let stripe_column = move |row: usize| {
            120.0 + 25.0 * (row as f64 / 256.0 - 0.5) + 8.0 * (row as f64 / 31.0 + phase).sin()
        };
        scene.stripe(0..end, 1.6, 180.0, stripe_column);
        for _ in 0..12 {
            let (row, column) = (scene.chance.between(0, height - 8), scene.chance.between(0, width - 12));
            if (column as f64 + 4.0 - stripe_column(row)).abs() >= 20.0 {
                let (tall, wide) = (scene.chance.between(2, 6), scene.chance.between(3, 10));
                scene.block(row..row + tall, column..column + wide, 150.0);
            }
        }
        for _ in 0..40 {
            let (row, column) = (scene.chance.between(0, height), scene.chance.between(0, width));
            scene.light[row * width + column] += 100.0;
        }
        let found = scene.found(&fixed(60)).unwrap();
        assert!(found.len() > end - 10, "{} rows of {end}", found.len());
        for point in found {
            let away = f64::from(point.centre) - stripe_column(point.row as usize);
            assert!(away.abs() < 2.0, "frame {seed}, row {}: {away} px", point.row);
        }
    }
}

#[test]
fn a_spur_joined_to_the_stripe_is_cut_whether_it_branches_or_lies_in_a_row() {
    let mut scene = Scene::dark(128, 128, 5.0, 1.0, 3);
    let stripe_column = |_: usize| 60.3;
    scene.stripe(0..128, 1.5, 180.0, stripe_column);
    scene.block(50..52, 62..90, 170.0);
    scene.block(80..95, 64..66, 170.0);
    scene.block(78..82, 60..66, 170.0);
    let found = scene.found(&fixed(50)).unwrap();
    assert!(found.len() >= 120);
    for point in &found {
        let away = (f64::from(point.centre) - 60.3).abs();
        assert!(away < 2.0, "row {}: {away} px", point.row);
        assert_eq!(point.is(RowPoint::SPUR), (50..52).contains(&point.row), "row {}", point.row);
    }
}

#[test]
fn where_no_stripe_can_be_recognised_there_is_an_error_and_no_point() {
    let empty = Scene::dark(64, 64, 8.0, 1.0, 1).found(&fixed(60)).unwrap_err();
    assert_eq!(empty, NoStripe::Dark { threshold: 60 });
    let white = Scene::dark(64, 64, 250.0, 1.0, 1).found(&fixed(60)).unwrap_err();
    assert!(matches!(white, NoStripe::Bright { .. }), "{white}");

    let mut two = Scene::dark(64, 64, 5.0, 1.0, 1);
    two.stripe(0..64, 1.5, 180.0, |_| 20.0);
    two.stripe(0..64, 1.5, 180.0, |_| 40.0);
    let error = two.found(&fixed(60)).unwrap_err();
    assert_eq!(error, NoStripe::Ambiguous { rows: 64, other_rows: 64 });
    let shared = two.found(&Settings { pieces: Pieces::All, ..fixed(60) }).unwrap();
    assert!(shared.is_empty(), "rows that two pieces share are left out");

    let mut flat = Scene::dark(64, 64, 5.0, 1.0, 1);
    flat.block(30..33, 5..60, 180.0);
    let error = flat.found(&fixed(60)).unwrap_err();
    assert!(matches!(error, NoStripe::Flat { columns: 55, rows: 3 }), "{error}");

    let mut short = Scene::dark(64, 64, 5.0, 1.0, 1);
    short.block(30..34, 20..23, 180.0);
    assert_eq!(short.found(&fixed(60)).unwrap_err(), NoStripe::Short { rows: 4, least: 8 });
}

#[test]
fn a_broken_stripe_gives_its_tallest_piece_or_all_of_them() {
    let mut scene = Scene::dark(64, 100, 5.0, 1.0, 1);
    scene.stripe(0..40, 1.5, 180.0, |_| 20.0);
    scene.stripe(45..100, 1.5, 180.0, |_| 33.0);
    let rows = |found: Vec<RowPoint>| (found.len(), found[0].row, found[found.len() - 1].row);
    assert_eq!(rows(scene.found(&fixed(60)).unwrap()), (55, 45, 99));
    assert_eq!(rows(scene.found(&Settings { pieces: Pieces::All, ..fixed(60) }).unwrap()), (95, 0, 99));
}

#[test]
fn a_stripe_at_the_pictures_edge_is_flagged() {
    let mut scene = Scene::dark(64, 64, 5.0, 1.0, 1);
    scene.stripe(0..64, 1.5, 180.0, |_| 0.2);
    assert!(scene.found(&fixed(60)).unwrap().iter().all(|point| point.is(RowPoint::AT_EDGE)));
}

#[test]
fn a_stripe_of_one_lit_pixel_a_row_does_not_claim_to_know_where_in_it_it_lies() {
    let mut pixels = vec![0_u8; 32 * 32];
    pixels.chunks_mut(32).for_each(|row| row[12] = 90);
    let image = Image::new(32, 32, &pixels).unwrap();
    let mut extractor = Extractor::new();
    let found = extractor.extract(&image, &fixed(40)).unwrap();
    assert_eq!(found.points.len(), 32);
    assert!(found.points.iter().all(|point| point.sigma > 0.15), "{:?}", found.points.first());
}
