//! The working volume: poses all over the places where the arm is to be right.

use std::ops::Range;

use nalgebra::{DMatrix, Point3};
use plumb_kinematics::LinkFrames;

use crate::joint_range::joint_range;
use crate::laboratory::{Laboratory, LaboratoryError};
use plumb_calibration::arm_model::SurfaceShape;
use plumb_calibration::arm_model::{AddedEffect, Model};
use plumb_calibration::effect::Effect;
use plumb_calibration::fit::{ResidualModel, State};
use plumb_calibration::measurement::Observations;
use plumb_calibration::table::{OrientationColumns, PositionColumns, ProfileColumns, Table};
use plumb_estimation::Random;

/// Poses by which the working volume is represented.
const POSES: usize = 150;

/// Poses drawn at most to find so many inside it.
const DRAWN: usize = 20_000;

/// Poses in the working volume, as a table in which the whole position of the first target is read.
pub(super) struct Volume {
    table: Table,
}

/// How the tip moves at those poses, mm.
pub(super) struct Derivatives {
    /// Slots, then effects' parameters, by coordinates of the tip.
    columns: DMatrix<f64>,
    free_parameters: usize,
}

impl Volume {
    /// Poses within the joints' limits whose tip lies in the model's `working_volume`, where it has one, and on the open side of every plane it knows.
    pub(super) fn of(lab: &Laboratory, model: &Model, state: &State) -> Result<Self, LaboratoryError> {
        let joints = model.chain.len();
        let mut rng = Random::seeded(23);
        let known = lab.table();
        let mut table = Table { source: known.source.clone(), joints, ..Table::default() };
        table.touch.names.clone_from(&known.touch.names);
        // The free numbers are those of the fit.
        table.orientations = known.orientations.iter().map(OrientationColumns::empty).collect();
        table.board = known.board.as_ref().map(|_| Vec::new());
        table.board_seen.names.clone_from(&known.board_seen.names);
        table.profiles = known.profiles.iter().map(ProfileColumns::empty).collect();
        table.approach = known.approach.as_ref().map(|_| Vec::new());
        let target = model.targets.first().map(|target| target.name.clone()).unwrap_or_default();
        let mut tip = PositionColumns { number: 0, target, xyz: Vec::new() };
        let ranges: Vec<(f64, f64)> = (0..joints).map(|joint| joint_range(lab, joint).ends).collect();
        let loads: Vec<f64> =
            known.payload.iter().flatten().copied().filter(|load| load.is_finite()).collect();
        let mut payloads = Vec::new();
        for _ in 0..DRAWN {
            if tip.xyz.len() >= POSES {
                break;
            }
            let q: Vec<f64> = ranges.iter().map(|(low, high)| low + (high - low) * rng.uniform()).collect();
            if !inside(model, state, &q) {
                continue;
            }
            table.q.extend(&q);
            if let Some(approach) = &mut table.approach {
                approach.extend((0..joints).map(|_| if rng.below(2) == 0 { -1 } else { 1 }));
            }
            table.lines.push(tip.xyz.len() as u32 + 1);
            table.note(None, None);
            payloads.push(if loads.is_empty() { 0.0 } else { loads[rng.below(loads.len())] });
            tip.xyz.push([0.0; 3]);
        }
        if tip.xyz.is_empty() {
            return Err(LaboratoryError::Refused(
                "no pose within the joints' limits brings the first target into the model's `working_volume`: check both".to_owned(),
            ));
        }
        table.payload = Some(payloads);
        table.positions.push(tip);
        Ok(Self { table })
    }

    /// How the tip moves with every fitted number and with every parameter of these effects.
    pub(super) fn derivatives(
        &self,
        model: &Model,
        taken: &[AddedEffect],
        state: &State,
        effects: &[&dyn Effect],
    ) -> Result<Derivatives, LaboratoryError> {
        let observations = Observations::new(model, &self.table)?;
        let problem = ResidualModel::new(model, &self.table, &observations, taken)?;
        let rows: Vec<usize> = (0..self.table.len()).collect();
        let mut columns = problem.block(state, &rows, &vec![1.0; rows.len()], effects).jacobian;
        for (mut column, equation) in columns.column_iter_mut().zip(observations.equations()) {
            column *= equation.sigma;
        }
        Ok(Derivatives { columns, free_parameters: problem.free_parameters().len() })
    }
}

impl Derivatives {
    /// Mean over the poses of the products of how far the tip is off a unit of each of an effect's parameters, mm2, when the fitted numbers answer it so.
    pub(super) fn off(
        &self,
        effect: Range<usize>,
        answer: &DMatrix<f64>,
        moves_the_tip: bool,
    ) -> DMatrix<f64> {
        let fitted = self.columns.rows(0, self.free_parameters);
        let mut off = -answer.tr_mul(&fitted);
        if moves_the_tip {
            off += self.columns.rows(effect.start, effect.len());
        }
        let poses = (self.columns.ncols() as f64 / 3.0).max(1.0);
        &off * off.transpose() / poses
    }
}

