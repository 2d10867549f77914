//! What a report of a model contains, and how it is gathered: comparison, diagnosis, the fall of the error, poses to measure. The page itself is made in core/report.

use serde::Serialize;

use crate::laboratory::{Comparison, EffectPlot, Laboratory, LaboratoryError};
use crate::{Diagnosis, NextPoses};
use plumb_calibration::arm_model::{AddedEffect, Model};
use plumb_calibration::measurement::RmsError;
use plumb_estimation::Progress;

/// What a step of the fall of the error is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StepKind {
    /// The model without any added effect.
    Start,
    /// Effects whose mechanism is identified, or that the user added.
    Mechanism,
    /// Effects that predict unseen rows and may represent others.
    Correction,
    /// A residual map: it explains nothing.
    ResidualMap,
}

/// One step of the fall of the error, mm2 (deg2 in a table of angles alone): variances add, root mean squares do not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorStep {
    /// What was added; `start` for the model without any added effect.
    pub added: String,
    /// What that is.
    pub kind: StepKind,
    /// Mean square over the rows that were fitted.
    pub fit_mm2: f64,
    /// Mean square over left-out regions.
    pub cv_mm2: Option<f64>,
    /// Mean square over the held-out rows.
    pub check_mm2: Option<f64>,
}

/// One line of the model's story: a revision.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chapter {
    /// The revision's number, 0 for the original.
    pub number: u32,
    /// What was done.
    pub did: String,
    /// RMS of the fit then.
    #[serde(flatten)]
    pub rms: Option<RmsError>,
}

/// Everything a report contains.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// The model as it is, against the table.
    pub comparison: Comparison,
    /// What it lacks.
    pub diagnosis: Diagnosis,
    /// The fall of the error through the added effects.
    #[serde(rename = "fall")]
    pub error_steps: Vec<ErrorStep>,
    /// Parameters that moved by more than two standard errors when the added effects came in.
    pub moved: Vec<String>,
    /// Poses to measure next, where any would settle something.
    pub next: Option<NextPoses>,
    /// The revisions.
    pub story: Vec<Chapter>,
    /// The own plots of what is named or tied, of the likeliest candidates, and of what was added.
    #[serde(skip)]
    pub plots: Vec<EffectPlot>,
}

/// Added effects shown one by one; more are shown in groups.
const STEPS: usize = 12;

/// Candidates with a plot of their own, where nothing is named or tied.
const CANDIDATES_PLOTTED: usize = 3;

/// Added effects with a plot of their own, the last of them.
const ADDED_PLOTTED: usize = 6;

