//! `row`: a row of the run's measurement table, for the model lab.

use plumb_calibration::table::RowColumn;
use plumb_document::{Key, Node, NodeValue, Span, did_you_mean};
use serde_json::{Map, Value, json};

use super::declaration::Action;
use super::joint_targets::{JointTargets, read_pair};
use super::kind::{Kind, StepKind};
use super::time::{CALCULATION_S, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::scope::named_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::{Expression, Shape};
use crate::in_words::with_decimals;
use crate::read_context::ReadContext;

/// A declared row: where the arm was, and what was measured there.
#[derive(Debug, Clone)]
pub(crate) struct RowStep {
    /// Which robot.
    pub(crate) robot: String,
    /// Where its name is written.
    pub(crate) robot_span: Span,
    /// Joints that were read elsewhere than the arm is when the row is written.
    pub(crate) joints: JointTargets,
    /// What was measured, by the model lab's columns.
    pub(crate) numbers: Vec<(String, Expression)>,
    /// Columns of words: on what, with which level.
    pub(crate) words: Vec<(String, String, Span)>,
}

/// Columns of a search that say how it was measured, not what.
pub(super) const CIRCUMSTANCES: [&str; 3] = ["payload_kg", "temperature_c", "repeat"];

fn read(node: &Node, context: &ReadContext<'_>) -> Option<RowStep> {
    let NodeValue::Map(entries) = &node.value else {
        let help = "write what was measured, as in `row: {robot: arm, height_mm: ruler.value, on: table}`";
        context.problems.add(node.span, format!("a row is a map; this is {}", node.value.kind()), help);
        return None;
    };
    let mut row = RowStep {
        robot: String::new(),
        robot_span: node.span,
        joints: read_joints(node, context),
        numbers: Vec::new(),
        words: Vec::new(),
    };
    let mut measures = false;
    for (key, node) in entries {
        let what = format!("`{}`", key.name);
        match key.name.as_str() {
            "robot" => {
                row.robot = node.text(&what, context.problems)?.to_owned();
                row.robot_span = node.span;
            }
            "joints_deg" | "joints_mm" => {}
            _ => measures |= read_column(&mut row, key, node, context)?,
        }
    }
    if row.robot.is_empty() {
        context.problems.add(node.span, "a row needs the key `robot`", "");
        return None;
    }
    if !measures {
        context.problems.add(node.span, "this row measures nothing", measured_help());
    }
    Some(row)
}

/// Reads a column by the model lab's own table of them, into the row. Whether it says what was measured: what is no column was meant to, and is reported once.
/// Nothing of a value that is reported.
fn read_column(row: &mut RowStep, key: &Key, node: &Node, context: &ReadContext<'_>) -> Option<bool> {
    let what = format!("`{}`", key.name);
    match RowColumn::of(&key.name) {
        Ok(Some(RowColumn::Word)) => {
            row.words.push((key.name.clone(), node.text(&what, context.problems)?.to_owned(), node.span));
            Some(WORDS_THAT_MEASURE.contains(&key.name.as_str()))
        }
        Ok(Some(column)) => {
            row.numbers.push((key.name.clone(), context.expression(node, &what)?));
            Some(column == RowColumn::Reading)
        }
        Ok(None) => {
            unknown(key, context);
            Some(true)
        }
        Err(wrong) => {
            context.problems.add(key.span, format!("a row has no column `{}`", key.name), wrong);
            Some(true)
        }
    }
}

/// Words that are a measurement without any number: that a place was touched, and over which surface or edge the arm's own sensor triggered.
const WORDS_THAT_MEASURE: [&str; 2] = ["touch", "on"];

/// What a row may say, by the kinds of measurement themselves.
fn measured_help() -> String {
    let mut columns: Vec<String> = plumb_calibration::measurement::kinds()
        .iter()
        .filter(|kind| !kind.columns().is_empty())
        .map(|kind| format!("`{}`", kind.columns()))
        .collect();
    columns.dedup();
    format!("give what was measured, one of: {}", columns.join(", "))
}

fn read_joints(node: &Node, context: &ReadContext<'_>) -> JointTargets {
    let Some(mut map) = plumb_document::MapReader::new(node, "a row", context.problems) else {
        return Vec::new();
    };
    read_pair(&mut map, "joints_deg", "joints_mm", context)
}

fn unknown(key: &Key, context: &ReadContext<'_>) {
    let columns = RowColumn::headers();
    let known = ["robot", "joints_deg", "joints_mm"].into_iter().chain(columns.iter().map(String::as_str));
    let help = did_you_mean(&key.name, known);
    context.problems.add(key.span, format!("a row has no column `{}`", key.name), help);
}

impl Action for RowStep {
    fn check(&self, context: &CheckContext<'_>) {
        for (_, value) in &self.numbers {
            context.check_expression(value);
        }
        let robot = context.robot(&self.robot, self.robot_span);
        for joint in &self.joints {
            joint.check(robot, context);
        }
        let Some(robot) = robot else { return };
        for (column, word, span) in &self.words {
            let (what, known) = match column.as_str() {
                "on" | "distance_to" => ("surface", &robot.surfaces),
                "level" => ("level", &robot.levels),
                "board" => ("board", &robot.boards),
                _ => continue,
            };
            if !known.contains(word) {
                let help = did_you_mean(word, known.iter().map(String::as_str));
                context.problems.add(
                    *span,
                    format!("the model of {} has no {what} `{word}`", robot.name),
                    help,
                );
            }
        }
    }

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        Shape::Map(Vec::new())
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(CALCULATION_S)
    }
}

