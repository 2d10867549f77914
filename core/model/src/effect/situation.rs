//! What an effect may know of a row, and what a table has to offer at all.

use nalgebra::{Matrix3, Vector3};
use plumb_kinematics::{Chain, Knob, Motion, Posture, Weights};

use super::{Drive, Handle};
use crate::file::{Model, Sensor, SurfaceShape};
use crate::table::Table;

/// The circumstances of one row.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a> {
    /// The arm.
    pub chain: &'a Chain,
    /// Commanded coordinates, rad or mm.
    pub q: &'a [f64],
    /// Commanded coordinates of the row before, in the order of time; nothing in the first.
    pub previous: Option<&'a [f64]>,
    /// Side each joint arrived from; empty where not logged.
    pub approach: &'a [i8],
    /// Seconds since the first row; not a number where not logged.
    pub time: f64,
    /// What steps in time are dated by: seconds as in the table, or the row's number where no time is logged.
    pub clock: f64,
    /// deg C; not a number where not logged.
    pub temperature: f64,
    /// Moments of gravity about the joints' axes, N m.
    pub moments: &'a [f64],
    /// Everything with weight.
    pub weights: Weights<'a>,
    /// The frames of the arm in this row.
    pub posture: &'a Posture,
    /// The predicted point, in the measurements' frame, mm.
    pub point: Vector3<f64>,
    /// Axes of the flange in the measurements' frame.
    pub hand: Matrix3<f64>,
    /// What the arm's own sensor did, in rows where it triggered.
    pub trigger: Option<Trigger>,
}

/// A switching of the arm's own sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trigger {
    /// The surface it was over, by its place in the model.
    pub surface: usize,
    /// It was over an edge, rather than over something flat or round.
    pub edge: bool,
    /// On which side of the edge it is light: +1 left of its direction, -1 right, 0 where the model does not say.
    pub light: f64,
    /// It came on, rather than went off.
    pub came_on: bool,
    /// How far it was from the table along its line of sight, mm; not a number where that is not known yet.
    pub distance: f64,
    /// The sensor by its data sheet, where the model has it.
    pub sensor: Option<Sensor>,
}

impl Situation<'_> {
    /// The commanded coordinate of a joint.
    pub fn coordinate(&self, joint: usize) -> f64 {
        self.q.get(joint).copied().unwrap_or(0.0)
    }

    /// The side a joint arrived from, as a number.
    pub fn side(&self, joint: usize) -> f64 {
        self.approach.get(joint).copied().map_or(0.0, f64::from)
    }

    /// The moment of gravity about a joint's axis, N m.
    pub fn moment(&self, joint: usize) -> f64 {
        self.moments.get(joint).copied().unwrap_or(0.0)
    }

    /// A change of a joint's coordinate (rad or mm a unit of the parameter): turns it about its axis, or slides it
    /// along, in the coordinate's sense.
    pub fn drive_joint(&self, joint: usize, parameter: usize, rate: f64) -> Drive {
        let row = self.chain.joints.get(joint);
        let sign = row.map_or(1.0, |row| row.sign);
        let slides = row.is_some_and(|row| row.motion == Motion::Slides);
        let knob = if slides { Knob::D } else { Knob::Theta };
        Drive { parameter, handle: Handle::Joint(joint, knob), rate: rate * sign }
    }

    /// A turn about a joint's axis in the axis's own sense.
    pub fn turn_joint(&self, joint: usize, parameter: usize, rate: f64) -> Drive {
        Drive { parameter, handle: Handle::Joint(joint, Knob::Theta), rate }
    }
}

/// What a table logs, and what of it varies: the passport of the data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Passport {
    /// Rows.
    pub rows: usize,
    /// Rows in groups of returns.
    pub returns: usize,
    /// Joints that arrived from both sides.
    pub both_sides: Vec<bool>,
    /// Span of time, s; nothing if not logged.
    pub time_span: Option<f64>,
    /// Range of temperature, K; nothing if not logged.
    pub temperature_range: Option<f64>,
    /// Range of load, kg; nothing if not logged.
    pub payload_range: Option<f64>,
    /// Number of sessions named.
    pub sessions: usize,
    /// Whether points were measured (or touched), not heights and tilts alone.
    pub measures_points: bool,
    /// Whether the arm's own sensor triggered over a surface in some row.
    pub triggers: bool,
    /// The surfaces over which it did, by their places in the model.
    pub triggered_on: Vec<usize>,
    /// Whether in some rows it came on, and in some it went off.
    pub switches_both_ways: bool,
    /// What steps in time are dated by, in order: time in s as in the table, or rows' numbers.
    pub clocks: Vec<f64>,
    /// Greatest moment of gravity about each joint in the table's poses, N m, by the nominal model.
    pub greatest_moments: Vec<f64>,
    /// Least and greatest coordinate of each joint.
    pub ranges: Vec<(f64, f64)>,
}

