//! The instrument that should be level does not.

use nalgebra::{DMatrix, Vector3};

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::tool_offset::length_of;
use super::{Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Site, Size, Unit};
use crate::arm_model::MeasuredFrom;

#[derive(Debug)]
struct InstrumentTilt {
    parameters: [Parameter; 2],
}

impl Effect for InstrumentTilt {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        for (parameter, axis) in [Vector3::x(), Vector3::y()].into_iter().enumerate() {
            // A small turn about the instrument's own origin, from where it reads.
            let moved = axis.cross(&sample.point);
            contributions.extend((0..3).map(|part| Contribution {
                parameter,
                dof: Dof::Reading(part),
                rate: moved[part],
            }));
        }
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Point
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        let size = length_of(values, covariance);
        Size {
            value: size.value * Unit::DEG.factor,
            unit: Unit::DEG.name,
            error: size.error * Unit::DEG.factor,
        }
    }
}

pub(super) const KIND: Kind = Kind {
    name: "instrument_tilt",
    family: Family::Instrument,
    sites: SiteKind::Instrument,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The instrument is out of level.",
    how_to_see: "A spirit level on the instrument; with the base fixed, poses all around the arm.",
    sketch: ["     ╱▔╲ the instrument", "    ╱  ╱ leans", "  ━┻━━┻━━━"],
    build: |_: &Setting<'_>| {
        // 6 degrees: no instrument is set up that far out of level.
        let parameters = ["x_deg", "y_deg"].map(|name| Parameter::new(name, Unit::DEG, (-0.1, 0.1)));
        Ok(Box::new(InstrumentTilt { parameters }))
    },
    candidates: |context| match context.model.measured_from {
        // An instrument that may be anywhere has no level to be out of: its tilt is the base's.
        MeasuredFrom::World if context.summary.measures_points => {
            vec![EffectId::at("instrument_tilt", Site::Instrument)]
        }
        _ => Vec::new(),
    },
};
