//! The arm's own sensor sees a spot, not a point: at an edge it switches before its middle is there.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Site, Unit};
use crate::arm_model::Sensor;

#[derive(Debug)]
struct TriggerSpot {
    sensor: Sensor,
    parameters: [Parameter; 1],
}

impl Effect for TriggerSpot {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Point
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // Over something flat the whole spot sees the same.
        let Some(trigger) = sample.trigger.filter(|trigger| trigger.edge) else { return };
        let early = self.sensor.early(trigger.came_on, trigger.distance, self.sensor.hysteresis);
        // A spot that is wider by a mm has a radius that is larger by half of one.
        contributions.push(Contribution { parameter: 0, dof: Dof::Edge, rate: trigger.light * 0.5 * early });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "trigger_spot",
    family: Family::Sensor,
    sites: SiteKind::Sensor,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The sensor sees a wider spot than the model says: it meets an edge when part of the spot has gone dark, before its middle is there.",
    how_to_see: "Meet the same edge at several heights of the hand, and from the dark side as well: at one height it is the same as an edge that lies elsewhere.",
    sketch: ["     ▽", "    ( ) half the spot", "  ████━━━━ over the edge"],
    build: |setting: &Setting<'_>| {
        // 12 mm: a wider spot would not resolve an edge at all.
        let parameters = [Parameter::new("wider_by_mm", Unit::MM, (-12.0, 12.0))];
        Ok(Box::new(TriggerSpot { sensor: setting.sensor()?, parameters }))
    },
    candidates: |context| match context.model.sensor.is_some()
        && context.summary.triggers_at_edges(context.model)
    {
        true => vec![EffectId::at("trigger_spot", Site::Sensor)],
        false => Vec::new(),
    },
};
