//! `compute`

use serde_json::Value;

use crate::engine::Engine;
use crate::engine::scope::named_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::expression::Script;
use crate::step::ComputeStep;

impl Engine {
    pub(super) fn execute_compute(
        &mut self,
        step: &ComputeStep,
        at: &StepContext,
    ) -> Result<Done, StepError> {
        let mut texts: Vec<&str> = step.values.iter().map(|(_, expression)| expression.text()).collect();
        texts.extend(step.script.as_ref().map(Script::text));
        let values = self.values(at.scope, &texts)?;
        let named = step.values.iter().map(|(name, expression)| (name.as_str(), expression));
        let results = Script::values(step.script.as_ref(), named, &self.calculator, &values)?;
        let shown: Vec<NamedValue> =
            results.iter().filter_map(|(name, value)| Some(named_value(name, value.as_f64()?))).collect();
        self.journal.noted(&at.path, "computed", &shown)?;
        let message = shown.iter().map(|value| format!("{} = {:.6} {}", value.name, value.value, value.unit));
        let message = message.map(|text| text.trim_end().to_owned()).collect::<Vec<_>>().join(", ");
        Ok(Done { result: Value::Object(results), values: shown, message })
    }
}
