//! Where an arm was measured: corrections and residual maps hold there and nowhere else.

use std::f64::consts::PI;

use plumb_kinematics::{Chain, Motion};

/// Poses kept of a table at most: so many show where an arm was measured, and a model file stays readable.
const MOST_POSES: usize = 200;

/// Range of a turning joint from which its sine and cosine are looked at, rad: below, its coordinate on its range.
const WIDE: f64 = PI;

/// A pose is as near as measured ones are to their neighbours; single poses far from all others do not widen that beyond so many times the median.
const LONELY: f64 = 2.0;

/// The range of one joint that was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointRange {
    /// Least coordinate, rad or mm.
    pub low: f64,
    /// Greatest coordinate, rad or mm.
    pub high: f64,
    /// Whether it turned so far that its sine and cosine are looked at.
    pub wide: bool,
}

impl JointRange {
    /// Of a joint of a chain, rad or mm.
    pub fn of(chain: &Chain, joint: usize, low: f64, high: f64) -> Self {
        let turns = chain.joints.get(joint).is_some_and(|joint| joint.motion == Motion::Turns);
        Self { low, high, wide: turns && high - low >= WIDE * (1.0 - ROUNDING) }
    }
}

/// The region of pose space in which an arm was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRegion {
    /// One a joint.
    pub joints: Vec<JointRange>,
    /// Poses that were measured, some of many, rad or mm.
    pub poses: Vec<Vec<f64>>,
    /// How far a pose may be from the nearest of them, in scaled coordinates.
    pub reach: f64,
}

/// Why a pose is outside the region that was measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Outside {
    /// A joint is outside the range it was measured in.
    Joint {
        /// The joint.
        joint: usize,
        /// Its coordinate, rad or mm.
        at: f64,
        /// The range, rad or mm.
        range: (f64, f64),
    },
    /// Every joint is in its range, but nothing was measured near this pose.
    Far {
        /// Distance to the nearest measured pose over the greatest that is allowed.
        times: f64,
    },
}

impl Outside {
    /// In words.
    pub fn describe(&self, chain: &Chain) -> String {
        match self {
            Self::Joint { joint, at, range: (low, high) } => {
                let name = chain.joints.get(*joint).map_or("?", |joint| joint.name.as_str());
                let slides = chain.joints.get(*joint).is_some_and(|joint| joint.motion == Motion::Slides);
                let (factor, unit) = match slides {
                    true => (1.0, "mm"),
                    false => (1.0_f64.to_degrees(), "deg"),
                };
                format!(
                    "{name} would be at {:.3} {unit}, and was measured from {:.3} to {:.3} {unit}",
                    at * factor,
                    low * factor,
                    high * factor
                )
            }
            Self::Far { times } => {
                format!(
                    "nothing was measured near this pose: it is {times:.1} times as far from the nearest as measured poses are from each other"
                )
            }
        }
    }
}

/// Rounding that a coordinate at the end of its range may have, relative to the range.
const ROUNDING: f64 = 1e-6;

impl MeasuredRegion {
    /// Of these poses (rad or mm) of an arm; nothing without poses.
    pub fn of(chain: &Chain, poses: &[Vec<f64>]) -> Option<Self> {
        let joints: Vec<JointRange> = (0..chain.len())
            .map(|index| {
                let all = poses.iter().filter_map(|pose| pose.get(index)).copied();
                let (low, high) =
                    all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)));
                JointRange::of(chain, index, low, high)
            })
            .collect();
        if poses.is_empty() || !joints.iter().all(|joint| joint.low.is_finite()) {
            return None;
        }
        let mut region = Self { joints, poses: Vec::new(), reach: 0.0 };
        let inputs: Vec<Vec<f64>> = poses.iter().map(|pose| region.inputs(pose)).collect();
        let kept = spread_out(&inputs);
        region.reach = reach(&inputs, &kept);
        region.poses = kept.iter().filter_map(|index| poses.get(*index)).cloned().collect();
        Some(region)
    }

    /// A pose's coordinates as functions of the pose see them: sine and cosine of a joint that turned far, else -1 to 1 over its range.
    pub fn inputs(&self, q: &[f64]) -> Vec<f64> {
        let mut inputs = Vec::with_capacity(self.joints.len() + 2);
        for (joint, value) in self.joints.iter().zip(q) {
            match joint.wide {
                true => inputs.extend([value.sin(), value.cos()]),
                false if joint.high > joint.low => {
                    inputs.push(2.0 * (value - joint.low) / (joint.high - joint.low) - 1.0);
                }
                false => {}
            }
        }
        inputs
    }

    /// Whether a pose (rad or mm) is in it; why not.
    ///
    /// # Errors
    /// [`Outside`]
    pub fn check(&self, q: &[f64]) -> Result<(), Outside> {
        for (index, (joint, value)) in self.joints.iter().zip(q).enumerate() {
            // The end of a range is a pose that was measured, as a file has it after rounding.
            let slack = ROUNDING * (joint.high - joint.low).max(1.0);
            if *value < joint.low - slack || *value > joint.high + slack {
                return Err(Outside::Joint { joint: index, at: *value, range: (joint.low, joint.high) });
            }
        }
        let here = self.inputs(q);
        let nearest =
            self.poses.iter().map(|pose| distance(&here, &self.inputs(pose))).fold(f64::INFINITY, f64::min);
        match nearest <= self.reach * (1.0 + ROUNDING) + ROUNDING {
            true => Ok(()),
            false => Err(Outside::Far { times: nearest / self.reach.max(ROUNDING) }),
        }
    }
}

