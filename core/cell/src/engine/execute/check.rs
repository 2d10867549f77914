//! `check`

use serde_json::json;

use crate::engine::Engine;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::step::CheckStep;

impl Engine {
    pub(super) fn execute_check(&mut self, step: &CheckStep, at: &StepContext) -> Result<Done, StepError> {
        let expressions: Vec<&str> = step.otherwise.expressions().chain([step.that.text()]).collect();
        let values = self.values(at.scope, &expressions)?;
        if step.that.truth(&self.calculator, &values)? {
            return Ok(Done {
                result: json!({"holds": true}),
                values: Vec::new(),
                message: "it holds".to_owned(),
            });
        }
        Err(StepError::Failed(step.otherwise.fill(&self.calculator, &values)?))
    }
}
