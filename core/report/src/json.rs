//! The JSON of what the lab finds: the typed results, with what is said of them in words where the contract has it.

use plumb_diagnosis::report::Report;
use plumb_diagnosis::{Diagnosis, Growth};
use serde_json::{Result, Value, json, to_value};

use crate::words::{alike_in_words, diagnosis_sentence, growth_sentence, rejection_in_words, rest_in_words};

/// A diagnosis with its sentence, the reasons of its candidates and the shape of the rest.
///
/// # Errors
/// What serde_json reports.
pub fn diagnosis(diagnosis: &Diagnosis) -> Result<Value> {
    let mut told = to_value(diagnosis)?;
    if let Some(candidates) = told["candidates"].as_array_mut() {
        for (value, candidate) in candidates.iter_mut().zip(&diagnosis.candidates) {
            if let Some(rejection) = &candidate.rejected {
                value["rejected"] = json!(rejection_in_words(rejection));
            }
        }
    }
    told["remaining"]["shape"] = json!(rest_in_words(&diagnosis.remaining));
    if !diagnosis.alike.is_empty() {
        told["alike"] = diagnosis.alike.iter().map(alike_in_words).collect();
    }
    told["sentence"] = json!(diagnosis_sentence(diagnosis));
    Ok(told)
}

/// A model grown: its diagnosis, then how it came about.
///
/// # Errors
/// What serde_json reports.
pub fn growth(growth: &Growth) -> Result<Value> {
    let mut told = diagnosis(&growth.diagnosis)?;
    told["sentence"] = json!(growth_sentence(growth));
    if let (Value::Object(told), Value::Object(all)) = (&mut told, to_value(growth)?) {
        // A growth holds its diagnosis among its own keys: what else it has comes after the sentence.
        for (key, value) in all {
            told.entry(key).or_insert(value);
        }
    }
    Ok(told)
}

/// Everything a report tells.
///
/// # Errors
/// What serde_json reports.
pub fn report(report: &Report) -> Result<Value> {
    let mut told = to_value(report)?;
    told["diagnosis"] = diagnosis(&report.diagnosis)?;
    Ok(told)
}
