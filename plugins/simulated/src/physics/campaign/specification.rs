//! What a campaign is to be: arm, poses, circumstances, and what is hidden.

use serde::{Deserialize, Serialize};

use crate::physics::description::ArmDescription;

use super::catalogue::Choice;

/// How far the poses reach.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Spread {
    /// Evenly over all travel.
    Wide,
    /// Within a window of 40 degrees of each joint, somewhere in its travel.
    Narrow,
    /// On a regular lattice of the first three joints, neighbours one after the other.
    Grid,
}

/// From where each pose is reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Approach {
    /// Every joint first goes 3 degrees too far, to a side drawn at random, and comes back.
    EitherSide,
    /// Straight from the pose before; the side is that of the move.
    Straight,
}

/// What the user's model leaves free from the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Free {
    /// Nothing but base and target.
    None,
    /// The joints' zeros besides.
    Zeros,
    /// Zeros, lengths, offsets, twists and skews besides.
    Geometry,
}

/// What is read at each pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reading {
    /// The target's position, three coordinates.
    Position,
    /// The target's position and how it is turned, as an instrument gives both of a body with reflectors on it.
    Pose,
    /// The target's height over a level table.
    Height,
    /// The target's distance to a fixed point.
    Distance,
    /// How far the flange leans about its own x and y.
    Tilt,
    /// Nothing but that the target sits in a socket, which recurs; the joint angles are what is read.
    Touch,
}

impl Reading {
    /// Unit of the readings.
    pub fn unit(self) -> &'static str {
        if self == Self::Tilt { "deg" } else { "mm" }
    }

    /// The table's columns for one row of readings, with what names the surface or point.
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Position => &["p1_x_mm", "p1_y_mm", "p1_z_mm"],
            Self::Pose => &["p1_x_mm", "p1_y_mm", "p1_z_mm", "p1_rx_rad", "p1_ry_rad", "p1_rz_rad"],
            Self::Height => &["height_mm", "on"],
            Self::Distance => &["distance_mm", "distance_to"],
            Self::Tilt => &["tilt_x_deg", "tilt_y_deg"],
            Self::Touch => &["touch"],
        }
    }

    /// What is in the column that names the surface or point.
    pub fn against(self) -> Option<&'static str> {
        match self {
            Self::Height => Some("table"),
            Self::Distance => Some("post"),
            Self::Position | Self::Pose | Self::Tilt | Self::Touch => None,
        }
    }
}

/// How much of an effect is hidden.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Size {
    /// Such that what it adds to the readings is this many times the noise (root mean square over the campaign, per reading).
    OverNoise(f64),
    /// In the mechanism's own unit.
    Exact(f64),
}

/// One thing to hide.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Requested {
    /// What.
    pub choice: Choice,
    /// How much.
    pub size: Size,
}

/// A measurement campaign to be simulated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Specification {
    /// The arm on paper.
    pub arm: ArmDescription,
    /// What is hidden; empty for an arm that only has small constant errors.
    pub hidden: Vec<Requested>,
    /// Poses visited once.
    pub poses: usize,
    /// How far they reach.
    pub spread: Spread,
    /// How many further poses are returned to.
    pub repeated_poses: usize,
    /// How often each of those is visited.
    pub returns: usize,
    /// From where poses are reached.
    pub approach: Approach,
    /// Whether the temperature moves over the campaign.
    pub heat: bool,
    /// Payloads in use, drawn at random at each pose, kg; empty for none.
    pub payloads_kg: Vec<f64>,
    /// What is read.
    pub reading: Reading,
    /// Standard deviation of each reading, in its unit.
    pub noise: f64,
    /// Share of readings that are grossly wrong.
    pub outliers: f64,
    /// What the user's model leaves free.
    pub free: Free,
}

/// Noise of a campaign where neither the command nor the arm's file says otherwise, mm.
pub const USUAL_NOISE_MM: f64 = 0.05;

impl Specification {
    /// The usual campaign: 60 wide poses, six more returned to five times, either side, steady conditions, positions, nothing hidden.
    pub fn usual(arm: ArmDescription) -> Self {
        Self {
            noise: arm.declared_noise.unwrap_or(USUAL_NOISE_MM),
            arm,
            hidden: Vec::new(),
            poses: 60,
            spread: Spread::Wide,
            repeated_poses: 6,
            returns: 5,
            approach: Approach::EitherSide,
            heat: false,
            payloads_kg: Vec::new(),
            reading: Reading::Position,
            outliers: 0.0,
            free: Free::Zeros,
        }
    }
}
