//! A joint lags behind its motor by half its play, towards where it came from.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, Parameter, Sample, Unit};

#[derive(Debug)]
struct JointBacklash {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for JointBacklash {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // The motor drives the flank it came on: coming from below the joint stays half the play behind, from above half ahead
        // (Nordin and Gutman 2002, Controlling mechanical systems with backlash).
        contributions.push(sample.contribute_to_joint(self.joint, 0, -0.5 * sample.side_or_way(self.joint)));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_backlash",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    // The same pose reached from the other side is off by the whole play.
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::WayOfArrival,
    sentence: "The joint has play: it stops short, towards where it came from.",
    how_to_see: "The same poses reached from both sides, with `approach_q<n>` 1 where the coordinate grew on the way and -1 where it fell; without that column the way from the row before counts.",
    sketch: ["   ┃╲ ╱┃   the tooth", "   ┃ ▼ ┃   lies left or", "   → ← gap  right"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        // A joint with play stays behind. A controller that takes out more play than there is makes it go too far, so the sign is open.
        let parameter = match setting.slides(joint) {
            false => Parameter::new("play_deg", Unit::DEG, (-0.1, 0.1)),
            true => Parameter::new("play_mm", Unit::MM, (-10.0, 10.0)),
        };
        Ok(Box::new(JointBacklash { joint, parameters: [parameter] }))
    },
    candidates: |context| {
        let mut ids = context.every_joint("joint_backlash");
        ids.retain(|id| id.joint().is_some_and(|joint| context.summary.came_both_ways(joint)));
        ids
    },
};
