//! The base stands turned against the frame of the measurements.

use nalgebra::DMatrix;

use super::registry::{Family, Kind, Places, Search, Setting};
use super::tool_offset::length_of;
use super::{Drive, Effect, EffectId, Handle, Parameter, Situation, Size, Spot, Unit};

#[derive(Debug)]
struct BaseTilt {
    parameters: [Parameter; 3],
}

impl Effect for BaseTilt {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn drive(&self, _: &Situation<'_>, drives: &mut Vec<Drive>) {
        drives.extend((0..3).map(|axis| Drive {
            parameter: axis,
            handle: Handle::BaseTurn(axis),
            rate: 1.0,
        }));
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
    name: "base_tilt",
    family: Family::Geometry,
    places: Places::Base,
    geometry_group: false,
    depends_on_conditions: false,
    search: Search::Nothing,
    sentence: "The base stands turned or tilted against the frame of the measurements.",
    how_to_see: "Poses all around the arm.",
    build: |_: &Setting<'_>| {
        let parameters =
            ["x_deg", "y_deg", "z_deg"].map(|name| Parameter::new(name, Unit::DEG, (-0.35, 0.35)));
        Ok(Box::new(BaseTilt { parameters }))
    },
    candidates: |survey| match survey.model.base.free {
        true => Vec::new(),
        false => vec![EffectId::at("base_tilt", Spot::Base)],
    },
};
