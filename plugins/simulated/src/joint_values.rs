//! One number for each joint of an arm, however many joints it has.

use std::ops::{Deref, DerefMut};

use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The most joints an arm may have: the most that fit into the messages of a robot's plugin.
pub const MOST_JOINTS: usize = plumb_plugin::MAX_JOINTS;

/// One number for each joint (rad, or mm of a joint that slides) or for each motor, in the arm's own order.
#[derive(Clone, Copy)]
pub struct JointValues {
    count: usize,
    values: [f64; MOST_JOINTS],
}

impl JointValues {
    /// These values; `None` for more than [`MOST_JOINTS`].
    pub fn from_slice(values: &[f64]) -> Option<Self> {
        let mut all = Self { count: values.len(), values: [0.0; MOST_JOINTS] };
        all.values.get_mut(..values.len())?.copy_from_slice(values);
        Some(all)
    }

    /// No values at all: of motors that nobody counts.
    pub const fn none() -> Self {
        Self { count: 0, values: [0.0; MOST_JOINTS] }
    }

    /// The values of an arm that has just so many joints; `None` for another arm's.
    pub fn fixed<const COUNT: usize>(&self) -> Option<[f64; COUNT]> {
        self.as_slice().try_into().ok()
    }

    /// The values, a joint after the other.
    pub fn as_slice(&self) -> &[f64] {
        self.values.get(..self.count).unwrap_or_default()
    }
}

impl<const COUNT: usize> From<[f64; COUNT]> for JointValues {
    fn from(array: [f64; COUNT]) -> Self {
        const { assert!(COUNT <= MOST_JOINTS, "more joints than an arm may have") };
        let mut values = [0.0; MOST_JOINTS];
        for (value, given) in values.iter_mut().zip(array) {
            *value = given;
        }
        Self { count: COUNT, values }
    }
}

impl Deref for JointValues {
    type Target = [f64];
    fn deref(&self) -> &[f64] {
        self.as_slice()
    }
}

impl DerefMut for JointValues {
    fn deref_mut(&mut self) -> &mut [f64] {
        self.values.get_mut(..self.count).unwrap_or_default()
    }
}

impl IntoIterator for JointValues {
    type Item = f64;
    type IntoIter = std::iter::Take<std::array::IntoIter<f64, MOST_JOINTS>>;
    fn into_iter(self) -> Self::IntoIter {
        self.values.into_iter().take(self.count)
    }
}

impl PartialEq for JointValues {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl std::fmt::Debug for JointValues {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.as_slice().fmt(formatter)
    }
}

impl Serialize for JointValues {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.as_slice().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for JointValues {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List;
        impl<'de> Visitor<'de> for List {
            type Value = JointValues;
            fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                write!(formatter, "a list of at most {MOST_JOINTS} numbers, one for each joint")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut all = JointValues::none();
                while let Some(value) = list.next_element()? {
                    let Some(room) = all.values.get_mut(all.count) else {
                        return Err(A::Error::invalid_length(all.count + 1, &self));
                    };
                    *room = value;
                    all.count += 1;
                }
                Ok(all)
            }
        }
        deserializer.deserialize_seq(List)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_any_length_goes_there_and_back_to_the_last_digit() {
        for count in 0..=MOST_JOINTS {
            let list: Vec<f64> = (0..count).map(|joint| joint as f64 / 3.0 - 0.1).collect();
            let values = JointValues::from_slice(&list).unwrap();
            let back: JointValues = serde_json::from_str(&serde_json::to_string(&values).unwrap()).unwrap();
            assert_eq!(back.as_slice(), list);
        }
    }

    #[test]
    fn more_joints_than_there_may_be_are_refused() {
        let long = vec![0.0; MOST_JOINTS + 1];
        assert!(JointValues::from_slice(&long).is_none());
        let error = serde_json::from_str::<JointValues>(&serde_json::to_string(&long).unwrap()).unwrap_err();
        assert!(error.to_string().contains("at most 8 numbers"), "{error}");
    }

    #[test]
    fn only_an_arm_of_so_many_joints_fills_a_fixed_list() {
        let four = JointValues::from([1.0, 2.0, 3.0, 4.0]);
        assert_eq!(four.fixed::<4>(), Some([1.0, 2.0, 3.0, 4.0]));
        assert_eq!(four.fixed::<6>(), None);
    }
}
