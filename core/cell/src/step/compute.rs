//! `compute`: values from parameters and earlier results.

use super::{ErrorTerm, check_name, error_terms};
use crate::expression::{Expression, Names, Script, Shape};
use crate::read_context::{CheckContext, ReadContext};
use crate::yaml::{MapReader, Node, NodeValue};

/// A declared computation.
#[derive(Debug, Clone)]
pub struct ComputeStep {
    /// Runs first; its variables are there for the values.
    pub script: Option<Script>,
    /// Worked out in order; each may use the ones before it. Units are the ends of the names.
    pub values: Vec<(String, Expression)>,
    /// What the values depend on and is not known exactly; script and values name them, and a budget is worked out for each value.
    pub errors: Vec<ErrorTerm>,
}

/// Where the result of a computation with `errors` keeps the budgets of its values.
pub(crate) const BUDGET: &str = "budget";

pub(super) fn read(node: &Node, context: &ReadContext<'_>) -> Option<ComputeStep> {
    let mut map = MapReader::new(node, "a computation", context.problems)?;
    let script = map
        .optional("script")
        .and_then(|node| Script::read(node, context.calculator, context.file, context.problems));
    let entries = map.required("values").and_then(|node| node.entries("`values`", context.problems));
    let errors = error_terms::read(&mut map, context);
    map.finish();
    let mut values = Vec::new();
    for (name, node) in entries? {
        check_name(&name.name, name.place, "the name of a value", context);
        if name.name == BUDGET && !errors.is_empty() {
            let help = "the uncertainty budgets of the other values are called so; choose another name";
            context.problems.add(name.place, "no value can be called `budget` here", help);
        }
        if matches!(node.value, NodeValue::Map(_) | NodeValue::List(_)) {
            context.problems.add(node.place, format!("`{}` is a number or an expression", name.name), "");
            continue;
        }
        values.push((name.name.clone(), context.expression(node, &format!("`{}`", name.name))?));
    }
    Some(ComputeStep { script, values, errors })
}

impl ComputeStep {
    pub(super) fn check(&self, context: &CheckContext<'_>) {
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

    pub(super) fn result_shape(&self) -> Shape {
        let each = || self.values.iter().map(|(name, _)| (name.clone(), Shape::Anything));
        let budgets = (BUDGET.to_owned(), Shape::Map(each().collect()));
        Shape::Map(each().chain((!self.errors.is_empty()).then_some(budgets)).collect())
    }
}
