//! What the laboratory finds in measurements of real machines, as a table for the manual:
//! `cargo run --release -p plumb-diagnosis --example story -- FOLDER [SEED ...]`, with the folder's model files and tables (those
//! that are there). Beside the held-out rows, chosen at random, stand whole regions and the last part of the time left out,
//! and a warning where what was added does harm there. Seconds are of processor time, both cores together.

use std::path::Path;
use std::process::ExitCode;

use plumb_diagnosis::Step;
use plumb_diagnosis::laboratory::{Laboratory, LaboratoryError, Options};
use plumb_diagnosis::split::Holdout;
use plumb_estimation::Progress;
use plumb_report::diagnosis_sentence;

/// Name, model file, table, how rows are held out.
const MACHINES: [(&str, &str, &str, bool); 4] = [
    ("UR5", "ur5.yaml", "ur5-grid.csv", true),
    ("Panda, sockets", "panda_1-sockets.yaml", "panda_1-sockets.csv", false),
    ("UR10, b", "ur10.yaml", "ur10-b.csv", true),
    ("UR10, a", "ur10.yaml", "ur10-a.csv", true),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((folder, rest)) = arguments.split_first() else {
        eprintln!("story FOLDER [SEED ...]");
        return ExitCode::from(2);
    };
    let seeds: Vec<u64> = rest.iter().filter_map(|seed| seed.parse().ok()).collect();
    let seeds = if seeds.is_empty() { vec![1] } else { seeds };
    println!(
        "| machine | held out | base and tool | + zeros | + geometry | grown | effects taken in | regions left out | last 30 % of the time left out | warning | CPU s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let there = |problem: &&(&str, &str, &str, bool)| Path::new(folder).join(problem.2).exists();
    for (name, model, table, random) in MACHINES.iter().filter(there).copied() {
        for seed in seeds.iter().take(if random { seeds.len() } else { 1 }) {
            let holdout =
                if random { Holdout::Random { fraction: 0.3, seed: *seed } } else { Holdout::Session };
            match story(name, &Path::new(folder).join(model), &Path::new(folder).join(table), holdout) {
                Ok(line) => println!("{line}"),
                Err(error) => eprintln!("{name}: {error}"),
            }
        }
    }
    ExitCode::SUCCESS
}

fn story(name: &str, model: &Path, table: &Path, holdout: Holdout) -> Result<String, LaboratoryError> {
    let watch = Progress::unwatched();
    let mut cells = vec![name.to_owned(), holdout.to_string()];
    let ladder: [&[&str]; 3] = [&[], &["joint_zero(*)"], &["joint_zero(*)", "geometry(*)"]];
    for free in ladder {
        let free = Some(free.iter().map(|pattern| (*pattern).to_owned()).collect());
        let laboratory = Laboratory::open(model, table, Options { free, holdout, ..Options::default() })?;
        cells.push(figure(laboratory.compare(&watch)?.rms_mm.check));
    }
    let start = processor_seconds();
    let growth = Laboratory::open(model, table, Options { holdout, ..Options::default() })?.grow(&watch)?;
    cells.push(figure(growth.diagnosis.rms_mm.check));
    cells.push(match growth.steps.len() {
        0 => format!("none; {}", diagnosis_sentence(&growth.diagnosis)),
        count => {
            let named = |step: &&Step| step.added.effect.n.is_none();
            let label = |step: &Step| format!("{} ({:.2e} {})", step.label, step.added.size, step.added.unit);
            let first: Vec<&str> = growth.steps.iter().take(4).map(|step| step.label.as_str()).collect();
            let names: Vec<String> = growth.steps.iter().filter(named).map(label).collect();
            format!("{count}: {} ...; with a name: {}", first.join(", "), names.join(", "))
        }
    });
    for way in ["regions", "time:0.3"] {
        let found = growth.extrapolation.iter().find(|one| one.left_out == way);
        cells
            .push(found.map_or_else(String::new, |way| {
                format!("{:.3} ({:.3} without)", way.rms_mm, way.without_mm)
            }));
    }
    let harmful: Vec<&str> =
        growth.extrapolation.iter().filter(|way| way.harmful()).map(|way| way.left_out.as_str()).collect();
    cells.push(match harmful.as_slice() {
        [] => String::new(),
        several => format!("does not extrapolate: {}", several.join(", ")),
    });
    cells.push(format!("{:.0}", processor_seconds() - start));
    Ok(format!("| {} |", cells.join(" | ")))
}

fn figure(rms: Option<f64>) -> String {
    rms.map_or_else(String::new, |rms| format!("{rms:.3}"))
}

/// Processor time used so far, s, to a hundredth.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or("").split_whitespace().skip(11).take(2);
    fields.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}
