//! What a diagnosis finds, as typed results. Words are made of them in core/report, and so is the contract's JSON: serialized here, a diagnosis lacks what is said in
//! words (`sentence`, `rejected`, `shape`, `warnings`).

use serde::Serialize;
use serde_json::Value;

use crate::explainable::Explainable;
use crate::hypothesis::Hypothesis;
use crate::jump::Jump;
use crate::laboratory::{Errors, Rms};
use crate::noise_floor::Floor;
use crate::note::Note;
use crate::residual_structure::Description;
use crate::thresholds::SETTLES;
use plumb_calibration::measurement::{ReadingNoise, ReadingUnit};

/// Exactly one of eight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is left but noise.
    AtFloor,
    /// One effect at one place.
    Named,
    /// The joint is known, the mechanism is not.
    Located,
    /// Several effects at several places explain it equally well.
    Tied,
    /// Something is left that nothing in the library explains.
    Unknown,
    /// The poses could not show it.
    Blind,
    /// The hardware does not return to where it was.
    NotRepeatable,
    /// Nothing can be named and nobody knows the noise.
    FloorUnknown,
}

impl Verdict {
    /// Whether something may be left that has no name.
    pub fn is_unnamed(self) -> bool {
        matches!(self, Self::Unknown | Self::Located | Self::Tied | Self::FloorUnknown)
    }
}

/// Which effect, and where; what else it takes to distinguish it from its like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectSite {
    /// The effect's name.
    pub effect: String,
    /// The joint, target, axis; `base`, `sensor` or nothing for effects without a place.
    #[serde(rename = "where")]
    pub site: String,
    /// The other joint of a coupling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with: Option<String>,
    /// Periods a turn of a harmonic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n: Option<f64>,
    /// What warms up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub of: Option<String>,
    /// When a joint jumped, s as in the table (the row's number where no time is logged).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at: Option<f64>,
}

/// The one effect that is named.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Named {
    /// Which and where.
    #[serde(flatten)]
    pub effect: EffectSite,
    /// Its size.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
    /// One standard error.
    pub se: f64,
}

/// A known place with several mechanisms.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Located {
    /// The joint (or base, sensor, axis).
    #[serde(rename = "where")]
    pub site: String,
    /// Names of effects that would do it, the likeliest first.
    pub family: Vec<String>,
}

/// What one effect would explain.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// Which and where.
    #[serde(flatten)]
    pub effect: EffectSite,
    /// As a person writes it, and as `add` takes it.
    pub label: String,
    /// Probability of so much by chance, after Holm's correction for all that were tried.
    pub holm_p: f64,
    /// Bayesian information criterion above that of the best.
    pub delta_bic: f64,
    /// Posterior probability among all that were weighed, mechanisms without a name and none at all; nothing where it was not weighed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probability: Option<f64>,
    /// Fall of the root mean square error of a point in rows left out in turn, in the way in which rows are held out, if this effect alone is added and everything is fitted anew, in the diagnosis' `unit`; negative if it
    /// grows; nothing where it was not fitted.
    pub cv_gain: Option<f64>,
    /// That error with the effect added.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub leaves_mm: Option<f64>,
    /// Expected size.
    pub size: f64,
    /// Unit of the size.
    pub unit: String,
    /// One standard error.
    pub se: f64,
    /// Whether a real machine could have it.
    pub plausible: bool,
    /// Fraction of the effect that the parameters already fitted would swallow, 0 to 1.
    pub absorbed: f64,
    /// By how much the root mean square error of a point falls if this effect alone is added: [`cv_gain`](Self::cv_gain) where it was fitted, else what the
    /// score test expects of the rows that were fitted.
    pub explains_mm: f64,
    /// Smallest size these poses would show four times in five, beside the scatter that is left with the candidate in, or the noise where that is larger.
    pub smallest: f64,
    /// Why it is not the name; nothing for the one that is named.
    #[serde(skip)]
    pub rejected: Option<Rejection>,
}

