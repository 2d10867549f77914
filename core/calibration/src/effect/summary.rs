//! What a table has to offer at all, for effects to be seen in it.

use plumb_kinematics::{LinkFrames, Weights};

use super::identity::Channel;
use super::sample::{moved, speed_fractions, way};
use super::sampling::distinct;
use crate::arm_model::{Model, SurfaceShape};
use crate::table::Table;
use crate::table::scalar::HEIGHT;

/// What a table logs, and what of it varies.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DatasetSummary {
    /// Rows.
    pub rows: usize,
    /// Rows in groups of returns.
    pub returns: usize,
    /// Joints that arrived from both sides.
    pub both_sides: Vec<bool>,
    /// Joints that moved both ways from row to row, in a table that logs no sides of approach and whose rows are poses gone to one after the other.
    pub both_ways: Vec<bool>,
    /// Joints of which the speed differed from move to move by more than its sense; none where rows are pictures of scans, or were read in motion.
    pub many_speeds: Vec<bool>,
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
    /// The surfaces over which it did, by their indices in the model.
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
    /// Where each slide was measured, mm, each position once and in order; empty of joints that turn.
    pub positions: Vec<Vec<f64>>,
}

fn range(values: &[f64]) -> Option<f64> {
    let (low, high) = span(values.iter().copied().filter(|value| value.is_finite()));
    // Without a finite value the span is turned inside out.
    (high >= low).then_some(high - low)
}

/// Least and greatest of some numbers; infinite, the greater first, where there is none.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// The coordinates of a joint in all rows, rad or mm.
fn coordinates(table: &Table, joint: usize) -> impl Iterator<Item = f64> {
    (0..table.len()).filter_map(move |row| table.q_of(row).get(joint).copied())
}

/// Whether a joint was logged to have arrived from both sides.
fn came_from_both_sides(table: &Table, joint: usize) -> bool {
    // 0 says that nobody knows, and counts for neither side.
    [1, -1].into_iter().all(|side| (0..table.len()).any(|row| table.approach_of(row, joint) == side))
}

/// Whether a row holds no height: what it lies on, if anything, is then what the arm's own sensor triggered over.
fn has_no_height(table: &Table, row: usize) -> bool {
    let height = table.scalar(&HEIGHT).and_then(|height| height.get(row));
    height.is_none_or(|height| !height.is_finite())
}

impl DatasetSummary {
    /// Reads it off a table.
    pub fn of(model: &Model, table: &Table) -> Self {
        let triggered: Vec<usize> =
            (0..table.len()).filter(|row| has_no_height(table, *row) && table.profiles.is_empty()).collect();
        let mut triggered_on: Vec<usize> =
            triggered.iter().filter_map(|row| model.surface_position(table.on.name(*row)?)).collect();
        triggered_on.sort_unstable();
        triggered_on.dedup();
        let moves = table.speed.iter().flatten().any(|speed| *speed != 0.0);
        let signals: Vec<bool> = triggered.iter().filter_map(|row| table.came_on(*row)).collect();
        Self {
            triggered_on,
            switches_both_ways: signals.contains(&true) && signals.contains(&false),
            rows: table.len(),
            returns: table.returns().iter().map(Vec::len).sum(),
            both_sides: (0..table.joints).map(|joint| came_from_both_sides(table, joint)).collect(),
            both_ways: both_ways(table),
            many_speeds: if moves { vec![false; table.joints] } else { many_speeds(model, table) },
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
            triggers: triggered.iter().any(|row| table.on.name(*row).is_some()),
            stripes: table.is_of_stripes(),
            moves,
            // Pictures are in the order of their scans, each from another side: undated, what depends on the pose would look like a step.
            clocks: if table.is_of_stripes() && table.time.is_none() { Vec::new() } else { clocks(table) },
            greatest_moments: greatest_moments(model, table),
            ranges: (0..table.joints).map(|joint| span(coordinates(table, joint))).collect(),
            positions: (0..table.joints).map(|joint| positions(model, table, joint)).collect(),
        }
    }

    /// Whether the arm's own sensor triggered over an edge of which the model says where it is light.
    pub(crate) fn triggers_at_edges(&self, model: &Model) -> bool {
        let mut surfaces = self.triggered_on.iter().filter_map(|surface| model.surfaces.get(*surface));
        // Where nobody says on which side an edge is light, a wider spot may have switched earlier or later.
        surfaces.any(|surface| surface.light.is_some() && matches!(surface.shape, SurfaceShape::Line { .. }))
    }

    /// Whether a joint is known to have arrived from both sides: it was logged.
    pub fn has_both_sides(&self, joint: usize) -> bool {
        self.both_sides.get(joint).copied().unwrap_or(false)
    }

