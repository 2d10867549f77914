//! What every part of a file format needs while it is read and checked.

use std::path::Path;
use std::sync::Arc;

use plumb_document::{Key, MapReader, Node, Problems, Span};

use crate::expression::{Calculator, Expression, Template};
use crate::step::Action;

/// Reads what a step of a kind does, the kind given by its name in the file; also gives the name of the kind.
pub(crate) type ReadAction = fn(&Key, &Node, &ReadContext<'_>) -> Option<(&'static str, Arc<dyn Action>)>;

/// The file being read.
pub(crate) struct ReadContext<'a> {
    pub(crate) calculator: &'a Calculator,
    /// The file's text.
    pub(crate) file: &'a str,
    /// Where files named in it lie.
    pub(crate) folder: &'a Path,
    pub(crate) problems: &'a Problems,
    /// Reads what a step does.
    pub(crate) read_action: ReadAction,
}

impl ReadContext<'_> {
    pub(crate) fn expression(&self, node: &Node, what: &str) -> Option<Expression> {
        Expression::read(node, what, self.calculator, self.file, self.problems)
    }

    pub(crate) fn template(&self, node: &Node, what: &str) -> Option<Template> {
        Template::read(node, what, self.calculator, self.file, self.problems)
    }

    /// A short text that has to be there.
    pub(crate) fn required_text(&self, map: &mut MapReader<'_>, key: &'static str) -> Option<(String, Span)> {
        let node = map.required(key)?;
        node.text(&format!("`{key}`"), self.problems).map(|text| (text.to_owned(), node.span))
    }

    /// A number that has a default.
    pub(crate) fn number_or(
        &self,
        map: &mut MapReader<'_>,
        key: &'static str,
        range: (f64, f64),
        default: f64,
    ) -> f64 {
        map.optional(key)
            .and_then(|node| node.number_between(&format!("`{key}`"), range.0, range.1, self.problems))
            .unwrap_or(default)
    }
}