fn range(values: &[f64]) -> Option<f64> {
    let finite = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    (high >= low).then_some(high - low)
}

impl Passport {
    /// Reads it off a table.
    pub fn of(model: &Model, table: &Table) -> Self {
        let sides = |joint: usize| {
            let has = |side: i8| (0..table.len()).any(|row| table.approach_of(row, joint) == side);
            has(1) && has(-1)
        };
        let span = |joint: usize| {
            (0..table.len())
                .filter_map(|row| table.q_of(row).get(joint).copied())
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)))
        };
        let triggered = |row: &usize| {
            !table.height.as_ref().and_then(|height| height.get(*row)).is_some_and(|h| h.is_finite())
        };
        let mut triggered_on: Vec<usize> = (0..table.len())
            .filter(triggered)
            .filter_map(|row| model.surface_position(table.on.name(row)?))
            .collect();
        triggered_on.sort_unstable();
        triggered_on.dedup();
        let signals = || (0..table.len()).filter(triggered).filter_map(|row| table.came_on(row));
        Self {
            triggered_on,
            switches_both_ways: signals().any(|on| on) && signals().any(|on| !on),
            rows: table.len(),
            returns: table.returns().iter().map(Vec::len).sum(),
            both_sides: (0..table.joints).map(sides).collect(),
            time_span: table.time.as_deref().and_then(range),
            temperature_range: table.temperature.as_deref().and_then(range),
            payload_range: table.payload.as_deref().and_then(range),
            sessions: table.session.names.len(),
            measures_points: !table.positions.is_empty() || !table.touch.names.is_empty(),
            triggers: (0..table.len()).any(|row| {
                let height = table.height.as_ref().and_then(|height| height.get(row));
                table.on.name(row).is_some() && height.is_none_or(|height| !height.is_finite())
            }),
            clocks: clocks(table),
            greatest_moments: greatest_moments(model, table),
            ranges: (0..table.joints).map(span).collect(),
        }
    }

    /// Whether the arm's own sensor triggered over an edge of which the model says where it is light.
    pub(crate) fn triggers_at_edges(&self, model: &Model) -> bool {
        let lit = |surface: &usize| {
            model.surfaces.get(*surface).is_some_and(|surface| {
                surface.light.is_some() && matches!(surface.shape, SurfaceShape::Line { .. })
            })
        };
        self.triggered_on.iter().any(lit)
    }

    /// Whether a joint arrived from both sides.
    pub fn has_both_sides(&self, joint: usize) -> bool {
        self.both_sides.get(joint).copied().unwrap_or(false)
    }
}

fn clocks(table: &Table) -> Vec<f64> {
    match &table.time {
        Some(time) => table
            .order()
            .into_iter()
            .filter_map(|row| time.get(row).copied())
            .filter(|time| time.is_finite())
            .collect(),
        None => (0..table.len()).map(|row| row as f64).collect(),
    }
}

/// Poses looked at to find the greatest moments.
const MANY: usize = 2000;

fn greatest_moments(model: &Model, table: &Table) -> Vec<f64> {
    let mut greatest = vec![0.0_f64; model.chain.len()];
    let down = model.down(&model.base.pose.rotation);
    let (mut posture, mut moments) = (Posture::default(), Vec::new());
    for row in (0..table.len()).step_by(table.len().div_ceil(MANY).max(1)) {
        let load =
            table.payload.as_ref().and_then(|loads| loads.get(row)).copied().filter(|load| load.is_finite());
        posture.update(&model.chain, table.q_of(row), &[]);
        Weights { masses: &model.masses, payload: load.unwrap_or(0.0), down }.moments(&posture, &mut moments);
        for (greatest, moment) in greatest.iter_mut().zip(&moments) {
            *greatest = greatest.max(moment.abs());
        }
    }
    greatest
}
