//! What came of the checks.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::PluginError;

/// What came of one check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CheckOutcome {
    /// The device does what it must.
    Passed,
    /// It could not be judged, and why.
    Skipped(String),
    /// It does not, and how.
    Failed(String),
}

/// What came of all checks, in order.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct CheckReport {
    /// The check's name, a statement, and what came of it.
    pub rows: Vec<(&'static str, CheckOutcome)>,
}

impl CheckReport {
    /// Whether no check failed.
    pub fn is_good(&self) -> bool {
        !self.rows.iter().any(|(_, outcome)| matches!(outcome, CheckOutcome::Failed(_)))
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (name, outcome) in &self.rows {
            match outcome {
                CheckOutcome::Passed => writeln!(formatter, "passed   {name}")?,
                CheckOutcome::Skipped(why) => writeln!(formatter, "skipped  {name}: {why}")?,
                CheckOutcome::Failed(how) => writeln!(formatter, "FAILED   {name}: {how}")?,
            }
        }
        Ok(())
    }
}

/// Runs a check. An error is a failure, and so is a panic: the report goes on.
pub(super) fn caught(check: impl FnOnce() -> Result<CheckOutcome, PluginError>) -> CheckOutcome {
    match catch_unwind(AssertUnwindSafe(check)) {
        Ok(Ok(outcome)) => outcome,
        Ok(Err(error)) => CheckOutcome::Failed(error.to_string()),
        Err(payload) => CheckOutcome::Failed(format!("it panicked: {}", panic_text(payload.as_ref()))),
    }
}

fn panic_text(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}
