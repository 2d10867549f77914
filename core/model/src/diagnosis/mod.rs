//! Diagnosis: what, if anything, the model lacks; in the order passport, floor, audit, score, refit, ties, verdict.

mod batch;
mod bearing;
mod camps;
mod extrapolation;
mod growth;
mod landing;
mod misfit;
mod next;
mod next_not_shown;
mod not_shown;
mod outcome;
mod products;
mod refine;
mod remainder;
mod repeatable;
mod score;
mod search;
mod trial;
mod unlisted;
mod verdict;
mod volume;
mod wording;

pub(crate) use trial::Fitted;

pub use extrapolation::Extrapolation;
pub use growth::{Growth, Step, StepRms};
pub use next::{KeepOut, NextPoses, Wanted};
pub use outcome::{
    Candidate, Diagnosis, EffectPlace, Located, Named, NextPose, NotShown, Remaining, Verdict,
};

use misfit::Misfit;
use repeatable::Split;

use crate::effect::{EffectId, Spot};
use crate::floor::{Floor, Returns};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::progress::Progress;

/// Rows a search looks at; more are thinned at random.
const MOST_ROWS: usize = 1500;

/// Candidates a diagnosis lists.
const LISTED: usize = 12;

impl Laboratory {
    /// Says what the model lacks, if anything.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn diagnose(&self, progress: &Progress) -> Result<Diagnosis, LaboratoryError> {
        self.diagnose_for(progress).map(|(diagnosis, _)| diagnosis)
    }

    /// The diagnosis, and the named effect with its values.
    fn diagnose_for(&self, progress: &Progress) -> Result<(Diagnosis, growth::Found), LaboratoryError> {
        progress.report(0.0, "fitting")?;
        let machine = self.machine(&[])?;
        let fit = self.fit(&machine, progress)?;
        progress.report(0.1, "noise floor")?;
        let returns = Returns::gather(&machine, &fit, &self.survey());
        let floor = Floor::among(&machine, returns.as_ref());
        let splits =
            returns.as_ref().map(|returns| repeatable::find_splits(&machine, returns)).unwrap_or_default();
        let comparison = self.comparison(&machine, &fit, progress)?;
        let candidates =
            search::Candidates { listed: search::probes(self), unlisted: unlisted::probes(self) };
        let thin = self.thinned(MOST_ROWS);
        let searched = thin.as_ref().unwrap_or(self);
        let finding = searched.find(&floor, &candidates, progress)?;
        let mut remaining = Remaining::default();
        if matches!(finding.verdict, Verdict::Located | Verdict::Unknown) {
            let place = |spot: &Spot| EffectId::at("", *spot).place(self.model());
            remaining.places = finding.places.iter().map(place).collect();
            let rest = remainder::remainder(&finding.stage.fitted);
            (remaining.covariates, remaining.shape) = (rest.covariates, rest.shape);
        }
        let mut verdict = finding.verdict;
        if !splits.is_empty() {
            verdict = Verdict::NotRepeatable;
            let place = |split: &Split| EffectId::at("", split.spot).place(self.model());
            remaining.covariates = Vec::new();
            remaining.shape = repeatable::told(splits.iter().map(|split| (split, place(split))));
            remaining.places = splits.iter().map(place).collect();
        }
        let settled = verdict == finding.verdict;
        let next = if settled { searched.poses_for(&finding, &floor, progress)? } else { Vec::new() };
        let found = finding
            .best()
            .filter(|_| verdict == Verdict::Named)
            .map(|best| (best.id.clone(), best.values.clone()));
        let at_floor = verdict == Verdict::AtFloor;
        let not_shown =
            if at_floor { searched.not_shown(&finding.stage.fitted, &floor)? } else { Vec::new() };
        let mut diagnosis = Diagnosis {
            verdict,
            floor,
            not_shown,
            not_logged: if at_floor { self.not_logged() } else { Vec::new() },
            rms_mm: comparison.rms_mm,
            check_opened: u32::from(comparison.rms_mm.check.is_some()),
            named: finding.named().filter(|_| settled),
            located: finding.located().filter(|_| settled),
            tied: if settled { finding.tied() } else { Vec::new() },
            same: if settled && verdict != Verdict::AtFloor { finding.same() } else { Vec::new() },
            alike: if settled { finding.alike() } else { Vec::new() },
            candidates: finding.candidates(LISTED),
            remaining,
            besides: finding.besides.iter().map(|id| id.label(self.model())).collect(),
            floor_ratio: finding.left_over.map(|misfit| misfit.ratio),
            left_ratio: finding.left_now.map(|misfit| misfit.ratio),
            next,
            outliers: comparison.outliers,
            warnings: comparison.warnings,
            sentence: String::new(),
        };
        diagnosis.warnings.extend(finding.rises());
        if let Some(thin) = &thin {
            diagnosis.warnings.push(format!(
                "the search looked at {} of {} fitted rows, spread at random",
                thin.measured_rows().len(),
                self.measured_rows().len()
            ));
        }
        diagnosis.sentence = wording::sentence(&diagnosis);
        Ok((diagnosis, found))
    }

    /// The diagnosis of a model to which no candidate can be added any more: at the floor, or something unknown is left.
    fn settled(&self, fitted: &Fitted<'_>, progress: &Progress) -> Result<Diagnosis, LaboratoryError> {
        let returns = Returns::gather(&fitted.machine, &fitted.fit, &self.survey());
        let floor = Floor::among(&fitted.machine, returns.as_ref());
        let comparison = self.comparison(&fitted.machine, &fitted.fit, progress)?;
        let misfit = Misfit::of(fitted, &floor);
        let verdict = match misfit {
            Some(misfit) if misfit.fires() => Verdict::Unknown,
            Some(_) => Verdict::AtFloor,
            None => Verdict::FloorUnknown,
        };
        let mut remaining = Remaining::default();
        if verdict == Verdict::Unknown {
            let rest = remainder::remainder(fitted);
            remaining.covariates = rest.covariates;
            remaining.shape = format!("no further effect predicts rows that were left out; {}", rest.shape);
        }
        let ratio = misfit.map(|misfit| misfit.ratio);
        let at_floor = verdict == Verdict::AtFloor;
        let not_shown = if at_floor { self.not_shown(fitted, &floor)? } else { Vec::new() };
        let mut diagnosis = Diagnosis {
            verdict,
            floor,
            not_shown,
            not_logged: if at_floor { self.not_logged() } else { Vec::new() },
            rms_mm: comparison.rms_mm,
            check_opened: u32::from(comparison.rms_mm.check.is_some()),
            named: None,
            located: None,
            tied: Vec::new(),
            same: Vec::new(),
            alike: Vec::new(),
            candidates: Vec::new(),
            remaining,
            besides: Vec::new(),
            floor_ratio: ratio,
            left_ratio: ratio,
            next: Vec::new(),
            outliers: comparison.outliers,
            warnings: comparison.warnings,
            sentence: String::new(),
        };
        diagnosis.sentence = wording::sentence(&diagnosis);
        Ok(diagnosis)
    }

    /// Conditions the table does not log and that effects of the library go by.
    fn not_logged(&self) -> Vec<String> {
        let table = self.table();
        let logged = [
            ("side of approach", table.approach.is_some()),
            ("time", table.time.is_some()),
            ("temperature", table.temperature.is_some()),
        ];
        logged.iter().filter(|(_, logged)| !logged).map(|(name, _)| (*name).to_owned()).collect()
    }

    /// The same laboratory with fewer rows to fit, chosen at random by pose; nothing if there are no more than `most`.
    fn thinned(&self, most: usize) -> Option<Self> {
        let rows = self.measured_rows();
        if rows.len() <= most {
            return None;
        }
        let mut thin = self.clone();
        thin.keep_rows(most);
        Some(thin)
    }
}
