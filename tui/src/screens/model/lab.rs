//! The model lab at work beside the screens: it fits and judges on a thread of its own and answers when it is done.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use plumb_calibration::revision::{Entry, Family, RevisionError};
use plumb_diagnosis::laboratory::{Comparison, Laboratory, LaboratoryError};
use plumb_diagnosis::report::StepKind;
use plumb_estimation::Progress;
use thiserror::Error;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

use super::residuals::Residuals;
use super::standing;
use super::state::{FallStep, ModelState, Preview, Standing};
use crate::commands::model::arguments::{OpenError, Opened};

/// A piece of work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum LabRequest {
    /// What would be left with this effect added?
    Preview(String),
    /// Add this effect (or this group of them) to the model.
    Add(String),
    /// Take what was added last away.
    Undo,
    /// What could explain the rest?
    Judge,
}

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

/// What came of it.
#[derive(Clone, Debug)]
pub(crate) enum LabAnswer {
    /// The model as it is now, held against the table; the candidates are not yet judged.
    Compared(Box<Standing>),
    /// The model as it is now, with what could explain what is left.
    Examined(Box<Standing>),
    /// What would be left.
    Previewed(Box<Preview>),
    /// A revision was written: what was done, and what came with it.
    Did(Vec<String>),
    /// It was told to give up.
    GaveUp {
        /// It was judging the candidates.
        judging: bool,
    },
    /// It could not be done, and why.
    Failed(String),
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
    /// Of the work in hand.
    progress: Arc<Mutex<Progress>>,
}

impl Desk {
    /// Gives the lab a piece of work; what it is judging it gives up. A lab that has ended takes none; its last answer said why.
    pub(crate) fn ask(&self, request: LabRequest) {
        self.progress().cancel();
        let _ended = self.requests.send(request);
    }

    /// Has the lab give up what it is doing.
    pub(crate) fn cancel(&self) {
        self.progress().cancel();
    }

    /// How far the work in hand is, 0 to 1, and what it does; nothing before it has said so.
    pub(crate) fn how_far(&self) -> Option<(f64, String)> {
        let (fraction, doing) = self.progress().state();
        (!doing.is_empty()).then_some((fraction, doing))
    }

    fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
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
        let (requests, to_do) = channel();
        let (to_screens, answers) = unbounded_channel();
        let progress = Arc::default();
        let desk = Desk { requests, progress: Arc::clone(&progress) };
        let layers = Vec::new();
        let worker = Worker {
            family: opened.family,
            data,
            layers,
            to_look_at,
            judged: false,
            judging: false,
            to_screens,
            progress,
        };
        thread::spawn(move || worker.run(&to_do));
        Ok((Self { desk, answers }, state))
    }

    /// A lab whose work another thread does: the line to it, what it is asked, and where it answers.
    pub(super) fn beside() -> (Self, Receiver<LabRequest>, UnboundedSender<LabAnswer>) {
        let (requests, to_do) = channel();
        let (to_screens, answers) = unbounded_channel();
        let desk = Desk { requests, progress: Arc::default() };
        (Self { desk, answers }, to_do, to_screens)
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
        self.desk.progress().cancel();
    }
}

/// A model that was looked at, with what it left.
struct Layer {
    laboratory: Laboratory,
    /// Its revision.
    number: u32,
    step: FallStep,
}

/// The lab's own thread: the models from the original to the newest.
struct Worker {
    family: Family,
    /// The table's name, as revisions note it.
    data: String,
    layers: Vec<Layer>,
    /// Revisions which have not been looked at yet, the original first: number, and what was done to make it.
    to_look_at: VecDeque<(Laboratory, u32, String)>,
    /// The candidates for what the newest model leaves were judged.
    judged: bool,
    /// It is at that.
    judging: bool,
    to_screens: UnboundedSender<LabAnswer>,
    progress: Arc<Mutex<Progress>>,
}

impl Worker {
    /// Works until nobody asks any more.
    fn run(mut self, to_do: &Receiver<LabRequest>) {
        self.answer(Self::look_at_opened);
        while let Ok(request) = to_do.recv() {
            self.answer(|worker| match request {
                LabRequest::Preview(effect) => worker.preview(&effect),
                LabRequest::Add(effect) => worker.add(&effect),
                LabRequest::Undo => worker.undo(),
                LabRequest::Judge => Ok(()),
            });
            // Judging that was given up for a request that changed nothing is taken up again.
            if !self.judged {
                self.answer(Self::look_again);
            }
        }
    }

