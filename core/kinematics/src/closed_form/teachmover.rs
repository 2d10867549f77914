//! The TeachMover: three joints in a plane that the waist turns; shoulder, elbow and wrist pitch are attitudes against the horizontal, positive up.

use nalgebra::Vector3;

use super::{NoSolution, wrapped};

/// Its lengths, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TeachMoverGeometry {
    /// The shoulder's axis over the base's foot.
    pub shoulder_height: f64,
    /// Shoulder to elbow.
    pub upper_arm: f64,
    /// Elbow to wrist.
    pub forearm: f64,
    /// Wrist to the point that is brought somewhere.
    pub hand: f64,
}

/// Where its point is to be, and how the hand is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TeachMoverPose {
    /// The point, base frame, mm.
    pub point: Vector3<f64>,
    /// The hand's attitude against the horizontal, positive up, rad.
    pub pitch: f64,
    /// Its turn about itself, rad.
    pub roll: f64,
}

/// To which side of the waist's axis the arm reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The way the waist points.
    Forward,
    /// Over its back.
    Backward,
}

/// Which of the ways of reaching a pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TeachMoverConfiguration {
    /// To which side it reaches.
    pub side: Side,
    /// The elbow is above the line from shoulder to wrist, seen with the arm reaching to the right.
    pub elbow_above: bool,
}

impl TeachMoverConfiguration {
    /// All four.
    pub const ALL: [Self; 4] = [
        Self { side: Side::Forward, elbow_above: true },
        Self { side: Side::Forward, elbow_above: false },
        Self { side: Side::Backward, elbow_above: true },
        Self { side: Side::Backward, elbow_above: false },
    ];
}

/// Nearer to the axis than this the waist's angle is not determined, mm.
const ON_AXIS: f64 = 1e-6;

impl TeachMoverGeometry {
    /// Waist, shoulder, elbow, wrist pitch and wrist roll (rad; the middle three against the horizontal) for a pose. Limits are the caller's.
    ///
    /// # Errors
    /// [`NoSolution`]
    pub fn inverse(
        &self,
        pose: &TeachMoverPose,
        configuration: TeachMoverConfiguration,
    ) -> Result<[f64; 5], NoSolution> {
        let outward = pose.point.x.hypot(pose.point.y);
        if outward < ON_AXIS {
            return Err(NoSolution::OnFirstAxis { radius_mm: outward });
        }
        let heading = pose.point.y.atan2(pose.point.x);
        let (waist, radius) = match configuration.side {
            Side::Forward => (heading, outward),
            Side::Backward => (wrapped(heading + std::f64::consts::PI), -outward),
        };
        let (rise, reach) = pose.pitch.sin_cos();
        let wrist_out = radius - self.hand * reach;
        let wrist_up = pose.point.z - self.shoulder_height - self.hand * rise;
        let across = wrist_out.hypot(wrist_up);
        let (longest, shortest) = (self.upper_arm + self.forearm, (self.upper_arm - self.forearm).abs());
        let away = (across - longest).max(shortest - across);
        if away > 1e-9 || across < 1e-9 {
            return Err(NoSolution::OutOfReach { away_mm: away.max(0.0) });
        }
        let (long, short) = (self.upper_arm, self.forearm);
        let at_shoulder =
            ((across * across + long * long - short * short) / (2.0 * across * long)).clamp(-1.0, 1.0).acos();
        let at_wrist = ((across * across + short * short - long * long) / (2.0 * across * short))
            .clamp(-1.0, 1.0)
            .acos();
        let toward_wrist = wrist_up.atan2(wrist_out);
        let sense = if configuration.elbow_above { 1.0 } else { -1.0 };
        let shoulder = wrapped(toward_wrist + sense * at_shoulder);
        let elbow = wrapped(toward_wrist - sense * at_wrist);
        Ok([waist, shoulder, elbow, pose.pitch, pose.roll])
    }

    /// Where joints (as [`TeachMoverGeometry::inverse`] gives them) bring the point.
    pub fn forward(&self, joints: &[f64; 5]) -> TeachMoverPose {
        let [waist, shoulder, elbow, pitch, roll] = *joints;
        let radius = self.upper_arm * shoulder.cos() + self.forearm * elbow.cos() + self.hand * pitch.cos();
        let height = self.upper_arm * shoulder.sin() + self.forearm * elbow.sin() + self.hand * pitch.sin();
        let (sine, cosine) = waist.sin_cos();
        let point = Vector3::new(radius * cosine, radius * sine, self.shoulder_height + height);
        TeachMoverPose { point, pitch, roll }
    }
}
