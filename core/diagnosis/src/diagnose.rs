//! One diagnosis from beginning to end: fit, noise floor, search, verdict, and what goes with the verdict.

use crate::candidates::{self, Candidates};
use crate::fitted::Fitted;
use crate::found::Found;
use crate::jump::Jump;
use crate::laboratory::{Comparison, Laboratory, LaboratoryError};
use crate::lack_of_fit::LackOfFit;
use crate::noise_floor::{Floor, Replicates};
use crate::note::Note;
use crate::outcome::{Diagnosis, Objection, Remaining, Rest, TwoPositions, Verdict};
use crate::repeatability::{self, Split};
use crate::residual_structure::residual_structure;
use crate::thresholds::SEARCH_ROWS;
use crate::unlisted;
use crate::verdict::Finding;
use plumb_calibration::arm_model::AddedEffect;
use plumb_calibration::effect::{EffectId, Site, kind};
use plumb_estimation::Progress;

/// Candidates a diagnosis lists.
const LISTED: usize = 12;

/// A diagnosis that says nothing yet but its verdict, its floor and how far the model misses.
fn without_findings(verdict: Verdict, floor: Floor, comparison: Comparison) -> Diagnosis {
    Diagnosis {
        verdict,
        floor,
        unit: comparison.unit,
        noise: comparison.noise,
        not_shown: Vec::new(),
        not_logged: Vec::new(),
        judged_mm: comparison.rms_mm.fit,
        rms_mm: comparison.rms_mm,
        error_mm: comparison.error_mm,
        explainable: None,
        hypothesis: None,
        check_opened: u32::from(comparison.rms_mm.check.is_some()),
        jumps: Vec::new(),
        named: None,
        located: None,
        tied: Vec::new(),
        free_first: None,
        probability: None,
        left_unexplained_mm: None,
        same: Vec::new(),
        alike: Vec::new(),
        candidates: Vec::new(),
        remaining: Remaining::default(),
        besides: Vec::new(),
        floor_ratio: None,
        left_ratio: None,
        next: Vec::new(),
        next_separation: None,
        outliers: comparison.outliers,
        warnings: comparison.warnings,
        few_poses: None,
    }
}

/// Whether an effect is an event at a moment of its own, rather than one between the model's epochs.
fn is_dated_by_itself(id: &EffectId) -> bool {
    id.inner.is_some() && kind(&id.name).is_some_and(|kind| kind.is_event)
}

/// The verdict on a model to which no candidate can be added any more: only the lack of fit is left to ask.
fn settled_verdict(lack_of_fit: Option<LackOfFit>) -> Verdict {
    match lack_of_fit {
        Some(lack_of_fit) if lack_of_fit.is_significant() => Verdict::Unknown,
        Some(_) => Verdict::AtFloor,
        None => Verdict::FloorUnknown,
    }
}

