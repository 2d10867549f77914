//! A slide's carriage pitches as it goes: its guideway is bowed upright.

use super::guideway::{Guideway, Turn, candidates};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};

pub(super) const KIND: Kind = Kind {
    name: "axis_pitch",
    family: Family::Geometry,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The carriage of a slide pitches as it goes (ISO 230-1: EBX, with EZX): its guideway is bowed up or down.",
    how_to_see: "Positions over the whole travel, high and low above the guideway.",
    sketch: ["         ▱ lifts", "  ▭    ╱", "  ━━━━━ bowed upright"],
    build: |setting: &Setting<'_>| Ok(Box::new(Guideway::new(setting, Turn::Pitch, "pitch_deg_per_m")?)),
    candidates: |context| candidates(context, "axis_pitch"),
};