impl Laboratory {
    /// Gathers what a report contains; `story` are the revisions so far.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn report(&self, story: Vec<Chapter>, progress: &Progress) -> Result<Report, LaboratoryError> {
        progress.report(0.0, "comparing")?;
        let comparison = self.compare_in_full(progress)?;
        let (error_steps, moved) = self.error_steps(&comparison, progress)?;
        let diagnosis = self.with_hypothesis(self.diagnose(progress)?, progress)?;
        let asks = !diagnosis.next.is_empty() || diagnosis.named.is_some();
        let next = match asks {
            true => {
                let requested = crate::Requested { count: 8, keep_out: Vec::new(), payloads: Vec::new() };
                self.next_poses(&requested, progress).ok()
            }
            false => None,
        };
        let plots = self.effect_plots(&self.worth_plotting(&diagnosis), progress)?;
        Ok(Report { comparison, diagnosis, error_steps, moved, next, story, plots })
    }

    /// Effects whose own plots are worth a look, the one in question first.
    fn worth_plotting(&self, diagnosis: &Diagnosis) -> Vec<String> {
        let named = diagnosis.named.iter().map(|named| &named.effect);
        let asked: Vec<_> = named.chain(&diagnosis.tied).collect();
        let mut requested: Vec<String> = diagnosis
            .candidates
            .iter()
            .enumerate()
            .filter(|(index, candidate)| {
                asked.contains(&&candidate.effect) || (asked.is_empty() && *index < CANDIDATES_PLOTTED)
            })
            .map(|(_, candidate)| candidate.label.clone())
            .collect();
        let added = self.model().effects.iter().rev().take(ADDED_PLOTTED);
        requested.extend(added.map(|added| self.model().label(&added.id)));
        requested
    }

    /// The fall of the error, effect by effect; a residual map, which goes with all of them, comes last.
    fn error_steps(
        &self,
        now: &Comparison,
        progress: &Progress,
    ) -> Result<(Vec<ErrorStep>, Vec<String>), LaboratoryError> {
        let plain = self.without_map();
        let without_map = plain.as_ref().unwrap_or(self);
        let effects: &[AddedEffect] = &self.model().effects;
        let group = effects.len().div_ceil(STEPS).max(1);
        let mut error_steps = Vec::new();
        let mut bare: Option<Comparison> = None;
        for count in (0..effects.len()).step_by(group) {
            progress.report(count as f64 / effects.len() as f64, "describing the fall of the error")?;
            let fewer = effects.iter().take(count).cloned().collect();
            let model = Model { effects: fewer, ..without_map.model().clone() };
            let smaller = Self::new(model, self.table().clone(), self.options().clone())?;
            let comparison = smaller.compare(progress)?;
            error_steps.push(self.step(count, group, &comparison));
            if count == 0 {
                bare = Some(comparison);
            }
        }
        match &plain {
            None => error_steps.push(self.step(effects.len(), group, now)),
            Some(plain) => {
                error_steps.push(self.step(effects.len(), group, &plain.compare(progress)?));
                error_steps.push(ErrorStep::of("residual_map".to_owned(), StepKind::ResidualMap, now));
            }
        }
        let moved = bare.map_or_else(Vec::new, |bare| crate::laboratory::moved(&bare.effects, &now.effects));
        Ok((error_steps, moved))
    }

    /// The step with the first `count` effects in.
    fn step(&self, count: usize, group: usize, comparison: &Comparison) -> ErrorStep {
        let first = count.saturating_sub(if count.is_multiple_of(group) { group } else { count % group });
        let new = self.model().effects.get(first..count).unwrap_or(&[]);
        let kind = if new.is_empty() {
            StepKind::Start
        } else if new.iter().any(|added| self.model().correction(&added.id).is_some()) {
            StepKind::Correction
        } else {
            StepKind::Mechanism
        };
        ErrorStep::of(self.group_label(new), kind, comparison)
    }

    /// What came in with some effects.
    fn group_label(&self, new: &[AddedEffect]) -> String {
        let labels: Vec<String> = new
            .iter()
            .map(|added| match self.model().correction(&added.id) {
                Some(_) => format!("{} (correction)", self.model().label(&added.id)),
                None => self.model().label(&added.id),
            })
            .collect();
        match labels.as_slice() {
            // What the model had before anything was added here.
            [] => "start".to_owned(),
            [one] => one.clone(),
            // A picture has room for one name a bar.
            [one, rest @ ..] => format!("{one} and {} more", rest.len()),
        }
    }
}

