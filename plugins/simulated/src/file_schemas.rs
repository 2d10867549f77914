//! JSON Schemas of world and arm files, for editors.

use plumb_document::with_words;
use serde_json::{Value, json};

use crate::arm::file as other_arms;
use crate::world::file as teachmover;

const WORLD: &[(&str, &str)] = &[
    ("world", "The world's title."),
    ("seed", "What is left to chance is drawn from this."),
    ("arm", "The arm in it, and what is not ideal about it."),
    ("table", "The table's top."),
    ("target", "What lies on the table."),
    ("sensor", "The proximity sensor on the hand."),
    ("instruments", "What the operator measures with, and how badly."),
    ("calibration", "The file in which a simulated controller keeps its own calibration."),
    ("cage", "What hangs on a PUMA's flange."),
    ("tool", "What hangs on the flange."),
    ("light", "Camera, projector and what there is to be seen."),
    ("arm.teachmover.start", "How the operator left the arm: true attitudes against the horizontal."),
    ("arm.teachmover.zero_error", "How far the truth is beyond what the controller believes."),
    ("arm.puma560.zero_error", "How far the truth is beyond what the controller believes."),
    ("arm.described.by", "The arm file, relative to this file."),
    ("arm.described.zero_error", "How far the truth is beyond what the controller believes."),
];

const ARM: &[(&str, &str)] = &[
    ("arm", "Its name in cell files."),
    ("title", "Its name for people."),
    ("convention", "How the rows are read: distal (standard) or proximal (modified, Craig)."),
    ("urdf", "A URDF file in place of `convention` and the rows' numbers."),
    ("tip", "The link at the end of the chain, where the URDF file's chain forks."),
    ("joints", "The joints from the base outwards."),
    ("links", "What the parts weigh."),
    (
        "levels",
        "Where a spirit level can lie: the joint that carries the place, and the arrow of the level as it points where every joint is at zero.",
    ),
    ("most_hung_kg", "What may hang on the flange beside the tool."),
    ("braking_s", "From full speed to rest."),
];

/// The schema of world files: which arm is in one decides what else may.
pub fn world_schema() -> Value {
    let of_teachmover = json!({"properties": {"arm": {"required": ["teachmover"]}}});
    let mut worlds = [teachmover::schema(), other_arms::schema()];
    // The reader of each names the arms of the other, for its messages alone.
    for (world, others) in worlds.iter_mut().zip([&["puma560", "described"][..], &[]]) {
        if let Some(arms) = world.pointer_mut("/properties/arm/properties").and_then(Value::as_object_mut) {
            others.iter().for_each(|other| drop(arms.remove(*other)));
        }
    }
    let [teachmover, other] = worlds.map(|world| with_words(world, "", WORLD));
    let properties =
        [&teachmover, &other].map(|world| world.get("properties").and_then(Value::as_object).cloned());
    let mut keys = serde_json::Map::new();
    for (key, schema) in properties.into_iter().flatten().flatten() {
        let described = schema.get("description").map(|text| json!({"description": text}));
        keys.entry(key).or_insert_with(|| described.unwrap_or_else(|| json!({})));
    }
    with_words(
        json!({"type": "object", "required": ["world", "arm"], "properties": keys, "if": of_teachmover, "then": teachmover, "else": other}),
        "A simulated world",
        &[],
    )
}

/// The schema of the files of arms that worlds describe.
pub fn arm_schema() -> Value {
    with_words(other_arms::arm_file::schema(), "An arm of a simulated world", ARM)
}
