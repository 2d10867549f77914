//! A joint turns a little more or less than commanded: a wrong gear ratio, a slipping drive, a stretched scale.

use super::coordinate_change::coordinate_change;
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Parameter, Unit};

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
        let gain = Parameter::new("gain", Unit::RATIO, (-0.05, 0.05));
        // Of the commanded coordinate, counted from its zero: a gain about another position is a gain and a zero.
        coordinate_change(setting, gain, |sample, joint| sample.coordinate(joint))
    },
    candidates: |context| context.every_joint("joint_gain"),
};