impl ErrorStep {
    fn of(added: String, kind: StepKind, comparison: &Comparison) -> Self {
        let rms = comparison.rms_mm;
        // Squares, for squares of errors that are independent add up: a step's height in the picture is its own share.
        let [cv_mm2, check_mm2] = [rms.cv, rms.check].map(|rms| rms.map(|rms| rms * rms));
        Self { added, kind, fit_mm2: rms.fit * rms.fit, cv_mm2, check_mm2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links;

    #[test]
    fn a_step_of_the_fall_is_reported_in_squares() {
        let lab = two_links(60, "joint_zero(*)", 0.3, 4, |_| [0.0; 2]);
        let comparison = lab.compare(&Progress::unwatched()).unwrap();
        let error_steps = ErrorStep::of("start".to_owned(), StepKind::Start, &comparison);
        // Three coordinates with noise of 0.3 mm each: 0.27 mm2, known to 11 % from 180 of them.
        assert!((0.2..0.35).contains(&error_steps.fit_mm2), "{}", error_steps.fit_mm2);
        let rms = comparison.rms_mm;
        assert!((error_steps.fit_mm2.sqrt() - rms.fit).abs() < 1e-12);
        assert!((error_steps.cv_mm2.unwrap().sqrt() - rms.cv.unwrap()).abs() < 1e-12);
        assert_eq!(error_steps.check_mm2, None, "nothing was held out");
    }

    /// The small arm with a mechanism, a correction and another mechanism added, in this order.
    fn with_three() -> Laboratory {
        let lab = two_links(60, "joint_zero(*)", 0.3, 4, |_| [0.0; 2]);
        let mut model = lab.model().clone();
        for text in ["joint_gain(elbow)", "joint_gain(shoulder)", "joint_harmonic(elbow, 2)"] {
            let id = plumb_calibration::effect::parse(text, &model).unwrap();
            let count = plumb_calibration::effect::build(&id, &model).unwrap().parameters().len();
            model.effects.push(AddedEffect { id, values: vec![0.0; count] });
        }
        let id = model.effects[1].id.clone();
        model.corrections.push(plumb_calibration::arm_model::Correction { id, may_be: Vec::new() });
        lab.with_model(model)
    }

    #[test]
    fn a_step_is_of_what_came_in_since_the_step_before() {
        let lab = with_three();
        let comparison = lab.compare(&Progress::unwatched()).unwrap();
        let step = |count: usize, group: usize| {
            let step = lab.step(count, group, &comparison);
            (step.added, step.kind)
        };
        let (gain, wave) = ("joint_gain(elbow)", "joint_harmonic(elbow, 2)");
        assert_eq!(step(0, 1), ("start".to_owned(), StepKind::Start));
        assert_eq!(step(1, 1), (gain.to_owned(), StepKind::Mechanism));
        assert_eq!(step(2, 1), ("joint_gain(shoulder) (correction)".to_owned(), StepKind::Correction));
        assert_eq!(step(3, 1), (wave.to_owned(), StepKind::Mechanism));
        // In groups of two a correction among them makes the step one; the last may hold fewer.
        assert_eq!(step(0, 2), ("start".to_owned(), StepKind::Start));
        assert_eq!(step(2, 2), (format!("{gain} and 1 more"), StepKind::Correction));
        assert_eq!(step(3, 2), (wave.to_owned(), StepKind::Mechanism));
        // A last group of two where groups have three.
        assert_eq!(step(2, 3), (format!("{gain} and 1 more"), StepKind::Correction));
    }

    #[test]
    fn the_fall_begins_without_what_was_added_and_ends_with_all_of_it() {
        let lab = with_three();
        let watch = Progress::unwatched();
        let now = lab.compare(&watch).unwrap();
        let (error_steps, moved) = lab.error_steps(&now, &watch).unwrap();
        let added: Vec<&str> = error_steps.iter().map(|step| step.added.as_str()).collect();
        let correction = "joint_gain(shoulder) (correction)";
        assert_eq!(added, ["start", "joint_gain(elbow)", correction, "joint_harmonic(elbow, 2)"]);
        assert!((error_steps[3].fit_mm2.sqrt() - now.rms_mm.fit).abs() < 1e-12);
        let bare = lab.with_model(Model { effects: Vec::new(), ..lab.model().clone() });
        assert!((error_steps[0].fit_mm2.sqrt() - bare.compare(&watch).unwrap().rms_mm.fit).abs() < 1e-9);
        assert!(error_steps.windows(2).all(|pair| pair[1].fit_mm2 < pair[0].fit_mm2));
        assert_eq!(moved, Vec::<String>::new(), "noise moves no zero by two of its errors");
    }

    #[test]
    fn what_is_named_or_tied_is_plotted_else_the_likeliest_and_then_what_was_added() {
        let lab = with_three();
        let mut diagnosis =
            two_links(20, "joint_zero(*)", 0.3, 4, |_| [0.0; 2]).diagnose(&Progress::unwatched()).unwrap();
        let named = ["a", "b", "c", "d"].map(|name| crate::testing::candidate(name, "elbow"));
        (diagnosis.candidates, diagnosis.named, diagnosis.tied) = (named.to_vec(), None, Vec::new());
        let added = ["joint_harmonic(elbow, 2)", "joint_gain(shoulder)", "joint_gain(elbow)"];
        let plotted = |diagnosis: &Diagnosis| {
            let mut all = lab.worth_plotting(diagnosis);
            assert_eq!(all.split_off(all.len() - 3), added, "the last that was added first");
            all
        };
        assert_eq!(plotted(&diagnosis), ["a(elbow)", "b(elbow)", "c(elbow)"]);
        diagnosis.tied =
            vec![crate::testing::effect_at("d", "elbow"), crate::testing::effect_at("b", "elbow")];
        assert_eq!(plotted(&diagnosis), ["b(elbow)", "d(elbow)"]);
        let (effect, unit) = (crate::testing::effect_at("c", "elbow"), "deg".to_owned());
        diagnosis.named = Some(crate::outcome::Named { effect, size: 0.1, unit, se: 0.01 });
        assert_eq!(plotted(&diagnosis), ["b(elbow)", "c(elbow)", "d(elbow)"]);
    }
}
