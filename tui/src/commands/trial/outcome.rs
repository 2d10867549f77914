//! What a trial command prints and how it ends.

/// What a trial command says, and whether what it judged was right.
pub(super) struct Outcome {
    pub(super) message: String,
    pub(super) right: bool,
    /// Something could not be done, though the rest was.
    pub(super) failed: bool,
}

impl Outcome {
    pub(super) fn done(message: String) -> Self {
        Self { message, right: true, failed: false }
    }
}
