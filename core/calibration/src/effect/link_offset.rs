//! A link sits shifted along its joint's axis.

use plumb_kinematics::DhParameter;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::row_error::RowError;
use super::{Parameter, Unit};

pub(super) const KIND: Kind = Kind {
    name: "link_offset",
    family: Family::Geometry,
    sites: SiteKind::Joints,
    geometry_group: true,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Coordinate,
    sentence: "The link is shifted along the joint's axis.",
    how_to_see: "Poses that tip the joint's axis into different directions.",
    sketch: ["   ━━◯╌╌╌ drawn", "     ┃ ↕", "     ◯━━━ built"],
    build: |setting: &Setting<'_>| {
        let parameter = Parameter::new("offset_mm", Unit::MM, (-20.0, 20.0));
        Ok(Box::new(RowError::new(setting, DhParameter::D, parameter)?))
    },
    candidates: |context| context.every_joint("link_offset"),
};
