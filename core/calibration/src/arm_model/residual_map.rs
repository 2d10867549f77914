//! The residual map: a flexible regression of what a model leaves, kept with it. It commands the arm where it was measured and explains nothing.
//!
//! Three kinds of function, each with weights: waves of the whole pose shift everything (random Fourier features: Rahimi & Recht 2007); cosines over a joint's
//! range, and the side from which it arrived, change that joint's coordinate (Solin & Särkkä 2020).

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::measured_region::MeasuredRegion;

/// A wave over the scaled coordinates of the pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Wave {
    /// rad per unit of each input of [`MeasuredRegion::inputs`].
    pub rates: Vec<f64>,
    /// rad.
    pub phase: f64,
    /// Shift of everything beyond the base at its crest, mm, base frame.
    pub shift: Vector3<f64>,
}

/// Cosines over a joint's range.
#[derive(Debug, Clone, PartialEq)]
pub struct Along {
    /// The joint.
    pub joint: usize,
    /// Of 1, 2, ... half periods over the range, the k-th divided by k; rad or mm of the joint's coordinate.
    pub weights: Vec<f64>,
}

/// What goes with the way in which a joint arrived (-1, 0, 1; `Table::approach`).
#[derive(Debug, Clone, PartialEq)]
pub struct Side {
    /// The joint.
    pub joint: usize,
    /// The side itself, then the side times the cosines of [`Along`]; rad or mm.
    pub weights: Vec<f64>,
}

/// What a column of the map moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapCarrier {
    /// Everything beyond the base along an axis of the base's frame.
    Shift(usize),
    /// A joint's coordinate.
    Joint(usize),
}

/// The map.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ResidualMap {
    /// Shifts.
    pub waves: Vec<Wave>,
    /// Errors of joints by their own coordinates.
    pub along: Vec<Along>,
    /// Errors of joints by the side of approach.
    pub sides: Vec<Side>,
    /// Fraction of the variance that the model left and that the map takes away: not understood.
    pub not_understood: f64,
}

/// What a map does in a pose.
#[derive(Debug, Clone, PartialEq)]
pub struct MapEffect {
    /// Shift of everything beyond the base, mm, base frame.
    pub shift: Vector3<f64>,
    /// Change of each joint's coordinate, rad or mm, in the coordinate's sense.
    pub joints: Vec<f64>,
}

impl ResidualMap {
    /// The map's functions in a pose, one a weight, in the order of [`Self::set_weights`].
    pub fn columns(&self, region: &MeasuredRegion, q: &[f64], approach: &[i8]) -> Vec<(MapCarrier, f64)> {
        let inputs = region.inputs(q);
        let mut columns = Vec::new();
        for wave in &self.waves {
            let angle =
                wave.phase + wave.rates.iter().zip(&inputs).map(|(rate, input)| rate * input).sum::<f64>();
            let value = angle.cos();
            // One wave shifts along all three axes, each with its own weight.
            columns.extend((0..3).map(|axis| (MapCarrier::Shift(axis), value)));
        }
        for along in &self.along {
            // A constant is none of them: that is the joint's zero.
            let waves = (1..=along.weights.len()).map(|order| cosine(region, q, along.joint, order));
            columns.extend(waves.map(|value| (MapCarrier::Joint(along.joint), value)));
        }
        for side in &self.sides {
            let came = approach.get(side.joint).copied().map_or(0.0, f64::from);
            // With a constant: half of plain play. The others say how it changes over the joint's range.
            let orders = 0..side.weights.len();
            columns.extend(orders.map(|order| {
                let wave = if order == 0 { 1.0 } else { cosine(region, q, side.joint, order) };
                (MapCarrier::Joint(side.joint), came * wave)
            }));
        }
        columns
    }

    /// Takes weights in the order of [`Self::columns`].
    pub fn set_weights(&mut self, weights: &[f64]) {
        let mut next = weights.iter().copied();
        let shifts = self.waves.iter_mut().flat_map(|wave| wave.shift.iter_mut());
        let along = self.along.iter_mut().flat_map(|along| along.weights.iter_mut());
        let sides = self.sides.iter_mut().flat_map(|side| side.weights.iter_mut());
        for weight in shifts.chain(along).chain(sides) {
            *weight = next.next().unwrap_or(0.0);
        }
    }

    /// Drops functions whose weights are all zero.
    pub fn drop_idle(&mut self) {
        self.waves.retain(|wave| does_something(wave.shift.as_slice()));
        self.along.retain(|along| does_something(&along.weights));
        self.sides.retain(|side| does_something(&side.weights));
    }

    /// The weights, in the order of [`Self::columns`].
    fn weights(&self) -> impl Iterator<Item = f64> {
        let shifts = self.waves.iter().flat_map(|wave| wave.shift.iter());
        let along = self.along.iter().flat_map(|along| along.weights.iter());
        let sides = self.sides.iter().flat_map(|side| side.weights.iter());
        shifts.chain(along).chain(sides).copied()
    }

    /// What it does in a pose (rad or mm); nothing outside the region that was measured.
    pub fn at(&self, region: &MeasuredRegion, q: &[f64], approach: &[i8]) -> Option<MapEffect> {
        region.check(q).ok()?;
        let mut effect = MapEffect { shift: Vector3::zeros(), joints: vec![0.0; region.joints.len()] };
        for ((carrier, value), weight) in self.columns(region, q, approach).into_iter().zip(self.weights()) {
            let changed = match carrier {
                MapCarrier::Shift(axis) => effect.shift.get_mut(axis),
                MapCarrier::Joint(joint) => effect.joints.get_mut(joint),
            };
            if let Some(changed) = changed {
                *changed += value * weight;
            }
        }
        Some(effect)
    }
}

fn does_something(weights: &[f64]) -> bool {
    weights.iter().any(|weight| *weight != 0.0)
}

/// A cosine of so many half periods over a joint's range, divided by that number.
fn cosine(region: &MeasuredRegion, q: &[f64], joint: usize, order: usize) -> f64 {
    let (Some(range), Some(value)) = (region.joints.get(joint), q.get(joint)) else { return 0.0 };
    let width = range.high - range.low;
    if width <= 0.0 {
        return 0.0;
    }
    let order = order as f64;
    (PI * order * (value - range.low) / width).cos() / order
}
