//! Names that can be added: the effects of the library at the arm's joints. `Tab` completes what has been written.

use plumb_calibration::effect::{SiteKind, kinds};

use super::state::ModelSummary;

/// Every name that could be meant, the judged candidates first.
fn names(summary: Option<&ModelSummary>) -> Vec<String> {
    let cards = summary.into_iter().flat_map(|summary| summary.cards.iter().map(|card| card.key.clone()));
    let joints =
        || summary.into_iter().flat_map(|summary| summary.joints.iter().map(|joint| joint.name.as_str()));
    let mut all: Vec<String> = cards.collect();
    all.push("geometry(*)".to_owned());
    for kind in kinds() {
        let name = kind.name;
        match kind.sites {
            SiteKind::Joints => {
                all.push(format!("{name}(*)"));
                all.extend(joints().map(|joint| format!("{name}({joint})")));
            }
            SiteKind::JointsAndOrder
            | SiteKind::JointsAndPieces
            | SiteKind::JointPairs
            | SiteKind::JointsAndQuantity => {
                all.extend(joints().map(|joint| format!("{name}({joint}, ")));
            }
            SiteKind::Targets => all.push(format!("{name}(p")),
            SiteKind::Axes => all.extend(["x", "y", "z"].map(|axis| format!("{name}({axis})"))),
            SiteKind::Surfaces | SiteKind::Readings => all.push(format!("{name}(")),
            SiteKind::Base | SiteKind::Instrument | SiteKind::Sensor => all.push(name.to_owned()),
        }
    }
    let mut seen = std::collections::HashSet::new();
    all.retain(|name| seen.insert(name.clone()));
    all
}

/// The names that begin with what has been written; where none does, those that have a word which begins with it, as `joint_backlash` of `back`.
pub(super) fn matching(summary: Option<&ModelSummary>, written: &str) -> Vec<String> {
    let all = names(summary);
    let (mut begin, others): (Vec<String>, Vec<String>) =
        all.into_iter().partition(|name| name.starts_with(written));
    if begin.is_empty() {
        let later = format!("_{written}");
        begin = others.into_iter().filter(|name| name.contains(&later)).collect();
    }
    begin
}

/// What has been written, completed as far as all names that are meant agree.
pub(super) fn completed(summary: Option<&ModelSummary>, written: &str) -> String {
    let found = matching(summary, written);
    let Some(first) = found.first() else { return written.to_owned() };
    let agree = |length: &usize| found.iter().all(|name| name.get(..*length) == first.get(..*length));
    let length = (0..=first.len()).rev().find(agree).unwrap_or(0);
    let common = first.get(..length).unwrap_or_default();
    // Of names that begin differently nothing is certain.
    if common.contains(written) { common.to_owned() } else { written.to_owned() }
}

#[cfg(test)]
mod tests {
    use plumb_diagnosis::laboratory::JointAxis;

    use super::*;

    fn arm() -> ModelSummary {
        let joints = ["pan", "lift"].map(|name| JointAxis { name: name.to_owned(), unit: "deg" });
        ModelSummary { joints: joints.into(), ..ModelSummary::default() }
    }

    #[test]
    fn a_name_is_completed_as_far_as_it_is_certain() {
        let arm = arm();
        assert_eq!(completed(Some(&arm), "joint_st"), "joint_st", "joint_step and joint_stiffening");
        assert_eq!(completed(Some(&arm), "joint_sti"), "joint_stiffening(");
        assert_eq!(completed(Some(&arm), "joint_stiffening(l"), "joint_stiffening(lift)");
        assert_eq!(completed(Some(&arm), "geo"), "geometry(*)");
        assert_eq!(completed(Some(&arm), "nonsense"), "nonsense");
        assert_eq!(completed(None, "base_t"), "base_tilt");
        assert_eq!(completed(Some(&arm), "backl"), "joint_backlash(", "no name begins with it");
        assert_eq!(completed(Some(&arm), "backlash(l"), "joint_backlash(lift)");
        assert_eq!(completed(None, "tilt"), "tilt", "of the base, the instrument or the sensor");
    }

    #[test]
    fn every_effect_of_the_library_can_be_completed() {
        for kind in kinds() {
            assert!(!matching(Some(&arm()), kind.name).is_empty(), "{}", kind.name);
        }
    }
}
