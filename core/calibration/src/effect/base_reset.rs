//! Base or instrument was set up anew between two stretches of rows.

use nalgebra::DMatrix;

use super::epoch_steps::{EpochSteps, Step};
use super::kind::{Family, Kind, Places, Search, Setting};
use super::{Drive, Effect, EffectId, Handle, Parameter, Situation, Size, Spot, Unit};

#[derive(Debug)]
struct BaseReset(EpochSteps);

impl Effect for BaseReset {
    fn parameters(&self) -> &[Parameter] {
        self.0.parameters()
    }

    fn drive(&self, situation: &Situation<'_>, drives: &mut Vec<Drive>) {
        self.0.drive(situation, drives);
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        self.0.size(values, covariance, 3)
    }
}

/// Farthest an instrument is taken from one place to the next, mm.
const MOST_MM: f64 = 2e4;

pub(super) const KIND: Kind = Kind {
    name: "base_reset",
    family: Family::Epoch,
    places: Places::Base,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: true,
    search: Search::Nothing,
    sentence: "The base, or the instrument, stood elsewhere from some row on: shifted and turned as one.",
    how_to_see: "Three fixed points of the cell read after every pause.",
    build: |setting: &Setting<'_>| {
        let along = |(axis, name)| Step {
            handle: Handle::BaseShift(axis),
            rate: 1.0,
            name,
            unit: Unit::MM,
            most: MOST_MM,
        };
        let about = |(axis, name)| Step {
            handle: Handle::BaseTurn(axis),
            rate: 1.0,
            name,
            unit: Unit::DEG,
            most: std::f64::consts::PI,
        };
        let shifts = ["x_mm", "y_mm", "z_mm"].into_iter().enumerate().map(along);
        let turns = ["x_deg", "y_deg", "z_deg"].into_iter().enumerate().map(about);
        Ok(Box::new(BaseReset(EpochSteps::new(setting, shifts.chain(turns).collect())?)))
    },
    candidates: |survey| match survey.model.epoch_count() {
        0 | 1 => Vec::new(),
        _ => vec![EffectId::at("base_reset", Spot::Base)],
    },
};
