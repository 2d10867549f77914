//! Numbers by the names of joints: `{lift_deg: 0.2, slide_mm: 0.1}`.

use std::fmt;
use std::ops::RangeInclusive;

use plumb_document::Spanned;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::arm::drive::JointDrive;
use crate::world::file::typed::Typed;

/// A map from a joint's name and its unit to a number, as it was typed.
#[derive(Debug, Default)]
pub(super) struct JointNumbers(Vec<(Spanned<String>, Spanned<f64>)>);

impl<'de> Deserialize<'de> for JointNumbers {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries;
        impl<'de> Visitor<'de> for Entries {
            type Value = JointNumbers;
            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str("a map of joints, each with its unit, to numbers, as {lift_deg: 0.2}")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(JointNumbers(entries))
            }
        }
        deserializer.deserialize_map(Entries)
    }
}

impl JointNumbers {
    /// One value for each joint, rad or mm: 0 where none is given. The range is in deg or mm.
    pub(super) fn values(
        &self,
        typed: Typed<'_>,
        joints: &[JointDrive],
        range: RangeInclusive<f64>,
    ) -> Vec<f64> {
        let keys: Vec<String> =
            joints.iter().map(|joint| format!("{}_{}", joint.name, joint.unit())).collect();
        let mut values = vec![0.0; joints.len()];
        for (key, number) in &self.0 {
            let found = keys.iter().position(|known| *known == key.value);
            let entry = found.and_then(|index| Some((joints.get(index)?, values.get_mut(index)?)));
            match entry {
                Some((joint, value)) => {
                    *value = joint.read(typed.number(&key.value, number, range.clone(), joint.unit()));
                }
                None => typed.unknown("key", key, keys.iter().map(String::as_str)),
            }
        }
        values
    }
}
