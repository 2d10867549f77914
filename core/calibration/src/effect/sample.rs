//! What an effect may know of a row.

use nalgebra::{Matrix3, Vector3};
use plumb_kinematics::{Chain, DhParameter, LinkFrames, Motion, Weights};

use super::{Contribution, Dof, Effect};
use crate::arm_model::Sensor;
use crate::table::Table;

/// One row of measurements as an effect sees it: pose, motion, time and load.
#[derive(Debug, Clone, Copy)]
pub struct Sample<'a> {
    /// The arm.
    pub chain: &'a Chain,
    /// Commanded coordinates, rad or mm.
    pub q: &'a [f64],
    /// Commanded coordinates of the row before, in the order of time; nothing in the first.
    pub previous: Option<&'a [f64]>,
    /// The way in which each joint arrived, as in [`Table::approach`](crate::table::Table::approach); empty where not logged.
    pub approach: &'a [i8],
    /// How fast each joint went, rad/s or mm/s; empty where not logged.
    pub speed: &'a [f64],
    /// Seconds since the first row; not a number where not logged.
    pub time: f64,
    /// What steps in time are dated by: seconds as in the table, or the row's number where no time is logged.
    pub clock: f64,
    /// The epoch of the row, from 0.
    pub epoch: usize,
    /// deg C; not a number where not logged.
    pub temperature: f64,
    /// Moments of gravity about the joints' axes, N m.
    pub moments: &'a [f64],
    /// Everything with weight.
    pub weights: Weights<'a>,
    /// The frames of the arm in this row.
    pub link_frames: &'a LinkFrames,
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
    /// The surface it was over, by its index in the model.
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

/// A smaller change of a joint's coordinate from one row to the next is no move but the scatter of what was read, rad or mm.
const LEAST_MOVE: f64 = 1e-3;

/// The way of a move: +1 up, -1 down, 0 where it is none.
pub(super) fn way(moved: f64) -> f64 {
    if moved.abs() < LEAST_MOVE { 0.0 } else { moved.signum() }
}

/// How far a joint moved between two rows, rad or mm; 0 of a joint that is not there.
pub(super) fn moved(q: &[f64], previous: &[f64], joint: usize) -> f64 {
    let coordinates = q.get(joint).zip(previous.get(joint));
    coordinates.map_or(0.0, |(now, before)| now - before)
}

/// How fast a joint went from one row to the next, as a fraction of the fastest of its kind, with the sense of its move.
///
/// All joints of a coordinated move start and stop together, so that their speeds are to each other as their ways, and the one with the longest way goes at full
/// speed (Siciliano et al. 2009, Robotics, section 4.1).
fn speed_fraction(chain: &Chain, q: &[f64], previous: &[f64], joint: usize) -> f64 {
    let motion = |joint: usize| chain.joints.get(joint).map(|row| row.motion);
    let of_its_kind = (0..q.len()).filter(|other| motion(*other) == motion(joint));
    let longest = of_its_kind.map(|other| moved(q, previous, other).abs()).fold(0.0, f64::max);
    // Below the scatter of what was read nothing moved.
    if way(longest) == 0.0 { 0.0 } else { moved(q, previous, joint) / longest }
}

/// The speed of a joint in the move to each row of a table, as in [`Sample::speed_fraction`].
pub fn speed_fractions(chain: &Chain, table: &Table, joint: usize) -> Vec<f64> {
    let rows = table.rows_before().into_iter().enumerate();
    let speeds = rows.map(|(row, before)| {
        before.map_or(0.0, |before| speed_fraction(chain, table.q_of(row), table.q_of(before), joint))
    });
    speeds.collect()
}

/// Temperature at which lengths are what they are said to be, deg C (ISO 1).
const REFERENCE_TEMPERATURE: f64 = 20.0;

impl Sample<'_> {
    /// What an effect contributes, in place of what `room` held.
    pub(crate) fn contributions_of<'c>(
        &self,
        effect: &dyn Effect,
        room: &'c mut Vec<Contribution>,
    ) -> &'c [Contribution] {
        room.clear();
        effect.contribute(self, room);
        room
    }

    /// How much warmer than 20 deg C (ISO 1) it was, K; 0 where no temperature is logged, for then nothing is known to have grown.
    pub fn warmer_than_reference(&self) -> f64 {
        if self.temperature.is_finite() { self.temperature - REFERENCE_TEMPERATURE } else { 0.0 }
    }

    /// The commanded coordinate of a joint.
    pub fn coordinate(&self, joint: usize) -> f64 {
        self.q.get(joint).copied().unwrap_or(0.0)
    }

    /// The way in which a joint arrived, as a number: +1 its coordinate grew, -1 it fell.
    pub fn side(&self, joint: usize) -> f64 {
        self.approach.get(joint).copied().map_or(0.0, f64::from)
    }

    /// How far a joint moved since the row before, rad or mm; 0 where there is none.
    pub fn last_move(&self, joint: usize) -> f64 {
        // In the order of time, not of the file: that is how the arm moved.
        self.previous.map_or(0.0, |previous| moved(self.q, previous, joint))
    }

    /// How fast a joint went in the last move, as a fraction of the fastest joint of its kind (of those that turn, or of those that slide), with the sense of its
    /// move; 0 where none of them moved, or no row is before.
    pub fn speed_fraction(&self, joint: usize) -> f64 {
        self.previous.map_or(0.0, |previous| speed_fraction(self.chain, self.q, previous, joint))
    }

    /// The way in which a joint arrived: as it was logged; where none were logged, its way from the row before.
    pub fn side_or_way(&self, joint: usize) -> f64 {
        // A logged side is known; a way is a guess by the row before, which says nothing of what happened between.
        match self.approach.is_empty() {
            true => way(self.last_move(joint)),
            false => self.side(joint),
        }
    }

    /// The moment of gravity about a joint's axis, N m.
    pub fn moment(&self, joint: usize) -> f64 {
        self.moments.get(joint).copied().unwrap_or(0.0)
    }

    /// A change of a joint's coordinate (rad or mm a unit of the parameter): turns it about its axis, or slides it
    /// along, in the coordinate's sense.
    pub fn contribute_to_joint(&self, joint: usize, parameter: usize, rate: f64) -> Contribution {
        let row = self.chain.joints.get(joint);
        // In its row a coordinate counts times its sign; whatever changes the coordinate does too.
        let sign = row.map_or(1.0, |row| row.sign);
        let slides = row.is_some_and(|row| row.motion == Motion::Slides);
        let dh_parameter = if slides { DhParameter::D } else { DhParameter::Theta };
        Contribution { parameter, dof: Dof::Joint(joint, dh_parameter), rate: rate * sign }
    }

    /// A turn about a joint's axis in the axis's own sense.
    pub fn rotate_joint(&self, joint: usize, parameter: usize, rate: f64) -> Contribution {
        Contribution { parameter, dof: Dof::Joint(joint, DhParameter::Theta), rate }
    }
}
