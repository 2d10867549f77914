//! What came of the checks.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::lesson::{CALL_ENDS, PROCESS_LIVES, lesson};
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

/// Words of failures that whatever check meets them, and the lesson that fits: a host refuses what is dated by another clock and what was not declared,
/// and knows how a process ended or that a call does not.
const CAUSES: [(&str, &str); 7] = [
    ("host's `now_ns`", "its times are those of the cell's clock"),
    ("which its plugin.yaml does not declare", "it emits what its manifest declares"),
    ("did not answer '", CALL_ENDS),
    ("was ended by SIG", PROCESS_LIVES),
    ("ended with code", PROCESS_LIVES),
    ("has ended (", PROCESS_LIVES),
    ("the plugin panicked", PROCESS_LIVES),
];

/// The check whose lesson fits a failure.
fn taught_by<'c>(name: &'c str, how: &str) -> &'c str {
    CAUSES.iter().find(|(words, _)| how.contains(words)).map_or(name, |(_, lesson)| lesson)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_any_check_may_meet_is_taught_by_its_cause() {
        for (words, cause) in CAUSES {
            assert!(lesson(cause).is_some(), "{words}");
        }
        let taught =
            |how: &str| row_in_words("a move ends at its target", &CheckOutcome::Failed(how.to_owned()));
        for (how, contract) in [
            (
                "the driver emits on 'extra', which its plugin.yaml does not declare",
                "a plugin emits on the streams",
            ),
            ("arm did not answer 'read joints' within 5s", "a call that moves nothing ends within 5 s"),
            ("the host of arm was ended by SIGSEGV", "a call returns, with an error"),
            ("waist ends at 1 instead of 2 rad", "`move_joints` returns when the robot is at rest"),
        ] {
            assert!(taught(how).contains(&format!("contract: {contract}")), "{}", taught(how));
        }
    }
}