/// Why a candidate is not the name. Other effects by their labels, as `add` takes them.
#[derive(Debug, Clone, PartialEq)]
pub enum Rejection {
    /// Errors of the geometry that the model does not free explain it as well: the group to free.
    HeldGeometry(&'static str),
    /// Chance may have made it: its p value after Holm's correction.
    NotSignificant(f64),
    /// No real machine has this size or sign.
    Implausible,
    /// These explain it as well.
    IndistinguishableFrom(Vec<String>),
    /// It holds only when some rows are called outliers.
    Outvoted,
    /// It explains these rows and does not predict rows it has not seen: there are too few.
    NotPredicted,
    /// Another explains more.
    WorseThan(String),
    /// A smooth function of what is known of a row explains it as well.
    SmoothExplains,
    /// A smooth function of what is known of a row predicts rows left out as well.
    SmoothPredicts,
    /// A mechanism without a name explains it as well, or is at work too, at this place.
    UnlistedAt(String),
    /// Too much else is left at this place.
    MoreLeftAt(String),
    /// Its size is another once the rest is allowed for.
    OtherSize,
    /// It is not significant once a smooth function of what is known of a row explains the rest.
    NotSignificantBesideSmooth,
    /// Others are likelier once a smooth function of what is known of a row explains the rest.
    LessLikelyBesideSmooth,
    /// Several effects that can imitate anything were taken in at this place.
    FlexibleTermsAt(String),
    /// More than noise is left with it in, which a mechanism without a name may explain as well.
    MoreThanNoiseLeft,
}

/// Why an effect should not be added without a question.
#[derive(Debug, Clone, PartialEq)]
pub enum Objection {
    /// It was judged, and is not the name.
    Rejected(Rejection),
    /// It is not among so many likeliest candidates.
    NotAmong(usize),
}

/// Two effects that move the readings of these poses alike, beyond what is fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alike {
    /// The likeliest, as `add` takes it.
    pub one: String,
    /// The other.
    pub other: String,
    /// Canonical correlation of what each adds to what is fitted.
    pub correlation: f64,
}

/// An effect these rows cannot show, though it could move the tip by more than the noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotShown {
    /// Which and where.
    #[serde(flatten)]
    pub effect: EffectSite,
    /// As a person writes it.
    pub label: String,
    /// RMS over the working volume by which it could still put the tip off and be found less than four times in five, mm; nothing where the rows hardly
    /// see it at any plausible size.
    pub up_to_mm: Option<f64>,
    /// The size it would have then; nothing where the rows do not bound it, or where a size needs masses the model does not have.
    pub size: Option<f64>,
    /// Unit of the size.
    pub unit: String,
    /// What to measure to see it.
    pub to_see: String,
}

/// What is left when nothing more can be named.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Remaining {
    /// Joints (or conditions) the rest goes with.
    #[serde(rename = "where")]
    pub places: Vec<String>,
    /// Covariates that still matter.
    pub covariates: Vec<String>,
    /// What it is like; nothing where that was not asked.
    #[serde(skip)]
    pub shape: Option<Rest>,
}

/// What the rest is like.
#[derive(Debug, Clone, PartialEq)]
pub enum Rest {
    /// It goes with something on record, or with nothing on record.
    Structure(Description),
    /// The same, where no further effect predicts rows that were left out.
    AfterAllEffects(Description),
    /// Returns to one pose fall into two groups, for no reason the table records.
    TwoPositions(Vec<TwoPositions>),
    /// It goes with the pose alone.
    PoseAlone(PoseFraction),
}

/// A place that returns to one pose find in two positions.
#[derive(Debug, Clone, PartialEq)]
pub struct TwoPositions {
    /// The joint, target or base.
    pub site: String,
    /// How far apart the two are, in `unit`.
    pub apart: f64,
    /// deg or mm.
    pub unit: &'static str,
}

/// How much of what is left goes with the pose alone, where few poses were measured often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseFraction {
    /// Fraction of the squares that is between poses.
    pub fraction: f64,
    /// Probability of so much if only the returns scattered.
    pub p: f64,
    /// Poses.
    pub poses: usize,
}

/// What is found where few poses were measured often and what is left goes with the pose.
#[derive(Debug, Clone, PartialEq)]
pub struct FewPoses {
    /// How much of it does.
    pub fraction: PoseFraction,
    /// The condition that is at work beside an error of each pose's own; nothing where none is.
    pub condition: Option<ConditionAtPoses>,
    /// Where a slide alone was moved: the effect that holds its error of position as a curve, as `add` takes it.
    pub curve: Option<String>,
}

