//! A move a robot is asked to make.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use super::JointVector;

/// A move of some joints, all starting and ending together.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable, Serialize, Deserialize)]
pub struct Motion {
    /// Where to, or by how much: rad, or mm where the description says so. As many as the robot has joints.
    pub target: JointVector,
    /// Bit `n` is set when joint `n` takes part; the others stay where they are and their targets are not looked at.
    pub joint_mask: u32,
    /// 1 when `target` is added to where the joints are, 0 when it is where they go.
    pub relative: u32,
    /// How fast, as a part of the full speed of the slowest joint: above 0, at most 1.
    pub speed_fraction: f64,
}

impl Motion {
    /// All joints to `target`.
    pub fn absolute(target: JointVector, speed_fraction: f64) -> Self {
        Self { target, joint_mask: mask_of_all(target.len()), relative: 0, speed_fraction }
    }

    /// All joints by `change`.
    pub fn relative(change: JointVector, speed_fraction: f64) -> Self {
        Self { target: change, joint_mask: mask_of_all(change.len()), relative: 1, speed_fraction }
    }

    /// The same move by fewer joints.
    pub fn only(self, joint_mask: u32) -> Self {
        Self { joint_mask, ..self }
    }

    /// Whether a joint takes part.
    pub fn moves(&self, joint: usize) -> bool {
        joint < self.target.len() && self.joint_mask & (1 << joint) != 0
    }

    /// Where the joints end when the move starts at `from`.
    pub fn end_from(&self, from: &JointVector) -> JointVector {
        let mut end = *from;
        for (joint, value) in end.as_mut_slice().iter_mut().enumerate() {
            if self.moves(joint) {
                let target = self.target.get(joint).unwrap_or(0.0);
                *value = if self.relative != 0 { *value + target } else { target };
            }
        }
        end
    }
}

fn mask_of_all(joints: usize) -> u32 {
    (1 << joints) - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_outside_the_mask_stay_where_they_are() {
        let from = JointVector::from_slice(&[1.0, 2.0, 3.0]).unwrap();
        let change = JointVector::from_slice(&[0.5, 0.5, 0.5]).unwrap();
        let end = Motion::relative(change, 1.0).only(0b010).end_from(&from);
        assert_eq!(end.as_slice(), [1.0, 2.5, 3.0]);
    }

    #[test]
    fn an_absolute_move_ends_at_its_target() {
        let from = JointVector::from_slice(&[1.0, 2.0]).unwrap();
        let target = JointVector::from_slice(&[-1.0, 0.25]).unwrap();
        assert_eq!(Motion::absolute(target, 1.0).end_from(&from), target);
    }
}
