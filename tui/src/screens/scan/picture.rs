//! A view as a picture.

use super::eye::{Seen, Short, Viewpoint};
use super::raster::{Ink, Raster};
use super::scale::Scale;
use super::state::{ScanState, Strokes};
use crate::screens::pane;

/// How large a picture is, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PictureSize {
    /// Pixels in a row; of each picture of a stereo pair.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Default for PictureSize {
    fn default() -> Self {
        Self { width: 1280, height: 960 }
    }
}

const PAPER: Ink = [255, 255, 255];
const LETTERS: Ink = [60, 60, 60];
const EDGE: Ink = [200, 40, 40];

/// Colours from low to high.
const RAMP: [Ink; 5] = [[49, 54, 149], [33, 130, 160], [60, 150, 70], [214, 130, 20], [178, 24, 43]];

/// Half the angle between the two eyes of a stereo pair, rad: about that of a reader's.
const HALF_STEREO: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Rows of a picture for the colours and the scale, and for each line of words below them.
const LEGEND: usize = 34;
const LINE: usize = 22;

/// Pixels at the sides that stay free.
const MARGIN: usize = 12;

/// How much of half a picture's shorter side a scale takes at most.
const LONGEST_SCALE: f64 = 0.5;

/// The view as PNG; with `stereo` two of them side by side, the left one for the left eye.
pub(crate) fn picture(scan: &ScanState, size: PictureSize, stereo: bool) -> Result<Vec<u8>, String> {
    let eyes = if stereo {
        vec![scan.eye.beside(-HALF_STEREO), scan.eye.beside(HALF_STEREO)]
    } else {
        vec![scan.eye.clone()]
    };
    let width = size.width * eyes.len();
    let mut raster = Raster::new(width, size.height, PAPER);
    let words = pane::wrapped(&words(scan), width.saturating_sub(2 * MARGIN) / Raster::LETTER);
    // Small pictures are for the cloud: the words take a third of them at most.
    let lines = words.len().min((size.height / 3).saturating_sub(LEGEND) / LINE);
    let foot = LEGEND + LINE * lines;
    for (index, eye) in eyes.into_iter().enumerate() {
        let scan = ScanState { eye, ..scan.clone() };
        draw(
            &scan,
            &mut raster,
            PictureSize { height: size.height.saturating_sub(foot).max(1), ..size },
            index * size.width,
        );
    }
    legend(scan, &mut raster, size, size.height.saturating_sub(foot));
    for (index, line) in words.iter().take(lines).enumerate() {
        let top = size.height.saturating_sub(foot) + LEGEND + LINE * index;
        raster.text(MARGIN, top, line, LETTERS);
    }
    raster.png().map_err(|error| error.to_string())
}

/// Draws the cloud into a part of the picture of this size.
fn draw(scan: &ScanState, raster: &mut Raster, size: PictureSize, left: usize) {
    let (width, height) = (size.width as f64, size.height as f64);
    let unit = width.min(height) / 2.0;
    let on_paper = |seen: Seen| (left as f64 + width / 2.0 + seen.x * unit, height / 2.0 - seen.y * unit);
    let inside = |(x, y): (f64, f64)| x >= left as f64 && x < left as f64 + width && y >= 0.0 && y < height;
    let (low, high) = scan.values();
    let projected: Vec<Option<(Seen, Ink)>> = scan
        .points
        .iter()
        .map(|point| Some((scan.eye.see(&point.position)?, shade((scan.value(point) - low) / (high - low)))))
        .collect();
    // What is far is drawn first, what is near over it.
    let mut order: Vec<usize> = (0..projected.len()).collect();
    let depth = |index: &usize| projected.get(*index).copied().flatten().map_or(0.0, |(seen, _)| seen.depth);
    order.sort_by(|one, other| depth(other).total_cmp(&depth(one)));
    let gap = scan.widest_gap();
    for index in order {
        let Some((seen, ink)) = projected.get(index).copied().flatten() else { continue };
        let here = on_paper(seen);
        if scan.strokes == Strokes::Points {
            if inside(here) {
                raster.disc(here.0, here.1, 1.2, ink);
            }
            continue;
        }
        let next = projected.get(index + 1).copied().flatten();
        if let (Some((next, _)), true) = (next, joined(scan, index, gap)) {
            let there = on_paper(next);
            if inside(here) && inside(there) {
                raster.line(here, there, 1.4, ink);
            }
        } else if inside(here) {
            raster.disc(here.0, here.1, 0.7, ink);
        }
    }
    if let (Viewpoint::EdgeOn { .. }, Some(band)) = (&scan.eye.viewpoint, &scan.band) {
        for edge in [band.edges.0, band.edges.1] {
            if let Some(seen) = scan.eye.see(&(band.middle + band.normal * edge)) {
                let (_, y) = on_paper(seen);
                raster.line((left as f64, y), (left as f64 + width, y), 1.0, EDGE);
            }
        }
    }
}

/// Whether a point and the next are neighbours on one stripe.
pub(super) fn joined(scan: &ScanState, index: usize, gap: f64) -> bool {
    let (Some(one), Some(other)) = (scan.points.get(index), scan.points.get(index + 1)) else { return false };
    one.stripe == other.stripe
        && (other.seen.v_px - one.seen.v_px) <= 2.0
        && (one.position - other.position).norm() <= gap
}

