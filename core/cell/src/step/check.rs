//! `check`: the run goes on only if something holds.

use plumb_document::{MapReader, Node};
use serde_json::json;

use super::declaration::{Action, numbers_shape};
use super::kind::{Kind, StepKind};
use super::time::{CALCULATION_S, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::expression::{Expression, Shape, Template};
use crate::read_context::ReadContext;

/// A declared check.
#[derive(Debug, Clone)]
pub(crate) struct CheckStep {
    /// What has to hold.
    pub(crate) that: Expression,
    /// What is said when it does not, and what would be right.
    pub(crate) otherwise: Template,
}

fn read(node: &Node, context: &ReadContext<'_>) -> Option<CheckStep> {
    let mut map = MapReader::new(node, "a check", context.problems)?;
    let that = map.required("that").and_then(|node| context.expression(node, "`that`"));
    let otherwise = map.required("otherwise").and_then(|node| context.template(node, "`otherwise`"));
    map.finish();
    Some(CheckStep { that: that?, otherwise: otherwise? })
}

impl Action for CheckStep {
    fn check(&self, context: &CheckContext<'_>) {
        context.check_expression(&self.that);
        context.check_template(&self.otherwise);
    }

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        numbers_shape(&["holds"])
    }

    fn judged(&self) -> Vec<&str> {
        vec![self.that.text()]
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(CALCULATION_S)
    }
}

pub(super) const KIND: Kind = Kind::entry::<CheckStep>();

impl StepKind for CheckStep {
    const NAME: &'static str = "check";
    const SENTENCE: &'static str = "ends the run as failed unless something holds";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["that", "otherwise"],
  "properties": {"that": {"$ref": "#/definitions/expression"}, "otherwise": {"$ref": "#/definitions/template"}}
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_check(self, at)
    }
}

impl Engine {
    fn execute_check(&mut self, step: &CheckStep, at: &StepContext) -> Result<Done, StepError> {
        let expressions: Vec<&str> = step.otherwise.expressions().chain([step.that.text()]).collect();
        let values = self.values(at.scope, &expressions)?;
        if step.that.truth(&self.calculator, &values)? {
            return Ok(Done { result: json!({"holds": true}), values: Vec::new(), message: "OK".to_owned() });
        }
        Err(StepError::Failed(step.otherwise.fill(&self.calculator, &values)?))
    }
}
