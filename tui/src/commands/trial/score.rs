//! How right a diagnosis is.

use plumb_simulated::physics::campaign::{Hidden, Truth, Verdict};
use serde::{Deserialize, Serialize};

/// A diagnosis, as far as it is scored: the contract of `plumb model diagnose --json` and `plumb model grow --json`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Diagnosis {
    /// The one verdict.
    pub verdict: Verdict,
    /// Cause and size when there is one.
    #[serde(default)]
    pub named: Option<Candidate>,
    /// The joint when only that is known.
    #[serde(default)]
    pub located: Option<Located>,
    /// What cannot be distinguished.
    #[serde(default)]
    pub tied: Vec<Candidate>,
    /// All that were weighed, best first.
    #[serde(default)]
    pub candidates: Vec<Candidate>,
    /// What was found besides, as `effect(site)`.
    #[serde(default)]
    pub besides: Vec<String>,
    /// What `grow` added, in order.
    #[serde(default)]
    pub steps: Vec<Step>,
    /// What it says that the readings could not show.
    #[serde(default)]
    pub not_shown: Vec<Candidate>,
}

impl Diagnosis {
    /// A diagnosis that says nothing.
    pub fn empty() -> Self {
        Self {
            verdict: Verdict::AtFloor,
            named: None,
            located: None,
            tied: Vec::new(),
            candidates: Vec::new(),
            besides: Vec::new(),
            steps: Vec::new(),
            not_shown: Vec::new(),
        }
    }
}

/// An effect somewhere.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Candidate {
    /// Name of the effect.
    pub effect: String,
    /// Where it sits.
    #[serde(rename = "where", default)]
    pub site: String,
    /// Size.
    #[serde(default)]
    pub size: Option<f64>,
    /// Unit of the size.
    #[serde(default)]
    pub unit: Option<String>,
    /// Standard error of the size.
    #[serde(default)]
    pub se: Option<f64>,
}

impl Candidate {
    /// An effect at a site, of unknown size.
    pub fn at(effect: &str, site: &str) -> Self {
        Self { effect: effect.to_owned(), site: site.to_owned(), size: None, unit: None, se: None }
    }
}

impl Candidate {
    fn is(&self, effect: &str, site: &str) -> bool {
        self.effect == effect && self.site == site
    }
}

/// A site without a mechanism.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Located {
    /// Where.
    #[serde(rename = "where", default)]
    pub site: String,
    /// What it could be.
    #[serde(default)]
    pub family: Vec<String>,
}

/// One effect added.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Step {
    /// Which.
    pub added: Candidate,
}

/// The score of a diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Score {
    /// The verdict is among those that are right, and what it names or locates is hidden.
    pub right: bool,
    /// The verdict is among those that are right.
    pub verdict_right: bool,
    /// The best candidate is something hidden.
    pub truth_first: bool,
    /// Something hidden is named, tied, or in the family located.
    pub truth_in_set: bool,
    /// Everything hidden that has a name is named, tied or found besides.
    pub all_found: bool,
    /// What `grow` added is just what is hidden; for a diagnosis, whether nothing is hidden.
    pub grown_exactly: bool,
    /// What is named or located sits where something hidden sits.
    #[serde(rename = "place_right")]
    pub site_right: bool,
    /// Something was named that is not hidden.
    pub false_name: bool,
    /// Nothing is named, and what is hidden is reported as what the readings could not show.
    #[serde(rename = "told_not_shown")]
    pub reported_not_shown: bool,
    /// Size found less size hidden, over its standard error.
    pub size_error_over_se: Option<f64>,
}

/// By how much more than the greatest size that was said not to show may be hidden: a size that is found four times in five is missed once in five.
const STILL_MISSED: f64 = 1.5;

