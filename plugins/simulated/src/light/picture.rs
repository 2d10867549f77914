//! Taking a picture.

use super::surface::{Hit, first_hit, is_clear};
use super::{Light, Switches};
use crate::physics::random::Random;
use crate::physics::rigid::{Rigid, Vector};

/// A grey picture, 8 bits a pixel, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// A row after the other.
    pub pixels: Vec<u8>,
}

/// Rays for each row of the picture.
const RAYS_PER_ROW: usize = 2;

/// The room's light is looked at in squares of so many pixels where it is the same all over, which the filter makes it.
const COARSE: usize = 16;

/// Numbers of the table noise is taken from.
const NOISE_TABLE: usize = 1 << 16;

/// The stripe's light on a surface, as the camera sees it.
#[derive(Debug, Clone, Copy)]
struct Lit {
    u: f64,
    v: f64,
    /// How far in the picture the light moves for a mm that the sheet moves along its normal.
    across: [f64; 2],
    thickness: f64,
    level: f64,
    patch: (usize, usize),
}

pub(super) fn take(light: &Light, world_from_flange: &Rigid, switches: Switches, number: u64) -> Picture {
    let camera = &light.camera;
    let (width, height) = (camera.width, camera.height);
    let mut random = Random::new(light.seed ^ number.wrapping_mul(0x9E37_79B9), "a picture's noise");
    let mut levels = room(light, world_from_flange, switches);
    if switches.laser {
        lay_stripe(light, world_from_flange, &mut levels, &mut random);
    }
    let noise = noise_table(light.seed);
    let mut pixels = vec![0_u8; width * height];
    for (pixels, levels) in pixels.chunks_exact_mut(width).zip(levels.chunks_exact(width)) {
        let from = random.bits() as usize % (NOISE_TABLE - width.min(NOISE_TABLE - 1));
        let noise = noise.get(from..).unwrap_or_default();
        expose(camera.dark_noise as f32, camera.noise_per_level as f32, levels, noise, pixels);
    }
    Picture { width, height, pixels }
}

/// Grey levels with their noise, cut off at the ends of the scale.
fn expose(dark: f32, per_level: f32, levels: &[f32], noise: &[f32], pixels: &mut [u8]) {
    let dark_square = dark * dark;
    for ((pixel, level), chance) in pixels.iter_mut().zip(levels).zip(noise) {
        let spread = (dark_square + per_level * level).sqrt();
        *pixel = (level + spread * chance + 0.5).clamp(0.0, 255.0) as u8;
    }
}

/// Normally distributed numbers, the same for a world: drawing them anew for every pixel would take longer than everything else.
fn noise_table(seed: u64) -> Vec<f32> {
    use std::cell::RefCell;
    thread_local! {
        static TABLE: RefCell<(u64, Vec<f32>)> = const { RefCell::new((0, Vec::new())) };
    }
    TABLE.with_borrow_mut(|(made_from, table)| {
        if table.is_empty() || *made_from != seed {
            let mut random = Random::new(seed, "a camera's noise");
            *table = (0..NOISE_TABLE).map(|_| random.normal() as f32).collect();
            *made_from = seed;
        }
        table.clone()
    })
}

/// What the room's light makes of the surfaces.
fn room(light: &Light, world_from_flange: &Rigid, switches: Switches) -> Vec<f32> {
    let camera = &light.camera;
    let (width, height) = (camera.width, camera.height);
    let full = if switches.filter { light.ambient.filtered } else { light.ambient.open };
    let world_from_camera = *world_from_flange * camera.flange_from_camera;
    let seen = |u: usize, v: usize| {
        let toward = world_from_camera.rotation.apply(camera.direction(u as f64, v as f64));
        let toward = toward * (1.0 / toward.norm());
        let hit = first_hit(&light.surfaces, world_from_camera.translation, toward);
        // Lamps above: what looks up is brightest.
        let lit = hit.map_or(0.0, |hit| hit.reflectance * (0.7 + 0.3 * hit.normal.z.max(0.0)));
        (camera.black + full * lit) as f32
    };
    let mut levels = vec![camera.black as f32; width * height];
    if full <= 0.0 {
        return levels;
    }
    let step = if switches.filter { COARSE } else { 1 };
    for v in (0..height).step_by(step) {
        for u in (0..width).step_by(step) {
            let level = seen((u + step / 2).min(width - 1), (v + step / 2).min(height - 1));
            for row in v..(v + step).min(height) {
                let begin = row * width;
                if let Some(square) = levels.get_mut(begin + u..begin + (u + step).min(width)) {
                    square.fill(level);
                }
            }
        }
    }
    levels
}

/// Lays the light of the stripe over the picture.
fn lay_stripe(light: &Light, world_from_flange: &Rigid, levels: &mut [f32], random: &mut Random) {
    let rays = light.camera.height * RAYS_PER_ROW;
    let widest = light.projector.half_fan.tan();
    let mut before: Option<Lit> = None;
    for ray in 0..=rays {
        let tangent = widest * (2.0 * ray as f64 / rays as f64 - 1.0);
        let lit = fall(light, world_from_flange, tangent);
        if let (Some(before), Some(lit)) = (before, lit)
            && before.patch == lit.patch
        {
            lay_piece(light, &before, &lit, levels, random);
        }
        before = lit;
    }
}

