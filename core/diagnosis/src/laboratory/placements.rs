//! Where bodies, cameras, the board and the base were found, and how sure that is.

use nalgebra::{Rotation3, Vector3};
use plumb_calibration::fit::{FreeParameter, ResidualModel};
use plumb_calibration::measurement::{Measurand, ReadingUnit};
use plumb_calibration::table::quaternion;
use serde::Serialize;

use super::point_errors::ErrorSummary;
use super::standard_errors::StandardErrors;

/// Where something sits, and how sure that is.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Placement {
    /// What: `p1`, `board`, `base`.
    pub name: String,
    /// In whose frame: `flange` or `measurements`.
    pub frame: &'static str,
    /// mm.
    pub xyz_mm: [f64; 3],
    /// One standard error of each; nothing where it is not fitted, or cannot be determined.
    pub se_mm: [Option<f64>; 3],
    /// Roll, pitch and yaw: Rz(yaw) Ry(pitch) Rx(roll).
    pub rpy_deg: [f64; 3],
    /// The same as a unit quaternion: w, x, y, z.
    pub quaternion: [f64; 4],
    /// One standard error of the turn about each axis of that frame; nothing where it is not fitted, or cannot be determined.
    pub se_deg: [Option<f64>; 3],
}

impl StandardErrors<'_> {
    fn placement(
        &self,
        (name, frame): (&str, &'static str),
        (xyz, rotation): (Vector3<f64>, Rotation3<f64>),
        (shift, turned): (impl Fn(usize) -> FreeParameter, impl Fn(usize) -> FreeParameter),
    ) -> Placement {
        let (roll, pitch, yaw) = rotation.euler_angles();
        Placement {
            name: name.to_owned(),
            frame,
            xyz_mm: xyz.into(),
            se_mm: [0, 1, 2].map(|axis| self.error_of(shift(axis))),
            rpy_deg: [roll, pitch, yaw].map(f64::to_degrees),
            quaternion: quaternion(&rotation),
            se_deg: [0, 1, 2].map(|axis| self.error_of(turned(axis)).map(f64::to_degrees)),
        }
    }
}

/// Where the bodies whose orientation was measured, the camera or the laser line sensor, and the board are, and the base where it is free; nothing of a table without orientations.
pub(super) fn placements(errors: &StandardErrors<'_>) -> Vec<Placement> {
    let StandardErrors { problem, fit, .. } = errors;
    let (model, state) = (problem.model, &fit.state);
    let bodies = problem.seen_bodies();
    let line_sensor = model.profile_sensor.filter(|_| !problem.table.profiles.is_empty());
    if bodies.is_empty() && !problem.table.sees_a_board() && line_sensor.is_none() {
        return Vec::new();
    }
    // A pose is reported only of what an orientation, a board or profiles were read of: of a bare point the turn is not known.
    let mut seen: Vec<usize> = bodies.iter().map(|body| body.target(problem)).collect();
    let boards = problem.boards_named();
    seen.extend(boards.iter().filter_map(|board| model.boards.get(*board)).map(|board| board.camera));
    seen.extend(line_sensor);
    let mut found = Vec::new();
    for (index, target) in model.targets.iter().enumerate().filter(|(index, _)| seen.contains(index)) {
        let xyz = state.targets.get(index).copied().unwrap_or(target.xyz);
        let rotation = state.rotations.get(index).copied().unwrap_or(target.rotation);
        let free_parameters = (
            move |axis| FreeParameter::Target(index, axis),
            move |axis| FreeParameter::TargetRotation(index, axis),
        );
        found.push(errors.placement((&target.name, "flange"), (xyz, rotation), free_parameters));
    }
    for (index, board) in boards.iter().filter_map(|index| Some((*index, state.boards.get(*index)?))) {
        let pose = (board.translation.vector, board.rotation);
        let free_parameters = (
            move |axis| FreeParameter::BoardShift(index, axis),
            move |axis| FreeParameter::BoardRotation(index, axis),
        );
        found.push(errors.placement((model.board_name(index), "measurements"), pose, free_parameters));
    }
    if model.base.free {
        let pose = (state.base.translation.vector, state.base.rotation);
        found.push(errors.placement(
            ("base", "measurements"),
            pose,
            (FreeParameter::BaseShift, FreeParameter::BaseRotation),
        ));
    }
    found
}

/// Whether a reading's error is shown as an angle besides the others.
fn is_angle(what: Measurand, beside_lengths: bool) -> bool {
    what.kind.is_orientation() || (beside_lengths && !what.is_length())
}

