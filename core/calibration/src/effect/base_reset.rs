//! Base or instrument was set up anew between two stretches of rows.

use super::epoch_steps::{EpochSteps, Step};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Dof, EffectId, Site, Unit};

/// Farthest an instrument is taken from one place to the next, mm.
const MOST_MM: f64 = 2e4;

pub(super) const KIND: Kind = Kind {
    name: "base_reset",
    family: Family::Epoch,
    sites: SiteKind::Base,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: true,
    search: Search::Nothing,
    driven_by: DrivenBy::RowOrder,
    sentence: "The base, or the instrument, was set up anew at some row: shifted and turned as one.",
    how_to_see: "Three fixed points of the cell read after every pause.",
    sketch: ["    △ →    ◁ set up", "   before   anew", "  ━━━━━━━━━━━━━"],
    build: |setting: &Setting<'_>| {
        let shifts = ["x_mm", "y_mm", "z_mm"].into_iter().enumerate().map(|(axis, name)| Step {
            dof: Dof::BaseShift(axis),
            rate: 1.0,
            name,
            unit: Unit::MM,
            most: MOST_MM,
        });
        // An instrument may be put down any way round.
        let turns = ["x_deg", "y_deg", "z_deg"].into_iter().enumerate().map(|(axis, name)| Step {
            dof: Dof::BaseRotation(axis),
            rate: 1.0,
            name,
            unit: Unit::DEG,
            most: std::f64::consts::PI,
        });
        Ok(Box::new(EpochSteps::new(setting, shifts.chain(turns).collect(), 3)?))
    },
    candidates: |context| match context.model.epoch_count() {
        0 | 1 => Vec::new(),
        _ => vec![EffectId::at("base_reset", Site::Base)],
    },
};
