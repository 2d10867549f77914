//! A message as expressions see it: its numbers by the names of [`stream_fields`](crate::stream_fields).

use plumb_plugin::message::{Field, FieldType, JointQuantity, Layout};
use plumb_plugin::{DigitalInputs, JointVector, Message as _};
use serde_json::{Map, Number, Value};

use crate::engine::arm::Arm;
use crate::engine::scope::result_name;
use crate::stream_fields::{joint_unit, line_name, name_with_unit};

/// The bit of `levels` that is the highest line.
const HIGHEST_LINE: u32 = u64::BITS - 1;

/// The numbers of a message. What is no number is null. `arm` is the robot whose joints it reports: they are what its drive says plus the zeros in
/// force, as everywhere in a procedure.
///
/// # Errors
/// A sentence without its subject, when the message cannot be one of the stream.
pub(super) fn message_fields(
    layout: &Layout,
    message: &[u8],
    arm: Option<&Arm>,
) -> Result<Map<String, Value>, String> {
    if message.len() < layout.size {
        return Err(format!(
            "has a message of {} bytes, and {} has {}",
            message.len(),
            layout.name,
            layout.size
        ));
    }
    let mut fields = Map::new();
    for field in layout.visible_fields() {
        let FieldType::Joints(quantity) = field.of else {
            fields.insert(name_with_unit(&field.name, &field.unit), number_of(field, message));
            continue;
        };
        if let (Some(arm), Some(joints)) = (arm, field.joints(message)) {
            fields.insert(field.name.clone(), Value::Object(joint_values(arm, &joints, quantity)?));
        }
    }
    if layout.name == DigitalInputs::TYPE_NAME
        && let Some(levels) = layout
            .visible_fields()
            .find(|field| field.name == "levels")
            .and_then(|field| field.whole(message))
    {
        fields.extend((0..=HIGHEST_LINE).map(|line| (line_name(line), Value::from(levels >> line & 1))));
    }
    Ok(fields)
}

/// A number at a path of the fields; none where nothing is there, or no number.
pub(super) fn number_at(fields: &Map<String, Value>, path: &str) -> Option<f64> {
    let mut names = path.split('.');
    let first = fields.get(names.next()?)?;
    names.try_fold(first, |value, name| value.get(name))?.as_f64()
}

fn number_of(field: &Field, message: &[u8]) -> Value {
    let finite = |number| Number::from_f64(number).map(Value::Number);
    let whole = field.whole(message).map(Value::from);
    whole.or_else(|| field.number(message).and_then(finite)).unwrap_or(Value::Null)
}

fn joint_values(
    arm: &Arm,
    drive: &JointVector,
    quantity: JointQuantity,
) -> Result<Map<String, Value>, String> {
    let joints = arm.description.joints.len();
    // Of a moment at which nobody knows where the joints were, a message says nothing of them.
    if drive.is_empty() {
        return Ok(Map::new());
    }
    if drive.len() != joints {
        return Err(format!("reports {} joints, and {} has {joints}", drive.len(), arm.name));
    }
    let values = match quantity {
        JointQuantity::Position => arm.corrected(drive),
        JointQuantity::HalfWidth | JointQuantity::Speed => drive.as_slice().to_vec(),
    };
    let named = arm.joints().zip(values).map(|(joint, value)| {
        let named = arm.named_value(joint, value);
        let unit = joint_unit(arm.unit(joint), quantity);
        (result_name(&named.name, &unit), Number::from_f64(named.value).map_or(Value::Null, Value::Number))
    });
    Ok(named.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::message::from_json;
    use serde_json::json;

    #[test]
    fn numbers_are_found_by_their_paths_and_nothing_else_is_one() {
        let Value::Object(fields) = json!({"moving": 1, "joints": {"elbow_deg": 2.5}, "weight_g": null})
        else {
            unreachable!()
        };
        assert_eq!(number_at(&fields, "moving"), Some(1.0));
        assert_eq!(number_at(&fields, "joints.elbow_deg"), Some(2.5));
        assert_eq!(number_at(&fields, "joints"), None);
        assert_eq!(number_at(&fields, "weight_g"), None, "what is no number is no value");
        assert_eq!(number_at(&fields, "joints.wrist_deg"), None);
    }

    #[test]
    fn the_level_of_each_line_is_0_or_1_and_a_cut_message_is_refused() {
        let layout = Layout::known("digital-inputs/1").expect("known");
        let levels = 1_u64 << HIGHEST_LINE | 2;
        let bytes = from_json(Some(&layout), &json!({"time_ns": 1, "levels": levels})).expect("a message");
        let fields = message_fields(&layout, &bytes, None).expect("whole");
        let level = |line| number_at(&fields, &line_name(line));
        assert_eq!([0, 1, 2, HIGHEST_LINE].map(level), [Some(0.0), Some(1.0), Some(0.0), Some(1.0)]);
        assert!(!fields.contains_key("joints"), "whose they are nobody knows");
        let cut = message_fields(&layout, &bytes[..40], None).expect_err("cut");
        assert!(cut.contains("a message of 40 bytes"), "{cut}");
    }
}
