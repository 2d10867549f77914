//! `row`: a row of the run's measurement table, for the model lab.

use super::joint_targets::{JointTargets, read_pair};
use crate::expression::Expression;
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{Key, Node, NodeValue, Place, did_you_mean};

/// A declared row: where the arm stood, and what was measured there.
#[derive(Debug, Clone)]
pub struct RowStep {
    /// Which robot.
    pub robot: String,
    /// Where its name stands.
    pub robot_place: Place,
    /// Joints that were read elsewhere than the arm stands when the row is written.
    pub joints: JointTargets,
    /// What was measured, by the model lab's columns.
    pub numbers: Vec<(String, Expression)>,
    /// Columns of words: on what, with which level.
    pub words: Vec<(String, String, Place)>,
}

/// The model lab's columns of numbers that a row may have, beside those of targets (`p1_x_mm`).
const NUMBERS: [&str; 7] =
    ["height_mm", "tilt_x_deg", "tilt_y_deg", "distance_mm", "payload_kg", "temperature_c", "repeat"];

/// Its columns of words.
const WORDS: [&str; 5] = ["on", "level", "session", "touch", "distance_to"];

/// Columns that say how it was measured, not what.
pub(super) const CIRCUMSTANCES: [&str; 3] = ["payload_kg", "temperature_c", "repeat"];

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<RowStep> {
    let NodeValue::Map(entries) = &node.value else {
        let help = "write what was measured, as in `row: {robot: arm, height_mm: ruler.value, on: table}`";
        context.problems.add(node.place, format!("a row is a map; this is {}", node.value.kind()), help);
        return None;
    };
    let mut row = RowStep {
        robot: String::new(),
        robot_place: node.place,
        joints: read_joints(node, context),
        numbers: Vec::new(),
        words: Vec::new(),
    };
    for (key, node) in entries {
        let what = format!("`{}`", key.name);
        match key.name.as_str() {
            "robot" => row.robot = node.text(&what, context.problems)?.to_owned(),
            "joints_deg" | "joints_mm" => {}
            name if WORDS.contains(&name) => {
                row.words.push((
                    key.name.clone(),
                    node.text(&what, context.problems)?.to_owned(),
                    node.place,
                ));
            }
            name if NUMBERS.contains(&name) || is_of_target(name) => {
                row.numbers.push((key.name.clone(), context.expression(node, &what)?));
            }
            _ => unknown(key, context),
        }
        if key.name == "robot" {
            row.robot_place = node.place;
        }
    }
    if row.robot.is_empty() {
        context.problems.add(node.place, "a row needs the key `robot`", "");
        return None;
    }
    let measures = |name: &str| !CIRCUMSTANCES.contains(&name);
    if !row.numbers.iter().any(|(name, _)| measures(name))
        && !row.words.iter().any(|(name, ..)| name == "touch")
    {
        let help = "give what was measured: `height_mm`, `tilt_x_deg`, `tilt_y_deg`, `distance_mm`, `touch`, or a point such as `p1_x_mm`";
        context.problems.add(node.place, "this row measures nothing", help);
    }
    Some(row)
}

fn read_joints(node: &Node, context: &ReadContext<'_>) -> JointTargets {
    let Some(mut map) = crate::yaml::MapReader::new(node, "a row", context.problems) else {
        return Vec::new();
    };
    read_pair(&mut map, "joints_deg", "joints_mm", context)
}

/// `p1_x_mm` and so on, to `p9_z_mm`.
fn is_of_target(name: &str) -> bool {
    let parts: Vec<&str> = name.split('_').collect();
    let [target, "x" | "y" | "z", "mm"] = parts.as_slice() else { return false };
    target.strip_prefix('p').is_some_and(|number| number.len() == 1 && ("1"..="9").contains(&number))
}

fn unknown(key: &Key, context: &ReadContext<'_>) {
    let known = ["robot", "joints_deg", "joints_mm", "p1_x_mm", "p1_y_mm", "p1_z_mm"];
    let help = did_you_mean(&key.name, known.into_iter().chain(NUMBERS).chain(WORDS));
    context.problems.add(key.place, format!("a row has no column `{}`", key.name), help);
}

impl RowStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
        for (_, value) in &self.numbers {
            context.check_expression(value);
        }
        let robot = context.robot(&self.robot, self.robot_place);
        for joint in &self.joints {
            joint.check(robot, context);
        }
        let Some(robot) = robot else { return };
        for (column, word, place) in &self.words {
            let (what, known) = match column.as_str() {
                "on" | "distance_to" => ("surface", &robot.surfaces),
                "level" => ("level", &robot.levels),
                _ => continue,
            };
            if !known.contains(word) {
                let help = did_you_mean(word, known.iter().map(String::as_str));
                context.problems.add(
                    *place,
                    format!("the model of {} has no {what} `{word}`", robot.name),
                    help,
                );
            }
        }
    }
}
