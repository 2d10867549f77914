//! Messages as JSON: for drivers of other languages, and for anyone who prints a stream.

use serde_json::{Map, Number, Value, json};

use super::{Field, FieldType, JointVector, Layout, PREFIX_LENGTH};

/// A message as JSON: its fields by their names. Of a picture and of a light stripe's points the header alone; of a layout of which nothing is known the
/// time, the number and the rest in hexadecimal.
pub fn to_json(layout: Option<&Layout>, message: &[u8]) -> Value {
    let long_enough = layout.filter(|layout| message.len() >= layout.size);
    let Some(layout) = long_enough else { return of_its_own(message) };
    let value = |field: &Field| Some((field.name.clone(), value_of(field, message)?));
    Value::Object(layout.visible_fields().filter_map(value).collect())
}

/// The bytes of a message from its fields. Those left out are zero; the number is the host's. Of a layout of which nothing is known, and of one whose
/// length is not fixed, the fields are `time_ns` and `hex`.
///
/// # Errors
/// What is wrong with the fields, and which there are.
pub fn from_json(layout: Option<&Layout>, fields: &Value) -> Result<Vec<u8>, String> {
    let Some(given) = fields.as_object() else {
        return Err(format!("a message is a map of fields, not {fields}"));
    };
    let Some(layout) = layout.filter(|layout| layout.tail.is_none()) else { return own_bytes(given) };
    let mut message = vec![0; layout.size];
    for (name, value) in given {
        let Some(field) = layout.visible_fields().find(|field| field.name == *name) else {
            let known: Vec<&str> = layout.visible_fields().map(|field| field.name.as_str()).collect();
            return Err(format!("its layout has no field '{name}'; it has {known:?}"));
        };
        let bytes = bytes_of(field.of, value)
            .map_err(|requested| format!("its field '{name}' is {requested}, not {value}"))?;
        field.write(&mut message, &bytes);
    }
    Ok(message)
}

fn value_of(field: &Field, message: &[u8]) -> Option<Value> {
    match field.of {
        FieldType::U32 | FieldType::U64 => field.whole(message).map(Value::from),
        // What is no number is null.
        FieldType::F32 | FieldType::F64 => {
            field.number(message).map(|number| Number::from_f64(number).map_or(Value::Null, Value::Number))
        }
        FieldType::Joints(_) => field.joints(message).map(|joints| json!(joints)),
        FieldType::F32x3 => None,
    }
}

/// The bytes of a field that is to hold a value.
///
/// # Errors
/// What the field holds.
fn bytes_of(of: FieldType, value: &Value) -> Result<Vec<u8>, String> {
    let bytes = match of {
        FieldType::U32 => value
            .as_u64()
            .and_then(|whole| u32::try_from(whole).ok())
            .map(|whole| whole.to_ne_bytes().to_vec()),
        FieldType::U64 => value.as_u64().map(|whole| whole.to_ne_bytes().to_vec()),
        FieldType::F32 => value.as_f64().map(|number| (number as f32).to_ne_bytes().to_vec()),
        FieldType::F64 => value.as_f64().map(|number| number.to_ne_bytes().to_vec()),
        FieldType::Joints(_) => {
            let numbers: Option<Vec<f64>> =
                value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect());
            let Some(numbers) = numbers else {
                return Err("a list of numbers, one for each joint".to_owned());
            };
            let joints = JointVector::from_slice(&numbers).map_err(|error| format!("a list ({error})"))?;
            Some(bytemuck::bytes_of(&joints).to_vec())
        }
        FieldType::F32x3 => None,
    };
    bytes.ok_or_else(|| {
        match of {
            FieldType::U32 | FieldType::U64 => "a whole number of 0 or more",
            _ => "a number",
        }
        .to_owned()
    })
}

/// A layout that only its plugin knows.
fn of_its_own(message: &[u8]) -> Value {
    let word = |at: usize| {
        let bytes = message.get(at..at + size_of::<u64>());
        bytes.map(bytemuck::pod_read_unaligned::<u64>).unwrap_or_default()
    };
    let rest = message.get(PREFIX_LENGTH..).unwrap_or_default();
    let hex: String = rest.iter().map(|byte| format!("{byte:02x}")).collect();
    json!({"time_ns": word(0), "sequence": word(8), "hex": hex})
}

