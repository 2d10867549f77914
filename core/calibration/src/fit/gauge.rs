//! Freedoms the data cannot see: named, and left where they were.

use nalgebra::DMatrix;

use super::residual_model::ResidualModel;
use super::state::Slot;
use plumb_estimation::RankRevealingCholesky;

/// A free number that changes nothing that was measured, or nothing that others would not change just so.
#[derive(Debug, Clone, PartialEq)]
pub struct Gauge {
    /// The number that was left where it was.
    pub held: String,
    /// What it cannot be told from, the strongest first; empty if it changes nothing at all.
    pub same_as: Vec<String>,
}

impl ResidualModel<'_> {
    /// What a slot is called.
    pub fn slot_name(&self, slot: Slot) -> String {
        let axis = |axis: usize| ["x", "y", "z"].get(axis).copied().unwrap_or("?");
        match slot {
            Slot::BaseShift(part) => format!("base {}", axis(part)),
            Slot::BaseTurn(part) => format!("base turn about {}", axis(part)),
            Slot::Target(target, part) => {
                let name = self.model.targets.get(target).map_or("target", |target| target.name.as_str());
                format!("{name} {}", axis(part))
            }
            Slot::TargetTurn(target, part) => {
                let name = self.model.targets.get(target).map_or("target", |target| target.name.as_str());
                format!("{name} turn about {}", axis(part))
            }
            Slot::BoardShift(part) => format!("board {}", axis(part)),
            Slot::BoardTurn(part) => format!("board turn about {}", axis(part)),
            Slot::Place(place, part) => {
                let name = self.observations.places.get(place).map_or("place", String::as_str);
                format!("{name} {}", axis(part))
            }
            Slot::Surface(surface, which) => {
                let name =
                    self.model.surfaces.get(surface).map_or("surface", |surface| surface.name.as_str());
                format!("{name} ({})", which + 1)
            }
            Slot::Effect(effect, parameter) => {
                let Some(part) = self.parts.get(effect) else { return "?".to_owned() };
                let label = self.model.label(&part.id);
                match part.effect.parameters() {
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
        let name =
            |index: usize| self.slots.get(index).map_or_else(|| "?".to_owned(), |slot| self.slot_name(*slot));
        let gauge = |column: &usize| {
            let mut parts = factor.combination(matrix, *column);
            parts.retain(|(_, share)| share.abs() > 0.05);
            parts.sort_by(|left, right| right.1.abs().total_cmp(&left.1.abs()));
            Gauge {
                held: name(*column),
                same_as: parts.into_iter().take(4).map(|(index, _)| name(index)).collect(),
            }
        };
        factor.dependent.iter().map(gauge).collect()
    }
}
