//! The JSON of what the lab finds: the typed results, with what is said of them in words where the contract has it.

use plumb_calibration::measurement::ReadingUnit;
use plumb_diagnosis::laboratory::{Comparison, EffectValue};
use plumb_diagnosis::report::Report;
use plumb_diagnosis::{Diagnosis, Explainable, Growth, NextPoses};
use serde_json::{Map, Result, Value, json, to_value};

use crate::words::{
    alike_in_words, comparison_sentence, diagnosis_sentence, explainable_sentence, gauge_in_words,
    growth_sentence, hypothesis_sentence, instead_in_words, map_sentence, next_poses_sentence, note_in_words,
    rejection_in_words, rest_in_words, why_held_in_words,
};

/// Keys of errors and noises of readings: in a table of angles alone they end in `_deg` in place of `_mm`, and hold degrees.
const ERRORS_OF_READINGS: [&str; 20] = [
    "after_mm",
    "before_mm",
    "beyond_others_mm",
    "check_mm2",
    "cv_mm2",
    "error_mm",
    "explains_mm",
    "fit_mm2",
    "floor_of_a_point_mm",
    "largest_mm",
    "leaves_mm",
    "left_mm",
    "left_out_mm",
    "left_unexplained_mm",
    "not_predictable_mm",
    "rms_mm",
    "scatter_mm",
    "sigma_mm",
    "to_name_mm",
    "without_mm",
];

/// The same with keys that say the unit in which errors of readings are given, at any depth; lengths that are no errors of readings keep theirs.
pub fn in_unit(value: Value, unit: ReadingUnit) -> Value {
    let of_unit = |key: String| match ERRORS_OF_READINGS.contains(&key.as_str()) {
        true => key.replace("_mm", &format!("_{unit}")),
        false => key,
    };
    match value {
        Value::Object(fields) => {
            let fields = fields.into_iter().map(|(key, field)| (of_unit(key), in_unit(field, unit)));
            Value::Object(fields.collect::<Map<String, Value>>())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(|item| in_unit(item, unit)).collect()),
        other => other,
    }
}

/// A diagnosis with its sentence, the reasons of its candidates and the shape of the rest.
///
/// # Errors
/// What serde_json reports.
pub fn diagnosis(diagnosis: &Diagnosis) -> Result<Value> {
    let mut output = to_value(diagnosis)?;
    if let Some(candidates) = output["candidates"].as_array_mut() {
        for (value, candidate) in candidates.iter_mut().zip(&diagnosis.candidates) {
            if let Some(rejection) = &candidate.rejected {
                value["rejected"] = json!(rejection_in_words(rejection));
            }
        }
    }
    output["remaining"]["shape"] = json!(rest_in_words(&diagnosis.remaining));
    if !diagnosis.alike.is_empty() {
        output["alike"] = diagnosis.alike.iter().map(alike_in_words).collect();
    }
    add_explainable(&mut output, diagnosis.explainable.as_ref());
    if let Some(hypothesis) = &diagnosis.hypothesis {
        output["hypothesis"]["sentence"] = json!(hypothesis_sentence(hypothesis));
    }
    output["warnings"] = diagnosis.warnings.iter().map(note_in_words).collect();
    output["sentence"] = json!(diagnosis_sentence(diagnosis));
    Ok(in_unit(output, diagnosis.unit))
}

/// Gives what holds `explainable` the sentence of that.
fn add_explainable(output: &mut Value, explainable: Option<&Explainable>) {
    if let Some(explainable) = explainable {
        output["explainable"]["sentence"] = json!(explainable_sentence(explainable));
    }
}

/// Fitted effects, with why one is not estimated.
///
/// # Errors
/// What serde_json reports.
pub fn effects(effects: &[EffectValue]) -> Result<Value> {
    let mut output = to_value(effects)?;
    if let Some(values) = output.as_array_mut() {
        for (value, effect) in values.iter_mut().zip(effects) {
            if let Some(why) = &effect.held_because {
                value["held_because"] = json!(why_held_in_words(why));
            }
        }
    }
    Ok(output)
}

/// A model held against a table.
///
/// # Errors
/// What serde_json reports.
pub fn comparison(comparison: &Comparison) -> Result<Value> {
    let mut output = to_value(comparison)?;
    add_explainable(&mut output, comparison.explainable.as_ref());
    output["effects"] = effects(&comparison.effects)?;
    output["gauges"] = comparison.gauges.iter().map(gauge_in_words).collect();
    output["warnings"] = comparison.warnings.iter().map(note_in_words).collect();
    output["sentence"] = json!(comparison_sentence(comparison));
    Ok(in_unit(output, comparison.unit))
}

/// Poses to measure next.
///
/// # Errors
/// What serde_json reports.
pub fn next_poses(poses: &NextPoses) -> Result<Value> {
    let mut output = to_value(poses)?;
    output["instead"] = json!(poses.instead.as_ref().map(instead_in_words));
    output["sentence"] = json!(next_poses_sentence(poses));
    Ok(output)
}

