//! The JSON Schema of model files, for editors: found from the types that read them, with words for people.

use plumb_document::{schema_of, with_words};
use serde_json::{Value, json};

use super::raw::{RawModel, RawValuedEffect};

/// What editors show beside a key.
const WORDS: &[(&str, &str)] = &[
    ("arm", "The arm's name."),
    ("urdf", "The URDF file the rows come from, where `convention` is `urdf`."),
    ("tip", "The link at the end of the chain, where the URDF file's chain forks."),
    ("joints", "The joints from the base outwards, a row each."),
    ("joints.a_mm", "Length along the row's x axis."),
    ("joints.alpha_deg", "Turn about the row's x axis."),
    ("joints.d_mm", "Offset along the joint's axis."),
    ("joints.theta_deg", "The joint's angle where its reading is 0."),
    ("joints.sign", "1, or -1 for a joint that counts the other way."),
    (
        "joints.gear_ratio",
        "Turns of the motor for a turn of the joint; harmonics of the motor's turn need it.",
    ),
    (
        "joints.screw_pitch_mm",
        "Travel of a joint that slides for one turn of its screw; `screw_wave` needs it.",
    ),
    ("joints.slides", "It slides along its axis in place of turning about it."),
    ("joints.less", "The reading is an attitude: the joint turns by it less that of this joint."),
    ("links", "What the parts weigh, for effects of gravity."),
    ("links.centre_mm", "Centre of mass in the frame of the joint's row."),
    ("base", "Where the arm's base is in the frame of what measures it."),
    ("base.per", "`session`: each session has a base of its own."),
    ("targets", "What is measured: points in the frame of the last row."),
    ("targets.rpy_deg", "How a body or a camera is turned on the flange: roll, pitch, yaw."),
    ("targets.free", "Whether fits may move it."),
    (
        "targets.free_rpy",
        "Whether fits may turn it, where its orientation was measured; as `free` where left out.",
    ),
    ("board", "A board that a camera on the hand sees, in the frame of the measurements."),
    ("board.seen_by", "The target that is the camera."),
    (
        "boards",
        "Several boards that a camera on the hand sees, by the names that tables have in the column `board`.",
    ),
    ("profile", "A laser line sensor on the hand, whose profiles the table holds as points in mm."),
    ("profile.seen_by", "The target that is the sensor: x along its line, z away from it."),
    ("free", "Effects that are fitted from the start, as joint_zero(*)."),
    ("effects", "Effects that were added: in force, with their values, and fitted again."),
    ("fitted", "Values of the free effects from the last fit."),
    ("surfaces", "What distances, touches and edges are measured to."),
    ("measured_from", "Whether positions are in the instrument's frame or the world's."),
    ("gravity", "Direction of gravity's pull in the frame of the base. Left out, it is the base's -z."),
    ("working_volume", "Where the point is to be right, mm in the frame of the base."),
    ("level", "A spirit level on the arm."),
    ("sensor", "The arm's own proximity sensor, by its data sheet."),
    ("levels", "Spirit levels by name."),
    ("noise", "One standard deviation of each measured quantity, as p1_mm."),
    ("epochs", "Where something was re-set among the rows."),
    (
        "measured_region",
        "Where the arm was measured; corrections and maps hold only there. `plumb model grow` writes it.",
    ),
    ("residual_map", "What is left and not understood, as a map. `plumb model grow` writes it."),
    ("touch", "Which point touches, and the known distances between touched points."),
    ("define", "Effects of the user's own, as formulas."),
    ("revision", "How this revision came to be; `plumb model` writes it."),
];

/// The schema of a model file.
pub fn model_schema() -> Value {
    let mut schema = schema_of::<RawModel>();
    let effect = json!({"anyOf": [
        {"description": "An effect by its name and place, as joint_zero(shoulder).", "type": "string"},
        schema_of::<RawValuedEffect>(),
    ]});
    for list in ["effects", "fitted"] {
        replace(&mut schema, &format!("/properties/{list}/items"), effect.clone());
    }
    let convention = json!({
        "description": "How the rows are read: distal (standard Denavit-Hartenberg), proximal (modified, Craig), or from a URDF file.",
        "anyOf": [
            {"enum": ["distal", "standard", "proximal", "modified", "urdf"]},
            {
                "type": "object",
                "additionalProperties": false,
                "properties": {"urdf": {"type": "string"}, "tip": {"type": "string"}}
            }
        ]
    });
    replace(&mut schema, "/properties/convention", convention);
    with_words(schema, "A model of an arm", WORDS)
}

fn replace(schema: &mut Value, pointer: &str, part: Value) {
    if let Some(slot) = schema.pointer_mut(pointer) {
        *slot = part;
    }
}
