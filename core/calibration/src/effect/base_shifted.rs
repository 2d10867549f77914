//! Base or instrument was shifted along one axis between two stretches of rows.

use super::epoch_steps::{EpochSteps, Step};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Dof, EffectId, Site, Unit};

/// Greatest plausible shift of what is not taken away and set up anew, mm.
const MOST: f64 = 200.0;

pub(super) const KIND: Kind = Kind {
    name: "base_shifted",
    family: Family::Epoch,
    sites: SiteKind::Axes,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: true,
    search: Search::Nothing,
    driven_by: DrivenBy::RowOrder,
    sentence: "The base was shifted against the instrument along one axis at some row: its foot, or the anchor of a wire.",
    how_to_see: "A fixed point of the cell read after every pause.",
    sketch: ["  ╌╌◯   ◯ ← anchor", "    ╎ → ┃   or foot", "  before after"],
    build: |setting: &Setting<'_>| {
        let Site::Axis(axis) = setting.id.site else {
            return Err(setting.unusable("needs an axis: x, y or z"));
        };
        // Along the axes of the measurements, in which a wire or a foot is moved.
        let dof = Dof::BaseShift(axis);
        let step = Step { dof, rate: 1.0, name: "mm", unit: Unit::MM, most: MOST };
        Ok(Box::new(EpochSteps::new(setting, vec![step], 1)?))
    },
    candidates: |context| match context.model.epoch_count() {
        0 | 1 => Vec::new(),
        // Of measured points a shift along one axis is the zero of that coordinate.
        _ if context.summary.measures_points => Vec::new(),
        _ => (0..3).map(|axis| EffectId::at("base_shifted", Site::Axis(axis))).collect(),
    },
};