/// How far measured orientations, and any other angles beside lengths, are off in some rows, degrees; nothing if none was measured.
pub(super) fn orientation_errors(
    problem: &ResidualModel<'_>,
    residuals: &[f64],
    rows: &[usize],
) -> Option<ErrorSummary> {
    let beside_lengths = problem.observations.unit() == ReadingUnit::Mm;
    ErrorSummary::of(rows.iter().flat_map(|row| {
        let own = residuals.get(problem.observations.range(*row)).unwrap_or(&[]);
        let equations = problem.observations.of_row(*row).iter().zip(own);
        let mut squares: Vec<((&str, u32), f64)> = Vec::new();
        for (equation, residual) in equations.filter(|(one, _)| is_angle(one.measurand, beside_lengths)) {
            let key = (equation.measurand.kind.name(), equation.measurand.index);
            // Three small turns about perpendicular axes add as a vector: their squares make the square of the angle.
            let square = residual.to_degrees().powi(2);
            match squares.iter_mut().find(|(known, _)| *known == key) {
                Some((_, sum)) => *sum += square,
                None => squares.push((key, square)),
            }
        }
        squares.into_iter().map(|(_, square)| square)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positions and orientations of a body on the planar arm, with noise of 0.1 mm and 0.05 deg an axis.
    fn tracked(rows: usize, base_free: bool) -> crate::laboratory::Laboratory {
        let lines = format!("free: []\nbase: {{xyz_mm: [0, 0, 0], free: {base_free}}}\n");
        let model = crate::testing::TWO_LINKS
            .replace("base: {xyz_mm: [0, 0, 0], free: false}\n", &lines)
            .replace("xyz_mm: [0, 0, 0], free: false}}", "free: true, free_rpy: true}}");
        let mut random = plumb_estimation::Random::seeded(17);
        let mut text = "q1_deg,q2_deg,p1_x_mm,p1_y_mm,p1_z_mm,p1_rx_deg,p1_ry_deg,p1_rz_deg\n".to_owned();
        for row in 0..rows {
            let q = [7.0 * row as f64 % 90.0 - 40.0, 13.0 * row as f64 % 70.0];
            let (first, both) = (q[0].to_radians(), (q[0] + q[1]).to_radians());
            let x = 200.0 * first.cos() + 180.0 * both.cos() + 20.0 * both.sin();
            let y = 200.0 * first.sin() + 180.0 * both.sin() - 20.0 * both.cos();
            let [x, y, z] = [x, y, 10.0].map(|part| part + 0.1 * random.normal());
            let [rx, ry, rz] = [0.0, 0.0, q[0] + q[1] + 25.0].map(|part| part + 0.05 * random.normal());
            text.push_str(&format!("{},{},{x},{y},{z},{rx},{ry},{rz}\n", q[0], q[1]));
        }
        let model = plumb_calibration::arm_model::Model::parse("m.yaml", &model).unwrap();
        let table = plumb_calibration::table::Table::parse("t.csv", &text).unwrap();
        let holdout = crate::split::Holdout::None;
        let options = crate::laboratory::Options { holdout, ..Default::default() };
        crate::laboratory::Laboratory::new(model, table, options).unwrap()
    }

    #[test]
    fn a_body_is_placed_with_errors_that_fall_with_the_root_of_the_rows() {
        let lab = tracked(36, false);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let found = placements(&StandardErrors::of_the_fit(&fitted.problem, &fitted.fit));
        assert_eq!(found.len(), 1, "the base is held");
        let body = &found[0];
        assert_eq!((body.name.as_str(), body.frame), ("p1", "flange"));
        for axis in 0..3 {
            let (xyz, rpy) = ([30.0, -20.0, 10.0][axis], [0.0, 0.0, 25.0][axis]);
            let (mm, deg) = (body.se_mm[axis].unwrap(), body.se_deg[axis].unwrap());
            // Six times as sure as one row of 36.
            assert!(
                (mm / (0.1 / 6.0) - 1.0).abs() < 0.3 && (deg / (0.05 / 6.0) - 1.0).abs() < 0.3,
                "{body:?}"
            );
            assert!((body.xyz_mm[axis] - xyz).abs() < 4.0 * mm, "{body:?}");
            assert!((body.rpy_deg[axis] - rpy).abs() < 4.0 * deg, "{body:?}");
        }
        let half = (12.5_f64.to_radians().cos(), 12.5_f64.to_radians().sin());
        assert!(
            (body.quaternion[0].abs() - half.0).abs() < 1e-3
                && (body.quaternion[3].abs() - half.1).abs() < 1e-3
        );
        // Three turns of 0.05 deg make an angle.
        let rows: Vec<usize> = (0..36).collect();
        let errors = orientation_errors(&fitted.problem, &fitted.fit.residuals, &rows).unwrap();
        assert!(
            errors.points == 36 && (errors.rms / (0.05 * 3.0_f64.sqrt()) - 1.0).abs() < 0.15,
            "{errors:?}"
        );
        let lab = crate::testing::two_links(6, "", 0.05, 31, |_| [0.0; 2]);
        let plain = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        assert!(placements(&lab.standard_errors(&plain)).is_empty(), "of a bare point the turn is not known");
        assert_eq!(orientation_errors(&plain.problem, &plain.fit.residuals, &[0, 1]), None);
    }

    #[test]
    fn what_cannot_be_distinguished_has_no_standard_error() {
        // On a planar arm the body's height and the base's are one number.
        let lab = tracked(36, true);
        let fitted = lab.fit_with(&[], None, &plumb_estimation::Progress::unwatched()).unwrap();
        let found = placements(&StandardErrors::of_the_fit(&fitted.problem, &fitted.fit));
        assert_eq!(found.iter().map(|one| one.name.as_str()).collect::<Vec<_>>(), ["p1", "base"]);
        let known = |axis: usize| found.iter().filter(|one| one.se_mm[axis].is_some()).count();
        assert_eq!([known(0), known(1), known(2)], [2, 2, 1], "{found:?}");
    }
}
