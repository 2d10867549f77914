//! The arm's own sensor lets go at another light than the model says.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Site, Unit};
use crate::arm_model::Sensor;

#[derive(Debug)]
struct TriggerHysteresis {
    sensor: Sensor,
    parameters: [Parameter; 1],
}

/// Half the width of the difference quotients.
const SMALL: f64 = 1e-4;

impl Effect for TriggerHysteresis {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Point
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // Coming on it fires at its level, whatever it holds afterwards.
        let Some(trigger) = sample.trigger.filter(|trigger| !trigger.came_on) else { return };
        // Both are found by halving: a closed form of their slopes would have to follow every change of the sensor's law.
        let [less, more] = [-SMALL, SMALL].map(|by| {
            let hysteresis = self.sensor.hysteresis + by;
            match trigger.edge {
                true => {
                    trigger.light
                        * 0.5
                        * self.sensor.spot
                        * self.sensor.early(false, trigger.distance, hysteresis)
                }
                false => self.sensor.above(false, hysteresis),
            }
        });
        let dof = if trigger.edge { Dof::Edge } else { Dof::Trigger };
        contributions.push(Contribution { parameter: 0, dof, rate: (more - less) / (2.0 * SMALL) });
    }
}

pub(super) const KIND: Kind = Kind {
    name: "trigger_hysteresis",
    family: Family::Sensor,
    sites: SiteKind::Sensor,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The sensor holds on longer, or lets go earlier, than the model says.",
    how_to_see: "Let it come on and go off over one place, with `signal` logged, each time with every joint arriving from the same side as before: play looks the same.",
    sketch: ["  on   ┌────", "     ↑ │↓", "  off ─┘  not the same"],
    build: |setting: &Setting<'_>| {
        // Half of the light in addition to what the data sheet says.
        let parameters = [Parameter::new("more_by", Unit::RATIO, (-0.5, 0.5))];
        Ok(Box::new(TriggerHysteresis { sensor: setting.sensor()?, parameters }))
    },
    candidates: |context| match context.model.sensor.is_some() && context.summary.switches_both_ways {
        true => vec![EffectId::at("trigger_hysteresis", Site::Sensor)],
        false => Vec::new(),
    },
};
