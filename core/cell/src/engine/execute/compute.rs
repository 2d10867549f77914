//! `compute`

use serde_json::{Value, json};

use crate::engine::Engine;
use crate::engine::scope::named_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::engine::uncertainty::Evaluated;
use crate::event::NamedValue;
use crate::expression::Script;
use crate::step::{BUDGET, ComputeStep};

impl Engine {
    pub(super) fn execute_compute(
        &mut self,
        step: &ComputeStep,
        at: &StepContext,
    ) -> Result<Done, StepError> {
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
