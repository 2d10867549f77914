//! The record at work beside the screens: it is read on a thread of its own and answers when it is done, so that a slow
//! disk never holds up a key.

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;

use plumb_record::{Record, RecordError, RunId, RunSummary};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

use super::state::BringBack;
use super::trend::{self, Trend};
use crate::commands::record::roll_back;
use crate::commands::show;

/// Runs read at most; who looks for older ones has `plumb history`.
const MOST_RUNS: u32 = 1000;

/// What is to be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ArchiveRequest {
    /// The runs, and what was corrected when.
    List,
    /// All there is of one run.
    Open(i64),
    /// Earlier corrections are to be in force again.
    BringBack(BringBack),
}

/// What was read.
#[derive(Clone, Debug)]
pub(crate) enum ArchiveAnswer {
    /// The runs, the newest first, and what was corrected when.
    Listed {
        /// The runs.
        runs: Vec<RunSummary>,
        /// One for each quantity that ever had a correction in force.
        trends: Vec<Trend>,
    },
    /// One run as text, a string a line; headings are at the margin.
    Opened {
        /// Its number.
        run: i64,
        /// The lines.
        lines: Vec<String>,
    },
    /// Earlier corrections are in force again.
    BroughtBack(String),
    /// They are not, and why.
    NotBroughtBack(String),
    /// It could not be read, and why.
    Failed(String),
}

/// The line to the record.
pub(crate) struct Archive {
    requests: Sender<ArchiveRequest>,
    answers: UnboundedReceiver<ArchiveAnswer>,
}

impl Archive {
    /// Opens the record in `directory` for reading, beside anyone who writes it.
    pub(crate) fn open(directory: PathBuf) -> Self {
        let (requests, to_do) = channel();
        let (to_screens, answers) = unbounded_channel();
        thread::spawn(move || work(&directory, &to_do, &to_screens));
        Self { requests, answers }
    }

    /// Where requests go. A record that could not be opened takes none; its last answer said why.
    pub(crate) fn desk(&self) -> Sender<ArchiveRequest> {
        self.requests.clone()
    }

    /// The next answer; none when there will be no more.
    pub(crate) async fn answer(&mut self) -> Option<ArchiveAnswer> {
        self.answers.recv().await
    }
}

fn work(directory: &Path, to_do: &Receiver<ArchiveRequest>, to_screens: &UnboundedSender<ArchiveAnswer>) {
    let mut record = None;
    while let Ok(request) = to_do.recv() {
        let answers = opened(&mut record, directory).and_then(|record| answers_to(record, &request));
        let answers =
            answers.unwrap_or_else(|error| vec![ArchiveAnswer::Failed(crate::failure::with_causes(&error))]);
        for answer in answers {
            if to_screens.send(answer).is_err() {
                return;
            }
        }
    }
}

/// The open record; opened at the first question, and tried again if that failed.
fn opened<'a>(record: &'a mut Option<Record>, directory: &Path) -> Result<&'a mut Record, RecordError> {
    match record {
        Some(record) => Ok(record),
        None => Ok(record.insert(Record::open(directory)?)),
    }
}

fn answers_to(record: &mut Record, request: &ArchiveRequest) -> Result<Vec<ArchiveAnswer>, RecordError> {
    Ok(match request {
        ArchiveRequest::List => vec![listed(record)?],
        ArchiveRequest::Open(run) => {
            let lines = show::report(record, &record.run(RunId(*run))?)?;
            vec![ArchiveAnswer::Opened { run: *run, lines }]
        }
        ArchiveRequest::BringBack(back) => match roll_back(record, &back.cell, &back.device, back.revision) {
            Ok(done) => {
                let text =
                    format!("Revision {} is in force: as revision {} was.", done.revision, back.revision);
                vec![ArchiveAnswer::BroughtBack(text), listed(record)?]
            }
            Err(error) => vec![ArchiveAnswer::NotBroughtBack(crate::failure::with_causes(&error))],
        },
    })
}

fn listed(record: &Record) -> Result<ArchiveAnswer, RecordError> {
    let runs = record.history(MOST_RUNS)?;
    let mut trends = Vec::new();
    for (cell, key) in record.corrected()? {
        trends.push(trend::of(&cell, &key, &record.correction_history(&cell, &key)?));
    }
    Ok(ArchiveAnswer::Listed { runs, trends })
}
