//! The base is elsewhere in the frame of the measurements.

use nalgebra::DMatrix;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::tool_offset::length_of;
use super::{Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Site, Size, Unit};

#[derive(Debug)]
struct BasePosition {
    parameters: [Parameter; 3],
}

impl Effect for BasePosition {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Nothing
    }

    fn contribute(&self, _: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        contributions.extend((0..3).map(|axis| Contribution {
            parameter: axis,
            dof: Dof::BaseShift(axis),
            rate: 1.0,
        }));
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        length_of(values, covariance)
    }
}

pub(super) const KIND: Kind = Kind {
    name: "base_position",
    family: Family::Geometry,
    sites: SiteKind::Base,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The base is elsewhere than the model says.",
    how_to_see: "Any poses; turns of the first joint tell it from a displaced target.",
    sketch: ["    ╎     ┃", "    ╎     ┃", "  ╌╌┴╌╌ →━┻━━ stands here"],
    build: |_: &Setting<'_>| {
        let parameters =
            // A metre: beyond that the base was measured in another frame.
            ["x_mm", "y_mm", "z_mm"].map(|name| Parameter::new(name, Unit::MM, (-1000.0, 1000.0)));
        Ok(Box::new(BasePosition { parameters }))
    },
    candidates: |context| match context.model.base.free {
        // A base that is free moves anyhow.
        true => Vec::new(),
        false => vec![EffectId::at("base_position", Site::Base)],
    },
};
