//! `repeat`: steps done several times, or once for each row of a table.

use plumb_document::{FileKind, MapReader, Node, read_text};

use super::declaration::{Action, Inside, Step, numbers_shape};
use super::kind::{Kind, StepKind};
use super::read::{check_name, read_steps};
use super::time::TimeContext;
use super::turns::{Rows, Turns};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::expression::{Expression, Shape};
use crate::read_context::ReadContext;

/// A declared repetition.
#[derive(Debug, Clone)]
pub(crate) struct RepeatStep {
    /// How often.
    pub(crate) turns: Turns,
    /// Ends the repetition after a turn in which it holds.
    pub(crate) until: Option<Expression>,
    /// What is done each time.
    pub(crate) steps: Vec<Step>,
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<RepeatStep> {
    let mut map = MapReader::new(node, "a repetition", context.problems)?;
    let over = map.optional("over");
    let turns = match over {
        Some(node) => read_over(node, context).map(Turns::Over),
        None => map.required("times").and_then(|node| context.expression(node, "`times`")).map(Turns::Times),
    };
    if over.is_some() && map.optional("times").is_some() {
        let help = "keep `times`, or `over` with a table";
        context.problems.add(map.span(), "a repetition is done so often, or over the rows of a table", help);
    }
    let until = map.optional("until").and_then(|node| context.expression(node, "`until`"));
    let steps = map.required("steps").and_then(|node| read_steps(node, context));
    map.finish();
    Some(RepeatStep { turns: turns?, until, steps: steps? })
}

fn read_over(node: &Node, context: &ReadContext<'_>) -> Option<Rows> {
    let name = node.text("`over`", context.problems)?;
    let path = context.folder.join(name);
    let wrong = |reason: String, help: &str| context.problems.add(node.span, reason, help);
    let text = match read_text(&path, FileKind::POSES) {
        Ok(text) => text,
        Err(error) => {
            wrong(format!("{}: {error}", path.display()), "the name is relative to this file");
            return None;
        }
    };
    match Rows::parse(&text) {
        Ok(rows) => {
            for column in &rows.columns {
                check_name(column, node.span, "the name of a column", context);
            }
            Some(rows)
        }
        Err(reason) => {
            wrong(
                format!("{}: {reason}", path.display()),
                "a line of names, then a line of as many numbers for each turn",
            );
            None
        }
    }
}

impl Action for RepeatStep {
    /// Its steps are checked with the procedure.
    fn check(&self, _context: &CheckContext<'_>) {}

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        let mut names = vec!["turn", "turns"];
        if let Turns::Over(table) = &self.turns {
            names.extend(table.columns.iter().map(String::as_str));
        }
        numbers_shape(&names)
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(0.0)
    }

    fn inside(&self) -> Inside<'_> {
        Inside::Repeated { turns: &self.turns, until: self.until.as_ref(), steps: &self.steps }
    }
}

pub(super) const KIND: Kind = Kind::entry::<RepeatStep>();

impl StepKind for RepeatStep {
    const NAME: &'static str = "repeat";
    const SENTENCE: &'static str = "does its steps several times, or once for each row of a table";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["steps"],
  "anyOf": [{"required": ["times"]}, {"required": ["over"]}],
  "properties": {
    "over": {"description": "A table of numbers (CSV) beside this file: a turn for each row, its columns are named by the step's id.", "$ref": "#/definitions/text"},
    "times": {"description": "How many times, at most; known before the run starts.", "$ref": "#/definitions/expression"},
    "until": {"description": "Ends the repetition after a turn in which it holds.", "$ref": "#/definitions/expression"},
    "steps": {"$ref": "#/definitions/steps"}
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    /// The engine goes through its steps one by one.
    fn execute(&self, _engine: &mut Engine, _at: &StepContext) -> Result<Done, StepError> {
        Ok(Done::default())
    }
}
