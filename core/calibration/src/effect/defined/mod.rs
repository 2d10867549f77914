//! Effects a user writes down as formulas, without compiling: they take part like any other.

mod definition;
mod formula;
mod variables;

pub use definition::{Addend, Definition, DefinitionError, FormulaTarget};
pub use formula::FormulaError;

#[cfg(test)]
mod tests;

use std::sync::Arc;

use super::{Contribution, Effect, LooksAt, Parameter, Sample};

/// A defined effect at its place.
#[derive(Debug)]
pub(super) struct Defined {
    definition: Arc<Definition>,
}

impl Defined {
    pub(super) fn new(definition: &Arc<Definition>) -> Self {
        Self { definition: Arc::clone(definition) }
    }
}

impl Effect for Defined {
    fn parameters(&self) -> &[Parameter] {
        &self.definition.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        self.definition.contribute(sample, contributions);
    }

    fn looks_at(&self) -> LooksAt {
        self.definition.looks_at
    }
}
