//! A coordinate of a target, as an instrument that sees points gives it.
//!
//! Equation: `z = e_axis . p`, where `p = R (F t) + o + s` is the target `t` carried by the flange `F`, seen from the base
//! (`R`, `o`) and shifted by what the instrument adds (`s`). Gradient: the axis itself. (Mooring, Roth and Driels,
//! Fundamentals of Manipulator Calibration, 1991, chapter 4.)

use nalgebra::Vector3;

use super::error::ObservationsError;
use super::kind::{Equation, Measurand, MeasurementKind, Prediction, RowContext, Subject};
use super::row::RowReader;
use crate::arm_model::Model;
use crate::effect::Channel;
use crate::table::Table;

/// Positions of targets: columns `p1_x_mm ...`, with `std_x_mm ...` for a row's own sigma.
#[derive(Debug)]
pub(super) struct Position;

impl MeasurementKind for Position {
    fn name(&self) -> &'static str {
        "position"
    }

    fn channel(&self, what: Measurand) -> Option<Channel> {
        [Channel::X, Channel::Y, Channel::Z].get(what.axis()).copied()
    }

    fn columns(&self) -> &'static str {
        "p1_x_mm ..."
    }

    fn coordinate(&self, what: Measurand) -> Option<usize> {
        Some(what.axis())
    }

    fn noise_key(&self, model: &Model, what: Measurand) -> String {
        let name = model.targets.get(what.index()).map_or("p?", |target| target.name.as_str());
        format!("{name}_mm")
    }

    fn seen_target(&self, what: Measurand) -> Option<usize> {
        Some(what.index())
    }

    fn check(&self, model: &Model, table: &Table) -> Result<(), ObservationsError> {
        let unknown = table.positions.iter().find(|columns| model.target_position(&columns.target).is_none());
        unknown.map_or(Ok(()), |columns| {
            Err(ObservationsError::UnknownTarget {
                table: table.source.clone(),
                target: columns.target.clone(),
            })
        })
    }

    fn read(&self, row: &RowReader<'_>, equations: &mut Vec<Equation>) -> Result<(), ObservationsError> {
        let std = row.table.std.as_ref().and_then(|std| std.get(row.row)).copied().unwrap_or([f64::NAN; 3]);
        for columns in &row.table.positions {
            let Some(target) = row.model.target_position(&columns.target) else { continue };
            let declared = row.model.noise.of_position(&columns.target);
            let xyz = columns.xyz.get(row.row).copied().unwrap_or([f64::NAN; 3]);
            for (axis, (value, std)) in (0_u8..).zip(xyz.into_iter().zip(std)) {
                if value.is_finite() {
                    let sigma = sigma_of(std, declared);
                    equations.push(Equation::new(self.of(target, axis), value, sigma));
                }
            }
        }
        Ok(())
    }

    fn subject(&self, _model: &Model, what: Measurand) -> Subject {
        Subject::Target(what.index())
    }

    fn predict(&self, what: Measurand, context: &RowContext<'_>) -> Prediction {
        let axis = Vector3::ith(what.axis(), 1.0);
        Prediction::of_point(context.point.dot(&axis), axis)
    }
}

impl Position {
    fn of(&self, target: usize, component: u8) -> Measurand {
        Measurand { kind: &Self, index: target as u32, component }
    }
}

/// A row's sigma: what it gives itself, but not less than the model declares; else what the model declares.
fn sigma_of(std: f64, declared: Option<f64>) -> Option<f64> {
    // An instrument that claims less than the model knows of it is not believed.
    if std.is_finite() { Some(std.max(declared.unwrap_or(0.0))) } else { declared }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rows_own_sigma_counts_but_not_below_the_declared_one() {
        assert_eq!(sigma_of(0.2, Some(0.1)), Some(0.2));
        assert_eq!(sigma_of(0.05, Some(0.1)), Some(0.1));
        assert_eq!(sigma_of(0.05, None), Some(0.05));
        assert_eq!(sigma_of(f64::NAN, Some(0.1)), Some(0.1));
        assert_eq!(sigma_of(f64::NAN, None), None);
    }
}
