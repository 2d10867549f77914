//! A world file as it was typed: parsed, its numbers each within what they can be, mistakes told by their place.

use std::ops::RangeInclusive;

use serde::de::DeserializeOwned;
use serde_yaml::{Location, Spanned};

use super::WorldFileError;

/// The file whose text is read, by the name its errors bear.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Typed<'a> {
    pub(crate) file: &'a str,
}

impl Typed<'_> {
    /// Reads the text, within bounds no honest file comes near.
    pub(crate) fn parse<T: DeserializeOwned>(self, text: &str) -> Result<T, WorldFileError> {
        let options = serde_yaml::options! {
            strict_booleans: true,
            with_snippet: false,
            budget: serde_yaml::budget! { max_nodes: 20_000, max_depth: 32 },
        };
        serde_yaml::from_str_with_options(text, options)
            .map_err(|error| WorldFileError::from_yaml(self.file, text, &error))
    }

    /// A number that may be left out.
    pub(crate) fn or(
        self,
        key: &str,
        value: &Option<Spanned<f64>>,
        default: f64,
        range: RangeInclusive<f64>,
        unit: &str,
    ) -> Result<f64, WorldFileError> {
        value.as_ref().map_or(Ok(default), |value| self.number(key, value, range, unit))
    }

    /// The number as it was typed, if it is finite and within its range (in `unit`).
    pub(crate) fn number(
        self,
        key: &str,
        value: &Spanned<f64>,
        range: RangeInclusive<f64>,
        unit: &str,
    ) -> Result<f64, WorldFileError> {
        let typed = value.value;
        if typed.is_finite() && range.contains(&typed) {
            return Ok(typed);
        }
        let problem = if typed.is_finite() {
            format!("`{key}` is {typed}, but must be {} to {} {unit}", range.start(), range.end())
        } else {
            format!("`{key}` is {typed}, which is no finite number")
        };
        Err(self.wrong(value.referenced, problem))
    }

    /// A mistake at a place of the file.
    pub(crate) fn wrong(self, place: Location, problem: String) -> WorldFileError {
        WorldFileError::at(self.file, place, problem)
    }
}
