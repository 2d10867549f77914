//! The model lab at work beside the screens: it fits and judges on a thread of its own and answers when it is done.

use std::collections::VecDeque;
use std::sync::mpsc::Sender;
use std::thread;

use plumb_calibration::effect;
use plumb_calibration::measurement::RmsError;
use plumb_calibration::revision::{Entry, Family, RevisionError};
use plumb_diagnosis::Diagnosis;
use plumb_diagnosis::laboratory::{Comparison, Laboratory, LaboratoryError};
use plumb_diagnosis::report::StepKind;
use plumb_estimation::Progress;
use plumb_report::objection_in_words;
use thiserror::Error;
use tokio::sync::mpsc::UnboundedReceiver;

use super::lab_thread::{InHand, LabThread, ScreensEnd, WorkError, line};
use super::request::{LabAnswer, LabRequest};
use super::residuals::Residuals;
use super::state::{Doubtful, ErrorStep, ModelState, Preview};
use super::summary;
use crate::commands::model::arguments::{OpenError, Opened};

/// Why a piece of work was not done.
#[derive(Debug, Error)]
enum LabError {
    /// The lab itself.
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
    /// A revision cannot be read or written.
    #[error(transparent)]
    Revision(#[from] RevisionError),
    /// The model that was opened could not be fitted.
    #[error("the model could not be fitted, so nothing can be tried on it")]
    NotFitted,
    /// An older revision is open.
    #[error("revision {opened} is open, but the newest is {newest}; open that to undo it")]
    NotNewest {
        /// The one that is open.
        opened: u32,
        /// The newest.
        newest: u32,
    },
}

impl WorkError for LabError {
    fn is_cancelled(&self) -> bool {
        matches!(self, Self::Laboratory(error) if error.is_cancelled())
    }
}

/// The line to the lab. Dropping it ends what the lab is doing.
pub(crate) struct Lab {
    desk: Desk,
    answers: UnboundedReceiver<LabAnswer>,
}

/// Where requests go.
#[derive(Clone)]
pub(crate) struct Desk {
    requests: Sender<LabRequest>,
    in_hand: InHand,
}

impl Desk {
    /// Gives the lab a piece of work; what it is judging it gives up. A lab that has ended takes none; its last answer said why.
    pub(crate) fn ask(&self, request: LabRequest) {
        self.in_hand.progress().cancel();
        let _ended = self.requests.send(request);
    }

    /// Has the lab give up what it is doing.
    pub(crate) fn cancel(&self) {
        self.in_hand.progress().cancel();
    }

    /// How far the work in hand is, 0 to 1, and what it does; nothing before it has said so.
    pub(crate) fn how_far(&self) -> Option<(f64, String)> {
        let (fraction, doing) = self.in_hand.progress().state();
        (!doing.is_empty()).then_some((fraction, doing))
    }
}

impl Lab {
    /// Starts to look at a model and the table called `data`.
    ///
    /// # Errors
    /// An earlier revision of the model cannot be read, or does not go with the table.
    pub(crate) fn open(opened: Opened, data: String) -> Result<(Self, ModelState), OpenError> {
        let name = opened
            .entry
            .path
            .file_name()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let files = format!("{name}, {data} ({} rows)", opened.laboratory.table().len());
        let state = ModelState::new(&opened.laboratory.model().arm, &files);
        let mut to_look_at = VecDeque::new();
        for (entry, did) in lineage(&opened)? {
            let (table, options) = (opened.laboratory.table().clone(), opened.laboratory.options().clone());
            to_look_at.push_back((Laboratory::new(entry.model, table, options)?, entry.number, did));
        }
        let (lab, thread) = Self::with_thread();
        let layers = Vec::new();
        let worker = Worker { family: opened.family, data, layers, to_look_at, judged: None, thread };
        thread::spawn(move || worker.run());
        Ok((lab, state))
    }

    /// A line to a lab, and its other end, for the thread that does the work.
    pub(super) fn with_thread() -> (Self, LabThread) {
        let (ScreensEnd { requests, in_hand, answers }, thread) = line();
        (Self { desk: Desk { requests, in_hand }, answers }, thread)
    }

    /// Where requests go.
    pub(crate) fn desk(&self) -> Desk {
        self.desk.clone()
    }

