//! What came of the checks.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::lesson::lesson;
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
            writeln!(formatter, "{}", row_in_words(name, outcome))?;
        }
        Ok(())
    }
}

/// What came of a check; where it failed, with what the contract says and what to change, a line each.
pub fn row_in_words(name: &str, outcome: &CheckOutcome) -> String {
    match outcome {
        CheckOutcome::Passed => format!("passed   {name}"),
        CheckOutcome::Skipped(why) => format!("skipped  {name}: {why}"),
        CheckOutcome::Failed(how) => {
            let lesson = lesson(taught_by(name, how))
                .map(|lesson| {
                    format!("\n         contract: {}\n         change:   {}", lesson.contract, lesson.change)
                })
                .unwrap_or_default();
            format!("FAILED   {name}: {how}{lesson}")
        }
    }
}

/// The check whose lesson fits a failure: a host refuses what is dated by another clock, whatever the check was about.
fn taught_by<'c>(name: &'c str, how: &str) -> &'c str {
    if how.contains("host's `now_ns`") { "its times are those of the cell's clock" } else { name }
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
