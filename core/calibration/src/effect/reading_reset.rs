//! The zero of a reading was set anew between two stretches of rows.

use super::epoch_steps::{EpochSteps, Step};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Dof, EffectId, Site, Unit};

/// Greatest plausible change of a zero: the travel of a gauge, mm; what a level may be turned by, rad.
const MOST_MM: f64 = 200.0;
const MOST_RAD: f64 = 0.2;

pub(super) const KIND: Kind = Kind {
    name: "reading_reset",
    family: Family::Epoch,
    sites: SiteKind::Readings,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: true,
    search: Search::Nothing,
    driven_by: DrivenBy::RowOrder,
    sentence: "The zero of one reading changed at some row: the instrument was switched off, re-zeroed or knocked.",
    how_to_see: "A fixed point read again after every pause, whatever the arm does.",
    sketch: ["  reads ──╮  ╭── 0 moved", "          ╰──╯", "  rows  1   2   3"],
    build: |setting: &Setting<'_>| {
        let Site::Reading(channel) = setting.id.site else {
            return Err(setting.unusable("needs a reading, such as distance"));
        };
        let (name, unit, most) = match channel.is_length() {
            true => ("mm", Unit::MM, MOST_MM),
            false => ("deg", Unit::DEG, MOST_RAD),
        };
        let step = Step { dof: Dof::ReadingZero(channel), rate: 1.0, name, unit, most };
        Ok(Box::new(EpochSteps::new(setting, vec![step], 1)?))
    },
    candidates: |context| match context.model.epoch_count() {
        // In a single epoch nothing was set anew.
        0 | 1 => Vec::new(),
        _ => context
            .summary
            .channels
            .iter()
            .map(|channel| EffectId::at("reading_reset", Site::Reading(*channel)))
            .collect(),
    },
};
