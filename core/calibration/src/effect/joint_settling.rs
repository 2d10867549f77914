//! A joint creeps into place: it stops short by a fraction of its last move.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, Parameter, Sample, Unit};

#[derive(Debug)]
struct JointSettling {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for JointSettling {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // What has not settled is a fraction of the way that it still had to go: an exponential approach, read at one time after each move.
        contributions.push(sample.contribute_to_joint(self.joint, 0, -sample.last_move(self.joint)));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_settling",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    // Two visits to one pose come after different moves.
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::LastMove,
    sentence: "The joint stops short by a fraction of its last move, as if it had not yet come to rest.",
    how_to_see: "The same poses after short and after long moves; a wait before reading.",
    sketch: ["  ──╮ asked", "     ╲", "      ╰─── creeps in"],
    build: |setting: &Setting<'_>| {
        // A twentieth of the way is seen by eye.
        let parameters = [Parameter::new("share", Unit::RATIO, (-0.05, 0.05))];
        Ok(Box::new(JointSettling { joint: setting.joint()?, parameters }))
    },
    candidates: |context| context.every_joint("joint_settling"),
};
