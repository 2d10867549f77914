//! How noisy each kind of reading is, and who says so.

use serde::Serialize;

use super::observations::Observations;
use crate::arm_model::Model;
use crate::reading_unit::ReadingUnit;

/// Who says how noisy a kind of reading is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoiseSource {
    /// The model file's `noise:`, or the table's `std_*`.
    Declared,
    /// The scatter that a fit leaves in these readings, beside that of the others.
    Estimated,
    /// Nobody.
    Unknown,
}

/// The noise of the readings that fraction one key of `noise:`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadingNoise {
    /// The key: `p1_mm`, `tilt_deg`.
    pub reading: String,
    /// Root mean square of their sigmas, in `unit`; 1 mm or 1 rad where nobody knows it.
    pub sigma: f64,
    /// The unit of `sigma`.
    pub unit: ReadingUnit,
    /// Who says so.
    pub source: NoiseSource,
}

/// Equations whose readings have one noise.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct NoiseGroup {
    /// Their key of `noise:`.
    pub(crate) key: String,
    /// Whether their sigmas were declared.
    pub(crate) is_declared: bool,
    /// Whether they are in mm (else rad).
    pub(crate) is_length: bool,
    /// Their indices among all equations.
    pub(crate) equations: Vec<usize>,
}

impl Observations {
    /// The equations by the noise their readings have, in the order of first appearance. Rows that declare a sigma of their
    /// own are apart from those that do not.
    pub(crate) fn noise_groups(&self, model: &Model) -> Vec<NoiseGroup> {
        let mut groups: Vec<NoiseGroup> = Vec::new();
        for (index, equation) in self.equations.iter().enumerate() {
            let what = equation.measurand;
            let key = what.kind.noise_key(model, what);
            let is_declared = equation.is_declared;
            match groups.iter_mut().find(|group| group.key == key && group.is_declared == is_declared) {
                Some(group) => group.equations.push(index),
                None => groups.push(NoiseGroup {
                    key,
                    is_declared,
                    is_length: what.is_length(),
                    equations: vec![index],
                }),
            }
        }
        groups
    }

    /// The noise of every kind of reading in the table.
    pub fn noise(&self, model: &Model) -> Vec<ReadingNoise> {
        self.noise_groups(model).iter().map(|group| self.noise_of(model, group)).collect()
    }

    fn noise_of(&self, model: &Model, group: &NoiseGroup) -> ReadingNoise {
        let sigmas = group.equations.iter().filter_map(|index| self.equations.get(*index));
        // Rows may declare sigmas of their own: their root mean square is reported.
        let squares: f64 = sigmas.map(|equation| equation.sigma.powi(2)).sum();
        let sigma = (squares / group.equations.len().max(1) as f64).sqrt();
        let source = match (group.is_declared, model.noise.estimated_of(&group.key)) {
            (true, _) => NoiseSource::Declared,
            (false, Some(_)) => NoiseSource::Estimated,
            (false, None) => NoiseSource::Unknown,
        };
        let unit = ReadingUnit::of(group.is_length);
        ReadingNoise { reading: group.key.clone(), sigma: sigma * unit.factor(), unit, source }
    }
}
