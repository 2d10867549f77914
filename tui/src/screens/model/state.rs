//! What the Model screen shows.

use std::time::Duration;

use super::residuals::Residuals;

/// Multiples of the noise floor the plots can be scaled to.
pub(crate) const SCALES: [f64; 8] = [4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0];

/// A model, a table, and what the lab says of them.
#[derive(Clone, Debug)]
pub(crate) struct ModelState {
    /// Name of the arm.
    pub arm: String,
    /// Which files are open.
    pub files: String,
    /// The model as it is, held against the table; none until the lab has looked.
    pub standing: Option<Standing>,
    /// What a candidate would leave, while it is previewed.
    pub preview: Option<Preview>,
    /// The candidate that is chosen.
    pub chosen: usize,
    /// The name of an effect while it is being written.
    pub naming: Option<String>,
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

/// What adding a candidate would leave.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Preview {
    /// The candidate, as the lab names it.
    pub candidate: String,
    /// Root mean square of the residuals it would leave, mm.
    pub rms_mm: f64,
    /// The residuals it would leave.
    pub residuals: Residuals,
}

/// A model held against its table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Standing {
    /// The verdict, as the contract words it.
    pub verdict: String,
    /// One plain sentence.
    pub sentence: String,
    /// One standard deviation of the noise in one direction, mm, where it is known.
    pub floor_mm: Option<f64>,
    /// Where the floor comes from.
    pub floor_source: String,
    /// Error of a point that no function of what is known of a row predicts, mm; nothing where that is not known, or nothing is predictable.
    pub not_predictable_mm: Option<f64>,
    /// Mean, 95 % and maximum of the error of a point, and how much of it could be explained, in words.
    pub error: String,
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
    pub fall: Vec<FallStep>,
}

/// One candidate.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Card {
    /// As the lab names it; goes back to the lab to preview or add it.
    pub key: String,
    /// The effect.
    pub effect: String,
    /// Where it acts.
    pub place: String,
    /// Its size with unit and error.
    pub size: String,
    /// How much less error it leaves where it was not fitted, mm.
    pub gain_mm: Option<f64>,
    /// Chance that noise alone looks as convincing, over all candidates (Holm).
    pub holm_p: Option<f64>,
    /// What would explain it as well.
    pub ties: Vec<String>,
    /// How the lab judges it.
    pub standing: CardStanding,
    /// Why it was not named, where it was not.
    pub reason: String,
}

/// How the lab judges a candidate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum CardStanding {
    /// It explains what is left, and nothing else does.
    Named,
    /// It could be this as well as another.
    Tied,
    /// It is not this, or cannot be told.
    #[default]
    Rejected,
}

/// The error after one effect.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FallStep {
    /// The effect added; `start` at first.
    pub added: String,
    /// Mean square error in the fit, mm2.
    pub fit_mm2: f64,
    /// Mean square error where it was not fitted, mm2, where it was measured.
    pub held_out_mm2: Option<f64>,
}

impl ModelState {
    /// A model and a table the lab has not looked at yet.
    pub(crate) fn new(arm: &str, files: &str) -> Self {
        Self {
            arm: arm.to_owned(),
            files: files.to_owned(),
            standing: None,
            preview: None,
            chosen: 0,
            naming: None,
            // From the side.
            plane: 1,
            plots_scrolled: 0,
            scale: 0,
            scale_kept: false,
            busy: Some(Busy::with("fitting the model", Duration::ZERO, false)),
        }
    }

    /// The candidate that is chosen.
    pub(crate) fn card(&self) -> Option<&Card> {
        self.standing.as_ref()?.cards.get(self.chosen)
    }

    /// Whether an effect was added that can be taken away again.
    pub(crate) fn can_undo(&self) -> bool {
        self.standing.as_ref().is_some_and(|standing| standing.fall.len() > 1)
    }

    /// Whether judging the candidates was given up, so that it can be asked for.
    pub(crate) fn can_judge(&self) -> bool {
        self.busy.is_none() && self.standing.as_ref().is_some_and(|standing| standing.verdict.is_empty())
    }

    /// One standard deviation of the noise along an axis, mm, where it is known.
    pub(crate) fn floor_mm(&self) -> Option<f64> {
        self.standing.as_ref()?.floor_mm
    }

    /// What one unit of the scale is, mm: the noise floor, or the typical error where the floor is unknown.
    pub(crate) fn unit_mm(&self) -> f64 {
        let standing = self.standing.as_ref();
        let unit = standing.map_or(0.0, |standing| match standing.floor_mm {
            Some(floor) => floor,
            None => standing.residuals.typical_mm(),
        });
        if unit.is_finite() && unit > 0.0 { unit } else { 1.0 }
    }

    /// Half the height of the plots, mm.
    pub(crate) fn half_height_mm(&self) -> f64 {
        self.unit_mm() * SCALES.get(self.scale).copied().unwrap_or(4.0)
    }

    /// Takes a look of the lab in. The scale becomes the smallest multiple of the floor that holds the typical errors three
    /// times over: few gross ones do not change it, and a preview is drawn on the scale of what it is compared with.
    pub(crate) fn take(&mut self, standing: Standing) {
        let typical = standing.residuals.typical_mm();
        self.standing = Some(standing);
        self.preview = None;
        self.chosen = 0;
        if !self.scale_kept {
            let unit = self.unit_mm();
            let fits = |scale: &f64| scale * unit >= 3.0 * typical;
            self.scale = SCALES.iter().position(fits).unwrap_or(SCALES.len() - 1);
        }
    }
}
