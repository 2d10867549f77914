//! How something hidden would have moved an arm that somebody measured: by this world's mechanics, through the rows as they were taken.

use super::visit::Visit;
use crate::physics::description::ArmDescription;
use crate::physics::imperfection::Imperfection;
use crate::physics::machine::{Conditions, Machine, NoEquilibrium};
use crate::physics::rigid::Vector;

/// A row of somebody's measurements, in the order of time.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRow {
    /// Commanded joint values, rad or mm.
    pub commanded: Vec<f64>,
    /// The way in which each joint arrived, as `approach_q1 ...` of a table: +1 its coordinate grew, -1 it fell, 0 not known; empty where that was not logged: straight from the row
    /// before.
    pub sides: Vec<f64>,
    /// Since the first row, s.
    pub time_s: f64,
    /// Degrees Celsius.
    pub temperature_c: f64,
    /// At the target, kg.
    pub payload_kg: f64,
}

/// How far points of the flange (mm, its frame) are elsewhere with `hidden` than without, in every row: mm, frame of the world, one a point. `known` is what the
/// arm deviates by anyway.
///
/// # Errors
/// The arm falls down.
pub fn displacements(
    arm: &ArmDescription,
    points: &[Vector],
    rows: &[MeasuredRow],
    known: &[Imperfection],
    hidden: &Imperfection,
) -> Result<Vec<Vec<Vector>>, NoEquilibrium> {
    let both: Vec<Imperfection> = known.iter().chain([hidden]).cloned().collect();
    let without = positions(arm, points, rows, known)?;
    let with = positions(arm, points, rows, &both)?;
    let difference = |(with, without): (Vec<Vector>, Vec<Vector>)| {
        with.into_iter().zip(without).map(|(with, without)| with - without).collect()
    };
    Ok(with.into_iter().zip(without).map(difference).collect())
}

/// Where the points are in every row.
fn positions(
    arm: &ArmDescription,
    points: &[Vector],
    rows: &[MeasuredRow],
    imperfections: &[Imperfection],
) -> Result<Vec<Vec<Vector>>, NoEquilibrium> {
    let mut machine = Machine::new(arm, imperfections);
    machine.go(&vec![0.0; arm.joints.len()], 0.0);
    let position_at = |row: &MeasuredRow| {
        let visit = Visit { sides: row.sides.clone(), ..Visit::at(row.commanded.clone()) };
        if row.sides.iter().any(|side| *side != 0.0) {
            machine.go(&visit.beyond(), row.time_s);
        }
        machine.go(&visit.commanded, row.time_s);
        let conditions =
            Conditions { time_s: row.time_s, temperature_c: row.temperature_c, payload_kg: row.payload_kg };
        let link_frames = machine.equilibrium(&conditions)?.link_frames;
        Ok(points.iter().map(|point| link_frames.world_from_flange.apply(*point)).collect())
    };
    rows.iter().map(position_at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::arms;
    use crate::physics::imperfection::Mechanism;

    fn row(commanded: [f64; 6], sides: Vec<f64>) -> MeasuredRow {
        let commanded = commanded.to_vec();
        MeasuredRow { commanded, sides, time_s: 0.0, temperature_c: 20.0, payload_kg: 0.0 }
    }

    #[test]
    fn a_joints_zero_moves_every_point_about_its_axis_whatever_else_deviates() {
        let arm = arms::by_name("ur5").unwrap().unwrap();
        let rows = [row([0.0, -1.0, 1.0, 0.0, 0.3, 0.0], Vec::new())];
        let points = [Vector::ZERO, Vector::new(0.0, 0.0, 100.0)];
        let known = [Imperfection { mechanism: Mechanism::LinkLength { joint: 1 }, size: 0.5 }];
        let hidden = Imperfection { mechanism: Mechanism::JointZero { joint: 0 }, size: 1e-3 };
        let moved = displacements(&arm, &points, &rows, &known, &hidden).unwrap();
        let at = positions(&arm, &points, &rows, &known).unwrap();
        for (moved, at) in moved[0].iter().zip(&at[0]) {
            let radius = at.x.hypot(at.y);
            assert!((moved.norm() - 1e-3 * radius).abs() < 1e-3, "{moved:?} at {radius}");
            assert!(moved.z.abs() < 1e-9);
        }
    }

    #[test]
    fn play_depends_on_the_side_of_approach_and_without_one_on_the_row_before() {
        let arm = arms::by_name("ur5").unwrap().unwrap();
        let hidden = Imperfection { mechanism: Mechanism::JointBacklash { joint: 0 }, size: 2e-3 };
        let pose = [0.3, -1.0, 1.0, 0.0, 0.3, 0.0];
        let side = |side: f64| vec![side, 0.0, 0.0, 0.0, 0.0, 0.0];
        let turn = |rows: &[MeasuredRow]| {
            let moved = displacements(&arm, &[Vector::ZERO], rows, &[], &hidden).unwrap();
            moved.last().unwrap()[0]
        };
        let (up, down) = (turn(&[row(pose, side(1.0))]), turn(&[row(pose, side(-1.0))]));
        assert!((up - down).norm() > 0.3, "{up:?} {down:?}");
        let before = row([1.0, -1.0, 1.0, 0.0, 0.3, 0.0], Vec::new());
        assert!((turn(&[before, row(pose, Vec::new())]) - down).norm() < 1e-9);
    }
}
