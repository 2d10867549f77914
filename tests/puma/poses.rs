//! Fresh poses to check with: points at two radii, under two loads, each reached with the arm lefty and righty.

use std::path::Path;

use plumb_calibration::arm_model::Model;
use plumb_kinematics::{Chain, LinkFrames};

/// How many poses: a point each lefty and righty.
pub(crate) const FRESH: usize = 30;

/// The tip of the cage in the flange's frame, mm, as the model of the cell has it.
const TIP_MM: [f64; 3] = [40.0, 0.0, 120.0];

/// Nothing of the arm comes lower than this, mm: the table lies at -671.8, the cage reaches 120 mm beyond the flange.
const LOWEST_MM: f64 = -430.0;

/// A small generator of numbers between 0 and 1 (xorshift), for poses alone.
struct Xorshift(u64);

impl Xorshift {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        low + (high - low) * (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// The table of poses as the cell's procedures go through it: lefty and righty of each point one after the other, the unloaded ones first.
pub(crate) fn fresh(model: &Path, seed: u64) -> String {
    let chain = Model::read(model).unwrap().chain;
    let mut rng = Xorshift(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let mut poses: Vec<([f64; 6], f64)> = Vec::new();
    while poses.len() < FRESH {
        let point = poses.len() / 2;
        let (radius, load) =
            (if point.is_multiple_of(2) { 400.0 } else { 700.0 }, if point < FRESH / 4 { 0.0 } else { 1.5 });
        let azimuth = rng.between(-120.0, 120.0);
        let (sin, cos) = azimuth.to_radians().sin_cos();
        let expected = [radius * cos, radius * sin, rng.between(-150.0, 250.0)];
        let across = if azimuth < 0.0 { azimuth + 180.0 } else { azimuth - 180.0 };
        let lefty = reach(&chain, expected, [azimuth, -20.0, 150.0], &mut rng);
        let righty = reach(&chain, expected, [across, -160.0, 30.0], &mut rng);
        if let (Some(lefty), Some(righty)) = (lefty, righty) {
            poses.extend([(lefty, load), (righty, load)]);
        }
    }
    let mut text = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg,repeat\n".to_owned();
    for (pose, load) in poses {
        pose.iter().for_each(|joint| text.push_str(&format!("{joint:.4},")));
        text.push_str(&format!("{load},0\n"));
    }
    text
}

/// Joints (deg) with which the tip is there, near `start` in the first three, the wrist at random; none within some trials.
fn reach(chain: &Chain, expected: [f64; 3], start: [f64; 3], rng: &mut Xorshift) -> Option<[f64; 6]> {
    (0..30).find_map(|_| {
        let [first, second, third] = start;
        let wrist = [rng.between(-100.0, 100.0), rng.between(-90.0, 90.0), rng.between(-180.0, 180.0)];
        let mut q = [first, second, third, wrist[0], wrist[1], wrist[2]];
        for _ in 0..60 {
            let here = tip(chain, &q);
            let short = [0, 1, 2].map(|axis| expected[axis] - here[axis]);
            if short.iter().all(|part| part.abs() < 1e-6) {
                q[0] = (q[0] + 180.0).rem_euclid(360.0) - 180.0;
                return (inside(chain, &q) && clear(chain, &q)).then_some(q);
            }
            let columns = [0, 1, 2].map(|joint| {
                let mut moved = q;
                moved[joint] += 1e-4;
                let there = tip(chain, &moved);
                [0, 1, 2].map(|axis| (there[axis] - here[axis]) / 1e-4)
            });
            let turn = solve(columns, short)?;
            let most = turn.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
            let fraction = (20.0 / most.max(1e-12)).min(1.0);
            for (q, turn) in q.iter_mut().zip(turn) {
                *q += fraction * turn;
            }
        }
        None
    })
}

fn link_frames(chain: &Chain, q: &[f64; 6]) -> LinkFrames {
    LinkFrames::of(chain, &q.map(f64::to_radians), &[])
}

fn tip(chain: &Chain, q: &[f64; 6]) -> [f64; 3] {
    let flange = link_frames(chain, q).flange;
    (flange.rotation * nalgebra::Vector3::from(TIP_MM) + flange.translation.vector).into()
}

fn inside(chain: &Chain, q: &[f64; 6]) -> bool {
    chain.joints.iter().zip(q).all(|(joint, q)| {
        let (low, high) = joint.limits;
        (low.to_degrees() + 3.0..=high.to_degrees() - 3.0).contains(q)
    })
}

fn clear(chain: &Chain, q: &[f64; 6]) -> bool {
    link_frames(chain, q).joints.iter().all(|joint| joint.end.translation.z > LOWEST_MM)
}

/// Solves three equations whose columns are given.
fn solve(columns: [[f64; 3]; 3], right: [f64; 3]) -> Option<[f64; 3]> {
    let matrix = nalgebra::Matrix3::from_columns(&columns.map(nalgebra::Vector3::from));
    matrix.lu().solve(&nalgebra::Vector3::from(right)).map(Into::into)
}
