//! Where an operator's eyes and hands bring the arm: over a point, or down onto a gauge block.

use super::World;
use super::drive::{AXES, Joint, Joints};
use crate::chance::normal;
use crate::physics::rigid::Vector;

/// As near as the operator's hand is brought, mm, before the eye's own error.
const NEAR: f64 = 1e-9;

/// Looks until it is near, or not to be reached.
const MOST_LOOKS: usize = 60;

/// The furthest a joint goes between two looks, rad.
const LONGEST_REACH: f64 = 0.2;

impl World {
    /// True attitudes with which the sensor's face is over this point, as well as the operator's eye can see. None when the arm does not
    /// reach there. Each try is seen a little differently.
    pub fn attitudes_over(&mut self, point: &Vector) -> Option<[Option<f64>; AXES]> {
        self.readings_taken += 1;
        let eye = self.description.instruments.eye.error;
        let seed = self.description.seed ^ 0x0e7e_0e7e;
        let slip = |index: u64| eye * normal(seed, self.readings_taken.wrapping_mul(2).wrapping_add(index));
        let goal = Vector { x: point.x + slip(0), y: point.y + slip(1), z: point.z };
        self.reach([Joint::Waist, Joint::Shoulder, Joint::Elbow], |tool| {
            [goal.x - tool.x, goal.y - tool.y, goal.z - tool.z]
        })
    }

    /// True attitudes with which the sensor's face is so high (mm) over the table, only the shoulder having moved.
    pub fn attitudes_at_height(&mut self, height: f64) -> Option<[Option<f64>; AXES]> {
        self.reach([Joint::Shoulder], |tool| [height - tool.z])
    }

    /// Lets some joints go until nothing is missing: looks what each of them does, and goes where all of it together leads.
    fn reach<const N: usize>(
        &self,
        joints: [Joint; N],
        missing: impl Fn(&Vector) -> [f64; N],
    ) -> Option<[Option<f64>; AXES]> {
        let left = |attitudes: &Joints| missing(&self.arm_state.pose_at(attitudes).tool);
        let mut attitudes = self.arm_state.attitudes;
        for _ in 0..MOST_LOOKS {
            let short = left(&attitudes);
            if short.iter().all(|part| part.abs() < NEAR) {
                let mut found = [None; AXES];
                joints.iter().for_each(|joint| found[joint.index()] = Some(attitudes.of(*joint)));
                return Some(found);
            }
            const NUDGE: f64 = 1e-6;
            let columns = joints.map(|joint| {
                let mut nudged = attitudes;
                nudged.0[joint.index()] += NUDGE;
                let after = left(&nudged);
                std::array::from_fn(|row| (short[row] - after[row]) / NUDGE)
            });
            let steps = solved(columns, short)?;
            for (joint, step) in joints.iter().zip(steps) {
                attitudes.0[joint.index()] += step.clamp(-LONGEST_REACH, LONGEST_REACH);
            }
        }
        None
    }
}

/// How much of each column makes up `wanted`: elimination with the greatest pivot. None when the columns do not lead there.
fn solved<const N: usize>(columns: [[f64; N]; N], requested: [f64; N]) -> Option<[f64; N]> {
    let mut rows: [([f64; N], f64); N] =
        std::array::from_fn(|row| (std::array::from_fn(|column| columns[column][row]), requested[row]));
    for pivot in 0..N {
        let best = (pivot..N).max_by(|a, b| rows[*a].0[pivot].abs().total_cmp(&rows[*b].0[pivot].abs()))?;
        rows.swap(pivot, best);
        if rows[pivot].0[pivot].abs() < 1e-9 {
            return None;
        }
        for row in (0..N).filter(|row| *row != pivot) {
            let fraction = rows[row].0[pivot] / rows[pivot].0[pivot];
            let (from, right) = rows[pivot];
            rows[row].0.iter_mut().zip(from).for_each(|(value, taken)| *value -= fraction * taken);
            rows[row].1 -= fraction * right;
        }
    }
    Some(std::array::from_fn(|row| rows[row].1 / rows[row].0[row]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_solved_makes_up_what_was_wanted(
            columns in prop::array::uniform3(prop::array::uniform3(-5.0..5.0_f64)),
            requested in prop::array::uniform3(-5.0..5.0_f64),
        ) {
            if let Some(fractions) = solved(columns, requested) {
                let largest = fractions.iter().fold(1.0, |most: f64, fraction| most.max(fraction.abs()));
                for row in 0..3 {
                    let sum: f64 = (0..3).map(|column| columns[column][row] * fractions[column]).sum();
                    prop_assert!((sum - requested[row]).abs() < 1e-9 * largest);
                }
            }
        }
    }
}