    /// The next answer; none when the lab has ended.
    pub(crate) async fn answer(&mut self) -> Option<LabAnswer> {
        self.answers.recv().await
    }
}

impl Drop for Lab {
    fn drop(&mut self) {
        self.desk.cancel();
    }
}

/// A model that was looked at, with what it left.
struct Layer {
    laboratory: Laboratory,
    /// Its revision.
    number: u32,
    step: ErrorStep,
}

/// The lab's own thread: the models from the original to the newest.
struct Worker {
    family: Family,
    /// The table's name, as revisions note it.
    data: String,
    layers: Vec<Layer>,
    /// Revisions which have not been looked at yet, the original first: number, and what was done to make it.
    to_look_at: VecDeque<(Laboratory, u32, String)>,
    /// What the candidates for what the newest model leaves were judged to be, once they were.
    judged: Option<Diagnosis>,
    thread: LabThread,
}

impl Worker {
    /// Works until nobody asks any more.
    fn run(mut self) {
        self.answer(Self::look_at_opened);
        while let Some(request) = self.thread.next() {
            self.answer(|worker| match request {
                LabRequest::Preview(effect) => worker.preview(&effect),
                LabRequest::Add(effect) => worker.add(&effect),
                LabRequest::AddNamed(effect) => worker.add_unless_doubted(effect),
                LabRequest::Undo => worker.undo(),
                LabRequest::Judge => Ok(()),
            });
            // Judging that was given up for a request that changed nothing is taken up again.
            if self.judged.is_none() {
                self.answer(Self::look_again);
            }
        }
    }

    /// Does a piece of work and says what went wrong with it, if something did.
    fn answer(&mut self, work: impl FnOnce(&mut Self) -> Result<(), LabError>) {
        self.thread.begin();
        let done = work(self);
        self.thread.end(done);
    }

    /// The progress of the work in hand, by which it can be ended.
    fn progress(&self) -> Progress {
        self.thread.progress()
    }

    /// Looks at the revisions that were not looked at yet. One that was given up is looked at again the next time.
    fn look_at_opened(&mut self) -> Result<(), LabError> {
        while let Some((laboratory, _, did)) = self.to_look_at.front() {
            let newest = self.to_look_at.len() == 1;
            let comparison = match newest {
                true => laboratory.compare_in_full(&self.progress())?,
                false => laboratory.compare(&self.progress())?,
            };
            let step = summary::step(did, self.kind_of_step(laboratory), &comparison);
            let Some((laboratory, number, _)) = self.to_look_at.pop_front() else { break };
            self.layers.push(Layer { laboratory, number, step });
            if newest {
                self.judge(&comparison)?;
            }
        }
        Ok(())
    }

    /// Shows what the newest model leaves, then judges what could explain that.
    fn judge(&mut self, comparison: &Comparison) -> Result<(), LabError> {
        self.judged = None;
        self.thread.begin_judging();
        let Some(top) = self.layers.last() else { return Ok(()) };
        let error_steps: Vec<ErrorStep> = self.layers.iter().map(|layer| layer.step.clone()).collect();
        self.thread.report(LabAnswer::Compared(Box::new(summary::compared(comparison, &error_steps))));
        let progress = self.progress();
        let diagnosis = top.laboratory.with_hypothesis(top.laboratory.diagnose(&progress)?, &progress)?;
        let plots =
            top.laboratory.effect_plots(&summary::plotted(comparison, &diagnosis), &self.progress())?;
        self.thread.report(LabAnswer::Examined(Box::new(summary::examined(
            comparison,
            &diagnosis,
            plots,
            &error_steps,
        ))));
        self.judged = Some(diagnosis);
        Ok(())
    }

    /// What the model to be looked at adds to the newest that was.
    fn kind_of_step(&self, laboratory: &Laboratory) -> StepKind {
        summary::kind_of_step(self.layers.last().map(|layer| layer.laboratory.model()), laboratory.model())
    }

    /// The newest model.
    fn top(&self) -> Result<&Layer, LabError> {
        self.layers.last().filter(|_| self.to_look_at.is_empty()).ok_or(LabError::NotFitted)
    }

