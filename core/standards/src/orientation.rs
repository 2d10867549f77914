//! Orientation of poses after ISO 9283:1998: accuracy `AP_a`, `AP_b`, `AP_c` (clause 7.2.1) and repeatability `RP_a`, `RP_b`, `RP_c` (7.2.2), variation with the
//! way of approach (7.2.3). `a`, `b` and `c` are turns about x, y and z (ISO 9787): here those by which what was reached is turned against what was commanded, about
//! the axes of the measurements, in the order x, y, z. So no attitude of the tool is singular; where a pose's own angles are far from that, they differ from it by
//! less than the product of two such turns.

use nalgebra::{Matrix3, Rotation3};
use serde::Serialize;

/// The figures of the orientation of one pose, deg; each of the turns about x, y and z.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct OrientationAtPose {
    /// `AP_a = mean(a) - a_commanded`, ...; nothing where the commanded orientation is not known.
    #[serde(rename = "AP_abc_deg")]
    pub accuracy: Option<[f64; 3]>,
    /// `RP_a = 3 S_a`, ..., to either side, with `n - 1` degrees of freedom.
    #[serde(rename = "RP_abc_deg")]
    pub repeatability: [f64; 3],
}

/// The greatest figures of all poses, deg; each of the turns about x, y and z, without its sign.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GreatestOrientation {
    /// Accuracy; nothing where the commanded orientations are not known.
    #[serde(rename = "AP_abc_deg")]
    pub accuracy: Option<[f64; 3]>,
    /// Repeatability.
    #[serde(rename = "RP_abc_deg")]
    pub repeatability: [f64; 3],
    /// Variation with the way of approach; nothing where each pose was reached by one way.
    #[serde(rename = "vAP_abc_deg")]
    pub variation: Option<[f64; 3]>,
}

/// The turns about x, y and z by which one orientation is turned against another, deg.
fn rotated(attained: &Rotation3<f64>, against: &Rotation3<f64>) -> [f64; 3] {
    let (a, b, c) = (attained * against.inverse()).euler_angles();
    [a, b, c].map(f64::to_degrees)
}

/// The rotation nearest to all of some (Kabsch 1976).
pub(crate) fn mean(rotations: &[Rotation3<f64>]) -> Option<Rotation3<f64>> {
    let svd = rotations.iter().map(|rotation| rotation.into_inner()).sum::<Matrix3<f64>>().svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut mirror = Matrix3::identity();
    mirror[(2, 2)] = (u * v_t).determinant().signum();
    Some(Rotation3::from_matrix_unchecked(u * mirror * v_t))
}

/// The figures of one pose from what was reached, and what was commanded where that is known.
pub(crate) fn at_pose(
    attained: &[Rotation3<f64>],
    commanded: Option<&[Rotation3<f64>]>,
) -> Option<OrientationAtPose> {
    let middle = mean(attained)?;
    let each: Vec<[f64; 3]> = match commanded {
        Some(commanded) => {
            attained.iter().zip(commanded).map(|(one, requested)| rotated(one, requested)).collect()
        }
        None => attained.iter().map(|one| rotated(one, &middle)).collect(),
    };
    let count = each.len() as f64;
    let means = [0, 1, 2].map(|part| each.iter().map(|angles| angles[part]).sum::<f64>() / count);
    let repeatability = [0, 1, 2].map(|part| {
        let squares: f64 = each.iter().map(|angles| (angles[part] - means[part]).powi(2)).sum();
        3.0 * (squares / (count - 1.0).max(1.0)).sqrt()
    });
    Some(OrientationAtPose { accuracy: commanded.map(|_| means), repeatability })
}

/// The greatest of each of three numbers, without their signs.
pub(crate) fn greatest(values: impl Iterator<Item = [f64; 3]>) -> Option<[f64; 3]> {
    values.fold(None, |most: Option<[f64; 3]>, value| {
        let most = most.unwrap_or_default();
        Some([0, 1, 2].map(|part| most[part].max(value[part].abs())))
    })
}

/// How far apart the mean orientations of the ways to one pose are, deg.
pub(crate) fn variation(means: &[Rotation3<f64>]) -> Option<[f64; 3]> {
    let pairs = means
        .iter()
        .enumerate()
        .flat_map(|(index, one)| means.iter().skip(index + 1).map(move |other| rotated(one, other)));
    greatest(pairs)
}
