//! JSON Schemas of the files people write, for editors: ours, with what each installed plugin may be given; and of the events a run writes.
//!
//! The readers of the files say more, and better: this is for completion while one types. Tests hold the two together.

use plumb_document::DocumentKind;
use plumb_plugin::Manifest;
use serde_json::{Map, Value, json};

use crate::device::configuration::mistakes;
use crate::step::KINDS;

/// The schema of cell, procedure and answers files; none of the other kinds, whose readers have their own. `plugins` are those installed.
///
/// # Errors
/// When the text built in is no JSON.
pub fn schema(kind: DocumentKind, plugins: &[Manifest]) -> Result<Option<Value>, serde_json::Error> {
    let text = match kind {
        DocumentKind::Cell => include_str!("cell.json"),
        DocumentKind::Procedure => include_str!("procedure.json"),
        DocumentKind::Answers => include_str!("answers.json"),
        _ => return Ok(None),
    };
    let mut schema: Value = serde_json::from_str(text)?;
    if kind == DocumentKind::Procedure {
        add_step_kinds(&mut schema)?;
    }
    if kind == DocumentKind::Cell
        && let Some(device) = schema.pointer_mut("/definitions/device").and_then(Value::as_object_mut)
    {
        add_plugins(device, plugins);
    }
    Ok(Some(schema))
}

/// The schema of a line of `plumb run --json`.
///
/// # Errors
/// When the text built in is no JSON.
pub fn events_schema() -> Result<Value, serde_json::Error> {
    serde_json::from_str(include_str!("events.json"))
}

/// Which kinds of step there are, and what each is given.
fn add_step_kinds(schema: &mut Value) -> Result<(), serde_json::Error> {
    let Some(kinds) = schema.pointer_mut("/definitions/do/properties").and_then(Value::as_object_mut) else {
        return Ok(());
    };
    for kind in KINDS {
        let mut fields: Value = serde_json::from_str(kind.schema)?;
        if let Some(fields) = fields.as_object_mut() {
            fields.entry("description").or_insert_with(|| json!(format!("It {}.", kind.sentence)));
        }
        kinds.insert(kind.name.to_owned(), fields);
    }
    Ok(())
}

/// Which plugins there are, and what each may be given and wired to.
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
    // The world's socket and an emulated controller's port or address are given by the cell.
    if !mistakes(&Value::Null, &plugin.config, &["world", "port", "address"]).is_empty() {
        required.push("config");
    }
    let stream = |message: &str| json!({"description": format!("A stream of {message}."), "type": "string"});
    let inputs: Map<String, Value> =
        plugin.inputs.iter().map(|input| (input.name.clone(), stream(&input.message))).collect();
    let requested: Vec<&str> =
        plugin.inputs.iter().filter(|input| !input.optional).map(|input| input.name.as_str()).collect();
    if !requested.is_empty() {
        required.push("inputs");
    }
    properties.insert(
        "inputs".to_owned(),
        json!({"properties": inputs, "required": requested, "additionalProperties": false}),
    );
    json!({
        "if": {"properties": {"plugin": {"const": plugin.id}}, "required": ["plugin"]},
        "then": {"properties": properties, "required": required},
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_procedures_schema_holds_every_kind_of_step_with_its_sentence() {
        let schema = schema(DocumentKind::Procedure, &[]).unwrap().unwrap();
        let kinds = schema.pointer("/definitions/do/properties").and_then(Value::as_object).unwrap();
        assert_eq!(kinds.len(), KINDS.len());
        assert!(kinds["search"]["properties"]["robot"].is_object());
        assert_eq!(kinds["configure"]["description"], "It changes settings of a sensor.");
    }
}
