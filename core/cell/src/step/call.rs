//! `call`: the steps of another procedure.

use plumb_document::{Key, MapReader, Node, Span};

use super::declaration::{Action, Inside};
use super::kind::{Kind, StepKind};
use super::time::TimeContext;
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::expression::{Expression, Shape};
use crate::read_context::ReadContext;

/// A declared call.
#[derive(Debug, Clone)]
pub(crate) struct CallStep {
    /// The procedure's file, relative to the file that calls it.
    pub(crate) file: String,
    /// Where it is.
    pub(crate) span: Span,
    /// Parameters other than their defaults; worked out from this procedure's own parameters before the run.
    pub(crate) with: Vec<(Key, Expression)>,
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<CallStep> {
    let mut map = MapReader::new(node, "a call", context.problems)?;
    let file = context.required_text(&mut map, "procedure");
    let with = map.optional("with").and_then(|node| node.entries("`with`", context.problems));
    map.finish();
    let (file, span) = file?;
    let mut parameters = Vec::new();
    for (name, node) in with.unwrap_or_default() {
        parameters.push((name.clone(), context.expression(node, &format!("`{}`", name.name))?));
    }
    Some(CallStep { file, span, with: parameters })
}

impl Action for CallStep {
    /// Its parameters are checked with the procedure it calls.
    fn check(&self, _context: &CheckContext<'_>) {}

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        Shape::Anything
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(0.0)
    }

    fn inside(&self) -> Inside<'_> {
        Inside::Called { file: &self.file, span: self.span, with: &self.with }
    }
}

pub(super) const KIND: Kind = Kind::entry::<CallStep>();

impl StepKind for CallStep {
    const NAME: &'static str = "call";
    const SENTENCE: &'static str = "does the steps of another procedure";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["procedure"],
  "properties": {
    "procedure": {"description": "A file relative to this one.", "$ref": "#/definitions/text"},
    "with": {"type": "object", "additionalProperties": {"$ref": "#/definitions/expression"}}
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
