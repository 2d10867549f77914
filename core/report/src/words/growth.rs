//! What is said of a model that was grown.

use super::residual_map::map_sentence;
use super::verdict::diagnosis_sentence;
use plumb_diagnosis::Growth;

/// The sentence on what the model has become, and on its residual map where one came last.
pub fn growth_sentence(growth: &Growth) -> String {
    let sentence = diagnosis_sentence(&growth.diagnosis);
    match &growth.residual_map {
        Some(map) => format!("{sentence} {}", map_sentence(map)),
        None => sentence,
    }
}