/// Where a ray of the sheet falls, and what the camera sees of it; none when it sees nothing.
fn fall(light: &Light, world_from_flange: &Rigid, tangent: f64) -> Option<Lit> {
    let projector = &light.projector;
    let world_from_projector = *world_from_flange * projector.flange_from_projector;
    let world_from_camera = *world_from_flange * light.camera.flange_from_camera;
    let toward = world_from_projector.rotation.apply(projector.direction(tangent));
    let hit = first_hit(&light.surfaces, world_from_projector.translation, toward)?;
    let point = world_from_projector.translation + toward * hit.distance;
    let lens = world_from_camera.translation;
    let sees =
        hit.normal.dot(lens - point) > 0.0 && is_clear(&light.surfaces, point + hit.normal * 1e-4, lens);
    if !sees {
        return None;
    }
    let camera_from_world = world_from_camera.inverse();
    let project = |point: Vector| light.camera.project(camera_from_world.apply(point));
    let [u, v] = project(point)?;
    // A sheet that moves along its normal moves its light along the surface.
    let sheet_normal = world_from_projector.rotation.x;
    let along = sheet_normal - toward * (hit.normal.dot(sheet_normal) / hit.normal.dot(toward));
    let [moved_u, moved_v] = project(point + along * 0.1)?;
    Some(Lit {
        u,
        v,
        across: [(moved_u - u) * 10.0, (moved_v - v) * 10.0],
        thickness: projector.thickness(hit.distance),
        level: level(light, &hit, toward, tangent),
        patch: hit.patch,
    })
}

/// Grey level of the stripe's middle before the lens blurs it.
fn level(light: &Light, hit: &Hit, toward: Vector, tangent: f64) -> f64 {
    let square_on = -hit.normal.dot(toward);
    let spread = (300.0 / hit.distance).powi(2);
    light.projector.level_at_300 * light.projector.brightness(tangent) * hit.reflectance * square_on * spread
}

/// Lays the light between two rays into the rows between them.
fn lay_piece(light: &Light, from: &Lit, to: &Lit, levels: &mut [f32], random: &mut Random) {
    let (upper, lower) = if from.v <= to.v { (from, to) } else { (to, from) };
    let span = lower.v - upper.v;
    if span <= 0.0 || span > light.camera.height as f64 {
        return;
    }
    let slope = (lower.u - upper.u) / span;
    let first = upper.v.ceil().max(0.0) as usize;
    let end = (lower.v.ceil().max(0.0) as usize).min(light.camera.height);
    for row in first..end {
        let fraction = (row as f64 - upper.v) / span;
        let between = |a: f64, b: f64| a + (b - a) * fraction;
        let middle = between(upper.u, lower.u);
        // In one row: what the sheet's thickness spreads along the surface, taken back along the stripe into the row.
        let [across_u, across_v] =
            [between(upper.across[0], lower.across[0]), between(upper.across[1], lower.across[1])];
        let thickness = between(upper.thickness, lower.thickness) * (across_u - across_v * slope).abs();
        let blur = light.camera.blur * (1.0 + slope * slope).sqrt();
        let sigma = thickness.hypot(blur).max(0.2);
        let peak = between(upper.level, lower.level) * thickness / sigma;
        lay_row(light, row, middle, sigma, peak, levels, random);
    }
}

/// Lays one row's light: a bell, as much of it as falls on each pixel, with speckle.
fn lay_row(
    light: &Light,
    row: usize,
    middle: f64,
    sigma: f64,
    peak: f64,
    levels: &mut [f32],
    random: &mut Random,
) {
    let width = light.camera.width;
    let reach = 4.0 * sigma + 1.0;
    let first = (middle - reach).ceil().max(0.0) as usize;
    let end = ((middle + reach).max(0.0) as usize + 1).min(width);
    let Some(pixels) =
        levels.get_mut(row * width..(row + 1) * width).and_then(|row| row.get_mut(first..end.max(first)))
    else {
        return;
    };
    for (column, pixel) in (first..).zip(pixels) {
        // Three positions in the pixel with Simpson's weights represent all of it.
        let bell = |part: f64| (-0.5 * ((column as f64 + part - middle) / sigma).powi(2)).exp();
        let falls = (bell(-0.5) + 4.0 * bell(0.0) + bell(0.5)) / 6.0;
        *pixel += (peak * falls * speckle(light.projector.speckle, random)) as f32;
    }
}

/// A factor of mean 1 and this contrast: the mean of as many grains, each exponentially distributed, as it takes.
fn speckle(contrast: f64, random: &mut Random) -> f64 {
    if contrast <= 0.0 {
        return 1.0;
    }
    let grains = (1.0 / (contrast * contrast)).round().max(1.0) as u32;
    if grains > 12 {
        return (1.0 + contrast * random.normal()).max(0.0);
    }
    (0..grains).map(|_| -(1.0 - random.between(0.0, 1.0)).ln()).sum::<f64>() / f64::from(grains)
}
