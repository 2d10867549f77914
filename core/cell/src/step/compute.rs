//! `compute`: values from parameters and earlier results.

use plumb_document::{MapReader, Node, NodeValue};
use serde_json::{Value, json};

use super::declaration::Action;
use super::error_terms::{self, ErrorTerm};
use super::kind::{Kind, StepKind};
use super::read::check_name;
use super::time::{CALCULATION_S, Foreseen, TimeContext};
use crate::cell_names::CellNames;
use crate::check_context::CheckContext;
use crate::engine::Engine;
use crate::engine::scope::named_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::engine::uncertainty::Evaluated;
use crate::event::NamedValue;
use crate::expression::{Expression, Names, Script, Shape};
use crate::read_context::ReadContext;

/// A declared computation.
#[derive(Debug, Clone)]
pub(crate) struct ComputeStep {
    /// Runs first; its variables are there for the values.
    pub(crate) script: Option<Script>,
    /// Worked out in order; each may use the ones before it. Units are the ends of the names.
    pub(crate) values: Vec<(String, Expression)>,
    /// What the values depend on and is not known exactly; script and values name them, and a budget is worked out for each value.
    pub(crate) errors: Vec<ErrorTerm>,
}

/// Where the result of a computation with `errors` keeps the budgets of its values.
pub(crate) const BUDGET: &str = "budget";

fn read(node: &Node, context: &ReadContext<'_>) -> Option<ComputeStep> {
    let mut map = MapReader::new(node, "a computation", context.problems)?;
    let script = map
        .optional("script")
        .and_then(|node| Script::read(node, context.calculator, context.file, context.problems));
    let entries = map.required("values").and_then(|node| node.entries("`values`", context.problems));
    let errors = error_terms::read(&mut map, context);
    map.finish();
    let mut values = Vec::new();
    for (name, node) in entries? {
        check_name(&name.name, name.span, "the name of a value", context);
        if name.name == BUDGET && !errors.is_empty() {
            let help = "the uncertainty budgets of the other values are called so; choose another name";
            context.problems.add(name.span, "no value can be called `budget` here", help);
        }
        if matches!(node.value, NodeValue::Map(_) | NodeValue::List(_)) {
            context.problems.add(node.span, format!("`{}` is a number or an expression", name.name), "");
            continue;
        }
        values.push((name.name.clone(), context.expression(node, &format!("`{}`", name.name))?));
    }
    Some(ComputeStep { script, values, errors })
}

impl Action for ComputeStep {
    fn check(&self, context: &CheckContext<'_>) {
        error_terms::check(&self.errors, context);
        let mut names: Names = context.names.clone();
        for error in &self.errors {
            names.set(&error.name, Shape::Single);
        }
        if let Some(script) = &self.script {
            script.check_names(&names, context.file, context.problems);
            for local in script.variables() {
                names.set(local, Shape::Anything);
            }
        }
        for (name, expression) in &self.values {
            expression.check_names(&names, context.file, context.problems);
            names.set(name, Shape::Anything);
        }
    }

    fn result_shape(&self, _cell: &CellNames) -> Shape {
        let each = || self.values.iter().map(|(name, _)| (name.clone(), Shape::Anything));
        let budgets = (BUDGET.to_owned(), Shape::Map(each().collect()));
        Shape::Map(each().chain((!self.errors.is_empty()).then_some(budgets)).collect())
    }

    fn judged(&self) -> Vec<&str> {
        let values = self.values.iter().map(|(_, expression)| expression.text());
        values.chain(self.script.as_ref().map(Script::text)).collect()
    }

    fn estimated_time_s(&self, _context: &TimeContext<'_>) -> Option<f64> {
        Some(CALCULATION_S)
    }

    fn foreseen(&self, context: &TimeContext<'_>) -> Foreseen {
        let mut values = context.values.clone();
        // The best estimate of every error is 0.
        values.extend(self.errors.iter().map(|error| (error.name.clone(), json!(0.0))));
        let named = self.values.iter().map(|(name, expression)| (name.as_str(), expression));
        let found = Script::values(self.script.as_ref(), named, context.calculator, &values);
        Foreseen { result: found.ok().map(Value::Object), joints: Vec::new() }
    }
}

pub(super) const KIND: Kind = Kind::entry::<ComputeStep>();

impl StepKind for ComputeStep {
    const NAME: &'static str = "compute";
    const SENTENCE: &'static str = "works out values from parameters and earlier results";
    const SCHEMA: &'static str = r##"{
  "type": "object",
  "additionalProperties": false,
  "required": ["values"],
  "properties": {
    "script": {"description": "Runs first; its variables are there for the values.", "type": "string"},
    "values": {"type": "object", "propertyNames": {"$ref": "#/definitions/name"}, "additionalProperties": {"$ref": "#/definitions/expression"}},
    "errors": {"$ref": "#/definitions/errors"}
  }
}"##;

    fn read(node: &Node, context: &ReadContext<'_>) -> Option<Self> {
        read(node, context)
    }

    fn execute(&self, engine: &mut Engine, at: &StepContext) -> Result<Done, StepError> {
        engine.execute_compute(self, at)
    }
}

impl Engine {
    fn execute_compute(&mut self, step: &ComputeStep, at: &StepContext) -> Result<Done, StepError> {
        let mut texts: Vec<&str> = step.values.iter().map(|(_, expression)| expression.text()).collect();
        texts.extend(step.script.as_ref().map(Script::text));
        let evaluated = self.evaluate_with_errors(&step.errors, &texts, at, |engine, values| {
            let named = step.values.iter().map(|(name, expression)| (name.as_str(), expression));
            Script::values(step.script.as_ref(), named, &engine.calculator, values)
        })?;
        let Evaluated { mut results, budgets } = evaluated;
        let standard_of = |name: &str| {
            budgets.iter().find(|(known, _)| known == name).and_then(|(_, budget)| budget.standard())
        };
        let shown: Vec<NamedValue> = results
            .iter()
            .filter_map(|(name, value)| {
                Some(NamedValue { uncertainty: standard_of(name), ..named_value(name, value.as_f64()?) })
            })
            .collect();
        if !step.errors.is_empty() {
            let budgets = budgets.iter().map(|(name, budget)| (name.clone(), json!(budget)));
            results.insert(BUDGET.to_owned(), Value::Object(budgets.collect()));
        }
        self.journal.noted(&at.path, "computed", &shown)?;
        let message = shown.iter().map(|value| format!("{} = {:.6} {}", value.name, value.value, value.unit));
        let message = message.map(|text| text.trim_end().to_owned()).collect::<Vec<_>>().join(", ");
        Ok(Done { result: Value::Object(results), values: shown, message })
    }
}
