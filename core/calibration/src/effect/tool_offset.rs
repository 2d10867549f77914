//! The measured point sits elsewhere on the flange than the model says.

use super::kind::{DrivenBy, Family, Kind, Search, Setting, SiteKind};
use super::{
    Contribution, Dof, Effect, EffectId, LooksAt, Parameter, Sample, Site, Size, Unit, standard_error,
};
use nalgebra::DMatrix;

#[derive(Debug)]
struct ToolOffset {
    target: usize,
    parameters: [Parameter; 3],
}

impl Effect for ToolOffset {
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    fn looks_at(&self) -> LooksAt {
        LooksAt::Nothing
    }

    fn contribute(&self, _: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        contributions.extend((0..3).map(|axis| Contribution {
            parameter: axis,
            dof: Dof::Target(self.target, axis),
            rate: 1.0,
        }));
    }

    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        length_of(values, covariance)
    }
}

/// The length of a vector of shifts, mm. A component that the table cannot see (its variance is exactly zero beside others
/// that are not) may be as large as those it does see, and the error says so.
pub(super) fn length_of(values: &[f64], covariance: &DMatrix<f64>) -> Size {
    let value = values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let mut variance = 0.0;
    for (row, left) in values.iter().enumerate() {
        for (column, right) in values.iter().enumerate() {
            let entry = covariance.get((row, column)).copied().unwrap_or(0.0);
            variance += if value > 0.0 { left * right * entry / (value * value) } else { 0.0 };
        }
    }
    let variances: Vec<f64> =
        (0..values.len()).filter_map(|row| covariance.get((row, row)).copied()).collect();
    let seen = variances.iter().filter(|variance| **variance > 0.0).count();
    let unseen = if seen < values.len() { value } else { 0.0 };
    // Of shifts that are all zero the length has no slope: its error is that of the worst known component.
    let variance = if value > 0.0 { variance } else { variances.into_iter().fold(0.0, f64::max) };
    let error = if seen == 0 { f64::INFINITY } else { standard_error(variance).hypot(unseen) };
    Size { value, unit: "mm", error }
}

pub(super) const KIND: Kind = Kind {
    name: "tool_offset",
    family: Family::Geometry,
    sites: SiteKind::Targets,
    geometry_group: false,
    depends_on_conditions: false,
    imitates_anything: false,
    depends_on_time: false,
    is_event: false,
    search: Search::Nothing,
    driven_by: DrivenBy::Several,
    sentence: "The measured point sits elsewhere on the flange than the model says.",
    how_to_see: "Poses that turn the wrist into many directions.",
    sketch: ["  ━━━━┓", "      ┃ ←→", "      ╵  • the tip"],
    build: |setting: &Setting<'_>| {
        // 20 cm: a probe is not longer, and a tracker's ball not further from its magnet.
        let parameters = ["x_mm", "y_mm", "z_mm"].map(|name| Parameter::new(name, Unit::MM, (-200.0, 200.0)));
        Ok(Box::new(ToolOffset { target: setting.target()?, parameters }))
    },
    candidates: |context| {
        // What a light stripe sees does not depend on where a tool is.
        if context.summary.stripes {
            return Vec::new();
        }
        // A target that is free moves anyhow.
        let fixed = context.model.targets.iter().enumerate().filter(|(_, target)| !target.free);
        fixed.map(|(index, _)| EffectId::at("tool_offset", Site::Target(index))).collect()
    },
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_component_that_cannot_be_seen_widens_the_error_of_the_length() {
        let seen = |variances: [f64; 3]| {
            length_of(&[3.0, 4.0, 0.0], &DMatrix::from_diagonal(&variances.to_vec().into())).error
        };
        assert!((seen([0.01, 0.01, 0.01]) - 0.1).abs() < 1e-12);
        assert!(seen([0.01, 0.01, 0.0]) > 5.0);
    }
}
