//! How well Agin's procedure finds the zeros, over many worlds.

use std::fmt;
use std::ops::RangeInclusive;

use super::cells::{Cells, found, value};

/// What came out for one joint.
#[derive(Debug, Default)]
pub(crate) struct OfJoint {
    /// Runs that found its error within 0.05 deg.
    pub(crate) near: usize,
    /// Within three of the standard errors stated.
    pub(crate) covered: usize,
    squares: f64,
    worst: f64,
}

/// What came out over all worlds.
#[derive(Debug, Default)]
pub(crate) struct Figures {
    /// Joints 2 to 6.
    pub(crate) joints: [OfJoint; 5],
    /// Runs that ended well.
    pub(crate) runs: usize,
    /// Seeds of runs that ended without a result.
    pub(crate) without_result: Vec<u64>,
}

/// Finds the zeros of a world each, whose zeros are off by up to two degrees and nothing else.
pub(crate) fn recovered(seeds: RangeInclusive<u64>, progress: impl Fn(u64)) -> Figures {
    let cells = Cells::new();
    let plain = std::fs::read_to_string(cells.puma().join("world.yaml")).unwrap();
    let plain = plain.replace("    base: {tilt_x_deg: 0.12, tilt_y_deg: -0.2}\n", "");
    let plain = plain.replace(", tilt_x_deg: 0.1, tilt_y_deg: -0.25}", "}");
    let mut figures = Figures::default();
    for seed in seeds {
        progress(seed);
        cells.change_world(|_| plain.replace("seed: 1", &format!("seed: {seed}")));
        figures.add(&cells, seed, &[]);
    }
    figures
}

/// The same with the mount and the table out of level, and so many readings; only joints 2 to 4 feel it.
pub(crate) fn tilted(seeds: RangeInclusive<u64>, quadrants: u32, waist_deg: i32) -> Figures {
    let cells = Cells::new();
    let plain = std::fs::read_to_string(cells.puma().join("world.yaml")).unwrap();
    let plain = out_of_level(&plain);
    let (quadrants, waist) = (format!("quadrants={quadrants}"), format!("waist_deg={waist_deg}"));
    let mut figures = Figures::default();
    for seed in seeds {
        cells.change_world(|_| plain.replace("seed: 1", &format!("seed: {seed}")));
        figures.add(&cells, seed, &["--set", &quadrants, "--set", &waist]);
    }
    figures
}

/// Root mean square of joints 3 and 4 from the first reading alone (lefty, one direction of the waist) of runs with the mount out of level, deg.
pub(crate) fn from_one_reading(seeds: RangeInclusive<u64>, waist_deg: i32) -> [f64; 2] {
    let cells = Cells::new();
    let level = std::fs::read_to_string(cells.puma().join("world.yaml")).unwrap();
    let (mut squares, count) = ([0.0; 2], seeds.clone().count());
    for seed in seeds {
        cells.change_world(|_| out_of_level(&level).replace("seed: 1", &format!("seed: {seed}")));
        let waist = format!("waist_deg={waist_deg}");
        let (code, events, output) =
            cells.run("cell.yaml", &["find-zeros", "--set", "quadrants=1", "--set", &waist]);
        assert_eq!(code, Some(0), "{output}");
        let read = |step: &str, joint: &str| {
            let at = |step: &str| value(&events, &format!("levels[1].{step}"), joint);
            90.0 - (at(step) + at(&format!("{step}_turned"))) / 2.0
        };
        let truths = cells.true_errors();
        let found = [read("elbow_lefty", "elbow"), read("roll_lefty", "wrist_roll")];
        for ((square, found), truth) in squares.iter_mut().zip(found).zip(truths.iter().skip(1)) {
            *square += (found - truth).powi(2);
        }
    }
    squares.map(|square: f64| (square / count as f64).sqrt())
}

/// The world with its mount and its table well out of level.
fn out_of_level(plain: &str) -> String {
    let plain = plain.replace("{tilt_x_deg: 0.12, tilt_y_deg: -0.2}", "{tilt_x_deg: 0.4, tilt_y_deg: -0.7}");
    plain.replace("tilt_x_deg: 0.1, tilt_y_deg: -0.25}", "tilt_x_deg: 0.3, tilt_y_deg: -0.5}")
}

impl Figures {
    fn add(&mut self, cells: &Cells, seed: u64, more: &[&str]) {
        let mut arguments = vec!["find-zeros"];
        arguments.extend(more);
        let (code, events, _) = cells.run("cell.yaml", &arguments);
        if code != Some(0) {
            self.without_result.push(seed);
            return;
        }
        self.runs += 1;
        for (joint, ((found, error), truth)) in
            self.joints.iter_mut().zip(found(&events, "found").into_iter().zip(cells.true_errors()))
        {
            let off = (found - truth).abs();
            joint.near += usize::from(off < 0.05);
            joint.covered += usize::from(off < 3.0 * error);
            joint.squares += off * off;
            joint.worst = joint.worst.max(off);
        }
    }

    /// Root mean square of joints 2, 3 and 4, deg.
    pub(crate) fn of_the_arm(&self) -> [f64; 3] {
        let [second, third, fourth, ..] = &self.joints;
        [second, third, fourth].map(|joint| (joint.squares / self.runs.max(1) as f64).sqrt())
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            formatter,
            "| joint | within 0.05 deg | within three standard errors | root mean square, deg | worst, deg |"
        )?;
        writeln!(formatter, "|---|---|---|---|---|")?;
        for (number, joint) in self.joints.iter().enumerate() {
            let (runs, rms) = (self.runs, (joint.squares / self.runs.max(1) as f64).sqrt());
            let OfJoint { near, covered, worst, .. } = joint;
            writeln!(
                formatter,
                "| {} | {near} of {runs} | {covered} of {runs} | {rms:.3} | {worst:.3} |",
                number + 2
            )?;
        }
        write!(formatter, "runs without a result: {:?}", self.without_result)
    }
}
