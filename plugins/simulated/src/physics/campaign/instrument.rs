//! The instrument that measures the target: what it makes of the true position.

use crate::physics::imperfection::{Imperfection, Mechanism};
use crate::physics::posture::Posture;
use crate::physics::rigid::{Rotation, Vector};

use super::specification::Reading;

/// Height of the table over which heights are read, mm in the world.
pub const TABLE_HEIGHT: f64 = -400.0;
/// Point to which distances are read, mm in the world.
pub const DISTANCE_POINT: Vector = Vector::new(900.0, -650.0, 200.0);

/// An instrument with its own errors.
#[derive(Debug, Clone, PartialEq)]
pub struct Instrument {
    reading: Reading,
    scale: Vector,
    lean: Rotation,
}

impl Instrument {
    /// An instrument for this kind of reading with whatever of `imperfections` is its own.
    pub fn new(reading: Reading, imperfections: &[Imperfection]) -> Self {
        let mut instrument = Self { reading, scale: Vector::ZERO, lean: Rotation::IDENTITY };
        for one in imperfections {
            match one.mechanism {
                Mechanism::InstrumentScale { axis: 0 } => instrument.scale.x += one.size,
                Mechanism::InstrumentScale { axis: 1 } => instrument.scale.y += one.size,
                Mechanism::InstrumentScale { .. } => instrument.scale.z += one.size,
                Mechanism::InstrumentTilt { direction } => {
                    let axis = Vector::new(direction.cos(), direction.sin(), 0.0);
                    instrument.lean = Rotation::about(axis, one.size) * instrument.lean;
                }
                _ => {}
            }
        }
        instrument
    }

    /// What it shows of a standing arm, before noise.
    pub fn read(&self, posture: &Posture) -> Vec<f64> {
        let seen = self.lean.inverse().apply(posture.target);
        let scale = self.scale;
        let seen = Vector::new(seen.x * (1.0 + scale.x), seen.y * (1.0 + scale.y), seen.z * (1.0 + scale.z));
        match self.reading {
            // Where a touching target is, is not read; this is what the touching constrains.
            Reading::Position | Reading::Touch => vec![seen.x, seen.y, seen.z],
            Reading::Height => vec![seen.z - TABLE_HEIGHT],
            Reading::Distance => vec![(seen - DISTANCE_POINT).norm()],
            Reading::Tilt => {
                // An inclinometer on the flange reads against gravity: how far its y and its -x rise against its z.
                let axes = self.lean.inverse() * posture.world_from_flange.rotation;
                let lean = |across: f64| across.atan2(axes.z.z).to_degrees();
                vec![lean(axes.y.z), lean(-axes.x.z)]
            }
        }
    }
}
