//! What a laboratory has worked out and is asked for again: a diagnosis, the comparison beside it, and the formula after it begin with the same fit.

use std::sync::OnceLock;

use crate::epochs::Dated;
use plumb_calibration::fit::Fit;

/// Kept from question to question. A copy knows nothing: it is made to be changed.
#[derive(Debug, Default)]
pub(super) struct Known {
    /// Of the model as it stands, to all rows that are not held out.
    pub(super) fit: OnceLock<Fit>,
    /// The same rows with the epochs they show; nothing where they show none.
    pub(super) dated: OnceLock<Option<Box<Dated>>>,
}

impl Clone for Known {
    fn clone(&self) -> Self {
        Self::default()
    }
}
