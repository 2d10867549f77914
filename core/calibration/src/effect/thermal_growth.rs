//! A link grows with temperature.

use plumb_kinematics::DhParameter;

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, Parameter, Sample, Unit};

#[derive(Debug)]
struct ThermalGrowth {
    joint: usize,
    length: f64,
    offset: f64,
    parameters: [Parameter; 1],
}

impl Effect for ThermalGrowth {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let warmer = sample.warmer_than_reference();
        // Lengths grow as they are long, and angles stay: dl = l alpha dT.
        let sizes = [(DhParameter::A, self.length), (DhParameter::D, self.offset)];
        contributions.extend(sizes.map(|(dh_parameter, size)| Contribution {
            parameter: 0,
            dof: Dof::Joint(self.joint, dh_parameter),
            rate: size * warmer,
        }));
    }
}

pub(super) const KIND: Kind = Kind {
    name: "thermal_growth",
    family: Family::LinkAndTime,
    sites: SiteKind::Joints,
    geometry_group: false,
    depends_on_conditions: true,
    imitates_anything: false,
    depends_on_time: true,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Temperature,
    sentence: "The link grows as it gets warmer.",
    how_to_see: "The same poses cold and warm, with the temperature logged.",
    sketch: ["  ◯━━━━━━━━━◯ cool", "  ◯━━━━━━━━━━━◯ warm", "             ←→"],
    build: |setting: &Setting<'_>| {
        let joint = setting.joint()?;
        let row = setting.model.chain.joints.get(joint);
        // A row of no length does not grow: its neighbours carry what is there.
        let (length, offset) = row.map_or((0.0, 0.0), |row| (row.a, row.d));
        // From nothing to 500e-6: steel has 12e-6, aluminium 23e-6, unfilled plastics up to 200e-6.
        let parameters = [Parameter::new("growth_per_k", Unit::GROWTH, (0.0, 5e-4))];
        Ok(Box::new(ThermalGrowth { joint, length, offset, parameters }))
    },
    candidates: |context| match context.summary.temperature_range {
        Some(range) if range > 0.0 => context.every_joint("thermal_growth"),
        _ => Vec::new(),
    },
};
