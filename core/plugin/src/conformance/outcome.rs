//! What came of the checks.

use std::fmt;

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
