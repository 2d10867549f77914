//! The lab of light stripes at work beside the screens: what zeros and rig cannot explain of scans, as the Model screen shows a model's table.
//! A stripe is one measurement: an effect of the arm moves all its points together.

use std::thread;

use plumb_calibration::effect::{self, EffectId, EffectNameError};
use plumb_diagnosis::laboratory::{Comparison, Laboratory, LaboratoryError};
use plumb_diagnosis::report::StepKind;
use plumb_diagnosis::stripe::AdjustError;
use plumb_diagnosis::{Diagnosis, Note};
use plumb_report::objection_in_words;
use thiserror::Error;

use super::lab::Lab;
use super::lab_thread::{LabThread, WorkError};
use super::request::{LabAnswer, LabRequest};
use super::residuals::Residuals;
use super::state::{Doubtful, ErrorStep, ModelState, ModelSummary, Preview};
use super::summary;
use crate::commands::stripe::Stripes;

/// Why a piece of work was not done.
#[derive(Debug, Error)]
enum StripeLabError {
    /// The adjustment.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
    /// The diagnosis.
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
    /// There is no such effect.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// The stripes could not be adjusted.
    #[error("the stripes could not be adjusted, so nothing can be tried on them")]
    NotAdjusted,
    /// Nothing was added.
    #[error("nothing was added that could be taken away")]
    NothingAdded,
}

impl WorkError for StripeLabError {
    fn is_cancelled(&self) -> bool {
        match self {
            Self::Adjust(error) => error.is_cancelled(),
            Self::Laboratory(error) => error.is_cancelled(),
            Self::Effect(_) | Self::NotAdjusted | Self::NothingAdded => false,
        }
    }
}

/// Starts to look at scans; `files` says of what.
pub(crate) fn open(stripes: Stripes, files: &str) -> (Lab, ModelState) {
    let (lab, thread) = Lab::with_thread();
    let state = ModelState::new(&stripes.model.arm, files);
    let begun_with = stripes.added.len();
    let worker =
        Worker { begun_with, stripes, error_steps: Vec::new(), adjusted: None, judged: None, thread };
    thread::spawn(move || worker.run());
    (lab, state)
}

/// The stripes with what is added now.
struct Adjusted {
    laboratory: Laboratory,
    comparison: Comparison,
}

/// The lab's own thread.
struct Worker {
    stripes: Stripes,
    /// How many effects were added on the command line.
    begun_with: usize,
    error_steps: Vec<ErrorStep>,
    /// None until the stripes were adjusted once.
    adjusted: Option<Adjusted>,
    /// What could explain what is left, once it was judged.
    judged: Option<Diagnosis>,
    thread: LabThread,
}

/// As any table, but that a row is a picture.
fn of_stripes(summary: ModelSummary) -> Box<ModelSummary> {
    Box::new(ModelSummary {
        row_name: "Stripe",
        floor_source: "from neighbouring points".to_owned(),
        ..summary
    })
}

impl Worker {
    /// Works until nobody asks any more.
    fn run(mut self) {
        self.answer(|worker| worker.look("start"));
        while let Some(request) = self.thread.next() {
            self.answer(|worker| match request {
                LabRequest::Preview(effect) => worker.preview(&effect),
                LabRequest::Add(effect) => worker.add(&effect),
                LabRequest::AddNamed(effect) => worker.add_unless_doubted(effect),
                LabRequest::Undo => worker.undo(),
                LabRequest::Judge => Ok(()),
            });
            // What was given up for a request that changed nothing is taken up again.
            if self.judged.is_none() {
                self.answer(Self::look_on);
            }
        }
    }

    /// Does a piece of work and says what went wrong with it, if something did.
    fn answer(&mut self, work: impl FnOnce(&mut Self) -> Result<(), StripeLabError>) {
        self.thread.begin();
        let done = work(self);
        self.thread.end(done);
    }

    /// Adjusts with what is added now and shows what that leaves, then judges what could explain the rest.
    fn look(&mut self, added: &str) -> Result<(), StripeLabError> {
        self.adjust(added)?;
        self.judge()
    }

    /// Adjusts with what is added now. Given up, everything is as it was.
    fn adjust(&mut self, added: &str) -> Result<(), StripeLabError> {
        let progress = self.thread.progress();
        let adjustment = self.stripes.adjusted(&progress)?;
        let laboratory = adjustment.laboratory()?;
        let comparison = laboratory.compare_in_full(&progress)?;
        let comparison = self.with_warnings(comparison, &adjustment.not_observable);
        let kind = if self.error_steps.is_empty() { StepKind::Start } else { StepKind::Mechanism };
        self.error_steps.push(summary::step(added, kind, &comparison));
        self.adjusted = Some(Adjusted { laboratory, comparison });
        self.judged = None;
        Ok(())
    }

