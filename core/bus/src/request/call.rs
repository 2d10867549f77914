//! How a request is made.

use std::time::Duration;

/// How a request is made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Call {
    /// How long it may take.
    pub time_limit: Duration,
    /// The span of the orchestrator's log it belongs to; 0 for none.
    pub span: u64,
}

impl Call {
    /// A call of a time limit, under no span.
    pub fn within(time_limit: Duration) -> Self {
        Self { time_limit, span: 0 }
    }
}
