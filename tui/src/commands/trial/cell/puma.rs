//! The PUMA's cell: zeros found with ruler and level, and a laser tracker for the rest.

use plumb_simulated::physics::campaign::Truth;
use plumb_simulated::physics::random::Random;

use super::super::TrialError;
use super::{Fault, TrialCell, arm_faults, truth};

/// The cell.
pub(in super::super) const CELL: TrialCell = TrialCell {
    name: "puma",
    faults: &[
        "none",
        "compliance",
        "stiffening",
        "sag",
        "backlash",
        "harmonic",
        "coupling",
        "gain",
        "length",
        "offset",
        "twist",
        "skew",
        "warm_up",
    ],
    files,
    world,
    commands,
};

/// Where `measure-tip` looks for the poses it is to take.
pub(in super::super) const POSES: &str = "poses.csv";

const OPEN_WORLD: &str = include_str!("../../../../../workcells/puma/world-trial.yaml");

const FILES: [(&str, &str); 12] = [
    ("cell.yaml", include_str!("../../../../../workcells/puma/cell-trial.yaml")),
    ("lab.yaml", include_str!("../../../../../workcells/puma/lab.yaml")),
    ("answers.yaml", include_str!("../../../../../workcells/puma/answers.yaml")),
    (POSES, include_str!("../../../../../workcells/puma/poses.csv")),
    ("procedures/calibrate.yaml", include_str!("../../../../../workcells/puma/procedures/calibrate.yaml")),
    ("procedures/find-zeros.yaml", include_str!("../../../../../workcells/puma/procedures/find-zeros.yaml")),
    (
        "procedures/what-is-left.yaml",
        include_str!("../../../../../workcells/puma/procedures/what-is-left.yaml"),
    ),
    (
        "procedures/lefty-righty.yaml",
        include_str!("../../../../../workcells/puma/procedures/lefty-righty.yaml"),
    ),
    ("procedures/verify.yaml", include_str!("../../../../../workcells/puma/procedures/verify.yaml")),
    ("procedures/read-tip.yaml", include_str!("../../../../../workcells/puma/procedures/read-tip.yaml")),
    (
        "procedures/measure-tip.yaml",
        include_str!("../../../../../workcells/puma/procedures/measure-tip.yaml"),
    ),
    (
        "procedures/measure-heights.yaml",
        include_str!("../../../../../workcells/puma/procedures/measure-heights.yaml"),
    ),
];

/// Noise of a coordinate the tracker shows, mm.
const NOISE_MM: f64 = 0.05;

fn files() -> Vec<(&'static str, String)> {
    let changed = |text: &str| text.replace("world-trial.yaml", super::WORLD);
    FILES.iter().map(|(name, text)| (*name, changed(text))).collect()
}

fn commands(at: &str) -> String {
    let record = format!("--record {at}/record");
    format!(
        "  plumb run {at}/cell.yaml calibrate --headless {record}\n  \
         plumb show --procedure calibrate --table --as-left {record} > {at}/table.csv\n  \
         plumb model diagnose {at}/lab.yaml --data {at}/table.csv\n  \
         plumb model next {at}/lab.yaml --data {at}/table.csv -n 10 --csv --keep-out 0,0,1,-430 --payload 0,1.5 > {at}/{POSES}\n  \
         plumb run {at}/cell.yaml measure-tip --headless {record}\n  \
         plumb show 1 2 --table --as-left {record} > {at}/table.csv\n  \
         plumb model diagnose {at}/lab.yaml --data {at}/table.csv\n  \
         plumb run {at}/cell.yaml verify --headless {record}\n"
    )
}

fn world(fault: &Fault, seed: u64, rng: &mut Random) -> Result<(String, Truth), TrialError> {
    let drawn = arm_faults::draw(fault, rng)?;
    let imperfections =
        drawn.as_ref().map_or_else(String::new, |(line, _)| format!("    imperfections: [{{{line}}}]"));
    let lines = OPEN_WORLD.lines().map(|line| match line.trim_start() {
        line if line.starts_with("imperfections:") => imperfections.clone(),
        "seed: 1" => format!("seed: {seed}"),
        "calibration: potcal-trial.txt" => "calibration: potcal.txt".to_owned(),
        _ => line.to_owned(),
    });
    let text = lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n") + "\n";
    Ok((text, truth(seed, NOISE_MM, drawn.into_iter().map(|(_, hidden)| hidden).collect())))
}
