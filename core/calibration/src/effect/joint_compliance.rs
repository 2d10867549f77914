//! A joint gives under the moment of gravity: a soft gear, shaft or belt.

use plumb_kinematics::Chain;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::link_torsion::links_along;
use super::{Contribution, Effect, LooksAt, Parameter, Sample, Unit};

#[derive(Debug)]
struct JointCompliance {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for JointCompliance {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // The moment is about the axis, and so is the deflection: the sense of the coordinate does not enter.
        contributions.push(sample.rotate_joint(self.joint, 0, sample.moment(self.joint)));
    }

    fn twin(&self, chain: &Chain) -> Option<String> {
        let name = |joint: usize| chain.joints.get(joint).map(|row| row.name.as_str());
        let links = links_along(chain, self.joint).into_iter().filter_map(name);
        let links: Vec<String> = links.map(|link| format!("link_torsion({link})")).collect();
        let axis = name(self.joint)?;
        let what = links.join(" and ");
        (!links.is_empty()).then(|| {
            format!("{what} would be the same, for that link lies along the axis of {axis}: no pose tells a joint that gives from a link that twists there")
        })
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Gravity
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_compliance",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Moment,
    sentence: "The joint gives under the weight it carries, in proportion to the moment about its axis.",
    how_to_see: "Poses with the arm stretched out and folded, with and without a load.",
    sketch: ["  ◯╌╌╌╌╌╌╌ unloaded", "   ╲ turns in the joint", "    ╲━━━━━▼ weight"],
    build: |setting: &Setting<'_>| {
        // 0.05 rad for a N m is a loose belt. A joint that turns against its load does not exist: the range begins at nothing.
        let parameters = [Parameter::new("compliance", Unit::COMPLIANCE, (0.0, 0.05))];
        Ok(Box::new(JointCompliance { joint: setting.joint()?, parameters }))
    },
    candidates: |context| match context.has_weight() {
        // A slide gives along its way as link_sag of what carries it.
        true => context.every_turning_joint("joint_compliance"),
        false => Vec::new(),
    },
};
