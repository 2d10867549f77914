//! A slide's carriage yaws as it goes: its guideway is bowed sideways.

use super::guideway::{Guideway, Turn, candidates};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};

pub(super) const KIND: Kind = Kind {
    name: "axis_yaw",
    family: Family::Geometry,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The carriage of a slide yaws as it goes (ISO 230-1: ECX, with EYX): its guideway is bowed sideways.",
    how_to_see: "Positions over the whole travel, with the axis across it at both ends of its own.",
    sketch: ["         ▱ seen from", "  ▭    ╱   above", "  ━━━━━ bowed sideways"],
    build: |setting: &Setting<'_>| Ok(Box::new(Guideway::new(setting, Turn::Yaw, "yaw_deg_per_m")?)),
    candidates: |context| candidates(context, "axis_yaw"),
};
