//! Diagnosis: which physical effect a model lacks, if any. The README gives the procedure in the order of its decisions;
//! `thresholds.rs` holds every constant that decides. Knows no device.

mod batch;
mod block_errors;
mod candidates;
mod claim;
mod cross_validation;
mod diagnose;
mod direction_test;
mod epochs;
mod exchange;
mod explainable;
mod extrapolation;
mod few_poses;
mod fitted;
mod forward_selection;
mod found;
mod growth;
mod hypothesis;
mod joint_range;
mod jump;
pub mod laboratory;
mod lack_of_fit;
mod mechanism_test;
mod mixture_test;
mod negative_play;
mod next_poses;
pub mod noise_floor;
mod not_shown;
mod note;
mod outcome;
mod pose_to_pose;
mod predictive_gain;
mod products;
mod project;
mod refine;
mod repeatability;
pub mod report;
mod residual_structure;
mod score_test;
pub mod split;
pub mod stripe;
#[cfg(test)]
mod testing;
mod thresholds;
mod unlisted;
mod verdict;
mod working_volume;

pub use claim::Claim;
pub use explainable::{BlockedExplainable, Explainable, ExplainableGroup};
pub use extrapolation::Extrapolation;
pub use growth::{Growth, Step, StepRms};
pub use hypothesis::{HYPOTHESIS, Hypothesis, HypothesisValue};
pub use jump::Jump;
pub use next_poses::{Asked, Instead, NextPoses, OtherWay, Requested};
pub use note::Note;
pub use outcome::{
    AcrossPoses, Alike, Candidate, ConditionAtPoses, Diagnosis, EffectSite, FewPoses, Located, Named,
    NextPose, NotShown, Objection, PoseFraction, Rejection, Remaining, Rest, TwoPositions, Verdict,
};
pub use residual_structure::{CategoryMeans, Description, ResidualShape, Trend};
