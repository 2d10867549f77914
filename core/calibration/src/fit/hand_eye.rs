//! Where a body sits on the flange and how the base is turned, from whole poses and from no start at all: the robot-world and hand-eye problem `S_i = A F_i B`.
//!
//! The rotations by Shah (Solving the robot-world/hand-eye calibration problem using the Kronecker product, Journal of Mechanisms and Robotics 5, 2013,
//! section 3): of `A' S_i = F_i B` follows `vec(B') = (F_i' x S_i') vec(A)`, so that `vec(A)` and `vec(B')` are the first singular vectors of the sum over
//! all poses, whose singular value is their number. The positions then follow from linear equations. Measured and nominal poses need not agree: the nearest
//! rotations are taken.

use nalgebra::{
    DMatrix, DVector, IsometryMatrix3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3,
};
use plumb_estimation::RankRevealingCholesky;

/// A flange in the base, and the body that it carries as what measures sees it; mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenPose {
    /// The flange, base frame.
    pub flange: IsometryMatrix3<f64>,
    /// The body, frame of what measures; of its origin NaN where that was not measured.
    pub seen: IsometryMatrix3<f64>,
}

/// The two rotations that are the same for all poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoRotations {
    /// From the base's axes to those of what measures.
    pub base: Rotation3<f64>,
    /// From the body's axes to the flange's.
    pub body: Rotation3<f64>,
}

/// Poses that can determine two rotations at least: two turns about different axes.
const FEWEST: usize = 3;

/// The second singular value, as a fraction of the first, from which the poses all turn about one axis: the rotations are then not determined. With the axes of
/// turns of 30 degrees spread over a cone of 10 degrees it is 0.998.
const ONE_AXIS: f64 = 0.9995;

/// The rotation nearest to a matrix (Kabsch 1976).
fn nearest(matrix: &Matrix3<f64>) -> Option<Rotation3<f64>> {
    let svd = matrix.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut mirror = Matrix3::identity();
    mirror[(2, 2)] = (u * v_t).determinant().signum();
    Some(Rotation3::from_matrix_unchecked(u * mirror * v_t))
}

/// Both rotations from the poses alone; nothing from too few, or where all turn about one axis.
pub fn two_rotations(poses: &[SeenPose]) -> Option<TwoRotations> {
    if poses.len() < FEWEST {
        return None;
    }
    let mut sum = DMatrix::<f64>::zeros(9, 9);
    for pose in poses {
        sum += pose.flange.rotation.matrix().transpose().kronecker(&pose.seen.rotation.matrix().transpose());
    }
    let svd = sum.svd(true, true);
    // The two greatest: nalgebra promises no order.
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|left, right| svd.singular_values[*right].total_cmp(&svd.singular_values[*left]));
    let (first, second) = (order[0], order[1]);
    if svd.singular_values[second] > ONE_AXIS * svd.singular_values[first] {
        return None;
    }
    let (u, v_t) = (svd.u.as_ref()?, svd.v_t.as_ref()?);
    let base = Matrix3::from_iterator(v_t.row(first).iter().copied());
    let body = Matrix3::from_iterator(u.column(first).iter().copied()).transpose();
    // Both have one sign in common, which leaves rotations.
    let sign = base.determinant().signum();
    let base = nearest(&(base * sign))?;
    let body = nearest(&(body * sign))?;
    Some(TwoRotations { base, body })
}

/// The body's rotation on the flange, where that of the base is known.
pub fn body_rotation(poses: &[SeenPose], base: &Rotation3<f64>) -> Option<Rotation3<f64>> {
    // The mean of rotations in the sense of the chordal distance (Moakher 2002): the one nearest to the sum of their matrices.
    let each = poses.iter().map(|pose| (base * pose.flange.rotation).inverse() * pose.seen.rotation);
    nearest(&each.map(Rotation3::into_inner).sum())
}

/// The base's rotation, where the body's on the flange is known.
pub fn base_rotation(poses: &[SeenPose], body: &Rotation3<f64>) -> Option<Rotation3<f64>> {
    let each = poses.iter().map(|pose| pose.seen.rotation * (pose.flange.rotation * body).inverse());
    nearest(&each.map(Rotation3::into_inner).sum())
}

/// Where the base's origin is seen and where the body's origin sits on the flange, from what the nearest already known, by linear equations; what the poses
/// cannot determine stays as it is. `free` says whether base and body may move.
pub fn positions(
    poses: &[SeenPose],
    base: &Rotation3<f64>,
    (origin, body): (Vector3<f64>, Vector3<f64>),
    (base_free, body_free): (bool, bool),
) -> (Vector3<f64>, Vector3<f64>) {
    let (mut matrix, mut gradient) = (DMatrix::zeros(6, 6), DVector::zeros(6));
    // What may not move has no column, and the factor leaves it out.
    let [base_fraction, body_fraction] = [base_free, body_free].map(|free| f64::from(u8::from(free)));
    for pose in poses.iter().filter(|pose| pose.seen.translation.vector.iter().all(|part| part.is_finite())) {
        let turned = base * pose.flange.rotation;
        let believed = base * pose.flange.translation.vector + turned * body + origin;
        let left = pose.seen.translation.vector - believed;
        for axis in 0..3 {
            let mut row = DVector::zeros(6);
            row[axis] = base_fraction;
            for part in 0..3 {
                row[3 + part] = body_fraction * turned.matrix()[(axis, part)];
            }
            matrix.ger(1.0, &row, &row, 1.0);
            gradient.axpy(left[axis], &row, 1.0);
        }
    }
    let step = RankRevealingCholesky::new(&matrix).solve(&gradient);
    // A pose that is not finite would spoil what was known before.
    if step.iter().any(|part| !part.is_finite()) {
        return (origin, body);
    }
    (origin + step.fixed_rows::<3>(0), body + step.fixed_rows::<3>(3))
}