fn distance(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// At most [`MOST_POSES`] of some poses, each the farthest from those before it (Gonzalez 1985); their indices in the list.
fn spread_out(inputs: &[Vec<f64>]) -> Vec<usize> {
    let mut nearest = vec![f64::INFINITY; inputs.len()];
    let mut kept = Vec::new();
    let mut next = Some(0);
    while let Some(chosen) = next.filter(|_| kept.len() < MOST_POSES) {
        kept.push(chosen);
        let Some(at) = inputs.get(chosen) else { break };
        for (near, input) in nearest.iter_mut().zip(inputs) {
            *near = near.min(distance(at, input));
        }
        next = (0..inputs.len())
            .max_by(|a, b| nearest[*a].total_cmp(&nearest[*b]))
            .filter(|farthest| nearest[*farthest] > 0.0);
    }
    kept
}

/// How far poses are from the nearest kept one but themselves: the greatest such distance, of lonely poses no more than [`LONELY`] times the median.
fn reach(inputs: &[Vec<f64>], kept: &[usize]) -> f64 {
    let to_others = inputs.iter().map(|input| {
        let others = kept.iter().filter_map(|index| inputs.get(*index));
        // At no distance is the pose itself, or a return to it.
        let distances = others.map(|other| distance(input, other)).filter(|distance| *distance > 0.0);
        distances.fold(f64::INFINITY, f64::min)
    });
    let mut all: Vec<f64> = to_others.filter(|distance| distance.is_finite()).collect();
    all.sort_by(f64::total_cmp);
    match (all.get(all.len() / 2), all.last()) {
        (Some(median), Some(greatest)) => greatest.min(LONELY * median),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_estimation::Random;
    use plumb_kinematics::{Convention, Joint};

    fn chain() -> Chain {
        let slide = Joint { motion: Motion::Slides, ..Joint::turning("slide", 0.0, 0.0, 0.0, 0.0) };
        Chain::new(Convention::Distal, vec![Joint::turning("turn", 100.0, 0.0, 0.0, 0.0), slide]).unwrap()
    }

    fn poses(count: usize, seed: u64) -> Vec<Vec<f64>> {
        let mut random = Random::seeded(seed);
        (0..count).map(|_| vec![random.uniform() - 0.5, 100.0 * random.uniform()]).collect()
    }

    #[test]
    fn poses_like_those_measured_are_inside_and_others_are_not() {
        let region = MeasuredRegion::of(&chain(), &poses(500, 1)).unwrap();
        assert!(region.poses.len() <= MOST_POSES);
        let inside = poses(200, 2).iter().filter(|pose| region.check(pose).is_ok()).count();
        assert!(inside >= 190, "{inside} of 200");
        let message = region.check(&[0.9, 50.0]).unwrap_err().describe(&chain());
        assert!(message.contains("turn would be at 51.566 deg, and was measured from -2"), "{message}");
        let message = region.check(&[0.0, 140.0]).unwrap_err().describe(&chain());
        assert!(message.contains("slide would be at 140.000 mm"), "{message}");
    }

    #[test]
    fn a_gap_in_the_middle_was_not_measured() {
        let mut around = poses(500, 3);
        around.retain(|pose| pose[0].hypot((pose[1] - 50.0) / 100.0) > 0.35);
        let region = MeasuredRegion::of(&chain(), &around).unwrap();
        let message = region.check(&[0.0, 50.0]).unwrap_err();
        assert!(matches!(message, Outside::Far { times } if times > 1.0), "{message:?}");
        assert!(region.check(&around[7]).is_ok());
    }

    #[test]
    fn without_poses_there_is_no_region() {
        assert!(MeasuredRegion::of(&chain(), &[]).is_none());
    }

    #[test]
    fn the_end_of_a_range_is_inside_as_a_file_has_it_after_rounding() {
        let poses: Vec<Vec<f64>> =
            poses(300, 3).into_iter().map(|pose| vec![pose[0], 1000.0 + pose[1]]).collect();
        let region = MeasuredRegion::of(&chain(), &poses).unwrap();
        let range = region.joints[1];
        // Six digits of a range of some 100 mm; of one shorter than 1, of 1.
        let slack = ROUNDING * (range.high - range.low);
        let is_beyond = |q: [f64; 2]| matches!(region.check(&q), Err(Outside::Joint { .. }));
        assert!(!is_beyond([0.0, range.high + 0.9 * slack]) && is_beyond([0.0, range.high + 1.1 * slack]));
        assert!(!is_beyond([0.0, range.low - 0.9 * slack]) && is_beyond([0.0, range.low - 1.1 * slack]));
        let range = region.joints[0];
        assert!(range.high - range.low < 1.0);
        let at = 1050.0;
        assert!(
            !is_beyond([range.high + 0.99 * ROUNDING, at]) && is_beyond([range.high + 1.01 * ROUNDING, at])
        );
    }
}
