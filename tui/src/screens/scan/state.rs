//! What the Scan screen shows.

use nalgebra::Point3;
use plumb_cell::event::StepPath;
use plumb_cloud::{Cloud, CloudPoint};
use plumb_plugin::StripePoint;

use super::band::Band;
use super::eye::{Eye, Viewpoint};

/// How points are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strokes {
    /// Each by itself.
    Points,
    /// Those of a stripe joined: a wire-frame.
    Stripes,
}

/// What colours say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colouring {
    /// How high a point lies.
    Height,
    /// How far it lies from the plane most points lie in.
    Residual,
    /// How bright the stripe was there.
    Intensity,
}

impl Colouring {
    /// What it colours by, in words, with its unit.
    pub(crate) fn title_and_unit(self) -> (&'static str, &'static str) {
        match self {
            Self::Height => ("height", "mm"),
            Self::Residual => ("from the plane", "mm"),
            Self::Intensity => ("brightness", ""),
        }
    }
}

/// A cloud and how it is looked at.
#[derive(Clone, Debug)]
pub(crate) struct ScanState {
    /// The file, or the step that scans.
    pub name: String,
    /// The points, stripe by stripe.
    pub points: Vec<CloudPoint>,
    /// How many stripes there are.
    pub stripes: usize,
    /// From where.
    pub eye: Eye,
    /// How it was before it went edge-on.
    pub before_edge: Option<Eye>,
    /// How points are drawn.
    pub strokes: Strokes,
    /// What colours say.
    pub colouring: Colouring,
    /// Where the cross is, in units of the view.
    pub aim: (f64, f64),
    /// The point the cross has found.
    pub cursor: Option<usize>,
    /// The point distances are measured from.
    pub mark: Option<usize>,
    /// The plane most points lie in; known once somebody asks for it.
    pub band: Option<Band>,
    /// Where the mouse was pressed or dragged to last, column and row.
    pub grabbed: Option<(u16, u16)>,
    /// The step that scans, while one does.
    pub step: Option<StepPath>,
    /// The operator has set the eye: it stays where it is while stripes come.
    pub eye_is_set: bool,
}

/// Points of one stripe further apart than this many times the usual are not joined.
const GAP: f64 = 8.0;

impl ScanState {
    /// A cloud from a file.
    pub(crate) fn of_cloud(name: String, cloud: Cloud) -> Self {
        let mut points = cloud.points;
        points.sort_by(|one, other| {
            (one.stripe, one.seen.v_px)
                .partial_cmp(&(other.stripe, other.seen.v_px))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        let mut stripes: Vec<u32> = points.iter().map(|point| point.stripe).collect();
        stripes.dedup();
        Self {
            name,
            stripes: stripes.len(),
            eye: Eye::around(points.iter().map(|point| point.position)),
            points,
            before_edge: None,
            strokes: if stripes.len() > 1 { Strokes::Stripes } else { Strokes::Points },
            colouring: Colouring::Height,
            aim: (0.0, 0.0),
            cursor: None,
            mark: None,
            band: None,
            grabbed: None,
            step: None,
            eye_is_set: false,
        }
    }

    /// The cloud of a step that scans, as its first stripe comes.
    pub(crate) fn of_step(step: &StepPath) -> Self {
        let empty = Self::of_cloud(step.0.clone(), Cloud::default());
        Self { step: Some(step.clone()), strokes: Strokes::Stripes, ..empty }
    }

    /// Adds a stripe that was just taken.
    pub(crate) fn add_stripe(&mut self, stripe: u32, positions: &[[f32; 3]]) {
        self.stripes += 1;
        self.points.extend((0_u16..).zip(positions).map(|(row, position)| CloudPoint {
            position: Point3::from(position.map(f64::from)),
            stripe,
            seen: StripePoint { v_px: f32::from(row), ..StripePoint::default() },
        }));
        self.band = None;
        if !self.eye_is_set {
            self.eye.see_all(self.points.iter().map(|point| point.position));
        }
    }

    /// The plane, worked out where it is not known yet.
    pub(crate) fn know_band(&mut self) {
        if self.band.is_none() {
            self.band = Band::of(&self.points);
        }
    }

    /// Looks along the plane most points lie in, or back to where the eye was before. False where there is no plane.
    pub(crate) fn toggle_edge_on(&mut self) -> bool {
        if let Some(before) = self.before_edge.take() {
            self.eye = before;
            return true;
        }
        self.know_band();
        let Some(band) = &self.band else { return false };
        let reach = self.points.iter().map(|point| (point.position - band.middle).dot(&band.along).abs());
        let span = 1.8 * reach.fold(1.0, f64::max);
        // The band takes a quarter of the view's height.
        let stretch = (span / 4.0 / band.thickness().max(1e-4)).max(1.0);
        let viewpoint = Viewpoint::EdgeOn { normal: band.normal, along: band.along, stretch };
        let eye = Eye { target: band.middle, viewpoint, opening: 0.0, span };
        self.before_edge = Some(std::mem::replace(&mut self.eye, eye));
        true
    }

    /// What a point is coloured by.
    pub(crate) fn value(&self, point: &CloudPoint) -> f64 {
        match (self.colouring, &self.band) {
            (Colouring::Residual, Some(band)) => band.away(&point.position),
            (Colouring::Intensity, _) => f64::from(point.seen.intensity),
            _ => point.position.z,
        }
    }

    /// From where to where the colours go. Residuals go as far to either side, as far as the band and what lies about it.
    pub(crate) fn values(&self) -> (f64, f64) {
        if let (Colouring::Residual, Some(band)) = (self.colouring, &self.band) {
            let most = 1.5 * band.edges.0.abs().max(band.edges.1.abs()).max(1e-6);
            return (-most, most);
        }
        let values = self.points.iter().map(|point| self.value(point));
        let (low, high) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        if low > high {
            (0.0, 1.0)
        } else if high - low < 1e-9 {
            (low - 0.5, high + 0.5)
        } else {
            (low, high)
        }
    }

    /// How far apart neighbours of a stripe may lie to be joined, mm.
    pub(crate) fn widest_gap(&self) -> f64 {
        let pairs = self.points.windows(2).filter_map(|pair| match pair {
            [one, other] if one.stripe == other.stripe => Some((one.position - other.position).norm()),
            _ => None,
        });
        let mut steps: Vec<f64> = pairs.collect();
        if steps.is_empty() {
            return 0.0;
        }
        let middle = steps.len() / 2;
        GAP * *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// The point nearest to a position of the view; of several in one position the nearest to the eye.
    pub(crate) fn nearest(&self, x: f64, y: f64) -> Option<usize> {
        let seen = self.points.iter().enumerate().filter_map(|(index, point)| {
            let seen = self.eye.see(&point.position)?;
            Some((index, (seen.x - x).hypot(seen.y - y), seen.depth))
        });
        let cost = |away: f64, depth: f64| away + 1e-3 * depth / self.eye.span;
        seen.min_by(|one, other| cost(one.1, one.2).total_cmp(&cost(other.1, other.2)))
            .map(|(index, ..)| index)
    }

    /// The point under the cursor, and the one that is marked.
    pub(crate) fn chosen(&self) -> (Option<&CloudPoint>, Option<&CloudPoint>) {
        let point = |index: Option<usize>| index.and_then(|index| self.points.get(index));
        (point(self.cursor), point(self.mark))
    }
}