impl Score {
    /// Holds a diagnosis against the truth.
    pub fn of(diagnosis: &Diagnosis, truth: &Truth) -> Self {
        let verdict_right = truth.accept_verdict.contains(&diagnosis.verdict);
        let hides = |candidate: &Candidate| is_hidden(truth, &candidate.effect, &candidate.site);
        let named: Vec<&Candidate> =
            diagnosis.named.iter().chain(diagnosis.steps.iter().map(|step| &step.added)).collect();
        let located = diagnosis.located.as_ref();
        let in_family =
            located.is_some_and(|one| one.family.iter().any(|effect| is_hidden(truth, effect, &one.site)));
        let truth_in_set =
            named.iter().any(|one| hides(one)) || diagnosis.tied.iter().any(hides) || in_family;
        let at_hidden = |site: &str| truth.hidden.iter().any(|hidden| hidden.site == site);
        let site_right =
            named.iter().any(|one| at_hidden(&one.site)) || located.is_some_and(|one| at_hidden(&one.site));
        let false_name = named.iter().any(|one| !hides(one));
        let all_found = truth.effects.iter().all(|(effect, site)| {
            let is = |one: &Candidate| one.is(effect, site);
            let besides = |text: &String| {
                text.split(['(', ',', ')']).map(str::trim).take(2).eq([effect.as_str(), site.as_str()])
            };
            named.iter().any(|one| is(one))
                || diagnosis.tied.iter().any(is)
                || diagnosis.besides.iter().any(besides)
        });
        let grown = |one: &Hidden| diagnosis.steps.iter().any(|step| step.added.is(&one.effect, &one.site));
        let only_hidden =
            diagnosis.steps.iter().all(|step| is_hidden(truth, &step.added.effect, &step.added.site));
        let grown_exactly = only_hidden && truth.hidden.iter().all(grown);
        let substance = match diagnosis.verdict {
            Verdict::Named => !false_name && !named.is_empty(),
            Verdict::Located => site_right,
            Verdict::Tied => truth_in_set,
            _ => !false_name,
        };
        let reported_not_shown = diagnosis.verdict == Verdict::AtFloor
            && !truth.hidden.is_empty()
            && truth.hidden.iter().any(|hidden| diagnosis.not_shown.iter().any(|one| covers(one, hidden)));
        let size = named.iter().find_map(|one| Some((*one, hidden(truth, &one.effect, &one.site)?)));
        Self {
            right: match diagnosis.steps.is_empty() {
                true => (verdict_right && substance) || reported_not_shown,
                false => grown_exactly,
            },
            reported_not_shown,
            grown_exactly,
            all_found,
            verdict_right,
            truth_first: diagnosis.candidates.first().or(diagnosis.named.as_ref()).is_some_and(hides),
            truth_in_set,
            site_right,
            false_name,
            size_error_over_se: size.and_then(|(found, hidden)| size_error(found, hidden)),
        }
    }
}

fn hidden<'truth>(truth: &'truth Truth, effect: &str, site: &str) -> Option<&'truth Hidden> {
    truth.hidden.iter().find(|hidden| hidden.effect == effect && hidden.site == site)
}

fn is_hidden(truth: &Truth, effect: &str, site: &str) -> bool {
    hidden(truth, effect, site).is_some()
}

/// Whether what was said not to show is what is hidden, at a size that could have been missed.
fn covers(not_shown: &Candidate, hidden: &Hidden) -> bool {
    let could_be_missed =
        |size: f64| hidden.size.abs() <= STILL_MISSED * (size * to_unit_of(hidden, not_shown)).abs();
    not_shown.is(&hidden.effect, &hidden.site) && not_shown.size.is_none_or(could_be_missed)
}

/// By which a size found has to be multiplied to be in the unit of what is hidden.
fn to_unit_of(hidden: &Hidden, found: &Candidate) -> f64 {
    let factor = |unit: &str| match unit {
        "deg" | "deg/deg" => std::f64::consts::PI / 180.0,
        "mrad" | "mrad/(N m)" => 1e-3,
        // Of what is hidden in rad for a mm.
        "deg/m" => std::f64::consts::PI / 180e3,
        _ => 1.0,
    };
    // A ratio of angles is the same number in degrees and radians.
    if hidden.unit == "rad/rad" {
        return 1.0;
    }
    factor(found.unit.as_deref().unwrap_or(&hidden.unit)) / factor(&hidden.unit)
}

