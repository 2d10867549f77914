//! The arm's own sensor triggers higher or lower over a surface than the model says.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, EffectId, Parameter, Sample, Site, Unit};

#[derive(Debug)]
struct TriggerHeight {
    parameters: [Parameter; 1],
}

impl Effect for TriggerHeight {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, _: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // One height over every surface, at every edge none: there the spot counts.
        contributions.push(Contribution { parameter: 0, dof: Dof::Trigger, rate: 1.0 });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "trigger_height",
    family: Family::Sensor,
    sites: SiteKind::Sensor,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The sensor on the arm triggers higher or lower over a surface than the model says.",
    how_to_see: "Trigger over the surface in many poses, and lower the arm onto it in some with a gauge under the tip.",
    sketch: ["     ▽  sensor", "     ↕  fires too high", "  ━━━━━━━━ or too low"],
    build: |_: &Setting<'_>| {
        // 20 mm, more than the working distance of most such sensors.
        Ok(Box::new(TriggerHeight { parameters: [Parameter::new("above_mm", Unit::MM, (-20.0, 20.0))] }))
    },
    candidates: |context| match context.summary.triggers {
        true => vec![EffectId::at("trigger_height", Site::Sensor)],
        false => Vec::new(),
    },
};
