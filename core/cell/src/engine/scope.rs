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
    /// Results over the turns of repetitions, of the steps whose lists the procedure uses. The lists of all steps would make a long run's memory
    /// grow with every turn, and the time of its expressions with the square of the turns.
    all: Map<String, Value>,
}

impl Scope {
    /// `listed` are the steps whose results are kept over all turns: those of [`steps_listed`].
    pub(crate) fn new(parameters: Map<String, Value>, listed: Vec<String>) -> Self {
        let all = listed.into_iter().map(|id| (id, Value::Array(Vec::new()))).collect();
        Self { parameters, results: Map::new(), all }
    }

    /// Keeps the result of a step.
    pub(crate) fn set_result(&mut self, id: &str, result: Value) {
        if let Some(Value::Array(list)) = self.all.get_mut(id) {
            list.push(result.clone());
        }
        self.results.insert(id.to_owned(), result);
    }

    /// Takes the newest result of a step away, because the step is to be done again. Where older ones are kept, the one before holds; else none
    /// does, so that an expression that needs it says so in place of working with what is out of date.
    pub(crate) fn take_back_result(&mut self, id: &str) {
        let before = match self.all.get_mut(id) {
            Some(Value::Array(list)) => {
                list.pop();
                list.last().cloned()
            }
            _ => None,
        };
        match before {
            Some(result) => self.results.insert(id.to_owned(), result),
            None => self.results.remove(id),
        };
    }

    /// Takes every result of a step away, its list too: an expression that needs one says so.
    pub(crate) fn forget_result(&mut self, id: &str) {
        self.results.remove(id);
        self.all.remove(id);
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

/// The steps of a procedure whose lists its text uses, as `all.STEP`. A sentence for people may look like a use; then a list is kept that nobody reads.
/// An expression cannot reach a list in another way: `all` by itself is refused when the procedure is checked.
pub(crate) fn steps_listed(text: &str, step_ids: Vec<String>) -> Vec<String> {
    let used: Vec<&str> = text.match_indices("all").filter_map(|(at, _)| listed_at(text, at)).collect();
    step_ids.into_iter().filter(|id| used.contains(&id.as_str())).collect()
}

/// The step named behind an `all` at this byte of a text, if it is the word, and followed by a point and a name.
fn listed_at(text: &str, at: usize) -> Option<&str> {
    let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
    if text.get(..at)?.ends_with(is_part) {
        return None;
    }
    let name = text.get(at + "all".len()..)?.trim_start().strip_prefix('.')?.trim_start();
    let end = name.find(|letter| !is_part(letter)).unwrap_or(name.len());
    name.get(..end).filter(|name| !name.is_empty())
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

/// The name by which expressions call a measured quantity: with its unit, spelled so that it is a name.
pub(crate) fn result_name(quantity: &str, unit: &str) -> String {
    match unit {
        "" => quantity.to_owned(),
        unit => format!("{quantity}_{}", unit.replace('%', "percent").replace('/', "_per_")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(text: &str) -> Vec<String> {
        steps_listed(text, ["scan", "met", "away"].map(str::to_owned).to_vec())
    }

    #[test]
    fn the_lists_that_a_text_uses_are_found_however_they_are_written() {
        assert_eq!(listed("for a in all.scan { b += all . met[0].x }"), ["scan", "met"]);
        assert_eq!(listed("sum: >-\n  all\n  .away.len()"), ["away"]);
        assert_eq!(listed("(all.scan)"), ["scan"]);
    }

    #[test]
    fn other_words_and_sentences_name_no_list() {
        for text in
            ["small.scan", "all scan", "all.scans", "wall.met", "that is all. Then scan", "all", "all."]
        {
            assert_eq!(listed(text), Vec::<String>::new(), "{text}");
        }
    }

    #[test]
    fn only_listed_results_are_kept_over_the_turns() {
        let mut scope = Scope::new(Map::new(), vec!["scan".to_owned()]);
        for turn in 0..1000 {
            scope.set_result("scan", Value::from(turn));
            scope.set_result("met", Value::from(turn));
        }
        let values = scope.values(Map::new());
        assert_eq!(values["met"], 999);
        assert_eq!(values["all"]["scan"].as_array().map(Vec::len), Some(1000));
        assert_eq!(values["all"].get("met"), None);
    }
}
