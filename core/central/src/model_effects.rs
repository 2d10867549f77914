//! The effects of a model file, as numbers to be followed over time.

use serde::Deserialize;
use serde_json::{Map, Value};

/// One number of one effect.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EffectValue {
    /// Kind of effect: `joint_compliance`.
    pub effect: String,
    /// Where it acts: joint, link or target, with whatever else distinguishes it (`shoulder, 20`). Empty where it has no site.
    pub site: String,
    /// Which of its numbers.
    pub parameter: String,
    /// The number, in the unit that the model file gives it.
    pub value: f64,
    /// `mechanism` or `correction`.
    pub claim: String,
}

/// What is read of a model file here. Everything else in it is left to the lab.
#[derive(Deserialize)]
struct ModelFile {
    #[serde(default)]
    effects: Vec<Map<String, Value>>,
}

/// Keys of an effect that are no part of its site.
const NO_SITE: [&str; 5] = ["effect", "values", "claim", "may_be", "free"];

/// The effects in the text of a model file. A text that is no model file has none: an older program may have written it, and
/// the row itself is kept in any case.
pub(crate) fn effects_of(text: &str) -> Vec<EffectValue> {
    let Ok(file) = serde_yaml::from_str::<ModelFile>(text) else { return Vec::new() };
    file.effects.iter().flat_map(values_of).collect()
}

fn values_of(effect: &Map<String, Value>) -> Vec<EffectValue> {
    let Some(name) = effect.get("effect").and_then(Value::as_str) else { return Vec::new() };
    let folder: Vec<String> = effect
        .iter()
        .filter(|(key, _)| !NO_SITE.contains(&key.as_str()))
        .map(|(_, value)| plain(value))
        .collect();
    let claim = effect.get("claim").and_then(Value::as_str).unwrap_or("mechanism");
    let Some(values) = effect.get("values").and_then(Value::as_object) else { return Vec::new() };
    let numbers = values.iter().filter_map(|(parameter, value)| Some((parameter, value.as_f64()?)));
    numbers
        .map(|(parameter, value)| EffectValue {
            effect: name.to_owned(),
            site: folder.join(", "),
            parameter: parameter.clone(),
            value,
            claim: claim.to_owned(),
        })
        .collect()
}

/// A value as a person would write it: text without quotes.
fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_every_effect_is_listed_with_its_site_and_claim() {
        let text = "arm: ur5\neffects:\n  - {effect: joint_compliance, where: lift, values: {compliance: 7.0e-6}}\n  \
                    - {effect: joint_harmonic, where: pan, n: 12, values: {sine: 1.0e-4, cosine: -2.0e-4}, claim: correction}\n";
        let found = effects_of(text);
        let listed: Vec<(&str, &str, &str, f64, &str)> = found
            .iter()
            .map(|one| (&*one.effect, &*one.site, &*one.parameter, one.value, &*one.claim))
            .collect();
        assert_eq!(
            listed,
            [
                ("joint_compliance", "lift", "compliance", 7e-6, "mechanism"),
                ("joint_harmonic", "pan, 12", "sine", 1e-4, "correction"),
                ("joint_harmonic", "pan, 12", "cosine", -2e-4, "correction"),
            ]
        );
    }

    #[test]
    fn a_text_that_is_no_model_file_has_no_effects() {
        assert!(effects_of("shopping list").is_empty());
        assert!(effects_of("effects: none").is_empty());
        assert!(effects_of("effects: [{where: lift}]").is_empty());
    }
}
