//! What the Model screen shows.

use std::time::Duration;

use plumb_calibration::measurement::ReadingUnit;
use plumb_diagnosis::laboratory::{EffectPlot, JointAxis};
use plumb_diagnosis::report::StepKind;

use super::residuals::Residuals;

/// Multiples of the noise floor the plots can be scaled to.
pub(crate) const SCALES: [f64; 8] = [4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0];

/// What the lab does before there is anything to show.
pub(super) const FITTING: &str = "fitting the model";

/// A model, a table, and what the lab says of them.
#[derive(Clone, Debug)]
pub(crate) struct ModelState {
    /// Name of the arm.
    pub arm: String,
    /// Which files are open.
    pub files: String,
    /// The model as it is, held against the table; none until the lab has looked.
    pub summary: Option<ModelSummary>,
    /// What a candidate would leave, while it is previewed.
    pub preview: Option<Preview>,
    /// The candidate that is chosen.
    pub chosen: usize,
    /// The name of an effect while it is being written.
    pub naming: Option<String>,
    /// The row of the table that is pointed out in all plots.
    pub pointed: Option<usize>,
    /// What is to be added although the lab rejects it, while that is asked.
    pub doubtful: Option<Doubtful>,
    /// Which of [`super::residuals::PLANES`] the bull's eye and the whiskers show.
    pub plane: usize,
    /// Plots scrolled away.
    pub plots_scrolled: usize,
    /// Which of [`SCALES`]; it follows the typical error of the model as it is until the operator steps it.
    pub scale: usize,
    /// The operator has stepped the scale, so that it stays.
    pub scale_kept: bool,
    /// What the lab is doing.
    pub busy: Option<Busy>,
}

/// What the lab is doing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Busy {
    /// In words.
    pub doing: String,
    /// Since when, by the screens' clock.
    pub since: Duration,
    /// It only judges candidates, and gives that up for anything else it is asked.
    pub only_judges: bool,
    /// How far it is, 0 to 1, and with what, once it has said so.
    pub progress: Option<(f64, String)>,
}

impl Busy {
    /// The lab begins with something at `since`.
    pub(crate) fn with(doing: &str, since: Duration, only_judges: bool) -> Self {
        Self { doing: doing.to_owned(), since, only_judges, progress: None }
    }
}

/// An effect that the lab would not name, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Doubtful {
    /// As the lab names it, or as it was written.
    pub effect: String,
    /// Why it was not named.
    pub reason: String,
    /// It is the chosen candidate, so that a key shows what it would leave.
    pub is_chosen: bool,
}

impl Doubtful {
    /// What is asked before it is added.
    pub(crate) fn question(&self) -> String {
        let preview = if self.is_chosen { " Space shows first what it would leave." } else { "" };
        format!(
            "{} was not named: {}.\n\nAny effect makes the error in the fit smaller, also one that is not there; the arm is then commanded by it.{preview}\n\n  \
             y  add it all the same\n  n  leave the model as it is",
            self.effect, self.reason
        )
    }
}

/// What adding a candidate would leave.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Preview {
    /// The candidate, as the lab names it.
    pub candidate: String,
    /// Root mean square of the residuals it would leave, in the unit of the table's readings.
    pub rms_mm: f64,
    /// The residuals it would leave.
    pub residuals: Residuals,
}

/// A line over the page: in full, and in short for where that does not fit into one row. The plots show what the short one leaves out.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct StripLine {
    pub full: String,
    pub short: String,
}

/// A model held against its table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ModelSummary {
    /// The verdict, as the contract words it.
    pub verdict: String,
    /// Nothing but noise is left.
    pub at_floor: bool,
    /// One plain sentence.
    pub sentence: String,
    /// The unit of the table's readings, and so of every error here whose name ends in `_mm`: mm, or degrees of angles alone.
    pub unit: ReadingUnit,
    /// One standard deviation of the noise of a reading, where it is known.
    pub floor_mm: Option<f64>,
    /// The same for a measured point: what errors of points are compared with.
    pub floor_of_a_point_mm: Option<f64>,
    /// Where the floor comes from.
    pub floor_source: String,
    /// Error of a point that no function of what is known of a row predicts; nothing where that is not known, or nothing is predictable.
    pub not_predictable_mm: Option<f64>,
    /// How large the error of a point is, in words.
    pub how_large: StripLine,
    /// How much of it could be explained, and by what kind of knowledge, in words.
    pub how_much: StripLine,
    /// Where it is: along which joints, in which rows, in words.
    pub where_it_is: StripLine,
    /// What the number of a row is called: a line of a table, or a stripe.
    pub row_name: &'static str,
    /// The joints.
    pub joints: Vec<JointAxis>,
    /// The own plots of the candidates and of what was added.
    pub plots: Vec<EffectPlot>,
    /// What could explain what is left, the likeliest first.
    pub cards: Vec<Card>,
    /// What is left.
    pub residuals: Residuals,
    /// Points along the arm in a pose near the middle of all, mm, frame of the measurements.
    pub arm_mm: Vec<[f64; 3]>,
    /// Poses to measure next, in words.
    pub next: Vec<String>,
    /// What the user should know besides.
    pub warnings: Vec<String>,
    /// The error from the bare model to this one, effect by effect.
    pub error_steps: Vec<ErrorStep>,
}

