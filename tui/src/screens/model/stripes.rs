//! The lab of light stripes at work beside the screens: what zeros and rig cannot explain of scans, as the Model screen shows a model's table.
//! A stripe is one measurement: an effect of the arm moves all its points together.

use std::sync::mpsc::Receiver;
use std::thread;

use plumb_calibration::effect::EffectNameError;
use plumb_diagnosis::laboratory::{JointAxis, RowResidual, Series};
use plumb_diagnosis::report::StepKind;
use plumb_diagnosis::stripe::{
    AdjustError, Adjustment, StripeDiagnosis, StripeVerdict, Suspect, Tried, ViewResidual, adjust, suspect,
    with_added,
};
use thiserror::Error;
use tokio::sync::mpsc::UnboundedSender;

use super::lab::{Lab, LabAnswer, LabRequest};
use super::residuals::Residuals;
use super::state::{Card, CardStanding, FallStep, ModelState, Preview, Standing};
use crate::commands::stripe::{LabError, Stripes, diagnosis_of, rig_of_lab, sizes_in_words};

/// Why a piece of work was not done.
#[derive(Debug, Error)]
enum StripeLabError {
    /// The adjustment.
    #[error(transparent)]
    Adjust(#[from] AdjustError),
    /// The cell or its scans.
    #[error(transparent)]
    Lab(#[from] LabError),
    /// There is no such effect.
    #[error(transparent)]
    Effect(#[from] EffectNameError),
    /// Nothing was added.
    #[error("nothing was added that could be taken away")]
    NothingAdded,
}

/// Starts to look at scans; `files` says of what.
pub(crate) fn open(stripes: Stripes, files: &str) -> (Lab, ModelState) {
    let (lab, to_do, to_screens) = Lab::beside();
    let state = ModelState::new(&stripes.model.arm, files);
    let worker =
        Worker { begun_with: stripes.added.len(), stripes, fall: Vec::new(), diagnosis: None, to_screens };
    thread::spawn(move || worker.run(&to_do));
    (lab, state)
}

/// The lab's own thread.
struct Worker {
    stripes: Stripes,
    /// How many effects were added on the command line.
    begun_with: usize,
    fall: Vec<FallStep>,
    diagnosis: Option<StripeDiagnosis>,
    to_screens: UnboundedSender<LabAnswer>,
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
        self.diagnosis = None;
        let left = self.adjusted(&self.stripes.added)?;
        let rms = left.rms_mm;
        let kind = if self.fall.is_empty() { StepKind::Start } else { StepKind::Mechanism };
        self.fall.push(FallStep { added: added.to_owned(), kind, fit_mm: rms, held_out_mm: None });
        self.say(LabAnswer::Compared(Box::new(self.compared(&left, None))));
        let diagnosis = diagnosis_of(&self.stripes)?;
        self.say(LabAnswer::Examined(Box::new(self.examined(&diagnosis))));
        self.diagnosis = Some(diagnosis);
        Ok(())
    }

    fn look_again(&mut self) -> Result<(), StripeLabError> {
        let last = self.fall.pop().map_or_else(|| "start".to_owned(), |step| step.added);
        self.look(&last)
    }

    /// What an adjustment leaves. The noise of the pictures is known once the rest was judged.
    fn compared(&self, left: &Adjustment, floor_mm: Option<f64>) -> Standing {
        Standing {
            floor_mm,
            // A distance is one reading.
            floor_of_a_point_mm: floor_mm,
            floor_source: "from the pictures".to_owned(),
            how_large: format!(
                "RMS {:.3} mm: distance of {} points from their surfaces; neighbouring points scatter by {:.3} mm. A stripe is one measurement.",
                left.rms_mm, left.points, left.noise_mm
            ),
            joints: self.joints(),
            row_name: "Stripe",
            residuals: self.residuals(left),
            warnings: left
                .not_observable
                .iter()
                .map(|hidden| format!("not shown by these scans: {hidden}"))
                .collect(),
            fall: self.fall.clone(),
            ..Standing::default()
        }
    }

    /// The same with what could explain the rest.
    fn examined(&self, diagnosis: &StripeDiagnosis) -> Standing {
        Standing {
            at_floor: diagnosis.verdict == StripeVerdict::AtFloor,
            verdict: diagnosis.verdict.word().replace('_', " "),
            sentence: diagnosis.sentence.clone(),
            cards: cards(diagnosis),
            ..self.compared(&diagnosis.classical, Some(diagnosis.floor_mm))
        }
    }

    fn adjusted(&self, added: &[Suspect]) -> Result<Adjustment, AdjustError> {
        let Stripes { model, rig, surfaces, scans, .. } = &self.stripes;
        let options = with_added(model, added);
        adjust(model, &rig_of_lab(rig), surfaces, &scans.views, &scans.pixels, &options)
    }

    /// What an adjustment leaves: a stripe a row, against each joint and the order of the stripes.
    fn residuals(&self, left: &Adjustment) -> Residuals {
        let views = &self.stripes.scans.views;
        let series = |against: &str, unit: &str, value: &dyn Fn(usize) -> Option<f64>| {
            let point = |one: &ViewResidual| Some((value(one.view)?, one.rms_mm, one.view));
            Series {
                against: against.to_owned(),
                unit: unit.to_owned(),
                shows: "distance of a stripe, mm".to_owned(),
                of_size: true,
                points: left.views.iter().filter_map(point).collect(),
            }
        };
        let joints = self.stripes.model.chain.joints.iter().enumerate();
        let mut all: Vec<Series> = joints
            .map(|(joint, known)| {
                series(&known.name, "deg", &|view| Some(views.get(view)?.q.get(joint)?.to_degrees()))
            })
            .collect();
        all.push(series("order", "row", &|view| Some(view as f64)));
        let row = |one: &ViewResidual| row(one, self.pose(one.view));
        Residuals { rows: left.views.iter().map(row).collect(), series: all }
    }

    /// The joints as they are shown: those of an arm that carries a stripe camera turn.
    fn joints(&self) -> Vec<JointAxis> {
        let joints = self.stripes.model.chain.joints.iter();
        joints.map(|joint| JointAxis { name: joint.name.clone(), unit: "deg" }).collect()
    }

    /// The coordinates of the joints in a view, deg.
    fn pose(&self, view: usize) -> Vec<f64> {
        let known = self.stripes.scans.views.get(view);
        known.map_or_else(Vec::new, |known| known.q.iter().map(|angle| angle.to_degrees()).collect())
    }

    fn preview(&self, effect: &str) -> Result<(), StripeLabError> {
        let tried = self.diagnosis.iter().flat_map(|diagnosis| &diagnosis.tried);
        let adjustment = match tried.into_iter().find(|tried| tried.suspect.name == effect) {
            Some(tried) => tried.adjustment.clone(),
            None => self.adjusted(&self.with(effect)?)?,
        };
        let residuals = self.residuals(&adjustment);
        let preview = Preview { candidate: effect.to_owned(), rms_mm: adjustment.rms_mm, residuals };
        self.say(LabAnswer::Previewed(Box::new(preview)));
        Ok(())
    }

    /// What is added, and one more.
    fn with(&self, effect: &str) -> Result<Vec<Suspect>, EffectNameError> {
        let one = suspect(effect, &self.stripes.model)?;
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

fn row(one: &ViewResidual, joints: Vec<f64>) -> RowResidual {
    RowResidual {
        row: one.view,
        line: u32::try_from(one.view + 1).unwrap_or(u32::MAX),
        held_out: false,
        weight: 1.0,
        vector_mm: one.off_mm,
        size_mm: one.rms_mm,
        point_mm: one.middle_mm,
        joints,
    }
}

/// The suspects that were adjusted for real, the best first.
fn cards(diagnosis: &StripeDiagnosis) -> Vec<Card> {
    let left_mm = diagnosis.classical.rms_mm;
    let card = |(place, tried): (usize, &Tried)| {
        let standing = match (diagnosis.verdict, place) {
            (StripeVerdict::Named, 0) => CardStanding::Named,
            (StripeVerdict::Tied, 0) => CardStanding::Tied,
            _ => CardStanding::Rejected,
        };
        let (gain, error) = tried.held_out_gain;
        let name = &tried.suspect.name;
        let (effect, rest) = name.split_once('(').unwrap_or((name, ""));
        Card {
            key: name.clone(),
            effect: effect.to_owned(),
            place: rest.trim_end_matches(')').to_owned(),
            size: sizes_in_words(tried),
            gain_mm: Some(left_mm - tried.adjustment.rms_mm),
            standing,
            reason: match standing {
                CardStanding::Named => String::new(),
                _ => format!(
                    "BIC gain {:.1}; held-out scans {:+.1} \u{b1} {:.1} %",
                    tried.bic_gain,
                    100.0 * gain,
                    100.0 * error
                ),
            },
            ..Card::default()
        }
    };
    diagnosis.tried.iter().enumerate().map(card).collect()
}
