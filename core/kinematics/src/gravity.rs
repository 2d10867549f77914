//! Moments of gravity about the joints.

use nalgebra::{Point3, Vector3};

use crate::posture::Posture;

/// Standard acceleration of free fall, m/s2.
pub const GRAVITY: f64 = 9.806_65;

/// A mass fixed in the frame after one joint's row.
#[derive(Debug, Clone, PartialEq)]
pub struct Mass {
    /// Index of the joint it moves with.
    pub after: usize,
    /// kg.
    pub mass: f64,
    /// Its centre in that joint's frame, mm.
    pub centre: Vector3<f64>,
}

/// The moment of gravity about each joint's axis, N m, positive in the axis's sense; for a sliding joint it is still
/// the moment about its axis.
///
/// `down` is the direction of gravity in the base frame (unit length). `payload` hangs at `payload_point` (base frame,
/// mm). The moments go to `moments`, which is cleared first.
pub fn moments(
    posture: &Posture,
    masses: &[Mass],
    payload: f64,
    payload_point: &Vector3<f64>,
    down: &Vector3<f64>,
    moments: &mut Vec<f64>,
) {
    moments.clear();
    let pull = down * (GRAVITY * 1e-3);
    for (index, joint) in posture.joints.iter().enumerate() {
        let about = |centre: Vector3<f64>| joint.axis.dot(&(centre - joint.axis_point).cross(&pull));
        let mut moment = if payload == 0.0 { 0.0 } else { payload * about(*payload_point) };
        for mass in masses.iter().filter(|mass| mass.after >= index) {
            if let Some(link) = posture.joints.get(mass.after) {
                moment += mass.mass * about((link.end * Point3::from(mass.centre)).coords);
            }
        }
        moments.push(moment);
    }
}
