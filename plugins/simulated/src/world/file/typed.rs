//! A world file, or an arm file, as it was typed: numbers each within what they can be, mistakes kept with their position.

use std::ops::RangeInclusive;
use std::path::Path;

use plumb_document::{Problems, Span, Spanned, did_you_mean};

/// The file whose text is read, and what is wrong with it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Typed<'a> {
    pub(crate) file: &'a Path,
    pub(crate) problems: &'a Problems,
}

impl Typed<'_> {
    /// A number that may be left out; NaN after a error.
    pub(crate) fn or(
        self,
        key: &str,
        value: &Option<Spanned<f64>>,
        default: f64,
        range: RangeInclusive<f64>,
        unit: &str,
    ) -> f64 {
        value.as_ref().map_or(default, |value| self.number(key, value, range, unit))
    }

    /// The number as it was typed, if it is finite and within its range (in `unit`); NaN after a error.
    pub(crate) fn number(
        self,
        key: &str,
        value: &Spanned<f64>,
        range: RangeInclusive<f64>,
        unit: &str,
    ) -> f64 {
        value.between(&format!("`{key}`"), range, unit, self.problems)
    }

    /// A mistake at a position in the file. What follows the last `; ` says what would be right.
    pub(crate) fn wrong(self, span: Span, problem: &str) {
        let (message, help) = problem.rsplit_once("; ").unwrap_or((problem, ""));
        self.problems.add(span, message, help);
    }

    /// A word that is none of those known.
    pub(crate) fn unknown<'k>(
        self,
        what: &str,
        word: &Spanned<String>,
        known: impl IntoIterator<Item = &'k str>,
    ) {
        let message = format!("unknown {what} `{}`", word.value);
        self.problems.add(word.span, message, did_you_mean(&word.value, known));
    }
}
