//! How long the laboratory takes over large tables of a made-up arm of six joints, and how much memory:
//! `cargo run --release -p plumb-diagnosis --example lab_time [ROWS ...]`. First a diagnosis of 1,000 rows, from the files to the
//! verdict with cross-validation and poses to measure next; then plain fits of its geometry to more and more rows. Seconds by the
//! clock and of processor time; memory is the most the process has held so far.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use nalgebra::Point3;
use plumb_calibration::arm_model::Model;
use plumb_calibration::fit::FitOptions;
use plumb_diagnosis::laboratory::{Laboratory, Options};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_estimation::Random;
use plumb_kinematics::{Deviation, DhParameter, LinkFrames};
use plumb_report::diagnosis_sentence;

const MODEL: &str = "
arm: made-up
convention: distal
joints:
  - {name: j1, a_mm: 0, alpha_deg: 90, d_mm: 141}
  - {name: j2, a_mm: -520, alpha_deg: 0, d_mm: 0}
  - {name: j3, a_mm: -437, alpha_deg: 0, d_mm: 0}
  - {name: j4, a_mm: 0, alpha_deg: 90, d_mm: 126}
  - {name: j5, a_mm: 0, alpha_deg: -90, d_mm: 97}
  - {name: j6, a_mm: 0, alpha_deg: 0, d_mm: 88}
links:
  - {after: j2, mass_kg: 8, centre_mm: [250, 0, 0]}
  - {after: j3, mass_kg: 3, centre_mm: [200, 0, 0]}
targets: {p1: {xyz_mm: [0, 0, 30], free: true}}
free: [joint_zero(*), geometry(*)]
noise: {p1_mm: 0.05}
";

/// A table of the arm with zeros a little off and a wheel of the second joint out of true.
fn table(model: &Model, rows: usize) -> Result<String, std::fmt::Error> {
    let mut random = Random::seeded(7);
    let zeros: Vec<f64> = (0..6).map(|_| 2e-3 * random.normal()).collect();
    let sides: String = (1..=6).map(|joint| format!(",approach_q{joint}")).collect();
    let mut text =
        format!("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,p1_x_mm,p1_y_mm,p1_z_mm,time_s{sides}\n");
    for row in 0..rows {
        let degrees: Vec<f64> =
            (0..6).map(|_| (300.0 * random.uniform() - 150.0).round_ties_even()).collect();
        let q: Vec<f64> = degrees.iter().map(|angle| angle.to_radians()).collect();
        let mut off = vec![Deviation::default(); 6];
        for (deviation, zero) in off.iter_mut().zip(&zeros) {
            deviation.add(DhParameter::Theta, *zero);
        }
        if let (Some(deviation), Some(angle)) = (off.get_mut(1), q.get(1)) {
            deviation.add(DhParameter::Theta, 3.5e-4 * (2.0 * angle + 0.7).sin());
        }
        let point = LinkFrames::of(&model.chain, &q, &off).flange * Point3::new(3.0, -2.0, 30.0);
        for angle in &degrees {
            write!(text, "{angle},")?;
        }
        for part in point.iter() {
            write!(text, "{:.4},", part + 0.05 * random.normal())?;
        }
        write!(text, "{}", 20 * row)?;
        for _ in 0..6 {
            text.push_str(if random.uniform() < 0.5 { ",-1" } else { ",1" });
        }
        text.push('\n');
    }
    Ok(text)
}

/// Processor time used so far, s, and the most memory held so far, MiB.
fn used() -> (f64, f64) {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or("").split_whitespace().skip(11).take(2);
    let ticks: f64 = fields.filter_map(|ticks| ticks.parse::<f64>().ok()).sum();
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let most = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let most = most.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
    (ticks / 100.0, most.unwrap_or(0.0) / 1024.0)
}

fn timed<T>(what: &str, work: impl FnOnce() -> Result<T, Box<dyn Error>>) -> Result<T, Box<dyn Error>> {
    let (start, (before, _)) = (Instant::now(), used());
    let found = work()?;
    let (after, most) = used();
    println!(
        "{what}: {:.2} s by the clock, {:.2} s of processor time; {most:.0} MiB",
        start.elapsed().as_secs_f64(),
        after - before
    );
    Ok(found)
}

fn main() -> Result<(), Box<dyn Error>> {
    let sizes: Vec<usize> = std::env::args().skip(1).filter_map(|rows| rows.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![1_000, 10_000, 100_000, 1_000_000] } else { sizes };
    let folder = tempfile::tempdir()?;
    let (model, data) = (folder.path().join("arm.yaml"), folder.path().join("table.csv"));
    std::fs::write(&model, MODEL)?;
    let arm = Model::read(&model)?;
    let watch = Progress::unwatched();
    std::fs::write(&data, table(&arm, 1000)?)?;
    let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
    println!("load {}", load.split_whitespace().next().unwrap_or("?"));
    for _ in 0..3 {
        let diagnosis = timed("diagnosis of 1000 rows, files to verdict", || {
            Ok(Laboratory::open(&model, &data, Options::default())?.diagnose(&watch)?)
        })?;
        println!("  {}", diagnosis_sentence(&diagnosis));
    }
    for rows in sizes {
        std::fs::write(&data, table(&arm, rows)?)?;
        fit(&model, &data, rows)?;
    }
    Ok(())
}

/// Reads a table and fits the geometry to all of it.
fn fit(model: &Path, data: &Path, rows: usize) -> Result<(), Box<dyn Error>> {
    let options = Options {
        holdout: Holdout::Random { fraction: 0.3, seed: 1 },
        fit: FitOptions { robust: false, ..FitOptions::default() },
        ..Options::default()
    };
    let laboratory = timed(&format!("reading {rows} rows"), || Ok(Laboratory::open(model, data, options)?))?;
    let rms = timed(&format!("comparing the model with {rows} rows (fit, cross-validation, floor)"), || {
        Ok(laboratory.compare(&Progress::unwatched())?.rms_mm)
    })?;
    println!("  rms {:.4} mm, held out {:.4} mm", rms.fit, rms.check.unwrap_or(f64::NAN));
    Ok(())
}
