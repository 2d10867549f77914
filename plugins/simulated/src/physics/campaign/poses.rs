//! Which poses are visited, in which order, from which side, when, and under which load.

use crate::physics::random::Random;
use crate::physics::rigid::Rigid;
use crate::physics::shape::Shape;

use super::specification::{Approach, Reading, Specification, Spread};
use super::touch;
pub use super::visit::Visit;
use super::visit::{anywhere, rounded, windows};

/// An inclinometer reads while its z rises at least so much: within 60 degrees of upright.
const LEAST_UPRIGHT: f64 = 0.5;

/// Plans the visits of a campaign.
pub fn plan(specification: &Specification, seed: u64) -> Vec<Visit> {
    let mut random = Random::new(seed, "poses");
    let windows = windows(specification, &mut random);
    if specification.reading == Reading::Touch {
        return touching(specification, seed, &mut random);
    }
    let mut poses: Vec<(Option<usize>, Vec<f64>)> = match specification.spread {
        Spread::Grid => grid(&windows, specification.poses, &mut random),
        Spread::Wide | Spread::Narrow => {
            (0..specification.poses).filter_map(|_| readable(specification, &windows, &mut random)).collect()
        }
    }
    .into_iter()
    .map(|pose| (None, pose))
    .collect();
    let singles = poses.len();
    for number in 1..=specification.repeated_poses {
        if let Some(pose) = readable(specification, &windows, &mut random) {
            poses.extend(std::iter::repeat_n((Some(number), pose), specification.returns));
        }
    }
    if specification.spread == Spread::Grid {
        strew(&mut poses, singles, &mut random);
    } else {
        random.shuffle(&mut poses);
    }
    visits(specification, poses, seed)
}

/// Visits to sockets, in random order.
fn touching(specification: &Specification, seed: u64, random: &mut Random) -> Vec<Visit> {
    let mut found = touch::poses(specification, seed, random);
    random.shuffle(&mut found);
    let (sockets, poses): (Vec<usize>, Vec<_>) =
        found.into_iter().map(|(socket, pose)| (socket, (None, pose))).unzip();
    let mut visits = visits(specification, poses, seed);
    for (visit, socket) in visits.iter_mut().zip(sockets) {
        visit.touch = Some(socket);
    }
    visits
}

/// A pose someone chose to measure besides.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// Commanded joint angles, degrees.
    pub commanded_deg: Vec<f64>,
    /// The way in which each joint is to arrive, as above; at random where empty.
    pub sides: Vec<f64>,
    /// kg.
    pub payload_kg: f64,
}

/// When each visit is and how warm it is then.
struct Timetable {
    pace_s: f64,
    day: Day,
}

impl Timetable {
    fn new(specification: &Specification, visits: usize, random: &mut Random) -> Self {
        let pace_s = random.between(40.0, 95.0);
        Self { pace_s, day: Day::new(specification.heat, pace_s * visits as f64, random) }
    }

    fn time_s(&self, visit: usize) -> f64 {
        (self.pace_s * visit as f64).round()
    }

    fn temperature_c(&self, time_s: f64) -> f64 {
        rounded(self.day.temperature_c(time_s), 100.0)
    }
}

fn visits(specification: &Specification, poses: Vec<(Option<usize>, Vec<f64>)>, seed: u64) -> Vec<Visit> {
    let mut random = Random::new(seed, "conditions");
    let timetable = Timetable::new(specification, poses.len(), &mut random);
    let mut before: Vec<f64> = vec![0.0; specification.arm.joints.len()];
    let mut visits = Vec::with_capacity(poses.len());
    for (index, (repeat, commanded_deg)) in poses.into_iter().enumerate() {
        let time_s = timetable.time_s(index);
        let sides = match specification.approach {
            Approach::EitherSide => commanded_deg.iter().map(|_| random.sign()).collect(),
            Approach::Straight => straight_sides(&before, &commanded_deg),
        };
        before.clone_from(&commanded_deg);
        let payload_kg = random.pick(&specification.payloads_kg).copied().unwrap_or(0.0);
        let temperature_c = timetable.temperature_c(time_s);
        visits.push(Visit { sides, time_s, temperature_c, payload_kg, repeat, ..Visit::to(commanded_deg) });
    }
    visits
}

