//! What is claimed of an added effect.

use serde::Serialize;

/// Whether the mechanism of an added effect is identified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Claim {
    /// It is identified: nothing else explains the rows as well.
    Mechanism,
    /// It predicts rows it has not seen, and may represent another mechanism.
    Correction,
}