    /// Looks at the newest model again, or on where that was given up before all revisions were looked at.
    fn look_again(&mut self) -> Result<(), LabError> {
        if !self.to_look_at.is_empty() {
            return self.look_at_opened();
        }
        let top = self.top()?;
        let comparison = top.laboratory.compare_in_full(&self.progress())?;
        self.judge(&comparison)
    }

    fn preview(&self, effect: &str) -> Result<(), LabError> {
        let top = self.top()?;
        let preview = top.laboratory.preview(effect, &self.progress())?;
        let residuals = Residuals { rows: preview.rows, series: preview.series };
        let preview = Preview { candidate: effect.to_owned(), rms_mm: preview.after.fit, residuals };
        self.thread.report(LabAnswer::Previewed(Box::new(preview)));
        Ok(())
    }

    /// Adds an effect that somebody wrote, unless the lab would not name it. Of groups and wildcards it has no opinion: they free numbers.
    fn add_unless_doubted(&mut self, effect: String) -> Result<(), LabError> {
        let all = effect::expand(&effect, self.top()?.laboratory.model()).unwrap_or_default();
        let [id] = all.as_slice() else { return self.add(&effect) };
        if self.judged.is_none() {
            self.look_again()?;
        }
        let laboratory = &self.top()?.laboratory;
        let objection = self.judged.as_ref().and_then(|diagnosis| laboratory.objection_by(diagnosis, id));
        let Some(objection) = objection else { return self.add(&effect) };
        let reason = objection_in_words(&objection);
        self.thread.report(LabAnswer::Doubted(Doubtful { effect, reason, is_chosen: false }));
        Ok(())
    }

    /// Adds an effect (or a wildcard or group) and writes the next revision.
    fn add(&mut self, effect: &str) -> Result<(), LabError> {
        let top = self.top()?;
        let addition = top.laboratory.add(effect, &self.progress())?;
        let rms = Some(RmsError { value: addition.rms_mm.fit, unit: addition.comparison.unit });
        let did = format!("add {effect}");
        let entry = self.family.write(addition.model, Some(top.number), &did, Some(&self.data), rms)?;
        let (table, options) = (top.laboratory.table().clone(), top.laboratory.options().clone());
        let laboratory = Laboratory::new(entry.model, table, options)?;
        let step = summary::step(effect, self.kind_of_step(&laboratory), &addition.comparison);
        self.layers.push(Layer { laboratory, number: entry.number, step });
        let mut news = vec![format!("{effect} added; revision {} is {}", entry.number, entry.path.display())];
        news.extend(
            addition.moved.iter().map(|moved| format!("moved by more than two standard errors: {moved}")),
        );
        self.thread.report(LabAnswer::Did(news));
        // In full: how much of what is left now could be explained, and which effects were added.
        self.look_again()
    }

    /// Goes back to the revision before, which becomes the next one.
    fn undo(&mut self) -> Result<(), LabError> {
        let top = self.top()?.number;
        let newest = self.family.newest();
        if top != newest {
            return Err(LabError::NotNewest { opened: top, newest });
        }
        let entry = self.family.undo()?;
        self.layers.pop();
        let news = format!("undone; revision {} is {}", entry.number, entry.path.display());
        if let Some(top) = self.layers.last_mut() {
            top.number = entry.number;
        }
        self.thread.report(LabAnswer::Did(vec![news]));
        self.look_again()
    }
}

/// The revisions a model came to be by, the original first, and what was done to make each.
fn lineage(opened: &Opened) -> Result<Vec<(Entry, String)>, RevisionError> {
    let mut newest_first = vec![opened.entry.clone()];
    while let Some(parent) = newest_first.last().and_then(|entry| entry.model.revision.as_ref()?.parent) {
        // A file somebody edited may name itself as its parent's parent; no lineage is longer than its numbers.
        if newest_first.iter().any(|entry| entry.number == parent) {
            break;
        }
        newest_first.push(opened.family.entry(parent)?);
    }
    let did = |entry: &Entry| match &entry.model.revision {
        Some(revision) => revision.did.strip_prefix("add ").unwrap_or(&revision.did).to_owned(),
        None => "start".to_owned(),
    };
    Ok(newest_first
        .into_iter()
        .rev()
        .map(|entry| (did(&entry), entry))
        .map(|(did, entry)| (entry, did))
        .collect())
}
