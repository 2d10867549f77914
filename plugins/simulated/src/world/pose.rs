//! Where the arm's parts are.

use super::drive::Joint;
use crate::physics::link_frames::LinkFrames;
use crate::physics::rigid::Vector;

/// Where the arm's parts are, mm in the world's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmPose {
    /// The elbow's axis.
    pub elbow: Vector,
    /// The wrist's centre.
    pub wrist: Vector,
    /// The sensor's face.
    pub tool: Vector,
    /// Unit vector from the wrist to the sensor's face, along which the sensor looks.
    pub looks: Vector,
}

impl ArmPose {
    /// The parts of a TeachMover in this configuration.
    pub(super) fn of(link_frames: &LinkFrames) -> ArmPose {
        let axis = |joint: Joint| link_frames.axes.get(joint.index());
        let centre = |joint: Joint| axis(joint).map_or(Vector::ZERO, |axis| axis.point);
        ArmPose {
            elbow: centre(Joint::Elbow),
            wrist: centre(Joint::WristPitch),
            tool: link_frames.target,
            // The wrist rolls about the hand's own axis.
            looks: axis(Joint::WristRoll).map_or(Vector::ZERO, |axis| axis.direction),
        }
    }

    /// How deep the lowest part is under the table, mm; negative over it.
    pub(super) fn under_table(&self) -> f64 {
        -self.tool.z.min(self.wrist.z).min(self.elbow.z)
    }
}
