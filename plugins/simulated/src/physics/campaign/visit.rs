//! One visit of a campaign, and where its pose may lie.

use super::catalogue::drawn_travel;
use super::specification::{Specification, Spread};
use crate::physics::description::ArmDescription;
use crate::physics::random::Random;

/// How far a joint goes too far before it comes back, rad.
const OVERSHOOT: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Half of a narrow window, rad.
const NARROW: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// One visit of the campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Visit {
    /// Commanded joint angles, rad; whole thousandths of a degree.
    pub commanded: Vec<f64>,
    /// The same in degrees.
    pub commanded_deg: Vec<f64>,
    /// The way in which each joint arrives, as `approach_q1 ...` of a table: +1 its coordinate grows, -1 it falls, 0 not moved.
    pub sides: Vec<f64>,
    /// Since switching on, s.
    pub time_s: f64,
    /// Degrees Celsius, as logged.
    pub temperature_c: f64,
    /// kg.
    pub payload_kg: f64,
    /// Number of the pose among the repeated ones, from 1.
    pub repeat: Option<usize>,
    /// Which socket the target sits in, from 0, where it sits in one.
    pub touch: Option<usize>,
}

impl Visit {
    /// A visit to a pose (degrees) under no particular circumstances.
    pub(super) fn to(commanded_deg: Vec<f64>) -> Self {
        Self {
            commanded: commanded_deg.iter().map(|angle| angle.to_radians()).collect(),
            commanded_deg,
            sides: Vec::new(),
            time_s: 0.0,
            temperature_c: 20.0,
            payload_kg: 0.0,
            repeat: None,
            touch: None,
        }
    }

    /// A visit to a pose as an arm reads it, rad or mm, reached straight from the one before.
    pub(super) fn at(commanded: Vec<f64>) -> Self {
        Self { commanded, ..Self::to(Vec::new()) }
    }

    /// Commands another pose (degrees; rounded to thousandths).
    pub(super) fn command(&mut self, commanded_deg: Vec<f64>) {
        self.commanded_deg = commanded_deg.into_iter().map(|angle| rounded(angle, 1000.0)).collect();
        self.commanded = self.commanded_deg.iter().map(|angle| angle.to_radians()).collect();
    }

    /// Where each joint goes before it comes back, rad.
    pub fn beyond(&self) -> Vec<f64> {
        self.commanded.iter().zip(&self.sides).map(|(angle, side)| angle - side * OVERSHOOT).collect()
    }
}

/// From where to where each joint goes in this campaign, degrees.
pub(super) fn windows(specification: &Specification, random: &mut Random) -> Vec<[f64; 2]> {
    let arm: &ArmDescription = &specification.arm;
    let window = |joint: usize| {
        let [low, high] = drawn_travel(arm, joint);
        let (low, high) = (low + OVERSHOOT, high - OVERSHOOT);
        let (low, high) = if low < high { (low, high) } else { (0.5 * (low + high), 0.5 * (low + high)) };
        if specification.spread != Spread::Narrow {
            return [low.to_degrees(), high.to_degrees()];
        }
        let half = NARROW.min(0.5 * (high - low));
        let middle = random.between(low + half, high - half);
        [(middle - half).to_degrees(), (middle + half).to_degrees()]
    };
    (0..arm.joints.len()).map(window).collect()
}

pub(super) fn anywhere(windows: &[[f64; 2]], random: &mut Random) -> Vec<f64> {
    windows.iter().map(|[low, high]| rounded(random.between(*low, *high), 1000.0)).collect()
}

/// A value rounded to so many parts of its unit.
pub(super) fn rounded(value: f64, per_unit: f64) -> f64 {
    (value * per_unit).round() / per_unit
}
