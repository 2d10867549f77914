//! What the History screen shows.

use plumb_record::RunSummary;

use super::trend::Trend;
use crate::history_command::state_in_words;

/// The runs of the record and what is chosen among them.
#[derive(Clone, Debug, Default)]
pub(crate) struct HistoryState {
    /// The newest first; none until the record was read.
    pub runs: Option<Vec<RunSummary>>,
    /// Words a run has to hold to be shown.
    pub filter: String,
    /// Letters go into the filter.
    pub filtering: bool,
    /// Place of the chosen run among those shown.
    pub chosen: usize,
    /// The run that is open over the list.
    pub opened: Option<OpenedRun>,
    /// What was ever corrected.
    pub trends: Vec<Trend>,
    /// The one that is drawn.
    pub trend: usize,
    /// Why the record could not be read.
    pub problem: Option<String>,
}

/// A run in full.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct OpenedRun {
    /// Its number.
    pub run: i64,
    /// What the record holds of it; empty until it was read.
    pub lines: Vec<String>,
    /// Lines scrolled away at the top.
    pub scrolled: usize,
}

impl HistoryState {
    /// The runs that hold every word of the filter.
    pub(crate) fn shown(&self) -> Vec<&RunSummary> {
        let words: Vec<String> = self.filter.split_whitespace().map(str::to_lowercase).collect();
        let holds = |run: &&RunSummary| {
            let text = format!(
                "{} {} {} {} {} {} {} {}",
                run.run,
                run.started.get(..16).unwrap_or(&run.started).replace('T', " "),
                run.cell,
                run.procedure,
                run.title,
                run.operator,
                state_in_words(run),
                run.message.as_deref().unwrap_or_default()
            )
            .to_lowercase();
            words.iter().all(|word| text.contains(word))
        };
        self.runs.iter().flatten().filter(holds).collect()
    }

    /// The run that is chosen.
    pub(crate) fn run(&self) -> Option<&RunSummary> {
        self.shown().get(self.chosen).copied()
    }

    /// Keeps the choice within what is shown.
    pub(super) fn keep_choice_within(&mut self) {
        self.chosen = self.chosen.min(self.shown().len().saturating_sub(1));
        self.trend = self.trend.min(self.trends.len().saturating_sub(1));
    }
}
