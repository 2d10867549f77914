//! The arm's own sensor sits askew in the hand: it looks aside, the further the higher it is.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Site, Unit};

#[derive(Debug)]
struct SensorTilt {
    parameters: [Parameter; 2],
}

impl Effect for SensorTilt {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Point
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let Some(trigger) = sample.trigger else { return };
        // A look that leans by a small angle meets what is `distance` ahead so much aside, along the hand's own x and y.
        for (parameter, direction) in sample.hand.column_iter().take(2).enumerate() {
            contributions.extend(direction.iter().enumerate().map(|(axis, part)| Contribution {
                parameter,
                dof: Dof::Reading(axis),
                rate: part * trigger.distance,
            }));
        }
    }
}

pub(super) const KIND: Kind = Kind {
    name: "sensor_tilt",
    family: Family::Sensor,
    sites: SiteKind::Sensor,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The sensor sits askew in the hand: it looks aside by so much of its distance.",
    how_to_see: "Meet edges at several heights of the hand, and trigger over the table with the hand tilted: at one height it is the same as a sensor that sits elsewhere.",
    sketch: ["      ▷ leans", "     ╱", "  ━━━━━━━━"],
    build: |setting: &Setting<'_>| {
        setting.sensor()?;
        // 20 degrees: further aside it does not see what is below the hand.
        let parameters = ["x_deg", "y_deg"].map(|name| Parameter::new(name, Unit::DEG, (-0.35, 0.35)));
        Ok(Box::new(SensorTilt { parameters }))
    },
    candidates: |context| match context.model.sensor.is_some() && context.summary.triggers {
        true => vec![EffectId::at("sensor_tilt", Site::Sensor)],
        false => Vec::new(),
    },
};