pub(super) const KIND: Kind = Kind::entry::<RowStep>();

impl StepKind for RowStep {
    const NAME: &'static str = "row";
    const SENTENCE: &'static str = "writes a row of the run's measurement table, which the model lab reads";
    const SCHEMA: &'static str = r##"{
  "description": "A row of the run's measurement table, which `plumb show --table` gives to the model lab.",
  "type": "object",
  "required": ["robot"],
  "propertyNames": {"anyOf": [{"pattern": "^(p[1-9][0-9]{0,2}|board)_([xyz]_(mm|m|in)|q[wxyz]|r[xyz]_(rad|deg))$"}, {"pattern": "^(p[1-9][0-9]{0,2}_(azimuth|elevation)|tilt_[xy])_(deg|rad)$"}, {"pattern": "^(profile([1-9][0-9]{0,2})?_[xz]|height|distance|std_[xyz]|tvec_[xyz])_(mm|m|in)$"}, {"pattern": "^rvec_[xyz]_(rad|deg)$"}, {"enum": ["robot", "joints_deg", "joints_mm", "on", "level", "board", "session", "touch", "distance_to", "repeat", "height_mm", "tilt_x_deg", "tilt_y_deg", "distance_mm", "std_x_mm", "std_y_mm", "std_z_mm", "payload_kg", "temperature_c", "p1_x_mm", "p1_y_mm", "p1_z_mm", "p1_azimuth_deg", "p1_elevation_deg", "p2_x_mm", "p2_y_mm", "p2_z_mm", "p3_x_mm", "p3_y_mm", "p3_z_mm", "p4_x_mm", "p4_y_mm", "p4_z_mm"]}]},
  "properties": {
    "robot": {"$ref": "#/definitions/text"},
    "joints_deg": {"description": "Joints that were read where the arm is not any more.", "$ref": "#/definitions/joint_numbers"},
    "joints_mm": {"description": "Joints that were read where the arm is not any more.", "$ref": "#/definitions/joint_numbers"},
    "on": {"description": "The surface of the model file that `height_mm` is over, or over which the arm's own sensor triggered.", "$ref": "#/definitions/text"},
    "level": {"description": "The level of the model file that was read.", "$ref": "#/definitions/text"},
    "board": {"description": "Which of the model file's boards the camera sees.", "$ref": "#/definitions/text"},
    "session": {"$ref": "#/definitions/text"},
    "touch": {"$ref": "#/definitions/text"},
    "distance_to": {"$ref": "#/definitions/text"}
  },
  "additionalProperties": {"$ref": "#/definitions/expression"}
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_row(self, at)
    }
}

impl Engine {
    /// The row is the step's result: the record keeps it with the end of the step.
    fn execute_row(&mut self, step: &RowStep, at: &StepContext) -> Result<Done, StepError> {
        let state = self.read_pose(&step.robot)?;
        let mut pose = state.joints;
        for joint in &step.joints {
            let value = joint.unit.to_internal(self.number(at.scope, &joint.value)?);
            let arm = self.arm(&step.robot)?;
            let index = arm.joint(&joint.joint)?;
            index.set(&mut pose, value - arm.zero(index))?;
        }
        let arm = self.arm(&step.robot)?;
        let (joints, sides) = (arm.recorded(&pose), arm.recorded_sides());
        let mut columns = Map::new();
        let mut shown: Vec<NamedValue> = Vec::new();
        for (name, value) in &step.numbers {
            let value = self.number(at.scope, value)?;
            if name.starts_with("std_") && value <= 0.0 {
                let help = "a standard uncertainty is above 0; leave the column out where it is not known";
                return Err(StepError::error(format!("`{name}` is {value}: {help}")));
            }
            // No return to a pose is 0, as in a table of poses.
            if name != "repeat" || value != 0.0 {
                columns.insert(name.clone(), json!(value));
            }
            shown.push(named_value(name, value));
        }
        columns.extend(step.words.iter().map(|(name, word, _)| (name.clone(), Value::from(word.as_str()))));
        let message = shown
            .iter()
            .map(|value| format!("{} {} {}", value.name, with_decimals(value.value, 3), value.unit));
        let message = message.map(|text| text.trim_end().to_owned()).collect::<Vec<_>>().join(", ");
        let (robot, time_ns) = (&step.robot, state.time_ns);
        let result =
            json!({"robot": robot, "time_ns": time_ns, "joints": joints, "sides": sides, "columns": columns});
        Ok(Done { result, values: shown, message })
    }
}
