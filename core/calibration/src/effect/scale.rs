//! The instrument's unit of length is off along one of its axes.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{Contribution, Dof, Effect, EffectId, EffectNameError, LooksAt, Parameter, Sample, Site, Unit};

#[derive(Debug)]
struct Scale {
    axis: usize,
    parameters: [Parameter; 1],
}

impl Effect for Scale {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        // From the instrument's own origin, which a scale leaves where it is.
        let coordinate = sample.point.get(self.axis).copied().unwrap_or(0.0);
        contributions.push(Contribution { parameter: 0, dof: Dof::Reading(self.axis), rate: coordinate });
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Point
    }
}

pub(super) const KIND: Kind = Kind {
    name: "scale",
    family: Family::Instrument,
    sites: SiteKind::Axes,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::InstrumentAxis,
    sentence: "The instrument reads lengths along one of its axes too long or too short.",
    how_to_see: "Points far apart along that axis, or a bar of known length.",
    sketch: ["  reads ├──┼──┼──┤", "  true  ├───┼───┼───┤", "  the ruler is short"],
    build: |setting: &Setting<'_>| match setting.id.site {
        // 2 %: a wrong unit is further off, and reported when the table is read.
        Site::Axis(axis) if axis < 3 => {
            Ok(Box::new(Scale { axis, parameters: [Parameter::new("excess", Unit::RATIO, (-0.02, 0.02))] }))
        }
        _ => Err(EffectNameError::Malformed { text: "scale".to_owned(), example: "scale(x)".to_owned() }),
    },
    candidates: |context| match context.summary.measures_points {
        true => (0..3).map(|axis| EffectId::at("scale", Site::Axis(axis))).collect(),
        false => Vec::new(),
    },
};
