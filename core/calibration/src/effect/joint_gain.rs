//! A joint turns a little more or less than commanded: a wrong gear ratio, a slipping drive, a stretched scale.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Effect, Parameter, Sample, Unit};

#[derive(Debug)]
struct JointGain {
    joint: usize,
    parameters: [Parameter; 1],
}

impl Effect for JointGain {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // Of the commanded coordinate, counted from its zero: a gain about another place is a gain and a zero.
        contributions.push(sample.contribute_to_joint(self.joint, 0, sample.coordinate(self.joint)));
    }

    fn changes_coordinate(&self) -> Option<usize> {
        Some(self.joint)
    }
}

pub(super) const KIND: Kind = Kind {
    name: "joint_gain",
    family: Family::Joint,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: false,
    // Over a short range any smooth error is a zero and a gain.
    imitates_anything: true,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Coordinate,
    sentence: "The joint turns in proportion more or less than commanded.",
    how_to_see: "Poses from one end of the joint's travel to the other.",
    sketch: ["says 0   30   60   90", "     ┼────┼────┼────┤", "is   0    31    62    93"],
    build: |setting: &Setting<'_>| {
        // 5 %: a wrong gear ratio is further off, and its row says so at once.
        let parameters = [Parameter::new("gain", Unit::RATIO, (-0.05, 0.05))];
        Ok(Box::new(JointGain { joint: setting.joint()?, parameters }))
    },
    candidates: |context| context.every_joint("joint_gain"),
};
