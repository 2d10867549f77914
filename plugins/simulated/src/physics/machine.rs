//! An arm at work: commanded to go somewhere, it goes as its imperfections let it, remembers what came before, and stands where forces balance.

use super::description::ArmDescription;
use super::drive::{self, DrivePart};
use super::elastic::{self, ElasticPart, Loaded, Yielding};
use super::imperfection::{Imperfection, Mechanism};
use super::posture::Posture;
use super::rigid::{Rigid, Rotation, Vector};
use super::shape::{Arm, Shape};
use super::slow_change::{self, SlowChange};

/// Circumstances of a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Since switching on, s.
    pub time_s: f64,
    /// Of the arm, degrees Celsius.
    pub temperature_c: f64,
    /// At the target, kg.
    pub payload_kg: f64,
}

/// Why an arm does not stand still.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error(
    "the arm finds no equilibrium under {payload_kg} kg: its springs are too soft for its weight (last step {last_step:.1e} rad)"
)]
pub struct NoEquilibrium {
    /// At the target, kg.
    pub payload_kg: f64,
    /// How far the last round of the balance still moved a joint, rad.
    pub last_step: f64,
}

/// A standing arm.
#[derive(Debug, Clone, PartialEq)]
pub struct Stance {
    /// Where everything is.
    pub posture: Posture,
    /// True joint values, rad, or mm of a slide.
    pub angles: Vec<f64>,
    /// Gravity's moment on each joint, N m (its force on a slide, N).
    pub moments: Vec<f64>,
}

/// An imperfect arm.
pub struct Machine {
    shape: Shape,
    arm: Arm,
    changes: Vec<SlowChange>,
    drive: Vec<Box<dyn DrivePart>>,
    elastic: Vec<Box<dyn ElasticPart>>,
    driven: Vec<f64>,
}

impl Machine {
    /// The arm of `description` with these imperfections, cold, with every joint at its zero and no history.
    pub fn new(description: &ArmDescription, imperfections: &[Imperfection]) -> Self {
        let mut shape = Shape::nominal(description);
        for imperfection in imperfections {
            misshape(&mut shape, imperfection);
        }
        Self {
            arm: shape.arm(),
            driven: vec![0.0; shape.rows.len()],
            changes: slow_change::changes(imperfections),
            drive: drive::parts(description, imperfections),
            elastic: elastic::parts(imperfections),
            shape,
        }
    }

    /// Goes straight to `commanded` (rad, or mm of a slide, one a joint), arriving at world time `time_s`.
    pub fn go(&mut self, commanded: &[f64], time_s: f64) {
        self.driven.clear();
        self.driven.extend_from_slice(commanded);
        for part in &mut self.drive {
            part.pass(&mut self.driven, time_s);
        }
    }

    /// Where the arm stands under these conditions.
    pub fn stand(&self, conditions: &Conditions) -> Result<Stance, NoEquilibrium> {
        if self.changes.is_empty() {
            return self.balance(&self.arm, conditions);
        }
        let mut shape = self.shape.clone();
        for change in &self.changes {
            change.apply(&mut shape, conditions.time_s, conditions.temperature_c);
        }
        self.balance(&shape.arm(), conditions)
    }

    /// Iterates until the load of the yielded arm yields the same arm again.
    fn balance(&self, arm: &Arm, conditions: &Conditions) -> Result<Stance, NoEquilibrium> {
        let mut yielding = Yielding::none(self.driven.len());
        let mut last_step = f64::INFINITY;
        for _ in 0..200 {
            let angles: Vec<f64> =
                self.driven.iter().zip(&yielding.turns).map(|(driven, turn)| driven + turn).collect();
            let rocking = Rigid::turned_about(
                arm.world_from_base.translation,
                Rotation::by(yielding.rocking),
                Vector::ZERO,
            );
            let posture = arm.posture(&angles, &yielding.bends, rocking);
            let loads = arm.loads(&posture, conditions.payload_kg);
            let moments = arm.gravity_moments(&posture, &loads);
            if self.elastic.is_empty() || last_step < 1e-13 {
                return Ok(Stance { posture, angles, moments });
            }
            let loaded = Loaded {
                arm,
                posture: &posture,
                angles: &angles,
                loads: &loads,
                moments: &moments,
                payload: conditions.payload_kg,
            };
            let mut next = Yielding::none(self.driven.len());
            for part in &self.elastic {
                part.yield_to(&loaded, &mut next);
            }
            last_step = step(&yielding, &next);
            yielding = next;
        }
        Err(NoEquilibrium { payload_kg: conditions.payload_kg, last_step })
    }
}

/// The largest change between two rounds, rad (mm of bending count a hundredth).
fn step(before: &Yielding, after: &Yielding) -> f64 {
    let turns = before.turns.iter().zip(&after.turns).map(|(a, b)| (a - b).abs());
    let bends = after.bends.iter().enumerate().map(|(link, bend)| {
        let earlier = before.bends.get(link).copied().unwrap_or(Rigid::IDENTITY);
        let turned =
            (bend.rotation.x - earlier.rotation.x).norm() + (bend.rotation.y - earlier.rotation.y).norm();
        turned + (bend.translation - earlier.translation).norm() * 1e-2
    });
    turns.chain(bends).fold((before.rocking - after.rocking).norm(), f64::max)
}

/// Builds a constant error of shape into the arm.
fn misshape(shape: &mut Shape, imperfection: &Imperfection) {
    let size = imperfection.size;
    match imperfection.mechanism {
        Mechanism::ToolOffset { direction } => shape.target += Vector::from(direction) * size,
        Mechanism::BasePosition { direction } => {
            shape.world_from_base.translation += Vector::from(direction) * size
        }
        Mechanism::BaseTilt { axis } => {
            let lean = Rotation::about(axis.into(), size);
            shape.world_from_base.rotation = lean * shape.world_from_base.rotation;
        }
        _ => {
            let Some(row) = imperfection.mechanism.joint().and_then(|joint| shape.rows.get_mut(joint)) else {
                return;
            };
            match imperfection.mechanism {
                Mechanism::JointZero { .. } => row.shift_zero(size),
                Mechanism::LinkLength { .. } => row.length += size,
                Mechanism::LinkOffset { .. } => row.offset += size,
                Mechanism::LinkTwist { .. } => row.twist += size,
                Mechanism::AxisSkew { .. } => row.skew += size,
                _ => {}
            }
        }
    }
}
