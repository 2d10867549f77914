//! `row`

use serde_json::{Map, Value, json};

use crate::engine::Engine;
use crate::engine::scope::named_value;
use crate::engine::step_context::{Done, StepContext};
use crate::engine::step_error::StepError;
use crate::event::NamedValue;
use crate::step::RowStep;

impl Engine {
    /// The row is the step's result: the record keeps it with the end of the step.
    pub(super) fn execute_row(&mut self, step: &RowStep, at: &StepContext) -> Result<Done, StepError> {
        let state = self.read_pose(&step.robot)?;
        let mut pose = state.joints;
        for joint in &step.joints {
            let value = joint.unit.to_internal(self.number(at.scope, &joint.value)?);
            let arm = self.arm(&step.robot)?;
            if let Some(column) = arm.column(&joint.joint) {
                pose.set(column, value - arm.zero(column));
            }
        }
        let arm = self.arm(&step.robot)?;
        let (joints, sides) = (arm.recorded(&pose), arm.recorded_sides());
        let mut columns = Map::new();
        let mut shown: Vec<NamedValue> = Vec::new();
        for (name, value) in &step.numbers {
            let value = self.number(at.scope, value)?;
            // No return to a pose is 0, as in a table of poses.
            if name != "repeat" || value != 0.0 {
                columns.insert(name.clone(), json!(value));
            }
            shown.push(named_value(name, value));
        }
        columns.extend(step.words.iter().map(|(name, word, _)| (name.clone(), Value::from(word.as_str()))));
        let message = shown.iter().map(|value| format!("{} {:.3} {}", value.name, value.value, value.unit));
        let message = message.map(|text| text.trim_end().to_owned()).collect::<Vec<_>>().join(", ");
        let (robot, time_ns) = (&step.robot, state.time_ns);
        let result =
            json!({"robot": robot, "time_ns": time_ns, "joints": joints, "sides": sides, "columns": columns});
        Ok(Done { result, values: shown, message })
    }
}