/// Root mean square angle, rad, by which poses miss two rotations.
pub fn rotations_left(poses: &[SeenPose], found: &TwoRotations) -> f64 {
    let squares = poses.iter().map(|pose| {
        let believed = found.base * pose.flange.rotation * found.body;
        // By quaternions: the angle of a matrix loses half its digits near zero.
        UnitQuaternion::from_rotation_matrix(&(believed.inverse() * pose.seen.rotation)).angle().powi(2)
    });
    (squares.sum::<f64>() / poses.len().max(1) as f64).sqrt()
}

/// How widely the axes spread about which the flange turns between poses: the axis (base frame, unit length) of most turning, and the root mean square angle
/// (rad) of the turning across it. Nothing of fewer than two poses.
pub fn turning(poses: &[SeenPose]) -> Option<(Vector3<f64>, f64)> {
    let first = poses.first()?;
    let mut spread = Matrix3::zeros();
    for pose in poses.get(1..)? {
        let rotation = pose.flange.rotation * first.flange.rotation.inverse();
        let vector = UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis();
        spread += vector * vector.transpose();
    }
    let count = poses.len().saturating_sub(1).max(1) as f64;
    let eigen = (spread / count).symmetric_eigen();
    let most = eigen.eigenvalues.imax();
    let across = eigen.eigenvalues.sum() - eigen.eigenvalues[most];
    (poses.len() > 1).then(|| (eigen.eigenvectors.column(most).into_owned(), across.max(0.0).sqrt()))
}

/// The rigid motion of a rotation and an origin.
pub fn rigid_of(rotation: Rotation3<f64>, origin: Vector3<f64>) -> IsometryMatrix3<f64> {
    IsometryMatrix3::from_parts(Translation3::from(origin), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_estimation::Random;

    fn apart(one: &Rotation3<f64>, other: &Rotation3<f64>) -> f64 {
        (one.matrix() - other.matrix()).norm()
    }

    fn any_pose(random: &mut Random, reach: f64) -> IsometryMatrix3<f64> {
        let mut three = |scale: f64| Vector3::from_fn(|_, _| scale * random.normal());
        rigid_of(Rotation3::new(three(1.0)), three(reach))
    }

    /// Poses of a known hand and base; the flange turned at random, or about one axis.
    fn poses(one_axis: bool) -> (Vec<SeenPose>, IsometryMatrix3<f64>, IsometryMatrix3<f64>) {
        let mut random = Random::seeded(11);
        let (base, body) = (any_pose(&mut random, 900.0), any_pose(&mut random, 60.0));
        let poses = (0..12).map(|_| {
            let mut flange = any_pose(&mut random, 400.0);
            if one_axis {
                flange.rotation = Rotation3::from_axis_angle(&Vector3::y_axis(), random.normal());
            }
            SeenPose { flange, seen: base * flange * body }
        });
        (poses.collect(), base, body)
    }

    #[test]
    fn base_and_body_are_found_from_no_start() {
        let (poses, base, body) = poses(false);
        let found = two_rotations(&poses).unwrap();
        assert!(apart(&found.base, &base.rotation) < 1e-9 && apart(&found.body, &body.rotation) < 1e-9);
        assert!(rotations_left(&poses, &found) < 1e-7);
        let start = (Vector3::zeros(), Vector3::zeros());
        let (origin, position) = positions(&poses, &found.base, start, (true, true));
        assert!((origin - base.translation.vector).norm() < 1e-6, "{origin}");
        assert!((position - body.translation.vector).norm() < 1e-6, "{position}");
        // With one of the two known, the other follows.
        assert!(apart(&body_rotation(&poses, &base.rotation).unwrap(), &body.rotation) < 1e-9);
        assert!(apart(&base_rotation(&poses, &body.rotation).unwrap(), &base.rotation) < 1e-9);
        let (held, _) = positions(&poses, &found.base, start, (false, true));
        assert_eq!(held, Vector3::zeros());
        // From a start that is known in part the other part is found, and what is held stays.
        let near = (base.translation.vector, Vector3::new(5.0, -7.0, 11.0));
        let (held, position) = positions(&poses, &found.base, near, (false, true));
        assert!(held == near.0 && (position - body.translation.vector).norm() < 1e-6, "{position}");
        let near = (Vector3::new(100.0, 20.0, -30.0), body.translation.vector);
        let (origin, held) = positions(&poses, &found.base, near, (true, false));
        assert!(held == near.1 && (origin - base.translation.vector).norm() < 1e-6, "{origin}");
    }

    #[test]
    fn poses_that_turn_about_one_axis_determine_no_two_rotations_and_the_axis_is_known() {
        let (poses, ..) = poses(true);
        assert_eq!(two_rotations(&poses), None);
        let (axis, across) = turning(&poses).unwrap();
        assert!(axis.y.abs() > 0.999_999 && across < 1e-6, "{axis} {across}");
        let (wide, ..) = self::poses(false);
        assert!(turning(&wide).unwrap().1 > 0.5);
        assert_eq!(two_rotations(&wide[..2]), None);
    }
}