/// What the view is, in words.
fn words(scan: &ScanState) -> String {
    match (&scan.eye.viewpoint, &scan.band) {
        (Viewpoint::EdgeOn { .. }, Some(band)) => {
            format!("edge-on: 95 % in {:.3} mm, rms {:.3} mm", band.thickness(), band.rms)
        }
        _ => scan.eye.describe(),
    }
}

/// Below the view: what colours say at the left, a scale at the right. `top` is where the view ends.
fn legend(scan: &ScanState, raster: &mut Raster, size: PictureSize, top: usize) {
    let (low, high) = scan.values();
    let (what, unit) = scan.colouring.title_and_unit();
    let bar = 120.min(size.width / 4);
    let middle = top as f64 + LEGEND as f64 / 2.0;
    for x in 0..bar {
        let ink = shade(x as f64 / bar as f64);
        let x = (MARGIN + x) as f64;
        raster.line((x, middle - 5.0), (x, middle + 5.0), 1.0, ink);
    }
    let half_side = size.width.min(top) as f64 / 2.0;
    let scale = Scale::across(&scan.eye, LONGEST_SCALE);
    let (right, length) = ((size.width - MARGIN) as f64, scale.in_view * half_side);
    raster.line((right - length, middle), (right, middle), 2.0, LETTERS);
    for end in [right - length, right] {
        raster.line((end, middle - 6.0), (end, middle + 6.0), 2.0, LETTERS);
    }
    let reported = scale.label(&scan.eye);
    let letters_top = top + (LEGEND - Raster::LETTER) / 2;
    let scale_left = ((right - length) as usize).saturating_sub(reported.len() * Raster::LETTER + MARGIN);
    raster.text(scale_left, letters_top, &reported, LETTERS);
    let legend = format!("{what} {} to {} {unit}", Short(low), Short(high));
    let from = MARGIN + bar + MARGIN;
    let room = scale_left.saturating_sub(from + MARGIN) / Raster::LETTER;
    raster.text(from, letters_top, &pane::fitted(legend.trim_end(), room), LETTERS);
    if let Some(scale) = Scale::of_thickness(&scan.eye, LONGEST_SCALE) {
        let (low, length) = (top as f64 - MARGIN as f64, scale.in_view * half_side);
        raster.line((right, low), (right, low - length), 2.0, LETTERS);
        for end in [low, low - length] {
            raster.line((right - 6.0, end), (right + 6.0, end), 2.0, LETTERS);
        }
        let reported = scale.label(&scan.eye);
        let left = (right as usize).saturating_sub(reported.len() * Raster::LETTER + MARGIN);
        raster.text(left, (low - length / 2.0).max(0.0) as usize, &reported, LETTERS);
    }
}

/// The colour of a value between 0 and 1.
fn shade(fraction: f64) -> Ink {
    let last = RAMP.len() - 1;
    let at = fraction.clamp(0.0, 1.0) * last as f64;
    let below = (at.floor() as usize).min(last - 1);
    let part = at - below as f64;
    std::array::from_fn(|channel| {
        let (low, high) = (f64::from(RAMP[below][channel]), f64::from(RAMP[below + 1][channel]));
        (low + part * (high - low)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use plumb_cloud::{Cloud, CloudPoint};

    use super::*;

    fn pixels(png: &[u8]) -> (usize, usize, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        (info.width as usize, info.height as usize, bytes)
    }

    #[test]
    fn the_words_of_a_picture_end_within_it_and_its_scale_is_as_long_as_it_says() {
        let corner =
            |x: f64, y: f64| CloudPoint { position: [x, y, 0.0].into(), stripe: 0, seen: Default::default() };
        let cloud = Cloud { points: vec![corner(0.0, 0.0), corner(100.0, 80.0)], ..Cloud::default() };
        let mut scan = ScanState::of_cloud("plate.ply".to_owned(), cloud);
        scan.eye.opening = 0.0;
        for (size, stereo) in
            [(PictureSize::default(), false), (PictureSize { width: 640, height: 480 }, true)]
        {
            let (width, height, bytes) = pixels(&picture(&scan, size, stereo).unwrap());
            let is_dark = |x: usize, y: usize| bytes[3 * (y * width + x)] < 120;
            let ink_at_the_edge = (0..height).any(|y| (width - 4..width).any(|x| is_dark(x, y)));
            assert!(!ink_at_the_edge, "nothing is cut at the right");
            // The scale is the longest dark run of a row at the right of the view.
            let run = |y: usize| {
                (size.width / 2..size.width - 2)
                    .rev()
                    .skip_while(|x| !is_dark(*x, y))
                    .take_while(|x| is_dark(*x, y))
                    .count()
            };
            let drawn = (height / 2..height).map(run).max().unwrap();
            let lines = pane::wrapped(&words(&scan), (width - 2 * MARGIN) / Raster::LETTER).len();
            let half_side = size.width.min(height - LEGEND - LINE * lines) as f64 / 2.0;
            let expected = Scale::across(&scan.eye, LONGEST_SCALE).in_view * half_side;
            assert!((drawn as f64 - expected).abs() <= 4.0, "{drawn} for {expected}");
        }
    }
}
