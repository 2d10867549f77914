//! What a table has to offer at all, for effects to be seen in it.

use plumb_kinematics::{Posture, Weights};

use super::identity::Channel;
use super::sampling::distinct;
use super::situation::way;
use crate::arm_model::{Model, SurfaceShape};
use crate::table::Table;

/// What a table logs, and what of it varies: the passport of the data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Passport {
    /// Rows.
    pub rows: usize,
    /// Rows in groups of returns.
    pub returns: usize,
    /// Joints that arrived from both sides.
    pub both_sides: Vec<bool>,
    /// Joints that moved both ways from row to row, in a table that logs no sides of approach and whose rows are poses gone to one after the other.
    pub both_ways: Vec<bool>,
    /// Span of time, s; nothing if not logged.
    pub time_span: Option<f64>,
    /// Range of temperature, K; nothing if not logged.
    pub temperature_range: Option<f64>,
    /// Range of load, kg; nothing if not logged.
    pub payload_range: Option<f64>,
    /// The numbers that were read.
    pub channels: Vec<Channel>,
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
    /// Whether light stripes were seen.
    pub stripes: bool,
    /// Whether the arm was in motion where that is logged.
    pub moves: bool,
    /// What steps in time are dated by, in order: time in s as in the table, or rows' numbers.
    pub clocks: Vec<f64>,
    /// Greatest moment of gravity about each joint in the table's poses, N m, by the nominal model.
    pub greatest_moments: Vec<f64>,
    /// Least and greatest coordinate of each joint.
    pub ranges: Vec<(f64, f64)>,
    /// Where each slide was measured, mm, each place once and in order; empty of joints that turn.
    pub places: Vec<Vec<f64>>,
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
                && table.profiles.is_empty()
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
            both_ways: both_ways(table),
            time_span: table.time.as_deref().and_then(range),
            temperature_range: table.temperature.as_deref().and_then(range),
            payload_range: table.payload.as_deref().and_then(range),
            channels: channels(table),
            sessions: table.session.names.len(),
            measures_points: !table.positions.is_empty()
                || !table.touch.names.is_empty()
                || !table.orientations.is_empty()
                || table.board.is_some()
                || !table.profiles.is_empty(),
            triggers: (0..table.len()).any(|row| table.on.name(row).is_some() && triggered(&row)),
            stripes: table.is_of_stripes(),
            moves: table.speed.iter().flatten().any(|speed| *speed != 0.0),
            // Pictures stand in the order of their scans, each from another side: undated, what depends on the pose would look like a step.
            clocks: if table.is_of_stripes() && table.time.is_none() { Vec::new() } else { clocks(table) },
            greatest_moments: greatest_moments(model, table),
            ranges: (0..table.joints).map(span).collect(),
            places: (0..table.joints).map(|joint| places(model, table, joint)).collect(),
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

    /// Whether a joint is known to have arrived from both sides: it was logged.
    pub fn has_both_sides(&self, joint: usize) -> bool {
        self.both_sides.get(joint).copied().unwrap_or(false)
    }

    /// Whether a joint arrived from both sides, as logged or, where no sides are logged, by its way from row to row.
    pub fn came_both_ways(&self, joint: usize) -> bool {
        self.has_both_sides(joint) || self.both_ways.get(joint).copied().unwrap_or(false)
    }
}

/// Which joints moved both ways from row to row; none where sides of approach are logged, or the rows are pictures of scans.
fn both_ways(table: &Table) -> Vec<bool> {
    if table.approach.is_some() || table.is_of_stripes() {
        return vec![false; table.joints];
    }
    let order = table.order();
    let moved = |joint: usize, sign: f64| {
        let pairs = order.iter().zip(order.iter().skip(1));
        let coordinate = |row: &usize| table.q_of(*row).get(joint).copied().unwrap_or(0.0);
        pairs.into_iter().any(|(before, after)| way(coordinate(after) - coordinate(before)) == sign)
    };
    (0..table.joints).map(|joint| moved(joint, 1.0) && moved(joint, -1.0)).collect()
}

/// Where a slide was measured, mm.
fn places(model: &Model, table: &Table, joint: usize) -> Vec<f64> {
    if !model.slides(joint) {
        return Vec::new();
    }
    distinct((0..table.len()).filter_map(|row| table.q_of(row).get(joint).copied()).collect())
}

/// The numbers that a table holds readings of.
fn channels(table: &Table) -> Vec<Channel> {
    let finite = |column: &Option<Vec<f64>>| column.iter().flatten().any(|value| value.is_finite());
    let position = |axis: usize| {
        let all = table.positions.iter().flat_map(|columns| &columns.xyz);
        all.filter_map(|xyz| xyz.get(axis)).any(|part| part.is_finite())
    };
    let tilt = |axis: usize| {
        table.tilt.iter().flatten().filter_map(|tilt| tilt.get(axis)).any(|part| part.is_finite())
    };
    let is_read = |channel: &Channel| match channel {
        Channel::X => position(0),
        Channel::Y => position(1),
        Channel::Z => position(2),
        Channel::Distance => finite(&table.distance),
        Channel::Height => finite(&table.height),
        Channel::TiltX => tilt(0),
        Channel::TiltY => tilt(1),
    };
    Channel::ALL.into_iter().filter(is_read).collect()
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
