//! What time and temperature do to an arm's shape.

use super::imperfection::{Imperfection, Mechanism, Warming};
use super::rigid::Vector;
use super::shape::Shape;

/// Temperature at which the arm has its cold size, degrees Celsius.
pub const COLD_C: f64 = 20.0;

/// A change of shape that goes on while the machine works.
#[derive(Debug, Clone, PartialEq)]
pub struct SlowChange {
    mechanism: Mechanism,
    size: f64,
}

/// The slow changes among these imperfections.
pub fn changes(imperfections: &[Imperfection]) -> Vec<SlowChange> {
    let slow = |one: &&Imperfection| {
        matches!(
            one.mechanism,
            Mechanism::ThermalGrowth { .. } | Mechanism::WarmUp { .. } | Mechanism::Drift { .. }
        )
    };
    imperfections
        .iter()
        .filter(slow)
        .map(|one| SlowChange { mechanism: one.mechanism.clone(), size: one.size })
        .collect()
}

impl SlowChange {
    /// Changes `shape` to what it is `time_s` after switching on, at `temperature_c`.
    pub fn apply(&self, shape: &mut Shape, time_s: f64, temperature_c: f64) {
        match self.mechanism {
            Mechanism::ThermalGrowth { joint } => {
                if let Some(row) = shape.rows.get_mut(joint) {
                    let growth = 1.0 + self.size * (temperature_c - COLD_C);
                    row.length *= growth;
                    row.offset *= growth;
                }
            }
            Mechanism::WarmUp { joint, of, time_constant_s } => {
                let reached = self.size * (1.0 - (-time_s / time_constant_s).exp());
                if let Some(row) = shape.rows.get_mut(joint) {
                    match of {
                        Warming::Zero => row.shift_zero(reached),
                        Warming::Length => row.length += reached,
                        Warming::Offset => row.offset += reached,
                    }
                }
            }
            Mechanism::Drift { direction } => {
                shape.world_from_base.translation += Vector::from(direction) * (self.size * time_s / 3600.0);
            }
            _ => {}
        }
    }
}
