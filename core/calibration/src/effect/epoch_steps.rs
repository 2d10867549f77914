//! What effects by epoch share: some numbers of their own in every epoch but the first, with which they are compared.

use nalgebra::DMatrix;

use super::kind::{Family, Setting};
use super::{Contribution, Dof, Effect, EffectNameError, Parameter, Sample, Size, Unit, standard_error};

/// A number that changes from epoch to epoch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Step {
    /// What it moves.
    pub(super) dof: Dof,
    /// Unit of the degree of freedom per unit of the number.
    pub(super) rate: f64,
    /// The end of its name: `mm`, `x_mm`.
    pub(super) name: &'static str,
    /// Its unit.
    pub(super) unit: Unit,
    /// Greatest plausible change, internal unit.
    pub(super) most: f64,
}

/// An effect of some numbers, each anew in every epoch but the first.
#[derive(Debug)]
pub(super) struct EpochSteps {
    steps: Vec<Step>,
    /// How many of the first numbers of an epoch make up the effect's size: those of one unit.
    counted: usize,
    parameters: Vec<Parameter>,
}

/// Whether an effect has numbers of its own in every epoch.
pub fn acts_by_epoch(name: &str) -> bool {
    super::kind(name).is_some_and(|kind| kind.family == Family::Epoch)
}

impl EpochSteps {
    /// These numbers in every epoch of a model, of which the first `counted` make up the size.
    ///
    /// # Errors
    /// The model has but one epoch.
    pub(super) fn new(
        setting: &Setting<'_>,
        steps: Vec<Step>,
        counted: usize,
    ) -> Result<Self, EffectNameError> {
        let epochs = setting.model.epoch_count();
        if epochs < 2 {
            return Err(setting.unusable(
                "needs rows among which something was re-set: say so under `epochs:`, or in a column `session`",
            ));
        }
        let parameters = (2..=epochs).flat_map(|epoch| {
            steps.iter().map(move |step| {
                Parameter::new(&format!("epoch_{epoch}_{}", step.name), step.unit, (-step.most, step.most))
            })
        });
        let parameters = parameters.collect();
        Ok(Self { parameters, steps, counted })
    }
}

impl Effect for EpochSteps {
    /// One parameter a number and epoch, epoch by epoch.
    fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// What moves in a row: nothing in the first epoch.
    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>) {
        let Some(before) = sample.epoch.checked_sub(1) else { return };
        let first = before * self.steps.len();
        // An epoch that the model does not know.
        if first + self.steps.len() > self.parameters.len() {
            return;
        }
        contributions.extend(self.steps.iter().enumerate().map(|(index, step)| Contribution {
            parameter: first + index,
            dof: step.dof,
            rate: step.rate,
        }));
    }

    /// The greatest change between two epochs in a row, by the counted numbers of each: its length, with the error of that.
    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        let unit = self.parameters.first().map_or(Unit::RATIO, |parameter| parameter.unit);
        let width = self.steps.len();
        let mut greatest = (0.0, f64::INFINITY);
        for epoch in 0..values.len() / width.max(1) {
            // How the length changes with each value: the change against the epoch before.
            let own = values.get(epoch * width..).unwrap_or(&[]);
            // The first epoch has no values: all others are given relative to it, and it is zero.
            let zeros = vec![0.0; width];
            let before =
                epoch.checked_sub(1).and_then(|before| values.get(before * width..)).unwrap_or(&zeros);
            let change: Vec<f64> =
                own.iter().zip(before).take(self.counted).map(|(now, before)| now - before).collect();
            let length = change.iter().map(|part| part * part).sum::<f64>().sqrt();
            // Of equal changes the last is reported; a change of no length still has an error.
            if length < greatest.0 {
                continue;
            }
            let mut slope = vec![0.0; values.len()];
            for (index, part) in change.iter().enumerate() {
                let fraction = if length > 0.0 { part / length } else { 1.0 };
                slope[epoch * width + index] += fraction;
                if let Some(before) = epoch.checked_sub(1) {
                    slope[before * width + index] -= fraction;
                }
            }
            // A number that these rows do not determine (its variance is exactly zero) may have changed by as much as those they do.
            let first = epoch * width;
            let variances =
                (first..first + self.counted).map(|index| covariance.get((index, index)).copied());
            let undetermined =
                variances.filter(|variance| variance.is_none_or(|variance| variance <= 0.0)).count();
            let unseen = if undetermined > 0 { length } else { 0.0 };
            let error =
                if undetermined == self.counted { f64::INFINITY } else { error_along(&slope, covariance) };
            greatest = (length, error.hypot(unseen));
        }
        let (value, error) = greatest;
        Size { value: value * unit.factor, unit: unit.name, error: error * unit.factor }
    }
}

/// The standard error of a linear function of some values.
fn error_along(slope: &[f64], covariance: &DMatrix<f64>) -> f64 {
    let mut variance = 0.0;
    for (row, left) in slope.iter().enumerate() {
        for (column, right) in slope.iter().enumerate() {
            variance += left * right * covariance.get((row, column)).copied().unwrap_or(0.0);
        }
    }
    standard_error(variance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two numbers of one unit in each of two epochs after the first.
    fn steps() -> EpochSteps {
        let step = |name| Step { dof: Dof::BaseShift(0), rate: 1.0, name, unit: Unit::MM, most: 9.0 };
        let parameter = |name: &str| Parameter::new(name, Unit::MM, (-9.0, 9.0));
        let parameters = ["a", "b", "c", "d"].map(parameter).to_vec();
        EpochSteps { steps: vec![step("x_mm"), step("y_mm")], counted: 2, parameters }
    }

    #[test]
    fn the_size_is_the_greatest_change_with_its_error_and_what_is_undetermined_is_not_zero() {
        let size = |variances: [f64; 4]| {
            steps().size(&[3.0, 4.0, 3.0, 4.0], &DMatrix::from_diagonal(&variances.to_vec().into()))
        };
        let known = size([0.01; 4]);
        assert!((known.value - 5.0).abs() < 1e-12 && (known.error - 0.1).abs() < 1e-12, "{known:?}");
        assert!(
            (size([0.01, 0.0, 0.01, 0.01]).error - 5.0_f64.hypot(0.06)).abs() < 1e-12,
            "one part is undetermined"
        );
        assert_eq!(size([0.0, 0.0, 0.01, 0.01]).error, f64::INFINITY);
    }

    #[test]
    fn a_change_of_nothing_is_known_as_well_as_both_of_its_epochs() {
        // From zeros to zeros: two numbers of either epoch, each known to 0.1.
        let none = steps().size(&[0.0; 4], &DMatrix::from_diagonal_element(4, 4, 0.01));
        assert!(none.value == 0.0 && (none.error - 0.2).abs() < 1e-12, "{none:?}");
        // The second epoch moved by more than the first: 5 against 1, and by the errors of both.
        let second = steps().size(&[1.0, 0.0, 4.0, 4.0], &DMatrix::from_diagonal_element(4, 4, 0.01));
        assert!(
            (second.value - 5.0).abs() < 1e-12 && (second.error - 0.02_f64.sqrt()).abs() < 1e-12,
            "{second:?}"
        );
    }
}
