//! Which step of a run.

use serde::{Deserialize, Serialize};

/// Position of a step in the expanded plan: its id, inside a repetition the repetition's id with the turn in brackets, counted from 1,
/// as in `cycle[2].lower`. Unique within a run.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub struct StepPath(pub String);

impl std::fmt::Display for StepPath {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.0)
    }
}
