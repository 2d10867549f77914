//! The light stripe's cell: a PUMA 560 with camera and projector on its flange, over a pyramid and a ball.

use plumb_simulated::physics::campaign::{Truth, Verdict};
use plumb_simulated::physics::random::Random;

use super::super::TrialError;
use super::{Fault, TrialCell, arm_faults, hidden, truth};
use crate::commands::stripe::study_world;

/// The cell.
pub(in super::super) const CELL: TrialCell = TrialCell {
    name: "light-stripe",
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
        "lens",
        "delay",
    ],
    files,
    world,
    commands,
};

/// How fast a scan in motion is, mm/s, without which a late exposure does not show.
pub(in super::super) const FLYING: &str = "fly_mm_s=160";

const OPEN_WORLD: &str = include_str!("../../../../../workcells/light-stripe/world.yaml");

const FILES: [(&str, &str); 5] = [
    ("arm.yaml", include_str!("../../../../../workcells/light-stripe/arm.yaml")),
    ("rig.yaml", include_str!("../../../../../workcells/light-stripe/rig.yaml")),
    ("scene.yaml", include_str!("../../../../../workcells/light-stripe/scene.yaml")),
    ("procedures/gather.yaml", include_str!("../../../../../workcells/light-stripe/procedures/gather.yaml")),
    (
        "procedures/direction-error.yaml",
        include_str!("../../../../../workcells/light-stripe/procedures/direction-error.yaml"),
    ),
];

/// What a point of a stripe is uncertain by, mm, about.
const NOISE_MM: f64 = 0.05;

fn files() -> Vec<(&'static str, String)> {
    let whole = include_str!("../../../../../workcells/light-stripe/cell.yaml");
    // Only what a trial needs: the other procedures, and the answers to what they ask, stay with the cell itself.
    let whole = whole.replace("\nanswers: answers.yaml", "");
    let cell = match whole.split_once("procedures: [") {
        Some((before, after)) => {
            let rest = after.split_once(']').map_or("", |(_, rest)| rest);
            format!("{before}procedures: [procedures/gather.yaml, procedures/direction-error.yaml]{rest}")
        }
        None => whole.clone(),
    };
    let others = FILES.iter().map(|(name, text)| (*name, (*text).to_owned()));
    std::iter::once(("cell.yaml", cell)).chain(others).collect()
}

fn commands(at: &str) -> String {
    let record = format!("--record {at}/record");
    format!(
        "  plumb run {at}/cell.yaml gather --headless {record}\n  \
         plumb stripe diagnose {at}/cell.yaml --scans {at}/record/run-1\n  \
         plumb stripe adjust {at}/cell.yaml --scans {at}/record/run-1 --add WHAT_IT_NAMES -o {at}/cell-true.yaml\n  \
         plumb run {at}/cell-true.yaml direction-error --headless {record}\n"
    )
}

fn world(fault: &Fault, seed: u64, rng: &mut Random) -> Result<(String, Truth), TrialError> {
    let of_arm = arm_faults::draw(fault, rng)?;
    let (kind, effect) = match fault.name.as_str() {
        "lens" => (study_world::Hidden::Lens, Some("lens_distortion")),
        "delay" => (study_world::Hidden::Delay, Some("clock_skew")),
        _ => (study_world::Hidden::Nothing, None),
    };
    let text = study_world::world(OPEN_WORLD, kind, seed).unwrap_or_else(|| OPEN_WORLD.to_owned());
    let (imperfections, hidden) = match (of_arm, effect) {
        (Some((line, hidden)), _) => (format!("\n    imperfections:\n      - {line}"), vec![hidden]),
        // By how much is not said: the world draws it.
        (None, Some(effect)) => (String::new(), vec![hidden(effect, "", 0.0, "")]),
        (None, None) => (String::new(), Vec::new()),
    };
    let mut lines: Vec<String> = Vec::new();
    for line in text.lines() {
        let zeros = line.trim_start().starts_with("zero_error:");
        lines.push(if zeros { format!("{line}{imperfections}") } else { line.to_owned() });
    }
    let mut truth = truth(seed, NOISE_MM, hidden);
    if fault.name == "warm_up" {
        // In the few minutes of its scans an arm warms up by little: that no name fits has to be said then.
        truth.accept_verdict.push(Verdict::Unknown);
    }
    Ok((lines.join("\n") + "\n", truth))
}
