//! What the History screen shows.

use plumb_record::RunSummary;

use super::trend::Trend;
use plumb_report::run_words::ended_in_words;

/// The runs of the record and what is chosen among them.
#[derive(Clone, Debug, Default)]
pub(crate) struct HistoryState {
    /// The newest first; none until the record was read.
    pub runs: Option<Vec<RunSummary>>,
    /// Words a run has to hold to be shown.
    pub filter: String,
    /// Letters go into the filter.
    pub filtering: bool,
    /// Index of the chosen run among those shown.
    pub chosen: usize,
    /// The run that is open over the list.
    pub opened: Option<OpenedRun>,
    /// What was ever corrected.
    pub trends: Vec<Trend>,
    /// The one that is drawn.
    pub trend: usize,
    /// Why the record could not be read.
    pub problem: Option<String>,
    /// Corrections that are to be brought back, once that is confirmed.
    pub bring_back: Option<BringBack>,
}

/// Corrections of a device as a run put them in force.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BringBack {
    /// The run that put them in force.
    pub run: i64,
    /// The cell.
    pub cell: String,
    /// The device.
    pub device: String,
    /// The last revision the run made.
    pub revision: i64,
    /// What changes, a line each.
    pub changes: Vec<String>,
}

impl BringBack {
    /// What the operator is asked.
    pub(crate) fn question(&self) -> String {
        format!(
            "{} of cell {}, back to revision {} of run {}:\n\n{}\n\n  y  bring them back; what is in force now stays in the record\n  n  leave \
             them as they are",
            self.device,
            self.cell,
            self.revision,
            self.run,
            self.changes.join("\n")
        )
    }
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
    /// The cells of which the record holds runs.
    pub(crate) fn cells(&self) -> Vec<&str> {
        let mut cells: Vec<&str> = self.runs.iter().flatten().map(|run| run.cell.as_str()).collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// Whose runs these are: the cell, or how many cells; nothing before there are any.
    pub(crate) fn whose(&self) -> Option<String> {
        match self.cells().as_slice() {
            [] => None,
            [cell] => Some((*cell).to_owned()),
            more => Some(format!("{} cells", more.len())),
        }
    }

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
                ended_in_words(run),
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

    /// What bringing back the corrections of the chosen run would change.
    ///
    /// # Errors
    /// Why there is nothing to bring back, for the operator.
    pub(crate) fn way_back(&self) -> Result<BringBack, String> {
        let Some(run) = self.run().map(|run| run.run.0) else { return Err("No run is chosen.".to_owned()) };
        let made = self.trends.iter().flat_map(|trend| trend.points.iter().map(move |point| (trend, point)));
        let last = made.filter(|(_, point)| point.run == Some(run)).max_by_key(|(_, point)| point.revision);
        let Some((trend, point)) = last else {
            return Err(format!("Run {run} put no correction in force: choose one that did."));
        };
        let (cell, device, revision) = (trend.cell.clone(), trend.device.clone(), point.revision);
        let of_device = |trend: &&Trend| trend.cell == cell && trend.device == device;
        let changes: Vec<String> =
            self.trends.iter().filter(of_device).filter_map(|trend| trend.change_to(revision)).collect();
        match changes.is_empty() {
            true => Err(format!("What run {run} put in force is in force.")),
            false => Ok(BringBack { run, cell, device, revision, changes }),
        }
    }

    /// Keeps the choice within what is shown.
    pub(super) fn keep_choice_within(&mut self) {
        self.chosen = self.chosen.min(self.shown().len().saturating_sub(1));
        self.trend = self.trend.min(self.trends.len().saturating_sub(1));
    }
}