impl Laboratory {
    /// Says what the model lacks, if anything.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn diagnose(&self, progress: &Progress) -> Result<Diagnosis, LaboratoryError> {
        self.diagnose_for(progress).map(|(diagnosis, _)| diagnosis)
    }

    /// Why an effect should not be added without a question: the lab judges it and neither names it, nor holds it for as good as what it names. Nothing where it has
    /// no objection, and of what is no candidate for a mechanism (a map of a positioning error, say), of which it has no opinion.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn objection(
        &self,
        id: &EffectId,
        progress: &Progress,
    ) -> Result<Option<Objection>, LaboratoryError> {
        match self.judges(id) {
            true => Ok(self.diagnose(progress)?.objection(&self.model().label(id))),
            false => Ok(None),
        }
    }

    /// As [`Self::objection`], by a diagnosis that was made of this model already.
    pub fn objection_by(&self, diagnosis: &Diagnosis, id: &EffectId) -> Option<Objection> {
        if self.judges(id) { diagnosis.objection(&self.model().label(id)) } else { None }
    }

    /// Whether an effect is among the candidates for a mechanism.
    fn judges(&self, id: &EffectId) -> bool {
        candidates::probes(self).iter().any(|probe| probe.id.same_as(id))
    }

    /// The diagnosis, and, where something is left without a name, how much of it could be explained at all, and a formula for it, if one is found.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn diagnose_in_full(&self, progress: &Progress) -> Result<Diagnosis, LaboratoryError> {
        let diagnosis = self.diagnose(progress)?;
        let unnamed = diagnosis.verdict.is_unnamed();
        let explainable = if unnamed { self.explainable(progress)? } else { None };
        self.with_hypothesis(Diagnosis { explainable, ..diagnosis }, progress)
    }

    /// A diagnosis with a formula for what is left, where nothing is named and one is found. What was re-set between rows is allowed for.
    ///
    /// # Errors
    /// Nothing can be fitted, or cancellation.
    pub fn with_hypothesis(
        &self,
        diagnosis: Diagnosis,
        progress: &Progress,
    ) -> Result<Diagnosis, LaboratoryError> {
        let structured = matches!(diagnosis.verdict, Verdict::Unknown | Verdict::Located);
        // Geometry that is to be freed first would be written as a formula, and a tie has names already.
        if !structured || diagnosis.free_first.is_some() {
            return Ok(diagnosis);
        }
        let hypothesis = match self.dated(progress)? {
            Some(dated) => dated.laboratory.hypothesis(&diagnosis.floor, progress),
            None => self.hypothesis(&diagnosis.floor, progress),
        }?;
        Ok(Diagnosis { hypothesis, ..diagnosis })
    }

    /// The diagnosis, and what may be added: the named effect, or corrections where nothing is named.
    pub(crate) fn diagnose_for(&self, progress: &Progress) -> Result<(Diagnosis, Found), LaboratoryError> {
        if let Some(plain) = self.without_map() {
            let (mut diagnosis, found) = plain.diagnose_for(progress)?;
            diagnosis.warnings.push(Note::MapLeftOut);
            return Ok((diagnosis, found));
        }
        progress.report(0.0, "looking for jumps")?;
        let mut found = match self.dated(progress)? {
            Some(dated) => dated.laboratory.diagnose_with(dated.jumps.clone(), progress),
            None => self.diagnose_with(Vec::new(), progress),
        }?;
        // A joint seems to have jumped where no jump was dated: was it perhaps the instrument, or the base?
        if let Some(event) = found.1.event.clone()
            && let Some(dated) = self.dated_at(&event, progress)?
        {
            found = dated.laboratory.diagnose_with(dated.jumps.clone(), progress)?;
        }
        let (mut diagnosis, found) = self.ask_beside_poses(found, progress)?;
        diagnosis.warnings.extend(self.negative_play(&diagnosis));
        Ok((diagnosis, found))
    }

    /// The diagnosis where something was re-set between these rows.
    fn diagnose_with(
        &self,
        jumps: Vec<Jump>,
        progress: &Progress,
    ) -> Result<(Diagnosis, Found), LaboratoryError> {
        progress.report(0.0, "fitting")?;
        let problem = self.problem(&[])?;
        let fit = self.fit(&problem, progress)?;
        progress.report(0.1, "noise floor")?;
        let replicates = Replicates::gather(&problem, &fit, &self.context());
        let floor = Floor::among(&problem, replicates.as_ref());
        let splits = replicates.as_ref().map(|replicates| repeatability::find_splits(&problem, replicates));
        // Asked of the model as it is: replicates share their pose, so that no missing effect of the pose can part them.
        let splits = splits.unwrap_or_default();
        let comparison = self.comparison(&problem, &fit, progress)?;
        let candidates = Candidates { listed: candidates::probes(self), unlisted: unlisted::probes(self) };
        // The floor and the errors are of all rows; only the search, which refits many times, is of a part.
        let thin = self.thinned(SEARCH_ROWS);
        let searched = thin.as_ref().unwrap_or(self);
        let finding = searched.find(&floor, &candidates, progress)?;
        let jumps = match finding.lasting_effects() {
            Some(found) => searched.jumps_beside(jumps, &found, &finding.stage.fitted, progress)?,
            None => jumps,
        };
        let mut diagnosis = Diagnosis {
            candidates: finding.candidates(LISTED, &floor),
            besides: finding.besides.iter().map(|id| self.model().label(id)).collect(),
            floor_ratio: finding.left_over.map(|lack_of_fit| lack_of_fit.ratio),
            left_ratio: finding.left_now.map(|lack_of_fit| lack_of_fit.ratio),
            jumps,
            ..without_findings(finding.verdict, floor, comparison)
        };
        // Hardware with two positions overrules every effect: no model can be right then.
        if splits.is_empty() {
            searched.describe(&finding, &mut diagnosis, progress)?;
        } else {
            diagnosis.verdict = Verdict::NotRepeatable;
            diagnosis.remaining = self.remaining_of_splits(&splits);
        }
        diagnosis.warnings.extend(finding.gravity_warning());
        diagnosis.warnings.extend(finding.twins());
        if let Some(thin) = &thin {
            let (looked_at, fitted) = (thin.measured_rows().len(), self.measured_rows().len());
            diagnosis.warnings.push(Note::SearchedPart { looked_at, fitted });
        }
        let named = finding.best().filter(|_| diagnosis.verdict == Verdict::Named);
        let named = named.map(|best| AddedEffect { id: best.id.clone(), values: best.values.clone() });
        let unnamed = diagnosis.verdict.is_unnamed();
        let corrections = if unnamed { finding.corrections() } else { Vec::new() };
        let event = finding.best().map(|best| best.id.clone()).filter(is_dated_by_itself);
        let together = if unnamed { finding.together } else { Vec::new() };
        Ok((diagnosis, Found { named, corrections, together, event }))
    }

    /// Fills in what goes with a finding's verdict: the name or the site, the ties, the rest, and poses to measure.
    fn describe(
        &self,
        finding: &Finding<'_>,
        diagnosis: &mut Diagnosis,
        progress: &Progress,
    ) -> Result<(), LaboratoryError> {
        // A tie is described by its candidates; what goes with which condition would be said of each of them.
        if matches!(finding.verdict, Verdict::Located | Verdict::Unknown) {
            let rest = residual_structure(&finding.stage.fitted);
            diagnosis.remaining = Remaining {
                places: finding.sites.iter().map(|site| self.site_name(*site)).collect(),
                shape: Some(Rest::Structure(rest.shape)),
                covariates: rest.covariates,
            };
        }
        (diagnosis.next, diagnosis.next_separation) = self.poses_for(finding, &diagnosis.floor, progress)?;
        diagnosis.named = finding.named();
        diagnosis.located = finding.located();
        diagnosis.tied = finding.tied();
        diagnosis.free_first = finding.free_first;
        diagnosis.left_unexplained_mm = finding.left_unexplained_mm;
        if matches!(finding.verdict, Verdict::Named | Verdict::Located | Verdict::Tied) {
            diagnosis.probability = finding.probability();
        }
        diagnosis.alike = finding.alike();
        if finding.verdict == Verdict::AtFloor {
            diagnosis.not_shown = self.not_shown(&finding.stage.fitted, &diagnosis.floor)?;
            diagnosis.not_logged = self.not_logged();
        } else {
            diagnosis.same = finding.same();
        }
        Ok(())
    }

    /// What is left where hardware is in two positions.
    fn remaining_of_splits(&self, splits: &[Split]) -> Remaining {
        let positions: Vec<TwoPositions> = splits
            .iter()
            .map(|split| {
                let (apart, unit) = split.shown();
                TwoPositions { site: self.site_name(split.site), apart, unit }
            })
            .collect();
        Remaining {
            places: positions.iter().map(|one| one.site.clone()).collect(),
            covariates: Vec::new(),
            shape: Some(Rest::TwoPositions(positions)),
        }
    }

    /// The name of a site: a joint, a target, `base`.
    fn site_name(&self, site: Site) -> String {
        self.model().site_name(site)
    }

    /// The diagnosis of a model to which no candidate can be added any more: at the floor, or something unknown is left.
    pub(crate) fn settled(
        &self,
        fitted: &Fitted<'_>,
        progress: &Progress,
    ) -> Result<Diagnosis, LaboratoryError> {
        let replicates = Replicates::gather(&fitted.problem, &fitted.fit, &self.context());
        let floor = Floor::among(&fitted.problem, replicates.as_ref());
        let comparison = self.comparison(&fitted.problem, &fitted.fit, progress)?;
        let lack_of_fit = LackOfFit::of(fitted, &floor);
        let ratio = lack_of_fit.map(|lack_of_fit| lack_of_fit.ratio);
        let mut diagnosis = Diagnosis {
            floor_ratio: ratio,
            left_ratio: ratio,
            ..without_findings(settled_verdict(lack_of_fit), floor, comparison)
        };
        if diagnosis.verdict == Verdict::Unknown {
            let rest = residual_structure(fitted);
            diagnosis.remaining.covariates = rest.covariates;
            diagnosis.remaining.shape = Some(Rest::AfterAllEffects(rest.shape));
        }
        if diagnosis.verdict == Verdict::AtFloor {
            diagnosis.not_shown = self.not_shown(fitted, &diagnosis.floor)?;
            diagnosis.not_logged = self.not_logged();
        }
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
    pub(crate) fn thinned(&self, most: usize) -> Option<Self> {
        let rows = self.measured_rows();
        if rows.len() <= most {
            return None;
        }
        let mut thin = self.clone();
        thin.keep_rows(most);
        Some(thin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links_with;
    use crate::thresholds::LACK_OF_FIT_LEVEL;

    const DECLARED: &str = "free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}";

    #[test]
    fn of_an_arm_that_is_right_it_is_said_what_these_rows_cannot_show_and_what_was_not_logged() {
        let lab = two_links_with(DECLARED, 40, 0.05, 21, |_| [0.0; 2]);
        let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
        assert_eq!(diagnosis.verdict, Verdict::AtFloor, "{diagnosis:#?}");
        assert_eq!(diagnosis.not_logged, ["side of approach", "time", "temperature"]);
        assert!(diagnosis.named.is_none() && diagnosis.next.len() <= 4);
        assert!((diagnosis.left_ratio.unwrap() - 1.0).abs() < 0.3, "{:?}", diagnosis.left_ratio);
        assert!(diagnosis.remaining.places.is_empty());
        // An effect of a size of five standard errors is found four times in five.
        let gains = diagnosis.candidates.iter().filter(|one| one.effect.effect == "joint_gain");
        for one in gains {
            assert!((one.smallest / one.se / 5.0 - 1.0).abs() < 0.3, "{one:?}");
        }
    }

    #[test]
    fn a_gain_is_named_with_its_size_and_promises_what_it_takes_away() {
        let lab = two_links_with(DECLARED, 40, 0.05, 22, |q| [0.0, 0.01 * q[1]]);
        let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
        let named = diagnosis.named.as_ref().unwrap_or_else(|| panic!("{diagnosis:#?}"));
        assert_eq!((named.effect.effect.as_str(), named.effect.site.as_str()), ("joint_gain", "elbow"));
        assert!((named.size - 0.01).abs() < 4.0 * named.se && named.se < 0.001, "{named:?}");
        let best = &diagnosis.candidates[0];
        assert!(best.rejected.is_none() && best.delta_bic == 0.0 && best.plausible, "{best:?}");
        // Its own 1.5 mm are no noise that hides it: five standard errors of what it leaves.
        assert!((best.smallest / best.se / 5.0 - 1.0).abs() < 0.3, "{best:?}");
        let promised = best.cv_gain.unwrap();
        // 150 mm times a hundredth of an elbow angle of 58 degrees RMS about its mean is 1.5 mm.
        assert!((1.0..2.0).contains(&promised), "{promised}");
        assert!((best.explains_mm - promised).abs() < 1e-12, "{best:?}");
        assert!(
            (diagnosis.rms_mm.cv.unwrap() - best.leaves_mm.unwrap() - promised).abs() < 0.05 * promised,
            "{best:?}"
        );
        let (_, found) = lab.diagnose_for(&Progress::unwatched()).unwrap();
        assert!(found.named.is_some() && found.corrections.is_empty(), "a mechanism needs no correction");
        assert!(
            diagnosis.candidates.iter().skip(1).all(|one| one.rejected.is_some() && one.delta_bic >= 0.0)
        );
    }

    #[test]
    fn what_nothing_in_the_library_does_is_placed_and_described() {
        // The shoulder is off by a function of both angles.
        let lab = two_links_with(DECLARED, 60, 0.05, 23, |q| [0.004 * (2.3 * q[0] + 1.7 * q[1]).sin(), 0.0]);
        let diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
        assert!(matches!(diagnosis.verdict, Verdict::Located | Verdict::Unknown), "{diagnosis:#?}");
        assert_eq!(
            diagnosis.remaining.places.first().map(String::as_str),
            Some("shoulder"),
            "{:?}",
            diagnosis.remaining
        );
        assert!(
            matches!(diagnosis.remaining.shape, Some(Rest::Structure(_)))
                && diagnosis.left_ratio.unwrap() > 3.0
        );
    }

    #[test]
    fn a_large_table_is_searched_in_part_and_says_so() {
        let lab = two_links_with(DECLARED, 30, 0.05, 24, |_| [0.0; 2]);
        assert!(lab.thinned(30).is_none());
        let thin = lab.thinned(12).unwrap();
        assert_eq!(thin.measured_rows().len(), 12);
    }

    #[test]
    fn a_model_without_candidates_is_at_the_floor_unless_more_than_noise_is_left() {
        let at = |p: f64| settled_verdict(Some(LackOfFit { ratio: 1.0, p }));
        assert_eq!(at(0.9 * LACK_OF_FIT_LEVEL), Verdict::Unknown);
        assert_eq!(at(1.1 * LACK_OF_FIT_LEVEL), Verdict::AtFloor);
        assert_eq!(settled_verdict(None), Verdict::FloorUnknown);
    }

    /// A planar arm whose weight of 20 N acts 50 mm before the tip of the forearm; the elbow bends by so much under a newton metre.
    fn loaded(bend: f64) -> Diagnosis {
        let lines = "free: [joint_zero(*)]\nnoise: {p1_mm: 0.05}\ngravity: [0, -1, 0]\n\
                     links: [{after: elbow, mass_kg: 2, centre_mm: [-50, 0, 0]}]";
        let lab = two_links_with(lines, 60, 0.05, 24, |q| {
            let moment = -2.0 * 9.81 * 0.1 * (q[0] + q[1]).cos();
            [0.0, bend * moment]
        });
        lab.diagnose(&Progress::unwatched()).unwrap()
    }

    #[test]
    fn a_joint_that_rises_under_its_load_is_warned_of_and_one_that_gives_way_is_not() {
        let rises = |diagnosis: &Diagnosis| {
            diagnosis
                .warnings
                .iter()
                .any(|warning| matches!(warning, Note::RisesUnderLoad(label) if label.contains("elbow")))
        };
        let [gives_way, wrong_way] = [0.002, -0.002].map(loaded);
        assert!(
            gives_way
                .candidates
                .iter()
                .any(|one| one.effect.effect == "joint_compliance" && one.holm_p < 1e-6)
        );
        assert!(!rises(&gives_way), "{:?}", gives_way.warnings);
        assert!(rises(&wrong_way), "{:?}", wrong_way.warnings);
    }

    #[test]
    fn what_is_left_of_two_positions_is_by_place_and_size() {
        let lab = crate::testing::two_links(6, "", 0.05, 31, |_| [0.0; 2]);
        let joint = Split { site: Site::Joint(1), apart: 0.5_f64.to_radians(), turns: true };
        let base = Split { site: Site::Base, apart: 0.3, turns: false };
        let left = lab.remaining_of_splits(&[joint, base]);
        assert_eq!((left.places, left.covariates), (vec!["elbow".to_owned(), "base".to_owned()], Vec::new()));
        let Some(Rest::TwoPositions(two)) = left.shape else { panic!("{:?}", left.shape) };
        assert!((two[0].apart - 0.5).abs() < 1e-12 && two[0].unit == "deg" && two[0].site == "elbow");
        assert_eq!(two[1], TwoPositions { site: "base".to_owned(), apart: 0.3, unit: "mm" });
    }

    #[test]
    fn a_mechanism_that_is_not_named_is_objected_to_and_what_is_no_mechanism_is_not() {
        let lab = two_links_with(DECLARED, 40, 0.05, 22, |q| [0.0, 0.01 * q[1]]);
        let progress = Progress::unwatched();
        let diagnosis = lab.diagnose_in_full(&progress).unwrap();
        assert!(diagnosis.explainable.is_none() && diagnosis.hypothesis.is_none(), "it has a name");
        let id = |text: &str| plumb_calibration::effect::parse(text, lab.model()).unwrap();
        assert!(lab.objection_by(&diagnosis, &id("joint_gain(elbow)")).is_none());
        assert!(lab.objection_by(&diagnosis, &id("joint_gain(shoulder)")).is_some());
        assert!(lab.objection_by(&diagnosis, &id("joint_zero(elbow)")).is_none(), "it is free already");
        assert!(lab.objection(&id("joint_gain(shoulder)"), &progress).unwrap().is_some());
        assert!(lab.objection(&id("joint_zero(elbow)"), &progress).unwrap().is_none());
    }

    #[test]
    fn what_has_no_name_is_asked_how_much_of_it_could_be_explained() {
        let lab = two_links_with(DECLARED, 60, 0.05, 23, |q| [0.004 * (2.3 * q[0] + 1.7 * q[1]).sin(), 0.0]);
        let diagnosis = lab.diagnose_in_full(&Progress::unwatched()).unwrap();
        assert!(diagnosis.verdict.is_unnamed() && diagnosis.explainable.is_some(), "{:?}", diagnosis.verdict);
    }

    #[test]
    fn a_model_to_which_all_was_added_is_at_the_floor_or_has_structure_left() {
        let settled = |poses: usize, off: f64| {
            let lab =
                two_links_with(DECLARED, poses, 0.05, 23, |q| [off * (2.3 * q[0] + 1.7 * q[1]).sin(), 0.0]);
            let fitted = lab.fit_with(&[], None, &Progress::unwatched()).unwrap();
            lab.settled(&fitted, &Progress::unwatched()).unwrap()
        };
        let sound = settled(12, 0.0);
        assert_eq!((sound.verdict, sound.not_logged.len()), (Verdict::AtFloor, 3));
        assert!(!sound.not_shown.is_empty() && sound.remaining.shape.is_none());
        assert!((sound.left_ratio.unwrap() - 1.0).abs() < 0.5 && sound.floor_ratio == sound.left_ratio);
        let left = settled(60, 0.004);
        assert_eq!((left.verdict, left.not_logged.len(), left.not_shown.len()), (Verdict::Unknown, 0, 0));
        assert!(left.remaining.shape.is_some() && left.left_ratio.unwrap() > 3.0);
    }

    #[test]
    fn a_formula_is_looked_for_where_something_is_left_without_a_name_and_no_geometry_is_to_be_freed() {
        let lab =
            two_links_with("free: [joint_zero(*)]", 120, 0.05, 1, |q| [0.0, 0.004 * (q[1] - 0.4).max(0.0)]);
        let progress = Progress::unwatched();
        let fitted = lab.fit_with(&[], None, &progress).unwrap();
        let with = |verdict: Verdict, free_first: Option<&'static str>| {
            let plain = lab.settled(&fitted, &progress).unwrap();
            let asked = lab.with_hypothesis(Diagnosis { verdict, free_first, ..plain }, &progress).unwrap();
            assert_eq!(asked.verdict, verdict);
            asked.hypothesis.is_some()
        };
        assert!(with(Verdict::Unknown, None));
        assert!(!with(Verdict::Named, None) && !with(Verdict::Tied, None));
        assert!(!with(Verdict::Located, Some("geometry(*)")));
    }
}
