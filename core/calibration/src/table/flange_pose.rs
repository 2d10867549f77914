//! Poses of the flange in place of joints, as the coordinates of an arm of three slides and three turns (the model `poses`): where only those are known, as from a
//! controller that reports no joints, bodies, cameras and the base are found by them.
//!
//! The coordinates are z, x and y, then the angles of `Rz(a) Ry(b) Rz(c)` (Diebel, Representing Attitude, 2006, section 8.13).

use nalgebra::{Matrix3, Rotation3};

use super::columns::Table;
use super::orientation::Body;

/// Coordinates of such an arm.
pub(super) const COORDINATES: usize = 6;

/// The columns that a flange's pose needs besides its orientation, in the order of the coordinates.
pub(super) const POSITIONS: [&str; 3] = ["flange_z_mm", "flange_x_mm", "flange_y_mm"];

/// Below this sine of the middle angle the outer two are one turn.
const ONE_TURN: f64 = 1e-8;

/// Which coordinate an axis of the position is.
pub(super) fn coordinate_of(axis: usize) -> usize {
    (axis + 1) % 3
}

/// The three angles of a rotation, rad.
fn angles(rotation: &Rotation3<f64>) -> [f64; 3] {
    let matrix: &Matrix3<f64> = rotation.matrix();
    // From both of its entries: near zero a single arc cosine would lose half of its digits.
    let sine = matrix[(0, 2)].hypot(matrix[(1, 2)]);
    let middle = sine.atan2(matrix[(2, 2)]);
    if sine < ONE_TURN {
        let side = matrix[(2, 2)].signum();
        return [(side * matrix[(1, 0)]).atan2(side * matrix[(0, 0)]), middle, 0.0];
    }
    [matrix[(1, 2)].atan2(matrix[(0, 2)]), middle, matrix[(2, 1)].atan2(-matrix[(2, 0)])]
}

/// Ends a row's flange pose: its angles become coordinates.
///
/// # Errors
/// It is not there.
pub(super) fn end_row(table: &mut Table, row: usize) -> Result<(), String> {
    let Some(columns) = table.orientations.iter().find(|columns| columns.body == Body::Flange) else {
        return Ok(());
    };
    let rotation = columns.rotations.get(row).copied().flatten();
    let rotation = rotation.ok_or("empty; every row needs the orientation of its flange")?;
    let own = table.q.get_mut(row * COORDINATES + POSITIONS.len()..(row + 1) * COORDINATES);
    for (coordinate, angle) in own.into_iter().flatten().zip(angles(&rotation)) {
        *coordinate = angle;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm_model::Model;
    use crate::fit::ResidualModel;
    use crate::measurement::Observations;
    use crate::template::Template;
    use nalgebra::Vector3;

    #[test]
    fn the_model_of_poses_carries_out_every_pose() {
        let model = Model::parse("poses.yaml", &Template::of("poses").unwrap().model).unwrap();
        for vector in [
            [0.3, -1.2, 0.8],
            [0.0, 0.0, 2.0],
            [0.0, 0.0, 0.0],
            [0.0, std::f64::consts::PI, 0.0],
            [2.0, 2.0, 0.1],
        ] {
            let [x, y, z] = vector;
            let text = format!(
                "flange_x_mm,flange_y_mm,flange_z_mm,flange_rx_rad,flange_ry_rad,flange_rz_rad,p1_x_mm\n100,-20,350,{x},{y},{z},0\n"
            );
            let table = Table::parse("poses.csv", &text).unwrap();
            assert!(table.orientations.is_empty() && table.joints == COORDINATES);
            let observations = Observations::new(&model, &table).unwrap();
            let problem = ResidualModel::new(&model, &table, &observations, &[]).unwrap();
            let mut state = problem.start();
            let rotation = Rotation3::new(Vector3::from(vector));
            for target in [Vector3::zeros(), Vector3::new(30.0, -40.0, 50.0)] {
                state.targets[0] = target;
                let expected = Vector3::new(100.0, -20.0, 350.0) + rotation * target;
                let found = problem.believed_point(&state, 0);
                assert!((found - expected).norm() < 1e-5, "{vector:?}: {found} {expected}");
            }
        }
    }

    #[test]
    fn a_pose_that_lacks_something_and_joints_beside_it_are_refused() {
        let position = "flange_x_mm,flange_y_mm,flange_z_mm";
        let rotation = "flange_qw,flange_qx,flange_qy,flange_qz";
        for (text, part) in [
            (format!("{position},p1_x_mm\n1,2,3,4\n"), "lacks its orientation"),
            (format!("flange_x_mm,flange_y_mm,{rotation}\n1,2,1,0,0,0\n"), "lacks `flange_z_mm`"),
            (
                format!("{position},{rotation},q1_deg\n1,2,3,1,0,0,0,5\n"),
                "joints or the pose of its flange, not both",
            ),
            (format!("{position},{rotation}\n1,,3,1,0,0,0\n"), "line 2, column 2 (`flange_y_mm`): empty"),
            (format!("{position},{rotation}\n1,2,3,,,,\n"), "every row needs the orientation of its flange"),
        ] {
            let message = Table::parse("t.csv", &text).unwrap_err().to_string();
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}