    /// Does a piece of work and says what went wrong with it, if something did.
    fn answer(&mut self, work: impl FnOnce(&mut Self) -> Result<(), LabError>) {
        *self.progress.lock().unwrap_or_else(PoisonError::into_inner) = Progress::default();
        self.judging = false;
        match work(self) {
            Ok(()) => {}
            Err(LabError::Laboratory(LaboratoryError::Cancelled(_))) => {
                self.say(LabAnswer::GaveUp { judging: self.judging });
            }
            Err(error) => self.say(LabAnswer::Failed(error.to_string())),
        }
    }

    /// The progress of the work in hand, by which it can be ended.
    fn progress(&self) -> Progress {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Tells the screens; screens that are gone hear nothing.
    fn say(&self, answer: LabAnswer) {
        let _gone = self.to_screens.send(answer);
    }

    fn look_at_opened(&mut self) -> Result<(), LabError> {
        while let Some((laboratory, number, did)) = self.to_look_at.pop_front() {
            let newest = self.to_look_at.is_empty();
            let comparison = match newest {
                true => laboratory.compare_in_full(&self.progress())?,
                false => laboratory.compare(&self.progress())?,
            };
            let step = standing::step(&did, self.kind_of_step(&laboratory), &comparison);
            self.layers.push(Layer { laboratory, number, step });
            if newest {
                self.judge(&comparison)?;
            }
        }
        Ok(())
    }

    /// Shows what the newest model leaves, then judges what could explain that.
    fn judge(&mut self, comparison: &Comparison) -> Result<(), LabError> {
        (self.judged, self.judging) = (false, true);
        let Some(top) = self.layers.last() else { return Ok(()) };
        let fall: Vec<FallStep> = self.layers.iter().map(|layer| layer.step.clone()).collect();
        self.say(LabAnswer::Compared(Box::new(standing::compared(comparison, &fall))));
        let progress = self.progress();
        let diagnosis = top.laboratory.with_hypothesis(top.laboratory.diagnose(&progress)?, &progress)?;
        let plots =
            top.laboratory.effect_plots(&standing::plotted(comparison, &diagnosis), &self.progress())?;
        self.judged = true;
        self.say(LabAnswer::Examined(Box::new(standing::examined(comparison, &diagnosis, plots, &fall))));
        Ok(())
    }

    /// What the model to be looked at adds to the newest that was.
    fn kind_of_step(&self, laboratory: &Laboratory) -> StepKind {
        standing::kind_of_step(self.layers.last().map(|layer| layer.laboratory.model()), laboratory.model())
    }

    /// The newest model.
    fn top(&self) -> Result<&Layer, LabError> {
        self.layers.last().ok_or(LabError::NotFitted)
    }

    /// Looks at the newest model again.
    fn look_again(&mut self) -> Result<(), LabError> {
        let top = self.top()?;
        let comparison = top.laboratory.compare_in_full(&self.progress())?;
        self.judge(&comparison)
    }

    fn preview(&self, effect: &str) -> Result<(), LabError> {
        let top = self.top()?;
        let preview = top.laboratory.preview(effect, &self.progress())?;
        let residuals = Residuals { rows: preview.rows, series: preview.series };
        let preview = Preview { candidate: effect.to_owned(), rms_mm: preview.after.fit, residuals };
        self.say(LabAnswer::Previewed(Box::new(preview)));
        Ok(())
    }

    /// Adds an effect (or a wildcard or group) and writes the next revision.
    fn add(&mut self, effect: &str) -> Result<(), LabError> {
        let top = self.top()?;
        let addition = top.laboratory.add(effect, &self.progress())?;
        let rms = Some(addition.rms_mm.fit);
        let did = format!("add {effect}");
        let entry = self.family.write(addition.model, Some(top.number), &did, Some(&self.data), rms)?;
        let (table, options) = (top.laboratory.table().clone(), top.laboratory.options().clone());
        let laboratory = Laboratory::new(entry.model, table, options)?;
        let step = standing::step(effect, self.kind_of_step(&laboratory), &addition.comparison);
        self.layers.push(Layer { laboratory, number: entry.number, step });
        let mut news = vec![format!("{effect} added; revision {} is {}", entry.number, entry.path.display())];
        news.extend(
            addition.moved.iter().map(|moved| format!("moved by more than two standard errors: {moved}")),
        );
        self.say(LabAnswer::Did(news));
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
        self.say(LabAnswer::Did(vec![news]));
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
