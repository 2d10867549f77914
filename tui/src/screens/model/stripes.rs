//! The lab of light stripes at work beside the screens: what zeros and rig cannot explain of scans, as the Model screen shows a model's table.
//! A stripe is one measurement: an effect of the arm moves all its points together.

use std::sync::mpsc::Receiver;
use std::thread;

use plumb_calibration::effect::{self, EffectId, EffectNameError};
use plumb_diagnosis::laboratory::{Comparison, Laboratory, LaboratoryError};
use plumb_diagnosis::report::StepKind;
use plumb_diagnosis::stripe::AdjustError;
use plumb_estimation::{Cancelled, Progress};
use thiserror::Error;
use tokio::sync::mpsc::UnboundedSender;

use super::lab::{Lab, LabAnswer, LabRequest};
use super::residuals::Residuals;
use super::standing;
use super::state::{FallStep, ModelState, Preview, Standing};
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
    /// It was told to end.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The stripes could not be adjusted.
    #[error("the stripes could not be adjusted, so nothing can be tried on them")]
    NotAdjusted,
    /// Nothing was added.
    #[error("nothing was added that could be taken away")]
    NothingAdded,
}

/// Starts to look at scans; `files` says of what.
pub(crate) fn open(stripes: Stripes, files: &str) -> (Lab, ModelState) {
    let (lab, to_do, to_screens) = Lab::beside();
    let state = ModelState::new(&stripes.model.arm, files);
    let worker =
        Worker { begun_with: stripes.added.len(), stripes, fall: Vec::new(), laboratory: None, to_screens };
    thread::spawn(move || worker.run(&to_do));
    (lab, state)
}

/// The lab's own thread.
struct Worker {
    stripes: Stripes,
    /// How many effects were added on the command line.
    begun_with: usize,
    fall: Vec<FallStep>,
    /// The stripes with what is added now.
    laboratory: Option<Laboratory>,
    to_screens: UnboundedSender<LabAnswer>,
}

/// As any table, but that a row is a picture.
fn of_stripes(standing: Standing) -> Box<Standing> {
    Box::new(Standing { row_name: "Stripe", floor_source: "from neighbouring points".to_owned(), ..standing })
}

impl Worker {
    /// Works until nobody asks any more.
    fn run(mut self, to_do: &Receiver<LabRequest>) {
        let looked = self.look("start");
        self.answer(looked);
        while let Ok(request) = to_do.recv() {
            let done = match request {
                LabRequest::Preview(effect) => self.preview(&effect),
                LabRequest::Add(effect) => self.add(&effect),
                LabRequest::Undo => self.undo(),
                LabRequest::Judge => self.look_again(),
            };
            self.answer(done);
        }
    }

    fn answer(&self, done: Result<(), StripeLabError>) {
        if let Err(error) = done {
            self.say(LabAnswer::Failed(error.to_string()));
        }
    }

    /// Tells the screens; screens that are gone hear nothing.
    fn say(&self, answer: LabAnswer) {
        let _gone = self.to_screens.send(answer);
    }

    /// Adjusts with what is added now and shows what that leaves, then judges what could explain the rest.
    fn look(&mut self, added: &str) -> Result<(), StripeLabError> {
        let progress = Progress::unwatched();
        let adjusted = self.stripes.adjusted()?;
        let laboratory = adjusted.laboratory()?;
        let comparison = self.with_warnings(laboratory.compare_in_full(&progress)?, &adjusted.not_observable);
        let kind = if self.fall.is_empty() { StepKind::Start } else { StepKind::Mechanism };
        self.fall.push(standing::step(added, kind, &comparison));
        self.say(LabAnswer::Compared(of_stripes(standing::compared(&comparison, &self.fall))));
        let diagnosis = laboratory.diagnose(&progress)?;
        let plots = laboratory.effect_plots(&standing::plotted(&comparison, &diagnosis), &progress)?;
        let examined = standing::examined(&comparison, &diagnosis, plots, &self.fall);
        self.say(LabAnswer::Examined(of_stripes(examined)));
        self.laboratory = Some(laboratory);
        Ok(())
    }

    /// The comparison, with what no scan of these could tell.
    fn with_warnings(&self, mut comparison: Comparison, not_observable: &[String]) -> Comparison {
        let hidden = not_observable.iter().map(|hidden| format!("not shown by these scans: {hidden}"));
        comparison.warnings.extend(hidden);
        comparison
    }

    fn look_again(&mut self) -> Result<(), StripeLabError> {
        let last = self.fall.pop().map_or_else(|| "start".to_owned(), |step| step.added);
        self.look(&last)
    }

    fn preview(&self, effect: &str) -> Result<(), StripeLabError> {
        let laboratory = self.laboratory.as_ref().ok_or(StripeLabError::NotAdjusted)?;
        let preview = laboratory.preview(effect, &Progress::unwatched())?;
        let residuals = Residuals { rows: preview.rows, series: preview.series };
        let preview = Preview { candidate: effect.to_owned(), rms_mm: preview.after.fit, residuals };
        self.say(LabAnswer::Previewed(Box::new(preview)));
        Ok(())
    }

    /// What is added, and one more.
    fn with(&self, effect: &str) -> Result<Vec<EffectId>, EffectNameError> {
        let one = effect::parse(effect, &self.stripes.model)?;
        Ok(self.stripes.added.iter().cloned().chain([one]).collect())
    }

    /// Adds an effect to what is adjusted. No file is written: `plumb stripe adjust --add` does that.
    fn add(&mut self, effect: &str) -> Result<(), StripeLabError> {
        let with_it = self.with(effect)?;
        let before = std::mem::replace(&mut self.stripes.added, with_it);
        if let Err(error) = self.look(effect) {
            self.stripes.added = before;
            return Err(error);
        }
        let news = format!(
            "{effect} added; `plumb stripe adjust ... --add '{effect}' -o CELL` writes a cell with it"
        );
        self.say(LabAnswer::Did(vec![news]));
        Ok(())
    }

    fn undo(&mut self) -> Result<(), StripeLabError> {
        if self.stripes.added.len() == self.begun_with {
            return Err(StripeLabError::NothingAdded);
        }
        self.stripes.added.pop();
        self.fall.pop();
        self.say(LabAnswer::Did(vec!["undone".to_owned()]));
        self.look_again()
    }
}
