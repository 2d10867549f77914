//! What a diagnosis found that may be added to the model.

use crate::outcome::EffectSite;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::EffectId;

/// The named effect with the values it was found at; where nothing is named, what may be added all the same, the likeliest first.
#[derive(Default)]
pub(crate) struct Found {
    pub(crate) named: Option<AddedEffect>,
    pub(crate) corrections: Vec<CorrectionCandidate>,
    /// What was found to act at once, where nothing is named: each passed beside the others. Nothing where it is one effect, or holds one that was re-set.
    pub(crate) together: Vec<CorrectionCandidate>,
    /// What comes nearest, where it is an event of which the moment was searched for.
    pub(crate) event: Option<EffectId>,
}

/// What a correction may represent besides the effects of the library, as model files have it.
pub(crate) const NOT_LISTED: &str = "a mechanism that is not listed";

/// An effect that predicts rows it has not seen though it may not be named.
#[derive(Clone)]
pub(crate) struct CorrectionCandidate {
    pub(crate) effect: AddedEffect,
    pub(crate) site: EffectSite,
    /// The mechanisms it may represent.
    pub(crate) may_be: Vec<String>,
}
