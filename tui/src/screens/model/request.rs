//! What a lab can be asked, and what it answers.

use super::state::{Doubtful, ModelSummary, Preview};

/// A piece of work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum LabRequest {
    /// What would be left with this effect added?
    Preview(String),
    /// Add this effect (or this group of them) to the model.
    Add(String),
    /// Add the effect (or group) of this name that somebody wrote, unless the lab objects: then it says why.
    AddNamed(String),
    /// Take what was added last away.
    Undo,
    /// What could explain the rest?
    Judge,
}

/// What came of it.
#[derive(Clone, Debug)]
pub(crate) enum LabAnswer {
    /// The model as it is now, held against the table; the candidates are not yet judged.
    Compared(Box<ModelSummary>),
    /// The model as it is now, with what could explain what is left.
    Examined(Box<ModelSummary>),
    /// Nothing was added: the lab would not name the effect whose name was written.
    Doubted(Doubtful),
    /// What would be left.
    Previewed(Box<Preview>),
    /// A revision was written: what was done, and what came with it.
    Did(Vec<String>),
    /// It was asked to give up.
    GaveUp {
        /// It was judging the candidates.
        judging: bool,
    },
    /// It could not be done, and why.
    Failed(String),
}
