//! A target was taken off and put back between two stretches of rows.

use super::epoch_steps::{EpochSteps, Step};
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Dof, EffectId, Site, Unit};

/// Greatest plausible shift of a target that is put back where it was, mm.
const MOST: f64 = 50.0;

pub(super) const KIND: Kind = Kind {
    name: "target_reset",
    family: Family::Epoch,
    sites: SiteKind::Targets,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: true,
    search: Search::Nothing,
    driven_by: DrivenBy::RowOrder,
    sentence: "The target sat elsewhere on the flange from some row on: it was re-seated.",
    how_to_see: "Poses that turn the wrist into many directions, before and after.",
    sketch: ["  ━━━━┓ before", "      ╵○ → • put back", "           elsewhere"],
    build: |setting: &Setting<'_>| {
        let target = setting.target()?;
        let steps = ["x_mm", "y_mm", "z_mm"].into_iter().enumerate().map(|(axis, name)| Step {
            dof: Dof::Target(target, axis),
            rate: 1.0,
            name,
            unit: Unit::MM,
            most: MOST,
        });
        let steps = steps.collect();
        Ok(Box::new(EpochSteps::new(setting, steps, 3)?))
    },
    candidates: |context| match context.model.epoch_count() {
        // In a single epoch it sat where it sits.
        0 | 1 => Vec::new(),
        _ => {
            let targets = 0..context.model.targets.len();
            targets.map(|target| EffectId::at("target_reset", Site::Target(target))).collect()
        }
    },
};