fn size_error(found: &Candidate, hidden: &Hidden) -> Option<f64> {
    // How far lost steps put a joint off is not known beforehand.
    if hidden.size == 0.0 {
        return None;
    }
    let scale = to_unit_of(hidden, found);
    let (size, se) = (found.size? * scale, found.se? * scale);
    (se > 0.0).then(|| (size - hidden.size) / se)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth() -> Truth {
        let hidden = Hidden {
            effect: "joint_backlash".into(),
            site: "elbow".into(),
            size: 1e-3,
            unit: "rad".into(),
            over_noise: 3.0,
            visible_over_noise: 2.5,
            standard_errors: 40.0,
            details: serde_json::Map::new(),
        };
        Truth {
            seed: 1,
            effects: vec![("joint_backlash".into(), "elbow".into())],
            accept_verdict: vec![Verdict::Named, Verdict::Located, Verdict::Tied],
            grow: false,
            hidden: vec![hidden],
            noise: 0.05,
            outlier_rows: Vec::new(),
        }
    }

    fn score(diagnosis: &str) -> Score {
        Score::of(&serde_json::from_str(diagnosis).unwrap(), &truth())
    }

    #[test]
    fn the_right_name_is_right_and_its_size_is_compared_in_its_errors() {
        let score = score(
            r#"{"verdict": "named", "named": {"effect": "joint_backlash", "where": "elbow", "size": 0.0582958, "unit": "deg", "se": 0.001}}"#,
        );
        assert!(score.right && score.site_right && !score.false_name);
        assert!((score.size_error_over_se.unwrap() - 1.0).abs() < 1e-3, "{score:?}");
    }

    #[test]
    fn a_wrong_name_at_the_right_joint_is_wrong_but_well_placed() {
        let score = score(r#"{"verdict": "named", "named": {"effect": "joint_settling", "where": "elbow"}}"#);
        assert!(score.verdict_right && !score.right && score.false_name && score.site_right);
    }

    #[test]
    fn a_tie_is_right_when_the_truth_is_in_it() {
        let tie = |effect: &str| {
            score(&format!(
                r#"{{"verdict": "tied", "tied": [{{"effect": "{effect}", "where": "elbow"}}, {{"effect": "drift", "where": "base"}}]}}"#
            ))
        };
        assert!(tie("joint_backlash").right);
        assert!(!tie("joint_gain").right);
    }

    #[test]
    fn a_site_is_right_when_it_is_the_hidden_one() {
        let located = |site: &str| {
            score(&format!(r#"{{"verdict": "located", "located": {{"where": "{site}", "family": []}}}}"#))
        };
        assert!(located("elbow").right && !located("waist").right);
    }

    #[test]
    fn growing_is_right_when_it_adds_just_what_is_hidden() {
        let grown = |effects: &[&str]| {
            let steps: Vec<String> = effects
                .iter()
                .map(|effect| format!(r#"{{"added": {{"effect": "{effect}", "where": "elbow"}}}}"#))
                .collect();
            score(&format!(r#"{{"verdict": "at_floor", "steps": [{}]}}"#, steps.join(", "))).right
        };
        assert!(grown(&["joint_backlash"]));
        assert!(!grown(&["joint_backlash", "joint_gain"]) && !grown(&["joint_gain"]));
    }

    #[test]
    fn nothing_seen_is_right_where_what_is_hidden_is_said_not_to_show_at_such_a_size() {
        let message = |unseen: &str| score(&format!(r#"{{"verdict": "at_floor", "not_shown": [{unseen}]}}"#));
        assert!(
            message(r#"{"effect": "joint_backlash", "where": "elbow", "size": null, "unit": "deg"}"#).right
        );
        assert!(
            message(r#"{"effect": "joint_backlash", "where": "elbow", "size": 0.05, "unit": "deg"}"#).right
        );
        assert!(
            !message(r#"{"effect": "joint_backlash", "where": "elbow", "size": 0.03, "unit": "deg"}"#).right
        );
        assert!(
            !message(r#"{"effect": "joint_backlash", "where": "waist", "size": null, "unit": "deg"}"#).right
        );
    }

    #[test]
    fn seeing_nothing_is_wrong_when_something_can_be_seen() {
        assert!(!score(r#"{"verdict": "at_floor"}"#).right);
    }
}