/// The visits to chosen poses that follow those of the campaign `so_far`, at its pace and through its day.
pub fn further(specification: &Specification, seed: u64, so_far: &[Visit], chosen: &[Chosen]) -> Vec<Visit> {
    let timetable = Timetable::new(specification, so_far.len(), &mut Random::new(seed, "conditions"));
    let mut random = Random::new(seed, "further");
    let mut before = so_far.last().map_or_else(Vec::new, |visit| visit.commanded_deg.clone());
    let mut visits = Vec::with_capacity(chosen.len());
    for (index, pose) in chosen.iter().enumerate() {
        let commanded_deg: Vec<f64> =
            pose.commanded_deg.iter().map(|angle| rounded(*angle, 1000.0)).collect();
        let at_random: Vec<f64> = commanded_deg.iter().map(|_| random.sign()).collect();
        let sides = match specification.approach {
            Approach::Straight => straight_sides(&before, &commanded_deg),
            Approach::EitherSide => {
                let side = |(joint, random_side): (usize, &f64)| match pose.sides.get(joint) {
                    Some(side) if *side != 0.0 => side.signum(),
                    _ => *random_side,
                };
                at_random.iter().enumerate().map(side).collect()
            }
        };
        before.clone_from(&commanded_deg);
        let time_s = timetable.time_s(so_far.len() + index);
        let temperature_c = timetable.temperature_c(time_s);
        let payload_kg = pose.payload_kg;
        visits.push(Visit { sides, time_s, temperature_c, payload_kg, ..Visit::to(commanded_deg) });
    }
    visits
}

fn straight_sides(before: &[f64], now: &[f64]) -> Vec<f64> {
    now.iter().zip(before).map(|(now, then)| sign_of(now - then)).collect()
}

fn sign_of(difference: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference.signum() }
}

/// The temperature over a campaign: steady, or a day's rise and fall with a door that opens now and then.
struct Day {
    duration_s: f64,
    swing: f64,
    phase: f64,
    /// When a door opens, and how much colder that makes it.
    doors: [(f64, f64); 3],
}

impl Day {
    fn new(heat: bool, duration_s: f64, random: &mut Random) -> Self {
        let warm = f64::from(u8::from(heat));
        let (swing, phase) = (warm * random.between(10.0, 16.0), random.between(-1.2, 0.3));
        let doors = [(); 3].map(|()| (random.between(0.0, duration_s), warm * random.between(2.0, 5.0)));
        Self { duration_s, swing, phase, doors }
    }

    fn temperature_c(&self, time_s: f64) -> f64 {
        let fraction = time_s / self.duration_s;
        let since = |at: f64| (time_s - at) / (0.08 * self.duration_s);
        let drop = |(at, depth): &(f64, f64)| if time_s >= *at { depth * (-since(*at)).exp() } else { 0.0 };
        let rise = self.swing * ((fraction * 4.5 + self.phase).sin() - self.phase.sin());
        20.0 + rise - self.doors.iter().map(drop).sum::<f64>()
    }
}

/// A pose anywhere at which the instrument can read; `None` when there is hardly one.
fn readable(specification: &Specification, windows: &[[f64; 2]], random: &mut Random) -> Option<Vec<f64>> {
    if specification.reading != Reading::Tilt {
        return Some(anywhere(windows, random));
    }
    let arm = Shape::nominal(&specification.arm).arm();
    let upright = |pose: &Vec<f64>| {
        let angles: Vec<f64> = pose.iter().map(|angle| angle.to_radians()).collect();
        arm.link_frames(&angles, &[], Rigid::IDENTITY).world_from_flange.rotation.z.z > LEAST_UPRIGHT
    };
    (0..200).map(|_| anywhere(windows, random)).find(upright)
}

/// A lattice of the first three joints, walked to and fro; the others turn through a few fixed angles.
fn grid(windows: &[[f64; 2]], count: usize, random: &mut Random) -> Vec<Vec<f64>> {
    let levels = (count.max(1) as f64).cbrt().ceil() as usize;
    let wrist: Vec<Vec<f64>> = (0..4).map(|_| anywhere(windows, random)).collect();
    let at = |level: usize, [low, high]: [f64; 2]| {
        let step = ((high - low) / levels as f64 / 5.0).floor().max(1.0) * 5.0;
        rounded(0.5 * (low + high) + step * (level as f64 - 0.5 * (levels as f64 - 1.0)), 1000.0)
    };
    let to_and_fro =
        |index: usize, round: usize| if round.is_multiple_of(2) { index } else { levels - 1 - index };
    let pose = |number: usize| {
        let (outer, middle, inner) = (number / (levels * levels), number / levels % levels, number % levels);
        let lattice = [outer, to_and_fro(middle, outer), to_and_fro(inner, number / levels)];
        let mut pose = wrist.get(number % 4).cloned().unwrap_or_default();
        for ((angle, level), window) in pose.iter_mut().zip(lattice).zip(windows) {
            *angle = at(level, *window);
        }
        pose
    };
    (0..count).map(pose).collect()
}

/// Spreads the returns (which are at the end) among the single poses without disturbing their order.
fn strew(poses: &mut Vec<(Option<usize>, Vec<f64>)>, singles: usize, random: &mut Random) {
    let mut returns = poses.split_off(singles.min(poses.len()));
    random.shuffle(&mut returns);
    for visit in returns {
        let index = random.below(poses.len() + 1);
        poses.insert(index, visit);
    }
}