/// One candidate.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Card {
    /// As the lab names it; goes back to the lab to preview or add it.
    pub key: String,
    /// The effect.
    pub effect: String,
    /// Where it acts.
    pub site: String,
    /// Its size with unit and error.
    pub size: String,
    /// How much less error it leaves where it was not fitted, in the unit of the table's readings.
    pub gain_mm: Option<f64>,
    /// The error that it leaves there, in the same.
    pub leaves_mm: Option<f64>,
    /// Chance that noise alone looks as convincing, over all candidates (Holm).
    pub holm_p: Option<f64>,
    /// Posterior probability, where it was weighed against others.
    pub probability: Option<f64>,
    /// What would explain it as well.
    pub ties: Vec<String>,
    /// How the lab judges it.
    pub status: CardStatus,
    /// Why it was not named, where it was not.
    pub reason: String,
}

/// How the lab judges a candidate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum CardStatus {
    /// It explains what is left, and nothing else does.
    Named,
    /// It could be this as well as another.
    Tied,
    /// It was added, or is fitted with the rest.
    InModel,
    /// It is not this, or cannot be determined.
    #[default]
    Rejected,
}

/// The error after one effect.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ErrorStep {
    /// The effect added; `start` at first.
    pub added: String,
    /// What that is.
    pub kind: StepKind,
    /// Root mean square error of a measured point in the fit, in the unit of the table's readings.
    pub fit_mm: f64,
    /// The same where regions were left out in turn, where it was measured.
    pub cross_validation_mm: Option<f64>,
}

impl ModelState {
    /// A model and a table the lab has not looked at yet.
    pub(crate) fn new(arm: &str, files: &str) -> Self {
        Self {
            arm: arm.to_owned(),
            files: files.to_owned(),
            summary: None,
            preview: None,
            chosen: 0,
            naming: None,
            pointed: None,
            doubtful: None,
            // From the side.
            plane: 1,
            plots_scrolled: 0,
            scale: 0,
            scale_kept: false,
            busy: Some(Busy::with(FITTING, Duration::ZERO, false)),
        }
    }

    /// The candidate that is chosen.
    pub(crate) fn card(&self) -> Option<&Card> {
        self.summary.as_ref()?.cards.get(self.chosen)
    }

    /// The own plot of the candidate that is chosen; none where these rows cannot show it.
    pub(crate) fn own_plot(&self) -> Option<&EffectPlot> {
        let key = &self.card()?.key;
        self.summary.as_ref()?.plots.iter().find(|plot| plot.effect == *key)
    }

    /// Whether an effect was added that can be taken away again.
    pub(crate) fn can_undo(&self) -> bool {
        self.summary.as_ref().is_some_and(|summary| summary.error_steps.len() > 1)
    }

    /// Whether judging the candidates, or the fit before it, was given up, so that it can be asked for.
    pub(crate) fn can_judge(&self) -> bool {
        self.busy.is_none() && self.summary.as_ref().is_none_or(|summary| summary.verdict.is_empty())
    }

    /// The unit in which errors of the table's readings are shown.
    pub(crate) fn reading_unit(&self) -> ReadingUnit {
        self.summary.as_ref().map_or(ReadingUnit::Mm, |summary| summary.unit)
    }

    /// One standard deviation of the noise of a reading, in [`Self::reading_unit`], where it is known.
    pub(crate) fn floor_mm(&self) -> Option<f64> {
        self.summary.as_ref()?.floor_mm
    }

    /// What one unit of the scale is, in [`Self::reading_unit`]: the noise floor, or the typical error where the floor is unknown.
    pub(crate) fn unit_mm(&self) -> f64 {
        let summary = self.summary.as_ref();
        let unit = summary.map_or(0.0, |summary| match summary.floor_mm {
            Some(floor) => floor,
            None => summary.residuals.typical_mm(),
        });
        if unit.is_finite() && unit > 0.0 { unit } else { 1.0 }
    }

    /// Half the height of the plots, in [`Self::reading_unit`].
    pub(crate) fn half_height_mm(&self) -> f64 {
        self.unit_mm() * SCALES.get(self.scale).copied().unwrap_or(4.0)
    }

    /// Takes a look of the lab in. The scale becomes the smallest multiple of the floor that holds the typical errors three
    /// times over: few gross ones do not change it, and a preview is drawn on the scale of what it is compared with.
    pub(crate) fn take(&mut self, summary: ModelSummary) {
        let typical = summary.residuals.typical_mm();
        self.chosen = first_choice(&summary);
        self.summary = Some(summary);
        self.preview = None;
        self.doubtful = None;
        if !self.scale_kept {
            let unit = self.unit_mm();
            let fits = |scale: &f64| scale * unit >= 3.0 * typical;
            self.scale = SCALES.iter().position(fits).unwrap_or(SCALES.len() - 1);
        }
    }
}

/// The card that is shown first: what could explain the rest; where nothing is left to explain, what was added last.
fn first_choice(summary: &ModelSummary) -> usize {
    let is_open =
        summary.cards.iter().any(|card| matches!(card.status, CardStatus::Named | CardStatus::Tied));
    let added = summary.cards.iter().rposition(|card| card.status == CardStatus::InModel);
    added.filter(|_| summary.at_floor && !is_open).unwrap_or(0)
}