/// A condition (play, settling) beside an error of each pose's own.
#[derive(Debug, Clone, PartialEq)]
pub struct ConditionAtPoses {
    /// The effect, as `add` takes it.
    pub label: String,
    /// How it goes from pose to pose.
    pub across: AcrossPoses,
}

/// How a condition's effect goes from pose to pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AcrossPoses {
    /// It is the same at every pose, as far as the rows show.
    Same,
    /// It differs by this standard deviation.
    Differs {
        /// In the unit of the table's readings.
        scatter_mm: f64,
    },
    /// It differs by this standard deviation, and other conditions do as well.
    Tied {
        /// In the unit of the table's readings.
        scatter_mm: f64,
    },
}

/// A pose worth measuring.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NextPose {
    /// Commanded coordinates, degrees (mm for joints that slide).
    pub q_deg: Vec<f64>,
    /// The way to arrive in, per joint: 1 so that its coordinate grows, -1 so that it falls, 0 no matter.
    pub approach: Vec<i8>,
    /// Load to carry, kg.
    pub payload_kg: f64,
    /// The surface over which the arm's own sensor is to trigger there, where that is what is measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on: Option<String>,
    /// Reading each fitted candidate predicts, mm (deg in a table of angles alone), as `effect(where)`: [x, y, z].
    pub predicted: serde_json::Map<String, Value>,
}

/// What the laboratory has to say of a model and a table.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// The verdict.
    pub verdict: Verdict,
    /// The noise floor.
    pub floor: Floor,
    /// The unit of the table's readings, and so of every error here whose name ends in `_mm`: mm, or degrees of angles alone.
    pub unit: ReadingUnit,
    /// The noise of every kind of reading: declared, or estimated from the fit.
    pub noise: Vec<ReadingNoise>,
    /// RMS of the residual of the model as it is.
    pub rms_mm: Rms,
    /// The same with mean, 95 % and maximum beside it, of one measured point.
    pub error_mm: Errors,
    /// How much of what is left could be explained at all; nothing where something is named, that was not asked, or the poses are too few.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub explainable: Option<Explainable>,
    /// Where nothing is named: a formula that explains what is left.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hypothesis: Option<Hypothesis>,
    /// Times the held-out set was looked at.
    pub check_opened: u32,
    /// Where among the rows something was re-set.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub jumps: Vec<Jump>,
    /// The effect that is named.
    pub named: Option<Named>,
    /// The place that is known.
    pub located: Option<Located>,
    /// Effects that cannot be distinguished.
    pub tied: Vec<EffectSite>,
    /// The group of the geometry to free before anything is named: errors of it explain as much as what would be named, or is tied.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub free_first: Option<&'static str>,
    /// Posterior probability that it is what is named, or one of what is tied; nothing where neither is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probability: Option<f64>,
    /// Where something is named, located or tied although more than noise is left: the root mean square error of a point that is left with it in, less the noise
    /// where that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_unexplained_mm: Option<f64>,
    /// Effects that are the same thing as the first of those in these data: whichever is added, every reading is predicted alike.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub same: Vec<String>,
    /// Which effects move the readings alike in these poses: why they are tied, or nearly so.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub alike: Vec<Alike>,
    /// What was considered, the likeliest first.
    pub candidates: Vec<Candidate>,
    /// What is left.
    pub remaining: Remaining,
    /// Of a model at the floor: what could still be wrong and these rows cannot show, that which could move the tip most first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_shown: Vec<NotShown>,
    /// Of a model at the floor: conditions the table does not log, so that nothing is said of their effects.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub not_logged: Vec<String>,
    /// What is left now, over the floor; nothing if the floor is unknown.
    pub left_ratio: Option<f64>,
    /// Effects that were found besides the one in question, as written.
    pub besides: Vec<String>,
    /// What is left when everything found is in, over the floor; nothing if the floor is unknown.
    pub floor_ratio: Option<f64>,
    /// Poses to measure next.
    pub next: Vec<NextPose>,
    /// How far apart the predictions of the effects in question lie over these poses, in standard errors, as [`NextPoses::separation`](crate::NextPoses::separation); nothing where
    /// there is no question, or that was not asked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub next_separation: Option<f64>,
    /// Lines of the table whose rows lie far outside the others' scatter.
    pub outliers: Vec<u32>,
    /// What the user should know besides.
    #[serde(skip)]
    pub warnings: Vec<Note>,
    /// What was found of few poses that were measured often; nothing of other tables.
    #[serde(skip)]
    pub few_poses: Option<FewPoses>,
    /// RMS of the fit of the model that was judged: `rms_mm.fit`, but where a residual map came in after the verdict.
    #[serde(skip)]
    pub judged_mm: f64,
}

