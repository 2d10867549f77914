//! What an adjustment of stripes is asked for, and why there may be none.

use super::RigParameter;
use plumb_calibration::effect::{EffectId, EffectNameError};

/// What is adjusted, beside the surfaces' places.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// Numbers of the rig.
    pub rig: Vec<RigParameter>,
    /// Effects of the library that act in joints.
    pub effects: Vec<EffectId>,
}

/// Why there is no adjustment.
#[derive(Debug, thiserror::Error)]
pub enum AdjustError {
    /// An effect cannot act in this model.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// Too few points lie near any surface.
    #[error(
        "only {near} of {all} points lie near a surface, for {unknowns} unknowns: do the surfaces stand about where they are said to?"
    )]
    TooFew {
        /// Points near a surface.
        near: usize,
        /// All points.
        all: usize,
        /// Numbers sought.
        unknowns: usize,
    },
    /// It does not come to an end.
    #[error("the adjustment does not settle; adjust fewer things at once")]
    Diverged,
}