fn own_bytes(given: &Map<String, Value>) -> Result<Vec<u8>, String> {
    let time_ns = given.get("time_ns").and_then(Value::as_u64).ok_or("it lacks `time_ns`, a whole number")?;
    let hex = given
        .get("hex")
        .and_then(Value::as_str)
        .ok_or("it lacks `hex`, what follows time_ns and sequence")?;
    let digit = |at: usize| hex.get(at..at + 2).and_then(|two| u8::from_str_radix(two, 16).ok());
    let rest: Option<Vec<u8>> = (0..hex.len()).step_by(2).map(digit).collect();
    let mut message = [time_ns.to_ne_bytes(), [0; 8]].concat();
    message.extend(rest.ok_or("`hex` is not in pairs of hexadecimal digits")?);
    message.resize(message.len().next_multiple_of(8), 0);
    Ok(message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::{FieldDescription, NumberType, StreamDescription};
    use crate::{JointState, Message as _};

    fn joint_state() -> Layout {
        Layout::known(JointState::TYPE_NAME).unwrap()
    }

    #[test]
    fn a_message_goes_through_json_and_back() {
        let fields = json!({"time_ns": 5, "joints": [0.25, -1.5], "moving": 1});
        let bytes = from_json(Some(&joint_state()), &fields).unwrap();
        let again = to_json(Some(&joint_state()), &bytes);
        assert_eq!(again, json!({"time_ns": 5, "sequence": 0, "moving": 1, "joints": [0.25, -1.5]}));
    }

    #[test]
    fn a_layout_of_a_plugins_own_goes_through_as_hexadecimal() {
        let bytes = from_json(None, &json!({"time_ns": 7, "hex": "0aff"})).unwrap();
        assert_eq!(bytes.len(), 24);
        assert_eq!(to_json(None, &bytes), json!({"time_ns": 7, "sequence": 0, "hex": "0aff000000000000"}));
    }

    #[test]
    fn what_cannot_be_a_message_is_refused_with_what_would_be() {
        let wrong = |fields: Value| from_json(Some(&joint_state()), &fields).unwrap_err();
        assert!(
            wrong(json!({"joint": [1.0]}))
                .contains(r#"no field 'joint'; it has ["time_ns", "sequence", "moving", "joints"]"#)
        );
        assert!(wrong(json!({"joints": [0, 0, 0, 0, 0, 0, 0, 0, 0]})).contains("at most 8 joints"));
        assert!(wrong(json!([1])).contains("a map of fields"));
        assert!(from_json(None, &json!({"time_ns": 7, "hex": "0"})).unwrap_err().contains("pairs"));
        assert!(from_json(None, &json!({"time_ns": 7, "hex": "é"})).unwrap_err().contains("pairs"));
    }

    #[test]
    fn a_layout_that_a_manifest_declares_goes_through_by_its_fields() {
        let field = |name: &str, of| FieldDescription { name: name.to_owned(), of, unit: "g".to_owned() };
        let mut stream = StreamDescription::of::<JointState>("weights");
        stream.message = "weight/1".to_owned();
        stream.fields = vec![field("settled", NumberType::U32), field("weight_g", NumberType::F64)];
        let layout = Layout::of(&stream).unwrap();
        let bytes = from_json(Some(&layout), &json!({"time_ns": 7, "weight_g": 12.5, "settled": 1})).unwrap();
        assert_eq!(bytes.len(), 32);
        assert_eq!(
            to_json(Some(&layout), &bytes),
            json!({"time_ns": 7, "sequence": 0, "settled": 1, "weight_g": 12.5})
        );
        let wrong = from_json(Some(&layout), &json!({"settled": -1})).unwrap_err();
        assert_eq!(wrong, "its field 'settled' is a whole number of 0 or more, not -1");
    }
}
