//! What is known while a tree is read, and why a type could not be made.

use std::cell::{Cell, RefCell};
use std::fmt;

use serde::de::{self, Expected, Unexpected};

use crate::suggestion::did_you_mean;
use crate::{Problem, Span};

/// What becomes of keys that a type does not know.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OtherKeys {
    /// They are mistakes.
    #[default]
    Refused,
    /// They belong to another program.
    LeftAside,
}

/// The name under which [`super::Spanned`] asks for its position.
pub(super) const SPANNED: &str = "plumb_document::Spanned";

/// What is known after the readings so far.
#[derive(Default)]
pub(super) struct Reading {
    pub(super) other_keys: OtherKeys,
    found: RefCell<Vec<Problem>>,
    /// Keys that are missing, by the map they are missing in.
    pub(super) missing: RefCell<Vec<(Span, &'static str)>>,
    /// Values that their type refuses.
    pub(super) broken: RefCell<Vec<Span>>,
    /// How many values were refused or replaced, those of earlier readings again among them.
    pub(super) refused: Cell<usize>,
}

impl Reading {
    pub(super) fn with(other_keys: OtherKeys) -> Self {
        Self { other_keys, ..Self::default() }
    }

    pub(super) fn is_clean(&self) -> bool {
        self.found.borrow().is_empty()
    }

    pub(super) fn into_found(self) -> Vec<Problem> {
        self.found.into_inner()
    }

    pub(super) fn report(&self, span: Span, message: String, help: String) {
        self.refused.set(self.refused.get() + 1);
        let problem = Problem { span: Some(span), message, help: Some(help).filter(|help| !help.is_empty()) };
        let mut found = self.found.borrow_mut();
        if !found.contains(&problem) {
            found.push(problem);
        }
    }
}

/// Why a type could not be made.
#[derive(Debug)]
pub(super) enum Refusal {
    /// It lacks a key.
    Missing(&'static str),
    /// It has a key that it does not know.
    Key(String, &'static [&'static str]),
    /// A word is none of those there are.
    Word(String, &'static [&'static str]),
    /// It is of another kind than this.
    Expected(String),
    /// In its own words.
    Words(String),
    /// Reported and remembered: the tree is to be read again.
    Again,
}

impl fmt::Display for Refusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing(key) => write!(formatter, "the key `{key}` is missing"),
            Self::Key(word, known) | Self::Word(word, known) => {
                write!(formatter, "`{word}` is not known; {}", did_you_mean(word, known.iter().copied()))
            }
            Self::Expected(right) => write!(formatter, "{right} is expected here"),
            Self::Words(words) => formatter.write_str(words),
            Self::Again => formatter.write_str("this cannot be read"),
        }
    }
}

impl std::error::Error for Refusal {}

impl de::Error for Refusal {
    fn custom<T: fmt::Display>(words: T) -> Self {
        Self::Words(words.to_string())
    }

    fn invalid_type(_: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::Expected(expected.to_string())
    }

    fn missing_field(field: &'static str) -> Self {
        Self::Missing(field)
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        Self::Key(field.to_owned(), expected)
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        Self::Word(variant.to_owned(), expected)
    }
}
