//! A surface is lighter or darker than the one the sensor was trimmed on: it switches higher or lower over it.

use super::EffectNameError;
use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Site, Unit};
use crate::arm_model::SurfaceShape;
use crate::arm_model::{Model, Sensor};

#[derive(Debug)]
struct Reflectance {
    surface: usize,
    sensor: Sensor,
    parameters: [Parameter; 1],
}

impl Effect for Reflectance {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Point
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // To first order: where light falls by `k` of itself a mm, a surface that sends back a fraction more is seen as much further away.
        if sample.trigger.is_some_and(|trigger| trigger.surface == self.surface) {
            contributions.push(Contribution {
                parameter: 0,
                dof: Dof::Trigger,
                rate: 1.0 / self.sensor.falls_off(),
            });
        }
    }
}

/// Whether a surface sends light back from an area: an edge is met beside it, a point has none.
fn reflects(model: &Model, surface: usize) -> bool {
    model.surfaces.get(surface).is_some_and(|surface| {
        matches!(surface.shape, SurfaceShape::Plane { .. } | SurfaceShape::Sphere { .. })
    })
}

pub(super) const KIND: Kind = Kind {
    name: "reflectance",
    family: Family::Sensor,
    sites: SiteKind::Surfaces,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The surface is lighter or darker than the white the sensor was trimmed on: it triggers higher or lower over it.",
    how_to_see: "Trigger over this surface and over another of known height from the same poses of the hand; over one surface alone it is the sensor's trigger height.",
    sketch: ["     ▽", "    ╱ ╲ less comes back", "  ▒▒▒▒▒▒▒▒"],
    build: |setting: &Setting<'_>| {
        let sensor = setting.sensor()?;
        match setting.id.site {
            Site::Surface(surface) if reflects(setting.model, surface) => Ok(Box::new(Reflectance {
                surface,
                sensor,
                parameters: [Parameter::new("lighter_by", Unit::RATIO, (-0.6, 0.6))],
            })),
            _ => Err(EffectNameError::Unusable {
                effect: setting.model.label(setting.id),
                reason: "needs a plane or a ball of the model's `surfaces:` to act on".to_owned(),
            }),
        }
    },
    candidates: |context| {
        let mut flat = context.summary.triggered_on.clone();
        flat.retain(|surface| reflects(context.model, *surface));
        // Over one surface alone a lighter one is the sensor's own height.
        match context.model.sensor.is_some() && flat.len() > 1 {
            true => {
                flat.into_iter().map(|surface| EffectId::at("reflectance", Site::Surface(surface))).collect()
            }
            false => Vec::new(),
        }
    },
};
