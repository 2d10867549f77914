//! Uncertainty budgets by the GUM (JCGM 100:2008): what the uncertainty of a value is made of.

use serde::{Deserialize, Serialize};

/// A sensitivity smaller than this changes the value by nothing that anybody can read (unit of the value per unit of the component).
const NO_EFFECT: f64 = 1e-9;

/// What the uncertainty of one value is made of. The components are independent of each other; two values that fraction a component
/// (the same name) are correlated by it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Budget {
    /// The input quantities that are not known exactly.
    pub components: Vec<Component>,
}

/// One input quantity of a [`Budget`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Component {
    /// What it is, in words: `line B off its distance`.
    pub name: String,
    /// Where its size comes from: the cell file, an instrument, this run.
    pub source: String,
    /// One standard uncertainty, in `unit`; none where it was not determined.
    pub standard: Option<f64>,
    /// Its own unit: `mm`, `deg`.
    pub unit: String,
    /// Change of the value for a change of this quantity by one unit: the partial derivative (GUM 5.1.3), unit of the value per `unit`.
    pub sensitivity: f64,
}

impl Component {
    /// What it contributes to the uncertainty, with the sign of its sensitivity, in the unit of the value; none where it was not determined.
    pub fn contribution(&self) -> Option<f64> {
        self.standard.map(|standard| standard * self.sensitivity)
    }

    /// Whether the value depends on it.
    fn matters(&self) -> bool {
        self.sensitivity.abs() > NO_EFFECT
    }
}

impl Budget {
    /// A budget of one component, known in the unit of the value itself.
    pub fn of_one(name: &str, source: &str, standard: Option<f64>, unit: &str) -> Self {
        let component = Component {
            name: name.to_owned(),
            source: source.to_owned(),
            standard,
            unit: unit.to_owned(),
            sensitivity: 1.0,
        };
        Self { components: vec![component] }
    }

    /// The combined standard uncertainty (GUM 5.1.2, independent components). None where a component that matters was not determined,
    /// and where nothing contributes: no value is known exactly.
    pub fn standard(&self) -> Option<f64> {
        let complete = self.not_determined().next().is_none();
        Some(self.at_least()).filter(|sum| complete && sum.is_finite() && *sum > 0.0)
    }

    /// The combined standard uncertainty of the components that were determined.
    pub fn at_least(&self) -> f64 {
        let squares = self.components.iter().filter_map(Component::contribution).map(|one| one * one);
        squares.sum::<f64>().sqrt()
    }

    /// The components that matter and were not determined.
    pub fn not_determined(&self) -> impl Iterator<Item = &Component> {
        self.components.iter().filter(|one| one.standard.is_none() && one.matters())
    }

    /// The covariance with another value, from the components both have (GUM F.1.2.3).
    fn covariance(&self, other: &Self) -> f64 {
        let shared = self.components.iter().filter_map(|mine| {
            let theirs = other.components.iter().find(|theirs| theirs.name == mine.name)?;
            Some(mine.contribution()? * theirs.contribution()?)
        });
        shared.sum()
    }

    /// The correlation coefficient with another value, -1 to 1; none where either was not determined.
    pub fn correlation(&self, other: &Self) -> Option<f64> {
        Some(self.covariance(other) / (self.standard()? * other.standard()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn component(name: &str, standard: Option<f64>, sensitivity: f64) -> Component {
        Component {
            name: name.to_owned(),
            source: "test".to_owned(),
            standard,
            unit: "mm".to_owned(),
            sensitivity,
        }
    }

    #[test]
    fn contributions_are_combined_in_quadrature() {
        let budget =
            Budget { components: vec![component("a", Some(3.0), 1.0), component("b", Some(2.0), -2.0)] };
        assert_eq!(budget.standard(), Some(5.0));
    }

    #[test]
    fn what_was_not_determined_leaves_the_sum_open_unless_it_changes_nothing() {
        let mut budget =
            Budget { components: vec![component("a", Some(3.0), 1.0), component("b", None, 0.5)] };
        assert_eq!((budget.standard(), budget.at_least()), (None, 3.0));
        let open: Vec<&str> = budget.not_determined().map(|one| one.name.as_str()).collect();
        assert_eq!(open, ["b"]);
        budget.components[1].sensitivity = 0.0;
        assert_eq!(budget.standard(), Some(3.0));
    }

    #[test]
    fn an_uncertainty_is_never_nothing() {
        assert_eq!(Budget::default().standard(), None);
        assert_eq!(Budget { components: vec![component("a", Some(0.0), 1.0)] }.standard(), None);
        assert_eq!(Budget { components: vec![component("a", Some(f64::INFINITY), 1.0)] }.standard(), None);
    }

    #[test]
    fn values_that_share_a_component_are_correlated_by_it() {
        let first =
            Budget { components: vec![component("lever", Some(1.0), 3.0), component("a", Some(4.0), 1.0)] };
        let second =
            Budget { components: vec![component("lever", Some(1.0), -3.0), component("b", Some(4.0), 1.0)] };
        assert_eq!(first.correlation(&second), Some(-9.0 / 25.0));
        assert_eq!(first.correlation(&first), Some(1.0));
    }
}
