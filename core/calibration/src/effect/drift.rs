//! The base, or the instrument, creeps in time.

use nalgebra::DMatrix;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::tool_offset::length_of;
use super::{Contribution, Dof, Effect, EffectId, Parameter, Sample, Site, Size, Unit};

#[derive(Debug)]
struct Drift {
    parameters: [Parameter; 3],
}

impl Effect for Drift {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // Rates in the hours that people read; a steady creep, for nobody knows its law.
        let hours = if sample.time.is_finite() { sample.time / 3600.0 } else { 0.0 };
        contributions.extend((0..3).map(|axis| Contribution {
            parameter: axis,
            dof: Dof::BaseShift(axis),
            rate: hours,
        }));
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        Size { unit: Unit::MM_PER_HOUR.name, ..length_of(values, covariance) }
    }
}

pub(super) const KIND: Kind = Kind {
    name: "drift",
    family: Family::LinkAndTime,
    sites: SiteKind::Base,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Time,
    sentence: "The base (or the instrument) creeps steadily in time.",
    how_to_see: "One pose again and again through the day, with the time logged.",
    sketch: ["            ╱╱", "      ╱╱╱╱╱", "  ╱╱╱╱  with time"],
    build: |_: &Setting<'_>| {
        // 50 mm an hour is a clamp that slips.
        let parameters = ["x_mm_per_h", "y_mm_per_h", "z_mm_per_h"]
            .map(|name| Parameter::new(name, Unit::MM_PER_HOUR, (-50.0, 50.0)));
        Ok(Box::new(Drift { parameters }))
    },
    candidates: |context| match context.summary.time_span {
        // Without a span of time a creep is a base that is elsewhere.
        Some(span) if span > 0.0 => vec![EffectId::at("drift", Site::Base)],
        _ => Vec::new(),
    },
};
