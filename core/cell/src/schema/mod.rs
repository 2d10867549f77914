//! JSON Schemas of the files people write, for editors: ours, with what each installed plugin may be told.
//!
//! The readers of the files say more, and better: this is for completion while one types. Tests hold the two together.

use plumb_plugin::Manifest;
use serde_json::{Map, Value, json};

use crate::FileKind;
use crate::device::configuration::mistakes;

/// The schema of a kind of file; none of model and world files, which the model lab and the world read. `plugins` are those installed.
///
/// # Errors
/// When the text built in is no JSON.
pub fn schema(kind: FileKind, plugins: &[Manifest]) -> Result<Option<Value>, serde_json::Error> {
    let text = match kind {
        FileKind::Workcell => include_str!("cell.json"),
        FileKind::Procedure => include_str!("procedure.json"),
        FileKind::Answers => include_str!("answers.json"),
        FileKind::World | FileKind::Model | FileKind::Study => return Ok(None),
    };
    let mut schema: Value = serde_json::from_str(text)?;
    if kind == FileKind::Workcell
        && let Some(device) = schema.pointer_mut("/definitions/device").and_then(Value::as_object_mut)
    {
        add_plugins(device, plugins);
    }
    Ok(Some(schema))
}

/// Which plugins there are, and what each may be told and wired to.
fn add_plugins(device: &mut Map<String, Value>, plugins: &[Manifest]) {
    if plugins.is_empty() {
        return;
    }
    let names: Vec<&str> = plugins.iter().map(|plugin| plugin.id.as_str()).collect();
    if let Some(plugin) = device.get_mut("properties").and_then(|properties| properties.get_mut("plugin")) {
        plugin["enum"] = json!(names);
    }
    let parts: Vec<Value> = plugins.iter().map(part_of).collect();
    device.insert("allOf".to_owned(), Value::Array(parts));
}

fn part_of(plugin: &Manifest) -> Value {
    let mut properties = Map::new();
    let mut required: Vec<&str> = Vec::new();
    if !plugin.config.is_null() {
        let mut config = plugin.config.clone();
        if let Some(config) = config.as_object_mut() {
            config.entry("description").or_insert_with(|| json!(plugin.title));
        }
        properties.insert("config".to_owned(), config);
    }
    // The world's socket and an emulated controller's port are given by the cell.
    if !mistakes(&Value::Null, &plugin.config, &["world", "port"]).is_empty() {
        required.push("config");
    }
    let stream = |message: &str| json!({"description": format!("A stream of {message}."), "type": "string"});
    let inputs: Map<String, Value> =
        plugin.inputs.iter().map(|input| (input.name.clone(), stream(&input.message))).collect();
    let wanted: Vec<&str> =
        plugin.inputs.iter().filter(|input| !input.optional).map(|input| input.name.as_str()).collect();
    if !wanted.is_empty() {
        required.push("inputs");
    }
    properties.insert(
        "inputs".to_owned(),
        json!({"properties": inputs, "required": wanted, "additionalProperties": false}),
    );
    json!({
        "if": {"properties": {"plugin": {"const": plugin.id}}, "required": ["plugin"]},
        "then": {"properties": properties, "required": required},
    })
}
