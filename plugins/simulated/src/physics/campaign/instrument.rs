//! The instrument that measures the target: what it makes of the true position.

use crate::physics::imperfection::{Imperfection, Mechanism};
use crate::physics::link_frames::LinkFrames;
use crate::physics::rigid::{Rotation, Vector};
use crate::physics::rotation_vector::rotation_vector;

use super::specification::Reading;

/// Height of the table over which heights are read, mm in the world.
pub const TABLE_HEIGHT: f64 = -400.0;
/// Point to which distances are read, mm in the world.
pub const DISTANCE_POINT: Vector = Vector::new(900.0, -650.0, 200.0);

/// How far from the target the reflectors of a body are, mm: its orientation is then known to the noise of a point over 141 mm.
pub const REFLECTORS_MM: f64 = 100.0;

/// How a body is turned whose reflectors were read: the target, then the ends of its x and of its y, mm. A rotation vector, rad.
pub fn turn_of(reflectors: &[f64]) -> Option<Vector> {
    let reflector = |number: usize| match reflectors.get(3 * number..3 * number + 3) {
        Some([x, y, z]) => Some(Vector::new(*x, *y, *z)),
        _ => None,
    };
    let x = (reflector(1)? - reflector(2)?).unit()?;
    let y = (reflector(3)? - reflector(4)?).across(x).unit()?;
    Some(rotation_vector(&Rotation { x, y, z: x.cross(y) }))
}

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

    /// Where it sees a point, mm.
    fn sees(&self, point: Vector) -> Vector {
        let (seen, scale) = (self.lean.inverse().apply(point), self.scale);
        Vector::new(seen.x * (1.0 + scale.x), seen.y * (1.0 + scale.y), seen.z * (1.0 + scale.z))
    }

    /// What it shows of an arm at rest, before noise.
    pub fn read(&self, link_frames: &LinkFrames) -> Vec<f64> {
        let seen = self.sees(link_frames.target);
        match self.reading {
            // Where a touching target is, is not read; this is what the touching constrains.
            Reading::Position | Reading::Touch => vec![seen.x, seen.y, seen.z],
            Reading::Pose => {
                // Each reflector is read by itself: the target in the middle, and one at either end of two axes of the body.
                let axes = link_frames.world_from_flange.rotation;
                let ends =
                    [axes.x, -axes.x, axes.y, -axes.y].map(|axis| link_frames.target + axis * REFLECTORS_MM);
                [link_frames.target]
                    .iter()
                    .chain(&ends)
                    .flat_map(|point| <[f64; 3]>::from(self.sees(*point)))
                    .collect()
            }
            Reading::Height => vec![seen.z - TABLE_HEIGHT],
            Reading::Distance => vec![(seen - DISTANCE_POINT).norm()],
            Reading::Tilt => {
                // An inclinometer on the flange reads against gravity: how far its y and its -x rise against its z.
                let axes = self.lean.inverse() * link_frames.world_from_flange.rotation;
                let lean = |across: f64| across.atan2(axes.z.z).to_degrees();
                vec![lean(axes.y.z), lean(-axes.x.z)]
            }
        }
    }
}
