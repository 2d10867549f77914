//! A link is longer or shorter than its drawing says.

use plumb_kinematics::DhParameter;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::row_error::RowError;
use super::{Parameter, Unit};

pub(super) const KIND: Kind = Kind {
    name: "link_length",
    family: Family::Geometry,
    sites: SiteKind::Joints,
    geometry_group: true,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Coordinate,
    sentence: "The link between this joint's axis and the next is longer or shorter than the model says.",
    how_to_see: "Poses that turn the joints before and after the link through wide angles.",
    sketch: ["  ◯━━━━━━━━━━━◯ built", "  ◯╌╌╌╌╌╌╌╌◯ drawn", "            ←→"],
    build: |setting: &Setting<'_>| {
        let parameter = Parameter::new("length_mm", Unit::MM, (-20.0, 20.0));
        Ok(Box::new(RowError::new(setting, DhParameter::A, parameter)?))
    },
    candidates: |context| context.every_joint("link_length"),
};
