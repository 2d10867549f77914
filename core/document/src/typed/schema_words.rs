//! Words for people in a schema that was found by reading: editors show them beside the key.

use serde_json::{Value, json};

/// A schema with its title (the part of another has none) and with descriptions of its keys, each named by its path: `joints.a_mm` is the key `a_mm` of the items of
/// `joints`. A path that leads nowhere is left out.
pub fn with_words(mut schema: Value, title: &str, words: &[(&str, &str)]) -> Value {
    for (path, text) in words {
        if let Some(schema_of_key) = schema_of_key(&mut schema, path) {
            schema_of_key.insert("description".to_owned(), json!(text));
        }
    }
    if title.is_empty() {
        return schema;
    }
    let mut whole = serde_json::Map::new();
    whole.insert("$schema".to_owned(), json!("http://json-schema.org/draft-07/schema#"));
    whole.insert("title".to_owned(), json!(title));
    whole.extend(schema.as_object().cloned().unwrap_or_default());
    Value::Object(whole)
}

/// The schema of a key.
fn schema_of_key<'s>(schema: &'s mut Value, path: &str) -> Option<&'s mut serde_json::Map<String, Value>> {
    let mut at = schema;
    for key in path.split('.') {
        if at.get("items").is_some() {
            at = at.get_mut("items")?;
        }
        if at.get("additionalProperties").is_some_and(Value::is_object) {
            at = at.get_mut("additionalProperties")?;
        }
        at = at.get_mut("properties")?.get_mut(key)?;
    }
    at.as_object_mut()
}
