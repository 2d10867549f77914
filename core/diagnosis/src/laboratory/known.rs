//! What a laboratory has worked out and is asked for again: a diagnosis, the comparison beside it, and the formula after it begin with the same fit.

use std::sync::OnceLock;

use plumb_calibration::fit::Fit;

/// Kept from question to question; `Dated` is the same laboratory with its epochs. A copy knows nothing: it is made to be changed.
#[derive(Debug)]
pub(super) struct Known<Dated> {
    /// Of the model as it is, to all rows that are not held out.
    pub(super) fit: OnceLock<Fit>,
    /// The same rows with the epochs they show; nothing where they show none.
    pub(super) dated: OnceLock<Option<Box<Dated>>>,
    /// The same with one more that begins where an event of an effect was found; nothing where one begins there already.
    pub(super) dated_at_event: OnceLock<Option<Box<Dated>>>,
}

impl<Dated> Default for Known<Dated> {
    fn default() -> Self {
        Self { fit: OnceLock::new(), dated: OnceLock::new(), dated_at_event: OnceLock::new() }
    }
}

impl<Dated> Clone for Known<Dated> {
    fn clone(&self) -> Self {
        Self::default()
    }
}
