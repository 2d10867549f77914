//! Diagnosis: what, if anything, the model lacks; in the order passport, floor, audit, score, refit, ties, verdict.

mod bearing;
mod growth;
mod misfit;
mod outcome;
mod refine;
mod repeatable;
mod score;
mod search;
mod trial;
mod unlisted;
mod verdict;
mod wording;

pub(crate) use trial::Fitted;

pub use growth::{Growth, Step, StepRms};
pub use outcome::{Candidate, Diagnosis, EffectPlace, Located, Named, NextPose, Remaining, Verdict};

use crate::effect::{EffectId, Spot};
use crate::floor::{Floor, Returns};
use crate::laboratory::{Laboratory, LaboratoryError};
use crate::progress::Progress;

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
        let split = returns.as_ref().and_then(|returns| repeatable::find_split(&machine, returns));
        let comparison = self.comparison(&machine, &fit, progress)?;
        let candidates =
            search::Candidates { listed: search::probes(self), unlisted: unlisted::probes(self) };
        let finding = self.find(&floor, &candidates, progress)?;
        let mut remaining = Remaining::default();
        if matches!(finding.verdict, Verdict::Located | Verdict::Unknown) {
            let place = |spot: &Spot| EffectId::at("", *spot).place(self.model());
            remaining.places = finding.places.iter().map(place).collect();
        }
        let mut verdict = finding.verdict;
        if let Some(split) = split {
            verdict = Verdict::NotRepeatable;
            let joint = self.model().chain.joints.get(split.joint).map_or("?", |joint| joint.name.as_str());
            remaining.places = vec![joint.to_owned()];
            remaining.shape = format!(
                "returns to one pose fall into two camps about {} deg apart at {joint}, for no reason the table records",
                wording::figure(split.apart.to_degrees())
            );
        }
        let settled = verdict == finding.verdict;
        let found = finding
            .best()
            .filter(|_| verdict == Verdict::Named)
            .map(|best| (best.id.clone(), best.values.clone()));
        let mut diagnosis = Diagnosis {
            verdict,
            floor,
            rms_mm: comparison.rms_mm,
            check_opened: u32::from(comparison.rms_mm.check.is_some()),
            named: finding.named().filter(|_| settled),
            located: finding.located().filter(|_| settled),
            tied: if settled { finding.tied() } else { Vec::new() },
            candidates: finding.candidates(LISTED),
            remaining,
            besides: finding.besides.iter().map(|id| id.label(self.model())).collect(),
            floor_ratio: finding.left_over.map(|misfit| misfit.ratio),
            left_ratio: finding.left_now.map(|misfit| misfit.ratio),
            next: Vec::new(),
            outliers: comparison.outliers,
            warnings: comparison.warnings,
            sentence: String::new(),
        };
        diagnosis.sentence = wording::sentence(&diagnosis);
        Ok((diagnosis, found))
    }
}