/// A model grown: its diagnosis, then how it came about.
///
/// # Errors
/// What serde_json reports.
pub fn growth(growth: &Growth) -> Result<Value> {
    let mut output = diagnosis(&growth.diagnosis)?;
    output["sentence"] = json!(growth_sentence(growth));
    let all = in_unit(to_value(growth)?, growth.diagnosis.unit);
    if let (Value::Object(output), Value::Object(all)) = (&mut output, all) {
        // A growth holds its diagnosis among its own keys: what else it has comes after the sentence.
        for (key, value) in all {
            output.entry(key).or_insert(value);
        }
    }
    if let Some(map) = &growth.residual_map {
        output["residual_map"]["sentence"] = json!(map_sentence(map));
    }
    Ok(output)
}

/// Everything a report says.
///
/// # Errors
/// What serde_json reports.
pub fn report(report: &Report) -> Result<Value> {
    let mut output = to_value(report)?;
    output["fall"] = in_unit(output["fall"].take(), report.comparison.unit);
    output["comparison"] = comparison(&report.comparison)?;
    output["diagnosis"] = diagnosis(&report.diagnosis)?;
    if let Some(poses) = &report.next {
        output["next"] = next_poses(poses)?;
    }
    Ok(output)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;
    use plumb_diagnosis::Requested;
    use plumb_estimation::Progress;

    const DECLARED: &str = "free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}";

    /// The keys of an object, in order.
    fn keys(value: &Value) -> Vec<&str> {
        value.as_object().unwrap().keys().map(String::as_str).collect()
    }

    #[test]
    fn a_diagnosis_ends_with_its_sentence_and_every_reason_and_shape_is_in_words() {
        let lab = two_links(40, DECLARED, 0.05, 22, |q| [0.0, 0.01 * q[1]]);
        let found = lab.diagnose(&Progress::unwatched()).unwrap();
        let output = diagnosis(&found).unwrap();
        assert_eq!(keys(&output).last(), Some(&"sentence"));
        assert_eq!(output["sentence"], json!(diagnosis_sentence(&found)));
        assert_eq!(keys(&output["remaining"]), ["where", "covariates", "shape"]);
        let candidates = output["candidates"].as_array().unwrap();
        assert!(candidates[0].get("rejected").is_none() && candidates.len() > 1);
        assert!(
            candidates[1..]
                .iter()
                .all(|one| one["rejected"].is_string() && *keys(one).last().unwrap() == "rejected")
        );
    }

    #[test]
    fn a_growth_reports_its_diagnosis_and_then_how_it_came_about() {
        let lab = two_links(40, DECLARED, 0.05, 22, |q| [0.0, 0.01 * q[1]]);
        let grown = lab.grow_with_map(&Progress::unwatched()).unwrap();
        let output = growth(&grown).unwrap();
        let keys = keys(&output);
        let end = keys.iter().position(|key| *key == "sentence").unwrap();
        assert_eq!(keys[end + 1..], ["start", "steps", "extrapolation"]);
        assert_eq!(output["sentence"], json!(growth_sentence(&grown)));
    }

    #[test]
    fn poses_say_what_would_do_instead_also_where_nothing_has_to() {
        let lab = two_links(40, DECLARED, 0.05, 22, |q| [0.0, 0.01 * q[1]]);
        let requested = Requested { count: 3, keep_out: Vec::new(), payloads: Vec::new() };
        let found = lab.next_poses(&requested, &Progress::unwatched()).unwrap();
        let output = next_poses(&found).unwrap();
        assert_eq!(keys(&output), ["next", "between", "separation", "instead", "sentence"]);
        assert!(output["instead"].is_null() && output["sentence"] == json!(next_poses_sentence(&found)));
    }

    #[test]
    fn a_comparison_says_in_words_what_is_not_estimated_and_why() {
        // Without masses a compliance moves nothing: it is held.
        let lines = "free: [joint_zero(*), joint_compliance(elbow)]\nnoise: {p1_mm: 0.05}";
        let lab = two_links(20, lines, 0.05, 5, |_| [0.0; 2]);
        let found = lab.compare(&Progress::unwatched()).unwrap();
        let output = comparison(&found).unwrap();
        assert_eq!(keys(&output).last(), Some(&"sentence"));
        let held: Vec<&Value> =
            output["effects"].as_array().unwrap().iter().filter(|one| one["held"] == true).collect();
        assert_eq!(held.len(), 1, "{output:#}");
        assert!(held[0]["held_because"].as_str().unwrap().starts_with("no masses are declared"), "{held:?}");
        let gauges = output["gauges"].as_array().unwrap();
        assert!(!gauges.is_empty(), "{output:#}");
        assert!(
            gauges.iter().all(|gauge| gauge.as_str().unwrap().contains(" not estimated: ")),
            "{gauges:?}"
        );
    }
}