impl Diagnosis {
    /// Whether the poses to measure next would distinguish effects in question; nothing where that was not asked.
    pub fn next_distinguishes(&self) -> Option<bool> {
        self.next_separation.map(|separation| separation >= SETTLES)
    }

    /// Why adding an effect should be asked about first: the candidates were judged, and it is neither named, nor tied, nor found besides. By its label, as `add`
    /// takes it; nothing where there is no objection, or nothing was judged.
    pub fn objection(&self, label: &str) -> Option<Objection> {
        let known = self.candidates.iter().find(|candidate| candidate.label == label);
        let in_question = known.is_some_and(|candidate| {
            let is_named = self.named.as_ref().is_some_and(|named| named.effect == candidate.effect);
            is_named || self.tied.contains(&candidate.effect)
        });
        if in_question || self.candidates.is_empty() || self.besides.iter().any(|besides| besides == label) {
            return None;
        }
        let reason = known.and_then(|candidate| candidate.rejected.clone());
        Some(reason.map_or(Objection::NotAmong(self.candidates.len()), Objection::Rejected))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{candidate, effect_at, two_links};
    use plumb_estimation::Progress;

    #[test]
    fn what_was_judged_and_is_not_in_question_is_objected_to_with_its_reason() {
        let lab = two_links(30, "joint_zero(*)", 0.05, 4, |_| [0.0; 2]);
        let mut diagnosis = lab.diagnose(&Progress::unwatched()).unwrap();
        let rejected =
            |at: &str| Candidate { rejected: Some(Rejection::Implausible), ..candidate("joint_gain", at) };
        diagnosis.candidates =
            vec![rejected("shoulder"), rejected("elbow"), candidate("joint_backlash", "elbow")];
        diagnosis.besides = vec!["link_length(elbow)".to_owned()];
        (diagnosis.named, diagnosis.tied) = (None, Vec::new());
        let judged = Some(Objection::Rejected(Rejection::Implausible));
        assert_eq!(diagnosis.objection("joint_gain(elbow)"), judged);
        assert_eq!(
            diagnosis.objection("joint_backlash(elbow)"),
            Some(Objection::NotAmong(3)),
            "no reason was kept"
        );
        assert_eq!(
            diagnosis.objection("scale(x)"),
            Some(Objection::NotAmong(3)),
            "not among the likeliest three"
        );
        assert_eq!(diagnosis.objection("link_length(elbow)"), None, "found besides");
        // Named or tied at one joint says nothing of the same effect at the other.
        let effect = effect_at("joint_gain", "elbow");
        diagnosis.named = Some(Named { effect: effect.clone(), size: 0.1, unit: "1".to_owned(), se: 0.01 });
        assert_eq!(
            (diagnosis.objection("joint_gain(elbow)"), diagnosis.objection("joint_gain(shoulder)")),
            (None, judged.clone())
        );
        (diagnosis.named, diagnosis.tied) = (None, vec![effect]);
        assert_eq!(
            (diagnosis.objection("joint_gain(elbow)"), diagnosis.objection("joint_gain(shoulder)")),
            (None, judged)
        );
        diagnosis.candidates.clear();
        assert_eq!(diagnosis.objection("scale(x)"), None, "nothing was judged");
    }

    #[test]
    fn something_without_a_name_may_be_left_where_nothing_is_named_and_more_than_noise_is_left() {
        use Verdict::{AtFloor, Blind, FloorUnknown, Located, Named, NotRepeatable, Tied, Unknown};
        assert!([Unknown, Located, Tied, FloorUnknown].into_iter().all(Verdict::is_unnamed));
        assert!(![Named, AtFloor, Blind, NotRepeatable].into_iter().any(Verdict::is_unnamed));
    }
}
