//! Freedoms the data cannot see: named, and left where they were.

use nalgebra::DMatrix;

use super::residual_model::ResidualModel;
use super::state::FreeParameter;
use plumb_estimation::RankRevealingCholesky;

/// A free number that changes nothing that was measured, or nothing that others would not change just so.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauge {
    /// The number that was left where it was.
    pub held: String,
    /// What it cannot be distinguished from, the strongest first; empty if it changes nothing at all.
    pub same_as: Vec<String>,
}

impl ResidualModel<'_> {
    /// What a free parameter is called.
    pub fn parameter_name(&self, free_parameter: FreeParameter) -> String {
        match free_parameter {
            FreeParameter::BaseShift(part) => format!("base {}", axis_name(part)),
            FreeParameter::BaseRotation(part) => format!("base rotation about {}", axis_name(part)),
            FreeParameter::Target(target, part) => {
                let name = self.model.targets.get(target).map_or("target", |target| target.name.as_str());
                format!("{name} {}", axis_name(part))
            }
            FreeParameter::TargetRotation(target, part) => {
                let name = self.model.targets.get(target).map_or("target", |target| target.name.as_str());
                format!("{name} rotation about {}", axis_name(part))
            }
            FreeParameter::BoardShift(board, part) => {
                format!("{} {}", self.model.board_name(board), axis_name(part))
            }
            FreeParameter::BoardRotation(board, part) => {
                format!("{} rotation about {}", self.model.board_name(board), axis_name(part))
            }
            FreeParameter::Place(index, part) => {
                let name = self.observations.places.get(index).map_or("place", String::as_str);
                format!("{name} {}", axis_name(part))
            }
            FreeParameter::Surface(surface, which) => {
                let name =
                    self.model.surfaces.get(surface).map_or("surface", |surface| surface.name.as_str());
                format!("{name} ({})", which + 1)
            }
            FreeParameter::Effect(effect, parameter) => {
                let Some(part) = self.parts.get(effect) else { return "?".to_owned() };
                let label = self.model.label(&part.id);
                match part.effect.parameters() {
                    // The only parameter is called by its effect.
                    [_] => label,
                    several => {
                        several.get(parameter).map_or(label.clone(), |one| format!("{label} {}", one.name))
                    }
                }
            }
        }
    }

    /// Names the dependent columns of the normal matrix.
    pub(crate) fn gauges(&self, matrix: &DMatrix<f64>, factor: &RankRevealingCholesky) -> Vec<Gauge> {
        factor
            .dependent
            .iter()
            .map(|column| self.gauge(factor.combination(matrix, *column), *column))
            .collect()
    }

    /// A dependent column as the parts that it is made of, each with its share.
    fn gauge(&self, mut parts: Vec<(usize, f64)>, column: usize) -> Gauge {
        parts.retain(|(_, fraction)| fraction.abs() > LEAST_SHARE);
        // What contributes most is named first.
        parts.sort_by(|left, right| right.1.abs().total_cmp(&left.1.abs()));
        let same_as =
            parts.into_iter().take(MOST_NAMED).map(|(index, _)| self.name_of_index(index)).collect();
        Gauge { held: self.name_of_index(column), same_as }
    }

    fn name_of_index(&self, index: usize) -> String {
        self.free_parameters
            .get(index)
            .map_or_else(|| "?".to_owned(), |free_parameter| self.parameter_name(*free_parameter))
    }
}

/// Least share of a combination that is named: what is less is rounding, or does not help anybody to see what is alike.
const LEAST_SHARE: f64 = 0.05;

/// Numbers that a message names at most as being alike.
const MOST_NAMED: usize = 4;

fn axis_name(axis: usize) -> &'static str {
    ["x", "y", "z"].get(axis).copied().unwrap_or("?")
}
