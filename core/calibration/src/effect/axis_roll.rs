//! A slide's carriage rolls about its travel as it goes: its guideway is twisted.

use super::guideway::{Guideway, Turn, candidates};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};

pub(super) const KIND: Kind = Kind {
    name: "axis_roll",
    family: Family::Geometry,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The carriage of a slide rolls as it goes (ISO 230-1: EAX): its guideway is twisted.",
    how_to_see: "Positions over the whole travel with the axes beyond it at both ends of theirs: a point far from the guideway shows it.",
    sketch: ["  ━━▭━━━━━━ level", "       ↻", "  ━━━━━━▱━━ rolls over"],
    build: |setting: &Setting<'_>| Ok(Box::new(Guideway::new(setting, Turn::Roll, "roll_deg_per_m")?)),
    candidates: |context| candidates(context, "axis_roll"),
};
