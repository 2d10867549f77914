//! A view as a picture.

use super::eye::{Seen, Short, Stand};
use super::raster::{Ink, Raster};
use super::state::{ScanState, Strokes};

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

/// Rows of a picture kept free for its words.
const FOOT: usize = 56;

/// The view as PNG; with `stereo` two of them side by side, the left one for the left eye.
pub(crate) fn picture(scan: &ScanState, size: PictureSize, stereo: bool) -> Result<Vec<u8>, String> {
    let eyes = if stereo {
        vec![scan.eye.beside(-HALF_STEREO), scan.eye.beside(HALF_STEREO)]
    } else {
        vec![scan.eye.clone()]
    };
    let mut raster = Raster::new(size.width * eyes.len(), size.height, PAPER);
    for (place, eye) in eyes.into_iter().enumerate() {
        let scan = ScanState { eye, ..scan.clone() };
        draw(&scan, &mut raster, size, place * size.width);
    }
    foot(scan, &mut raster, size);
    raster.png().map_err(|error| error.to_string())
}

fn draw(scan: &ScanState, raster: &mut Raster, size: PictureSize, left: usize) {
    let (width, height) = (size.width as f64, size.height.saturating_sub(FOOT).max(1) as f64);
    let unit = width.min(height) / 2.0;
    let on_paper = |seen: Seen| (left as f64 + width / 2.0 + seen.x * unit, height / 2.0 - seen.y * unit);
    let inside = |(x, y): (f64, f64)| x >= left as f64 && x < left as f64 + width && y >= 0.0 && y < height;
    let (low, high) = scan.values();
    let places: Vec<Option<(Seen, Ink)>> = scan
        .points
        .iter()
        .map(|point| Some((scan.eye.see(&point.position)?, shade((scan.value(point) - low) / (high - low)))))
        .collect();
    // What is far is drawn first, what is near over it.
    let mut order: Vec<usize> = (0..places.len()).collect();
    let depth = |place: &usize| places.get(*place).copied().flatten().map_or(0.0, |(seen, _)| seen.depth);
    order.sort_by(|one, other| depth(other).total_cmp(&depth(one)));
    let gap = scan.widest_gap();
    for place in order {
        let Some((seen, ink)) = places.get(place).copied().flatten() else { continue };
        let here = on_paper(seen);
        if scan.strokes == Strokes::Points {
            if inside(here) {
                raster.disc(here.0, here.1, 1.2, ink);
            }
            continue;
        }
        let next = places.get(place + 1).copied().flatten();
        if let (Some((next, _)), true) = (next, joined(scan, place, gap)) {
            let there = on_paper(next);
            if inside(here) && inside(there) {
                raster.line(here, there, 1.4, ink);
            }
        } else if inside(here) {
            raster.disc(here.0, here.1, 0.7, ink);
        }
    }
    if let (Stand::EdgeOn { .. }, Some(band)) = (&scan.eye.stand, &scan.band) {
        for edge in [band.edges.0, band.edges.1] {
            if let Some(seen) = scan.eye.see(&(band.middle + band.normal * edge)) {
                let (_, y) = on_paper(seen);
                raster.line((left as f64, y), (left as f64 + width, y), 1.0, EDGE);
            }
        }
    }
}

/// Whether a point and the next are neighbours on one stripe.
pub(super) fn joined(scan: &ScanState, place: usize, gap: f64) -> bool {
    let (Some(one), Some(other)) = (scan.points.get(place), scan.points.get(place + 1)) else { return false };
    one.stripe == other.stripe
        && (other.seen.v_px - one.seen.v_px) <= 2.0
        && (one.position - other.position).norm() <= gap
}

fn foot(scan: &ScanState, raster: &mut Raster, size: PictureSize) {
    let top = size.height.saturating_sub(FOOT - 6);
    let (low, high) = scan.values();
    let (what, unit) = scan.colouring.told();
    let bar = 120;
    for x in 0..bar {
        let ink = shade(x as f64 / bar as f64);
        raster.line((12.0 + x as f64, top as f64 + 2.0), (12.0 + x as f64, top as f64 + 12.0), 1.0, ink);
    }
    let letters = |x: usize| size.width.saturating_sub(x) / 16;
    let cut = |text: String, x: usize| text.chars().take(letters(x)).collect::<String>();
    let legend = format!("{what} {} to {} {unit}", Short(low), Short(high));
    raster.text(bar + 24, top, &cut(legend, bar + 24), LETTERS);
    let mut words = scan.eye.told();
    if let (Stand::EdgeOn { .. }, Some(band)) = (&scan.eye.stand, &scan.band) {
        words = format!("edge-on: 95 % in {:.3} mm, rms {:.3} mm", band.thickness(), band.rms);
    }
    raster.text(12, top + 22, &cut(words, 12), LETTERS);
}

/// The colour of a value between 0 and 1.
fn shade(share: f64) -> Ink {
    let last = RAMP.len() - 1;
    let at = share.clamp(0.0, 1.0) * last as f64;
    let below = (at.floor() as usize).min(last - 1);
    let part = at - below as f64;
    std::array::from_fn(|channel| {
        let (low, high) = (f64::from(RAMP[below][channel]), f64::from(RAMP[below + 1][channel]));
        (low + part * (high - low)).round() as u8
    })
}