    /// Shows what is left, then judges what could explain that.
    fn judge(&mut self) -> Result<(), StripeLabError> {
        let Adjusted { laboratory, comparison } =
            self.adjusted.as_ref().ok_or(StripeLabError::NotAdjusted)?;
        self.thread.begin_judging();
        self.thread.report(LabAnswer::Compared(of_stripes(summary::compared(comparison, &self.error_steps))));
        let progress = self.thread.progress();
        let diagnosis = laboratory.diagnose(&progress)?;
        let plots = laboratory.effect_plots(&summary::plotted(comparison, &diagnosis), &progress)?;
        let examined = summary::examined(comparison, &diagnosis, plots, &self.error_steps);
        self.thread.report(LabAnswer::Examined(of_stripes(examined)));
        self.judged = Some(diagnosis);
        Ok(())
    }

    /// Goes on where it was given up: with the adjustment, or with judging.
    fn look_on(&mut self) -> Result<(), StripeLabError> {
        match self.adjusted {
            Some(_) => self.judge(),
            None => self.look("start"),
        }
    }

    /// The comparison, with what no scan of these could determine.
    fn with_warnings(&self, mut comparison: Comparison, not_observable: &[String]) -> Comparison {
        comparison.warnings.extend(not_observable.iter().cloned().map(Note::Noticed));
        comparison
    }

    fn preview(&self, effect: &str) -> Result<(), StripeLabError> {
        let adjusted = self.adjusted.as_ref().ok_or(StripeLabError::NotAdjusted)?;
        let preview = adjusted.laboratory.preview(effect, &self.thread.progress())?;
        let residuals = Residuals { rows: preview.rows, series: preview.series };
        let preview = Preview { candidate: effect.to_owned(), rms_mm: preview.after.fit, residuals };
        self.thread.report(LabAnswer::Previewed(Box::new(preview)));
        Ok(())
    }

    /// What is added, and one more.
    fn with(&self, effect: &str) -> Result<Vec<EffectId>, EffectNameError> {
        let one = effect::parse(effect, &self.stripes.model)?;
        Ok(self.stripes.added.iter().cloned().chain([one]).collect())
    }

    /// Adds an effect that somebody wrote, unless it would not be named here.
    fn add_unless_doubted(&mut self, effect: String) -> Result<(), StripeLabError> {
        let id = effect::parse(&effect, &self.stripes.model)?;
        if self.judged.is_none() {
            self.look_on()?;
        }
        let judged = self.adjusted.as_ref().zip(self.judged.as_ref());
        let objection =
            judged.and_then(|(adjusted, diagnosis)| adjusted.laboratory.objection_by(diagnosis, &id));
        let Some(objection) = objection else { return self.add(&effect) };
        let reason = objection_in_words(&objection);
        self.thread.report(LabAnswer::Doubted(Doubtful { effect, reason, is_chosen: false }));
        Ok(())
    }

    /// Adds an effect to what is adjusted. No file is written: `plumb stripe adjust --add` does that.
    fn add(&mut self, effect: &str) -> Result<(), StripeLabError> {
        let with_it = self.with(effect)?;
        let before = std::mem::replace(&mut self.stripes.added, with_it);
        if let Err(error) = self.adjust(effect) {
            self.stripes.added = before;
            return Err(error);
        }
        let news = format!(
            "{effect} added; `plumb stripe adjust ... --add '{effect}' -o CELL` writes a cell with it"
        );
        self.thread.report(LabAnswer::Did(vec![news]));
        self.judge()
    }

    /// Takes away what was added last.
    fn undo(&mut self) -> Result<(), StripeLabError> {
        if self.stripes.added.len() == self.begun_with {
            return Err(StripeLabError::NothingAdded);
        }
        let (added, error_steps) = (self.stripes.added.clone(), self.error_steps.clone());
        self.stripes.added.pop();
        self.error_steps.pop();
        let before = self.error_steps.pop().map_or_else(|| "start".to_owned(), |step| step.added);
        if let Err(error) = self.adjust(&before) {
            (self.stripes.added, self.error_steps) = (added, error_steps);
            return Err(error);
        }
        self.thread.report(LabAnswer::Did(vec!["undone".to_owned()]));
        self.judge()
    }
}
