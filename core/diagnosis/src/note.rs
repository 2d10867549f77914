//! What the user should know besides an error or a verdict.

use crate::extrapolation::Extrapolation;

/// A note. Effects by their labels, as `add` takes them.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// What the reader of the table or the fit noticed, or who writes revisions, in its own words.
    Noticed(String),
    /// Rows that lie outside the region in which the model's corrections were measured.
    OutsideRegion {
        /// Those rows.
        outside: usize,
        /// All of them.
        rows: usize,
    },
    /// The fit has not arrived.
    NotArrived {
        /// RMS that it reached, sigmas.
        reached: f64,
        /// RMS that a last step promises, sigmas.
        promised: f64,
    },
    /// The model's residual map was left out: it explains nothing.
    MapLeftOut,
    /// The search looked at a part of the fitted rows.
    SearchedPart {
        /// Rows that it looked at.
        looked_at: usize,
        /// Rows that were fitted.
        fitted: usize,
    },
    /// This explains most, clearly, and would rise under its load.
    RisesUnderLoad(String),
    /// What no pose distinguishes from an effect in question, because on this arm it is the same.
    Twin {
        /// The effect.
        label: String,
        /// What does the same, in the words of its kind.
        twin: String,
    },
    /// The play of this joint is negative.
    NegativePlay(String),
    /// The fitted rows name this, and the held-out rows are predicted worse with it: it was not added.
    WorseHeldOut(String),
    /// So many of the effects that were added are corrections.
    Corrections(usize),
    /// What was added does harm where nothing was fitted.
    DoesNotExtrapolate(Extrapolation),
}
