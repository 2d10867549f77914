//! A joint's axis leans in the plane of the link before it: Hayati's parameter, which the four of Denavit and Hartenberg
//! lack at parallel axes.

use plumb_kinematics::DhParameter;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::row_error::RowError;
use super::{Parameter, Unit};

pub(super) const KIND: Kind = Kind {
    name: "axis_skew",
    family: Family::Geometry,
    sites: SiteKind::Joints,
    geometry_group: true,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The joint's axis leans in the plane of the link before it, so that nominally parallel axes are not.",
    how_to_see: "Wide turns of the joint, at several angles of the one before.",
    sketch: ["    ╎ ╱ the axis leans", "    ╎╱", "  ━━◯━━━━"],
    build: |setting: &Setting<'_>| {
        let parameter = Parameter::new("skew_deg", Unit::DEG, (-0.1, 0.1));
        Ok(Box::new(RowError::new(setting, DhParameter::Beta, parameter)?))
    },
    candidates: |context| context.every_joint("axis_skew"),
};
