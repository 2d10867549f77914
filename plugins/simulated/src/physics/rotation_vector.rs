//! Rotations as instruments give them: the axis times the angle.

use super::rigid::{Rotation, Vector};

/// The rotation vector of a rotation, rad (Diebel 2006, section 7).
pub fn rotation_vector(rotation: &Rotation) -> Vector {
    let trace = rotation.x.x + rotation.y.y + rotation.z.z;
    let angle = ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos();
    let twist =
        Vector::new(rotation.y.z - rotation.z.y, rotation.z.x - rotation.x.z, rotation.x.y - rotation.y.x);
    match twist.unit() {
        Some(axis) if angle < HALF_TURN => axis * angle,
        _ if angle < HALF_TURN => Vector::ZERO,
        _ => half_turn(rotation, twist) * angle,
    }
}

/// Above this angle (rad) the axis is taken from the symmetric part: the other one vanishes at half a turn.
const HALF_TURN: f64 = 3.0;

/// The axis of about half a turn, from `R + R' = 2 cos(angle) + 2 (1 - cos(angle)) a a'`; `twist` says which way it points.
fn half_turn(rotation: &Rotation, twist: Vector) -> Vector {
    let rows = rotation.inverse();
    let both = [rotation.x + rows.x, rotation.y + rows.y, rotation.z + rows.z];
    let twice_cosine = rotation.x.x + rotation.y.y + rotation.z.z - 1.0;
    let units = [Vector::X, Vector::Y, Vector::Z];
    let along = both.into_iter().zip(units).map(|(column, unit)| column - unit * twice_cosine);
    let longest = along.fold(Vector::ZERO, |best, one| if one.norm() > best.norm() { one } else { best });
    let axis = longest.unit().unwrap_or(Vector::X);
    if axis.dot(twist) < 0.0 { -axis } else { axis }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_vector_is_that_of_its_rotation_up_to_half_a_turn() {
        let axes = [Vector::X, Vector::Z, Vector::new(0.6, -0.64, 0.48), Vector::new(-0.36, 0.48, 0.8)];
        for axis in axes {
            for angle in [0.0, 1e-3, 0.7, 2.0, 2.99, 3.05, 3.13, std::f64::consts::PI - 1e-9] {
                let found = rotation_vector(&Rotation::about(axis, angle));
                assert!((found - axis * angle).norm() < 1e-5, "{axis:?} {angle}: {found:?}");
            }
        }
    }
}