/// Whether a pose has its tip in the working volume.
fn inside(model: &Model, state: &State, q: &[f64]) -> bool {
    let tool = state.targets.first().copied().unwrap_or_default();
    // In the frame of the measurements, in which planes and the working volume are given.
    let point = (state.base * LinkFrames::of(&model.chain, q, &[]).flange * Point3::from(tool)).coords;
    // A free surface is where the fit puts it, which is no limit for the arm.
    let open = model.surfaces.iter().all(|surface| match surface.shape {
        SurfaceShape::Plane { normal, offset } if !surface.free => normal.dot(&point) >= offset,
        _ => true,
    });
    open && model.working_volume.is_none_or(|volume| {
        point.iter().zip(&volume).all(|(value, (low, high))| (low..=high).contains(&value))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::two_links_with;
    use plumb_estimation::Progress;

    fn volume(lines: &str) -> (Laboratory, State) {
        let lab = two_links_with(&format!("free: []\n{lines}"), 20, 0.05, 61, |_| [0.0; 2]);
        let state = lab.fit_with(&[], None, &Progress::unwatched()).unwrap().fit.state;
        (lab, state)
    }

    #[test]
    fn a_tip_is_inside_on_the_open_side_of_every_known_plane() {
        let (lab, state) = volume("surfaces: {wall: {plane: {normal: [1, 0, 0], offset_mm: 100}}}");
        assert!(inside(lab.model(), &state, &[0.0, 0.0]), "350 mm out along x");
        assert!(!inside(lab.model(), &state, &[1.6, 0.0]), "beside it");
        let (free, state) =
            volume("surfaces: {wall: {plane: {normal: [1, 0, 0], offset_mm: 100}, free: true}}");
        assert!(inside(free.model(), &state, &[1.6, 0.0]), "a free surface is no limit");
    }

    #[test]
    fn the_tip_is_off_by_what_an_effect_does_less_what_the_fitted_numbers_answer() {
        // Two poses of three coordinates. A fitted number moves x; the effect moves x by 3 and y by 2 in either pose.
        let columns =
            DMatrix::from_row_slice(2, 6, &[1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 3.0, 2.0, 0.0, 3.0, 2.0, 0.0]);
        let derivatives = Derivatives { columns, free_parameters: 1 };
        let answer = DMatrix::from_element(1, 1, 3.0);
        let off = |moves: bool| derivatives.off(1..2, &answer, moves)[(0, 0)];
        assert!(
            (off(true) - 4.0).abs() < 1e-12,
            "x is answered, y is left: 2 squared, the mean of two poses"
        );
        // What only the instrument reads is answered by the arm, which then stands off by the answer.
        assert!((off(false) - 9.0).abs() < 1e-12, "{}", off(false));
    }

    #[test]
    fn poses_are_drawn_from_the_volume_alone() {
        let (lab, state) = volume("surfaces: {wall: {plane: {normal: [0, 1, 0], offset_mm: 0}}}");
        let drawn = Volume::of(&lab, lab.model(), &state).unwrap();
        assert!(drawn.table.len() > 50);
        for row in 0..drawn.table.len() {
            let q = drawn.table.q_of(row);
            assert!(200.0 * q[0].sin() + 150.0 * (q[0] + q[1]).sin() >= 0.0, "{q:?}");
            assert!(q[0].abs() <= 170.0_f64.to_radians() && q[1].abs() <= 150.0_f64.to_radians());
        }
    }

    #[test]
    fn poses_of_the_volume_have_sides_loads_and_ranges_of_the_table() {
        let (lab, state) = volume("");
        let lab = crate::testing::with_table(&lab, |table| {
            table.approach = Some(crate::testing::sides_in_turn(20));
            table.payload =
                Some((0..20).map(|row| if row % 3 == 0 { f64::NAN } else { (row % 3) as f64 }).collect());
        });
        let drawn = Volume::of(&lab, lab.model(), &state).unwrap().table;
        assert_eq!(drawn.len(), POSES);
        let sides = drawn.approach.as_ref().unwrap();
        let from = |side: i8| sides.iter().filter(|own| **own == side).count();
        assert_eq!(from(1) + from(-1), 2 * POSES);
        assert!(from(1) > POSES / 2 && from(-1) > POSES / 2, "either side is drawn");
        let loads = drawn.payload.as_ref().unwrap();
        assert!(
            loads.iter().all(|load| [1.0, 2.0].contains(load))
                && loads.contains(&1.0)
                && loads.contains(&2.0)
        );
        for (joint, limit) in [(0, 170.0_f64), (1, 150.0)] {
            let reached = (0..POSES).map(|row| drawn.q_of(row)[joint].to_degrees() / limit);
            let far = |side: f64| reached.clone().filter(|fraction| side * fraction > 0.8).count();
            assert!(far(1.0) > POSES / 40 && far(-1.0) > POSES / 40, "up to both ends of joint {joint}");
            assert!(reached.clone().all(|fraction| fraction.abs() <= 1.0));
        }
        assert_eq!(drawn.lines, (1..=u32::try_from(POSES).unwrap()).collect::<Vec<_>>());
        let bare = Volume::of(&volume("").0, lab.model(), &state).unwrap().table;
        assert!(bare.approach.is_none() && bare.payload.unwrap().iter().all(|load| *load == 0.0));
    }
}
