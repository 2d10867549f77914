//! Messages as JSON: for drivers of other languages, and for whoever prints a stream.

use bytemuck::{AnyBitPattern, NoUninit};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value, json};

use super::{
    DigitalInputs, FrameHeader, Health, JointState, Message, PREFIX_LENGTH, ProximityEdge, StripeHeader,
};

/// A message as JSON: its fields by their names. Of a picture and of a light stripe's points the header alone; of a layout of a plugin's own the time, the
/// number and the rest in hexadecimal.
pub fn to_json(type_name: &str, message: &[u8]) -> Value {
    let known = match type_name {
        JointState::TYPE_NAME => read::<JointState>(message),
        DigitalInputs::TYPE_NAME => read::<DigitalInputs>(message),
        ProximityEdge::TYPE_NAME => read::<ProximityEdge>(message),
        Health::TYPE_NAME => read::<Health>(message),
        FrameHeader::TYPE_NAME => begin::<FrameHeader>(message).map(|frame| {
            json!({"time_ns": frame.time_ns, "sequence": frame.sequence, "width": frame.width, "height": frame.height,
                   "exposure_ns": frame.exposure_ns})
        }),
        StripeHeader::TYPE_NAME => begin::<StripeHeader>(message).map(|stripe| {
            json!({"time_ns": stripe.time_ns, "sequence": stripe.sequence, "count": stripe.count, "fault": stripe.fault,
                   "joints": stripe.joints, "speeds": stripe.speeds})
        }),
        _ => None,
    };
    known.unwrap_or_else(|| of_its_own(message))
}

/// The bytes of a message from its fields. Those left out are zero; the number is the host's. A layout of a plugin's own is `time_ns` and `hex`.
///
/// # Errors
/// What is wrong with the fields, and which there are.
pub fn from_json(type_name: &str, fields: &Value) -> Result<Vec<u8>, String> {
    let Some(given) = fields.as_object() else {
        return Err(format!("a message is a map of fields, not {fields}"));
    };
    match type_name {
        JointState::TYPE_NAME => bytes_of::<JointState>(given),
        DigitalInputs::TYPE_NAME => bytes_of::<DigitalInputs>(given),
        ProximityEdge::TYPE_NAME => bytes_of::<ProximityEdge>(given),
        _ => own_bytes(given),
    }
}

fn begin<M: AnyBitPattern>(message: &[u8]) -> Option<M> {
    message.get(..size_of::<M>()).map(bytemuck::pod_read_unaligned)
}

fn read<M: AnyBitPattern + Serialize>(message: &[u8]) -> Option<Value> {
    begin::<M>(message).and_then(|message| serde_json::to_value(message).ok())
}

/// A layout that only its plugin knows.
fn of_its_own(message: &[u8]) -> Value {
    let word = |at: usize| begin::<u64>(message.get(at..).unwrap_or_default()).unwrap_or_default();
    let rest = message.get(PREFIX_LENGTH..).unwrap_or_default();
    let hex: String = rest.iter().map(|byte| format!("{byte:02x}")).collect();
    json!({"time_ns": word(0), "sequence": word(8), "hex": hex})
}

fn bytes_of<M: Default + NoUninit + Serialize + DeserializeOwned>(
    given: &Map<String, Value>,
) -> Result<Vec<u8>, String> {
    let mut fields = serde_json::to_value(M::default()).unwrap_or_default();
    for (name, value) in given {
        match fields.get_mut(name) {
            Some(field) => *field = value.clone(),
            None => {
                let known: Vec<&String> = fields.as_object().into_iter().flat_map(Map::keys).collect();
                return Err(format!("its layout has no field '{name}'; it has {known:?}"));
            }
        }
    }
    let message: M = serde_json::from_value(fields).map_err(|error| error.to_string())?;
    Ok(bytemuck::bytes_of(&message).to_vec())
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

    #[test]
    fn a_message_goes_through_json_and_back() {
        let fields = json!({"time_ns": 5, "joints": [0.25, -1.5], "moving": 1});
        let bytes = from_json(JointState::TYPE_NAME, &fields).unwrap();
        let again = to_json(JointState::TYPE_NAME, &bytes);
        assert_eq!(again, json!({"time_ns": 5, "sequence": 0, "moving": 1, "joints": [0.25, -1.5]}));
    }

    #[test]
    fn a_layout_of_a_plugins_own_goes_through_as_hexadecimal() {
        let bytes = from_json("weights/1", &json!({"time_ns": 7, "hex": "0aff"})).unwrap();
        assert_eq!(bytes.len(), 24);
        assert_eq!(
            to_json("weights/1", &bytes),
            json!({"time_ns": 7, "sequence": 0, "hex": "0aff000000000000"})
        );
    }

    #[test]
    fn what_cannot_be_a_message_is_refused_with_what_would_be() {
        let wrong = |fields: Value| from_json(JointState::TYPE_NAME, &fields).unwrap_err();
        assert!(
            wrong(json!({"joint": [1.0]}))
                .contains(r#"no field 'joint'; it has ["time_ns", "sequence", "moving", "joints"]"#)
        );
        assert!(wrong(json!({"joints": [0, 0, 0, 0, 0, 0, 0, 0, 0]})).contains("at most 8 joints"));
        assert!(wrong(json!([1])).contains("a map of fields"));
        assert!(from_json("weights/1", &json!({"time_ns": 7, "hex": "0"})).unwrap_err().contains("pairs"));
        assert!(from_json("weights/1", &json!({"time_ns": 7, "hex": "é"})).unwrap_err().contains("pairs"));
    }
}
