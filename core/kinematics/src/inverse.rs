//! From where the flange is to be to the joints that bring it there.

use nalgebra::{DMatrix, DVector, IsometryMatrix3, Vector3};

/// Why no joints were found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the arm cannot bring its flange there from where it begins: it comes to {away_mm:.2} mm and {turned_deg:.3} deg of it at best"
)]
pub struct OutOfReach {
    /// How far the flange stays away, mm.
    pub away_mm: f64,
    /// How far it stays turned, deg.
    pub turned_deg: f64,
}

/// A turn of one radian weighs as much as so many mm.
const LEVER: f64 = 300.0;

/// As near is there: mm, with turns at [`LEVER`].
const THERE: f64 = 1e-6;

/// Steps at most.
const MOST_STEPS: usize = 200;

/// The joints nearest to `start` for which `flange_of` gives `wanted`, by damped least squares. Whatever model is behind `flange_of` is
/// undone as it is: a fitted one as well as the one on paper. Limits are the caller's.
///
/// # Errors
/// [`OutOfReach`]
pub fn inverse(
    flange_of: impl Fn(&[f64]) -> IsometryMatrix3<f64>,
    requested: &IsometryMatrix3<f64>,
    start: &[f64],
) -> Result<Vec<f64>, OutOfReach> {
    let mut joints = start.to_vec();
    let mut short = difference(&flange_of(&joints), requested);
    let mut damping = 1.0;
    for _ in 0..MOST_STEPS {
        if short.norm() < THERE {
            return Ok(joints);
        }
        let slope = derivative(&flange_of, &joints);
        let normal = slope.tr_mul(&slope);
        let toward = slope.tr_mul(&short);
        let damped = &normal + DMatrix::identity(joints.len(), joints.len()) * damping;
        let Some(step) = damped.lu().solve(&toward) else { break };
        // No joint turns by more than a quarter radian at once: beyond that the slope means little.
        let scale = (0.25 / step.amax()).min(1.0);
        let tried: Vec<f64> = joints.iter().zip(step.iter()).map(|(joint, by)| joint + by * scale).collect();
        let left = difference(&flange_of(&tried), requested);
        if left.norm() < short.norm() {
            (joints, short) = (tried, left);
            damping = (damping * 0.2).max(1e-9);
        } else {
            damping *= 8.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    if short.norm() < 1e3 * THERE {
        return Ok(joints);
    }
    let (away, turned) = (short.fixed_rows::<3>(0).norm(), short.fixed_rows::<3>(3).norm() / LEVER);
    Err(OutOfReach { away_mm: away, turned_deg: turned.to_degrees() })
}

/// From one pose to another: a shift and a turn, both in the base frame, the turn at its lever.
fn difference(from: &IsometryMatrix3<f64>, to: &IsometryMatrix3<f64>) -> DVector<f64> {
    let shift = to.translation.vector - from.translation.vector;
    let turn: Vector3<f64> = (to.rotation * from.rotation.inverse()).scaled_axis() * LEVER;
    DVector::from_iterator(6, shift.iter().chain(turn.iter()).copied())
}

fn derivative(flange_of: &impl Fn(&[f64]) -> IsometryMatrix3<f64>, joints: &[f64]) -> DMatrix<f64> {
    const SMALL: f64 = 1e-6;
    let mut slope = DMatrix::zeros(6, joints.len());
    let mut moved = joints.to_vec();
    for joint in 0..joints.len() {
        let mut at = |by: f64| {
            moved.clone_from_slice(joints);
            if let Some(value) = moved.get_mut(joint) {
                *value += by;
            }
            flange_of(&moved)
        };
        let column = difference(&at(-SMALL), &at(SMALL)) / (2.0 * SMALL);
        slope.set_column(joint, &column);
    }
    slope
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Chain, Convention, Joint, LinkFrames};

    fn puma() -> Chain {
        let quarter = std::f64::consts::FRAC_PI_2;
        let row = |(name, a, alpha, d): (&str, f64, f64, f64)| Joint::turning(name, a, alpha, d, 0.0);
        let rows = [
            ("waist", 0.0, -quarter, 0.0),
            ("shoulder", 431.8, 0.0, 149.09),
            ("elbow", -20.32, quarter, 0.0),
            ("wrist_roll", 0.0, -quarter, 433.07),
            ("wrist_bend", 0.0, quarter, 0.0),
            ("flange", 0.0, 0.0, 56.25),
        ];
        Chain::new(Convention::Distal, rows.map(row).to_vec()).unwrap()
    }

    #[test]
    fn the_joints_of_a_pose_are_found_from_nearby() {
        let chain = puma();
        let flange_of = |joints: &[f64]| LinkFrames::of(&chain, joints, &[]).flange;
        let joints = [0.4, -0.5, 0.3, 0.2, 1.1, -0.7];
        let start = joints.map(|joint| joint + 0.15);
        let found = inverse(flange_of, &flange_of(&joints), &start).unwrap();
        for (found, joint) in found.iter().zip(joints) {
            assert!((found - joint).abs() < 1e-8, "{found} {joint}");
        }
    }

    #[test]
    fn what_is_out_of_reach_says_how_far() {
        let chain = puma();
        let flange_of = |joints: &[f64]| LinkFrames::of(&chain, joints, &[]).flange;
        let mut requested = flange_of(&[0.0; 6]);
        requested.translation.vector = Vector3::new(2000.0, 0.0, 0.0);
        let error = inverse(flange_of, &requested, &[0.0, -0.5, 0.3, 0.0, 1.0, 0.0]).unwrap_err();
        assert!(error.away_mm > 900.0, "{error}");
    }
}
