//! Which joints bring a robot's tip somewhere, for the time of a plan: near enough is good enough, and limits are left to the run.

use nalgebra::{DMatrix, DVector, Vector3};

use super::geometry::Geometry;

/// How near is near enough, mm.
const NEAR_MM: f64 = 0.5;

/// Steps of Newton's method at most.
const STEPS: usize = 40;

/// The longest step of a joint, rad; of one that slides so many times [`MM_PER_RADIAN`].
const LONGEST_STEP: f64 = 0.25;

/// A way in mm that counts as much as a turn of a radian: what a turn of a joint about half an arm away makes.
const MM_PER_RADIAN: f64 = 200.0;

/// For the slope, rad.
const NUDGE: f64 = 1e-6;

/// A point of the model's, where it shall go, and by which joints of the cell's list.
pub(super) struct RequestedTip<'a> {
    /// In the model's frame of measurements, mm.
    pub(super) xyz_mm: Vector3<f64>,
    /// Which of the model's targets; the first where none is named.
    pub(super) target: Option<&'a str>,
    /// Positions in the list of joints, and whether each slides.
    pub(super) by: Vec<(usize, bool)>,
}

/// The joints in the cell's order that bring the tip there, from a start; none where they are not found.
pub(super) fn joints_for_tip(
    geometry: &dyn Geometry,
    start: &[f64],
    requested: &RequestedTip<'_>,
) -> Option<Vec<f64>> {
    let mut joints = start.to_vec();
    let scale = |slides: bool| if slides { MM_PER_RADIAN } else { 1.0 };
    for _ in 0..STEPS {
        let mut tried = vec![joints.clone()];
        for (index, slides) in &requested.by {
            let mut nudged = joints.clone();
            *nudged.get_mut(*index)? += NUDGE * scale(*slides);
            tried.push(nudged);
        }
        let points = geometry.tips(requested.target, &tried)?;
        let (here, nudged) = points.split_first()?;
        let left = requested.xyz_mm - Vector3::new(here.x, here.y, here.z);
        if left.norm() < NEAR_MM {
            return Some(joints);
        }
        let columns =
            nudged.iter().map(|there| DVector::from_column_slice((there - here).as_slice()) / NUDGE);
        let slope = DMatrix::from_columns(&columns.collect::<Vec<_>>());
        let mut step =
            slope.svd(true, true).solve(&DVector::from_column_slice(left.as_slice()), 1e-9).ok()?;
        let longest = step.amax();
        if longest > LONGEST_STEP {
            step *= LONGEST_STEP / longest;
        }
        for ((index, slides), by) in requested.by.iter().zip(step.iter()) {
            *joints.get_mut(*index)? += by * scale(*slides);
        }
    }
    None
}
