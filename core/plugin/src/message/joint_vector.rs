//! One number for each joint of a robot.

use std::fmt;

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The most joints a robot may have, its gripper among them.
pub const MAX_JOINTS: usize = 8;

/// One number for each joint, in the order of the robot's description: rad for a turning joint, mm for a sliding one or a gripper.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct JointVector {
    /// How many of `values` are in use.
    pub count: u32,
    /// Always zero.
    pub reserved: u32,
    /// The numbers; those past `count` are zero.
    pub values: [f64; MAX_JOINTS],
}

/// More numbers were given than a robot may have joints.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{given} joint values given; a robot has at most {MAX_JOINTS} joints")]
pub struct TooManyJoints {
    /// How many numbers were given.
    pub given: usize,
}

impl JointVector {
    /// `count` zeros; at most [`MAX_JOINTS`] of them.
    pub fn zeros(count: usize) -> Self {
        Self { count: count.min(MAX_JOINTS) as u32, reserved: 0, values: [0.0; MAX_JOINTS] }
    }

    /// The numbers of a slice.
    ///
    /// # Errors
    /// [`TooManyJoints`] when the slice holds more than [`MAX_JOINTS`].
    pub fn from_slice(values: &[f64]) -> Result<Self, TooManyJoints> {
        let mut vector = Self::zeros(values.len());
        match vector.values.get_mut(..values.len()) {
            Some(entries) => entries.copy_from_slice(values),
            None => return Err(TooManyJoints { given: values.len() }),
        }
        Ok(vector)
    }

    /// The numbers in use. A count beyond the array, which only a faulty sender writes, is read as the whole array.
    pub fn as_slice(&self) -> &[f64] {
        &self.values[..self.len()]
    }

    /// The numbers in use, to be changed in place.
    pub fn as_mut_slice(&mut self) -> &mut [f64] {
        let count = self.len();
        &mut self.values[..count]
    }

    /// How many numbers are in use.
    pub fn len(&self) -> usize {
        (self.count as usize).min(MAX_JOINTS)
    }

    /// Whether no number is in use.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The number of one joint, or `None` past the last.
    pub fn get(&self, joint: usize) -> Option<f64> {
        self.as_slice().get(joint).copied()
    }

    /// Writes the number of one joint; a joint past the last is left alone.
    pub fn set(&mut self, joint: usize, value: f64) {
        if let Some(entry) = self.as_mut_slice().get_mut(joint) {
            *entry = value;
        }
    }
}

impl Default for JointVector {
    fn default() -> Self {
        Self::zeros(0)
    }
}

impl PartialEq for JointVector {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl fmt::Debug for JointVector {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_list().entries(self.as_slice()).finish()
    }
}

impl<const N: usize> TryFrom<[f64; N]> for JointVector {
    type Error = TooManyJoints;

    fn try_from(values: [f64; N]) -> Result<Self, TooManyJoints> {
        Self::from_slice(&values)
    }
}

impl Serialize for JointVector {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.as_slice().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for JointVector {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::from_slice(&Vec::<f64>::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_values_than_joints_are_refused() {
        let error = JointVector::from_slice(&[0.0; 9]).unwrap_err();
        assert_eq!(error.to_string(), "9 joint values given; a robot has at most 8 joints");
    }

    #[test]
    fn a_count_beyond_the_array_reads_as_the_whole_array() {
        let mut vector = JointVector::zeros(3);
        vector.count = u32::MAX;
        assert_eq!(vector.as_slice().len(), MAX_JOINTS);
        assert_eq!(vector.get(8), None);
    }

    #[test]
    fn a_value_set_past_the_end_is_left_out() {
        let mut vector = JointVector::from_slice(&[1.0, 2.0]).unwrap();
        vector.set(2, 7.0);
        vector.set(MAX_JOINTS, 7.0);
        assert_eq!((vector.as_slice(), vector.values[2]), ([1.0, 2.0].as_slice(), 0.0));
        vector.set(1, 7.0);
        assert_eq!(vector.as_slice(), [1.0, 7.0]);
    }

    #[test]
    fn values_past_the_count_do_not_make_two_vectors_differ() {
        let mut one = JointVector::from_slice(&[1.0, 2.0]).unwrap();
        one.values[5] = 7.0;
        assert_eq!(one, JointVector::from_slice(&[1.0, 2.0]).unwrap());
    }
}
