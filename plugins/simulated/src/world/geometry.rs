//! Where the arm's parts stand for true attitudes: the world's own geometry of a TeachMover, independent of the project's
//! kinematics.
//!
//! Frame: the waist's axis is z, upward; the table's top is z = 0; x points where the waist's angle is 0. Lengths in mm.

use super::drive::{Joint, Joints};

/// A point or a direction in the world's frame, mm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Point {
    /// Outward at waist angle 0.
    pub x: f64,
    /// Outward at waist angle +90 degrees.
    pub y: f64,
    /// Upward from the table.
    pub z: f64,
}

/// The arm's lengths, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmGeometry {
    /// The shoulder's axis over the table.
    pub shoulder_height: f64,
    /// Shoulder's axis to elbow's axis.
    pub upper_arm: f64,
    /// Elbow's axis to the wrist.
    pub forearm: f64,
    /// Wrist to the sensor's face, the lowest point of a hand that hangs.
    pub hand: f64,
}

/// Where the arm's parts stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmPose {
    /// The elbow's axis.
    pub elbow: Point,
    /// The wrist's centre.
    pub wrist: Point,
    /// The sensor's face.
    pub tool: Point,
    /// Unit vector from the wrist to the sensor's face, along which the sensor looks.
    pub looks: Point,
}

impl ArmGeometry {
    /// Where the parts stand when the joints' true attitudes are these.
    pub fn pose(&self, attitudes: &Joints) -> ArmPose {
        let (waist_sine, waist_cosine) = attitudes.of(Joint::Waist).sin_cos();
        let along = |from: Point, length: f64, attitude: f64| {
            let (rise, reach) = attitude.sin_cos();
            Point {
                x: from.x + length * reach * waist_cosine,
                y: from.y + length * reach * waist_sine,
                z: from.z + length * rise,
            }
        };
        let shoulder = Point { x: 0.0, y: 0.0, z: self.shoulder_height };
        let pitch = attitudes.of(Joint::WristPitch);
        let elbow = along(shoulder, self.upper_arm, attitudes.of(Joint::Shoulder));
        let wrist = along(elbow, self.forearm, attitudes.of(Joint::Elbow));
        ArmPose {
            elbow,
            wrist,
            tool: along(wrist, self.hand, pitch),
            looks: along(Point::default(), 1.0, pitch),
        }
    }

    /// The length furthest from the waist's axis a part can reach, mm.
    pub fn reach(&self) -> f64 {
        self.upper_arm + self.forearm + self.hand
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    const ARM: ArmGeometry =
        ArmGeometry { shoulder_height: 195.0, upper_arm: 177.8, forearm: 177.8, hand: 109.0 };

    #[test]
    fn the_hand_hangs_under_the_wrist() {
        let pose = ARM.pose(&Joints([FRAC_PI_2, 0.0, -FRAC_PI_2, -FRAC_PI_2, 0.0, 0.0]));
        assert!((pose.tool.x).abs() < 1e-12);
        assert!((pose.tool.y - 177.8).abs() < 1e-12);
        assert!((pose.tool.z - (195.0 - 177.8 - 109.0)).abs() < 1e-12);
        assert!((pose.looks.z + 1.0).abs() < 1e-15);
    }

    #[test]
    fn moving_the_shoulder_keeps_the_attitude_of_forearm_and_hand() {
        let low = ARM.pose(&Joints([0.0, 0.2, -1.0, -1.5, 0.0, 0.0]));
        let high = ARM.pose(&Joints([0.0, 0.7, -1.0, -1.5, 0.0, 0.0]));
        assert!(((low.tool.x - low.elbow.x) - (high.tool.x - high.elbow.x)).abs() < 1e-12);
        assert!(((low.tool.z - low.elbow.z) - (high.tool.z - high.elbow.z)).abs() < 1e-12);
    }
}
