//! What is wrong with the text of a camera or rig file.

/// A file that is not of its form, or holds a value that cannot be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{origin}: {what}")]
pub struct WrongFile {
    /// The file.
    pub origin: String,
    /// What is wrong and where, and what would be right.
    pub what: String,
}

impl WrongFile {
    pub(super) fn new(origin: &str, what: impl ToString) -> Self {
        Self { origin: origin.to_owned(), what: what.to_string() }
    }
}
