//! The scale of a reading changed between two stretches of rows.

use super::epoch_steps::{EpochSteps, Step};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Dof, EffectId, Site, Unit};

/// Greatest plausible change of a scale: more would be another unit.
const MOST: f64 = 0.05;

pub(super) const KIND: Kind = Kind {
    name: "reading_rescaled",
    family: Family::Epoch,
    sites: SiteKind::Readings,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: true,
    search: Search::Nothing,
    driven_by: DrivenBy::RowOrder,
    sentence: "The scale of one reading changed at some row: another setting, another instrument.",
    how_to_see: "Two fixed points far apart read again after every pause.",
    sketch: ["  reads ├──┼──┼──┤", "  later ├───┼───┼───┤", "  another scale"],
    build: |setting: &Setting<'_>| {
        let Site::Reading(channel) = setting.id.site else {
            return Err(setting.unusable("needs a reading, such as distance"));
        };
        let dof = Dof::ReadingScale(channel);
        let step = Step { dof, rate: 1.0, name: "excess", unit: Unit::RATIO, most: MOST };
        Ok(Box::new(EpochSteps::new(setting, vec![step], 1)?))
    },
    candidates: |context| match context.model.epoch_count() {
        0 | 1 => Vec::new(),
        _ => {
            // The scale of an angle is a whole turn: no instrument loses it.
            let lengths = context.summary.channels.iter().filter(|channel| channel.is_length());
            lengths.map(|channel| EffectId::at("reading_rescaled", Site::Reading(*channel))).collect()
        }
    },
};