    /// Whether a joint arrived from both sides, as logged or, where no sides are logged, by its way from row to row.
    pub fn came_both_ways(&self, joint: usize) -> bool {
        self.has_both_sides(joint) || self.both_ways.get(joint).copied().unwrap_or(false)
    }

    /// Whether the speed of a joint differed from move to move by more than its sense, so that what goes with it is not play.
    pub fn went_at_many_speeds(&self, joint: usize) -> bool {
        self.many_speeds.get(joint).copied().unwrap_or(false)
    }
}

/// Which joints moved both ways from row to row; none where sides of approach are logged, or the rows are pictures of scans.
fn both_ways(table: &Table) -> Vec<bool> {
    if table.approach.is_some() || table.is_of_stripes() {
        return vec![false; table.joints];
    }
    let order = table.order();
    (0..table.joints)
        .map(|joint| {
            let in_order = order.iter().filter_map(|row| table.q_of(*row).get(joint).copied());
            let q: Vec<f64> = in_order.collect();
            // A move below the scatter of what was read is none and has neither way.
            let ways: Vec<f64> =
                q.iter().zip(q.iter().skip(1)).map(|(before, after)| way(after - before)).collect();
            ways.contains(&1.0) && ways.contains(&-1.0)
        })
        .collect()
}

/// The correlation of a joint's speed with the sense of its moves above which both are one (pure number). Why: what is left of the one beside the other is then below a
/// third of it, less than play that differs along the travel; of two joints that move at random it is 0.92.
const SAME_AS_SENSE: f64 = 0.95;

/// Joints of which the speed differed from move to move by more than its sense, where all joints of a kind start and stop together.
fn many_speeds(model: &Model, table: &Table) -> Vec<bool> {
    if table.is_of_stripes() {
        return vec![false; table.joints];
    }
    let before = table.rows_before();
    let differ = |joint: usize| {
        let (mut across, mut speeds, mut senses) = (0.0, 0.0, 0.0);
        for (row, speed) in speed_fractions(&model.chain, table, joint).into_iter().enumerate() {
            let before = before.get(row).copied().flatten();
            let sense = before.map_or(0.0, |before| way(moved(table.q_of(row), table.q_of(before), joint)));
            across += speed * sense;
            speeds += speed * speed;
            senses += sense * sense;
        }
        // Nothing that moves has no correlation, and is not asked.
        across < SAME_AS_SENSE * f64::sqrt(speeds * senses)
    };
    (0..table.joints).map(differ).collect()
}

/// Where a slide was measured, mm.
fn positions(model: &Model, table: &Table, joint: usize) -> Vec<f64> {
    if !model.slides(joint) {
        return Vec::new();
    }
    distinct(coordinates(table, joint).collect())
}

/// The numbers that a table holds readings of.
fn channels(table: &Table) -> Vec<Channel> {
    Channel::all().filter(|channel| is_read(table, *channel)).collect()
}

/// Whether a table holds a reading of a channel: a column of empty cells is none.
fn is_read(table: &Table, channel: Channel) -> bool {
    match channel {
        Channel::X => has_position(table, 0),
        Channel::Y => has_position(table, 1),
        Channel::Z => has_position(table, 2),
        Channel::Number(_) => {
            let of_it = table.scalars.iter().filter(|column| channel.scalar() == Some(column.scalar));
            of_it.flat_map(|column| &column.values).any(|value| value.is_finite())
        }
        Channel::TiltX => has_tilt(table, 0),
        Channel::TiltY => has_tilt(table, 1),
    }
}

fn has_position(table: &Table, axis: usize) -> bool {
    let all = table.positions.iter().flat_map(|columns| &columns.xyz);
    all.filter_map(|xyz| xyz.get(axis)).any(|part| part.is_finite())
}

fn has_tilt(table: &Table, axis: usize) -> bool {
    table.tilt.iter().flatten().filter_map(|tilt| tilt.get(axis)).any(|part| part.is_finite())
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
    let (mut link_frames, mut moments) = (LinkFrames::default(), Vec::new());
    // The nominal arm in the commanded pose: what bends changes the moments by a thousandth, and candidates need no more than their size.
    for row in (0..table.len()).step_by(table.len().div_ceil(MANY).max(1)) {
        let load =
            table.payload.as_ref().and_then(|loads| loads.get(row)).copied().filter(|load| load.is_finite());
        link_frames.update(&model.chain, table.q_of(row), &[]);
        Weights { masses: &model.masses, payload: load.unwrap_or(0.0), down }
            .moments(&link_frames, &mut moments);
        for (greatest, moment) in greatest.iter_mut().zip(&moments) {
            *greatest = greatest.max(moment.abs());
        }
    }
    greatest
}
