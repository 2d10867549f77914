//! Two axes are twisted against each other, about their common normal.

use plumb_kinematics::DhParameter;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::row_error::RowError;
use super::{Parameter, Unit};

pub(super) const KIND: Kind = Kind {
    name: "link_twist",
    family: Family::Geometry,
    sites: SiteKind::Joints,
    geometry_group: true,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Coordinate,
    sentence: "The next axis is twisted about the link's own length; of two slides: they are not square (ISO 230-1).",
    how_to_see: "Wide turns of the next joint, at several angles of this one.",
    sketch: ["  ╎ drawn   ╱ built", "  ◯━━━━━━━━◯", "           ╱"],
    build: |setting: &Setting<'_>| {
        let parameter = Parameter::new("twist_deg", Unit::DEG, (-0.1, 0.1));
        Ok(Box::new(RowError::new(setting, DhParameter::Alpha, parameter)?))
    },
    candidates: |context| context.every_joint("link_twist"),
};
