//! How a run of the record ended, in words.

use plumb_record::{RunEnd, RunState, RunSummary};

/// The state of a run, for people.
pub fn state_in_words(run: &RunSummary) -> &'static str {
    match run.state {
        RunState::Running => "not ended",
        RunState::Ended(RunEnd::NeedsOperator) => "needs operator",
        RunState::Ended(end) => end.name(),
    }
}

/// The state of a run, and how many of its steps were skipped.
pub fn ended_in_words(run: &RunSummary) -> String {
    let state = state_in_words(run);
    match run.skipped.len() {
        0 => state.to_owned(),
        count => format!("{state}, {count} skipped"),
    }
}

/// Which steps were skipped, as a sentence's end: `, 1 step skipped: waist.lower`; empty where none was.
pub fn skipped_in_words(run: &RunSummary) -> String {
    match run.skipped.as_slice() {
        [] => String::new(),
        [only] => format!(", 1 step skipped: {only}"),
        many => format!(", {} steps skipped: {}", many.len(), many.join(", ")),
    }
}
