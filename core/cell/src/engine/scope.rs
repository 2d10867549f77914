//! The values that expressions see while a run goes on.

use serde_json::{Map, Value};

use crate::event::NamedValue;

/// Index of a scope: one for the procedure, one for each time another is called.
pub(crate) type ScopeId = usize;

/// What the steps of one procedure see.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scope {
    parameters: Map<String, Value>,
    results: Map<String, Value>,
    /// Results of each step over the turns of repetitions.
    all: Map<String, Value>,
}

impl Scope {
    pub(crate) fn new(parameters: Map<String, Value>, step_ids: Vec<String>) -> Self {
        let all = step_ids.into_iter().map(|id| (id, Value::Array(Vec::new()))).collect();
        Self { parameters, results: Map::new(), all }
    }

    /// Keeps the result of a step.
    pub(crate) fn set_result(&mut self, id: &str, result: Value) {
        if let Some(Value::Array(list)) = self.all.get_mut(id) {
            list.push(result.clone());
        }
        self.results.insert(id.to_owned(), result);
    }

    /// Changes the present result of a step without adding to the list of results.
    pub(crate) fn set_state(&mut self, id: &str, state: Value) {
        self.results.insert(id.to_owned(), state);
    }

    pub(crate) fn results(&self) -> &Map<String, Value> {
        &self.results
    }

    /// All values, with those of the robots.
    pub(crate) fn values(&self, robots: Map<String, Value>) -> Map<String, Value> {
        let mut values = self.parameters.clone();
        values.extend(robots);
        values.extend(self.results.clone());
        values.insert("all".to_owned(), Value::Object(self.all.clone()));
        values
    }

    /// Parameters and what else is known before the run.
    pub(crate) fn plan_values(&self, models: Map<String, Value>) -> Map<String, Value> {
        let mut values = self.parameters.clone();
        values.extend(models);
        values
    }
}

/// Joints as expressions see them: `{"shoulder_deg": 41.0, ...}`.
pub(crate) fn joints_value(joints: &[NamedValue]) -> Value {
    let entries =
        joints.iter().map(|joint| (format!("{}_{}", joint.name, joint.unit), Value::from(joint.value)));
    Value::Object(entries.collect())
}

/// A value whose name ends in a unit, taken apart for people: `Y_mm` is `Y` in `mm`.
pub(crate) fn named_value(name: &str, value: f64) -> NamedValue {
    const UNITS: [&str; 8] = ["mm", "deg", "micron", "s", "rad", "percent", "kg", "N"];
    match name.rsplit_once('_') {
        Some((stem, unit)) if UNITS.contains(&unit) => {
            NamedValue { name: stem.to_owned(), value, unit: unit.to_owned(), uncertainty: None }
        }
        _ => NamedValue { name: name.to_owned(), value, unit: String::new(), uncertainty: None },
    }
}
