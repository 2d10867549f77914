//! Trials in a cell: `plumb trial new --cell teachmover` builds a whole cell around a sealed world. What is hidden has to be found with the cell's own
//! sensor, by runs.

use std::fs;
use std::path::Path;

use plumb_simulated::physics::campaign::{Hidden, Truth, Verdict};
use plumb_simulated::physics::random::Random;
use plumb_simulated::world_file;

use super::{Outcome, TrialError};

/// The cells there are.
pub(super) const CELLS: [&str; 1] = ["teachmover"];

/// What can be hidden in the TeachMover's.
pub(super) const FAULTS: [&str; 6] = ["none", "spot", "backlash", "coupling", "droop", "lost_steps"];

/// The sealed world of a cell's trial.
pub(super) const WORLD: &str = "world.yaml";

/// Where `measure-poses` looks for the poses it is to take.
pub(super) const POSES: &str = "poses.csv";

/// With which the line of a world's text begins that holds the truth.
const TRUTH: &str = "# truth: ";

const FILES: [(&str, &str); 11] = [
    ("cell.yaml", include_str!("../../../workcells/teachmover/cell-trial.yaml")),
    ("trial.model.yaml", include_str!("../../../workcells/teachmover/trial.model.yaml")),
    ("answers-trial.yaml", include_str!("../../../workcells/teachmover/answers-trial.yaml")),
    ("procedures/find-zeros.yaml", include_str!("../../../workcells/teachmover/procedures/find-zeros.yaml")),
    (
        "procedures/waist-initialization.yaml",
        include_str!("../../../workcells/teachmover/procedures/waist-initialization.yaml"),
    ),
    (
        "procedures/shoulder-elbow-initialization.yaml",
        include_str!("../../../workcells/teachmover/procedures/shoulder-elbow-initialization.yaml"),
    ),
    (
        "procedures/measure-by-triggers.yaml",
        include_str!("../../../workcells/teachmover/procedures/measure-by-triggers.yaml"),
    ),
    (
        "procedures/measure-poses.yaml",
        include_str!("../../../workcells/teachmover/procedures/measure-poses.yaml"),
    ),
    (POSES, include_str!("../../../workcells/teachmover/poses.csv")),
    (
        "procedures/verify-by-points.yaml",
        include_str!("../../../workcells/teachmover/procedures/verify-by-points.yaml"),
    ),
    ("procedures/read-point.yaml", include_str!("../../../workcells/teachmover/procedures/read-point.yaml")),
];

const OPEN_WORLD: &str = include_str!("../../../workcells/teachmover/world-trial.yaml");

/// Joint, motor, and half-steps a second at full speed: those rated without load, and for the elbow those of the gripper, whose motor turns along.
const RATED: [(&str, &str, f64); 3] =
    [("waist", "base", 472.0), ("shoulder", "shoulder", 405.0), ("elbow", "elbow", 292.0)];

/// One thing hidden: what the world's file says of the arm, and what the lab calls it.
struct Fault {
    /// Keys of `arm: teachmover:` in the world file.
    arm: String,
    spot_mm: f64,
    hidden: Option<Hidden>,
    accept: Vec<Verdict>,
}

/// Builds the cell.
pub(super) fn new(
    cell: &str,
    fault: Option<&str>,
    seed: u64,
    directory: &Path,
) -> Result<Outcome, TrialError> {
    if !CELLS.contains(&cell) {
        return Err(TrialError::UnknownCell { name: cell.to_owned(), known: CELLS.join(", ") });
    }
    let mut lot = Random::new(seed, "cell trial");
    let drawn = lot.pick(&FAULTS).copied().unwrap_or("none");
    let world = world_text(fault.unwrap_or(drawn), seed, &mut lot)?;
    if directory.join(WORLD).exists() {
        return Err(TrialError::Exists(directory.join(WORLD)));
    }
    let make = |path: &Path| {
        fs::create_dir_all(path).map_err(|source| TrialError::Write { path: path.to_owned(), source })
    };
    make(directory)?;
    make(&directory.join("procedures"))?;
    for (name, text) in FILES {
        // The way to the zeros is driven without haste, so that steps are lost where they can be dated.
        let text = text
            .replace("world-trial.yaml", WORLD)
            .replace("chunk_deg: 1, speed: 1}", "chunk_deg: 1, speed: 0.3}");
        super::write(&directory.join(name), &text)?;
    }
    let open = directory.join("world-open.yaml");
    super::write(&open, &world)?;
    let sealed = world_file::write_sealed(&open, &directory.join(WORLD));
    let removed = fs::remove_file(&open);
    sealed.map_err(|source| TrialError::World(Box::new(source)))?;
    removed.map_err(|source| TrialError::Write { path: open, source })?;
    let at = directory.display();
    Ok(Outcome::done(format!(
        "A cell with something hidden in it, or nothing, stands in {at}.\n  \
         plumb run {at}/cell.yaml find-zeros --record {at}/record\n  \
         plumb run {at}/cell.yaml measure-by-triggers --record {at}/record\n  \
         plumb show --procedure measure-by-triggers --table --record {at}/record > {at}/table.csv\n  \
         plumb model diagnose {at}/trial.model.yaml --data {at}/table.csv\n  \
         plumb run {at}/cell.yaml verify-by-points --record {at}/record\n  \
         plumb trial reveal {at}\n"
    )))
}

/// The truth of a cell's trial.
pub(super) fn open(directory: &Path) -> Result<Truth, TrialError> {
    let path = directory.join(WORLD);
    let described = world_file::read(&path).map_err(|source| TrialError::World(Box::new(source)))?;
    let text = described.sealed_text().map(str::to_owned).unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(TRUTH));
    let truth = line.and_then(|json| serde_json::from_str(json).ok());
    truth.ok_or(TrialError::NoTruth(path))
}

fn world_text(name: &str, seed: u64, lot: &mut Random) -> Result<String, TrialError> {
    // Drawn first, so that the same seed is the same arm whatever is hidden in it.
    let [waist, shoulder, elbow, pitch] = [1.5, 1.5, 1.0, 0.5].map(|most| lot.between(-most, most));
    let [x, y, turn] = [0.3, 0.3, 0.1].map(|most| lot.between(-most, most));
    let fault = fault(name, lot)?;
    let truth = Truth {
        seed,
        effects: fault.hidden.iter().map(|one| (one.effect.clone(), one.place.clone())).collect(),
        hidden: fault.hidden.into_iter().collect(),
        accept_verdict: fault.accept,
        grow: false,
        noise: 0.06,
        outlier_rows: Vec::new(),
    };
    let zeros = "zero_error: {waist_deg: 1.2, shoulder_deg: -1.4, elbow_deg: 0.8, wrist_pitch_deg: 0.4}";
    let drawn = format!(
        "zero_error: {{waist_deg: {waist:.4}, shoulder_deg: {shoulder:.4}, elbow_deg: {elbow:.4}, wrist_pitch_deg: {pitch:.4}}}{}",
        fault.arm
    );
    let text = OPEN_WORLD
        .replace("seed: 1\n", &format!("seed: {seed}\n"))
        .replace(zeros, &drawn)
        .replace("diameter_mm: 1,", &format!("diameter_mm: {:.3},", fault.spot_mm))
        .replace(
            "    patch_margin_mm",
            &format!(
                "    misplaced: {{x_mm: {x:.4}, y_mm: {y:.4}, turn_deg: {turn:.4}}}\n    patch_margin_mm"
            ),
        );
    Ok(format!("{TRUTH}{}\n{text}", serde_json::to_string(&truth).unwrap_or_default()))
}

fn fault(name: &str, lot: &mut Random) -> Result<Fault, TrialError> {
    let one_of_three = lot.below(3);
    let (joint, motor, rated) = RATED.get(one_of_three).copied().unwrap_or(("elbow", "elbow", 292.0));
    let share = lot.between(0.0, 1.0);
    let sign = if lot.chance(0.5) { 1.0 } else { -1.0 };
    let size = |low: f64, high: f64| low + (high - low) * share;
    let with = |arm: String, effect: &str, place: &str, size: f64, unit: &str| {
        let hidden = Hidden {
            effect: effect.to_owned(),
            place: place.to_owned(),
            size,
            unit: unit.to_owned(),
            over_noise: 0.0,
            visible_over_noise: 0.0,
            standard_errors: 0.0,
            details: serde_json::Map::new(),
        };
        Fault {
            arm: format!("\n    {arm}"),
            spot_mm: 1.0,
            hidden: Some(hidden),
            accept: vec![Verdict::Named, Verdict::Tied, Verdict::Located],
        }
    };
    let whole = |value: f64| (value * 1e4).round() / 1e4;
    Ok(match name {
        "none" => Fault { arm: String::new(), spot_mm: 1.0, hidden: None, accept: vec![Verdict::AtFloor] },
        "spot" => {
            let wider = whole(size(2.0, 4.0));
            let known = with(String::new(), "trigger_spot", "sensor", wider, "mm");
            Fault { arm: String::new(), spot_mm: 1.0 + wider, ..known }
        }
        "backlash" => {
            let play = whole(size(0.3, 0.7));
            with(format!("backlash: {{{joint}_deg: {play}}}"), "joint_backlash", joint, play, "deg")
        }
        "coupling" => {
            let drag = whole(sign * size(0.01, 0.02));
            let mut fault = with(
                format!("cable_drag: {{elbow_deg_per_shoulder_deg: {drag}}}"),
                "joint_coupling",
                "elbow",
                drag,
                "1",
            );
            if let Some(hidden) = &mut fault.hidden {
                hidden.details.insert("with".to_owned(), "shoulder".into());
            }
            fault
        }
        "droop" => {
            let give = whole(size(0.5, 1.0));
            let masses = "upper_arm_kg: 0.9, forearm_kg: 0.5, hand_kg: 0.4";
            let text = format!("droop: {{{masses}, elbow_deg_per_nm: {give}}}");
            with(text, "joint_compliance", "elbow", give.to_radians(), "rad/(N m)")
        }
        "lost_steps" => {
            let holds = (rated * size(0.8, 0.9)).round();
            // How far it will be off (0 here: not known) depends on where in its turns the motor falls out of step.
            let text = format!("pull_out_half_steps_per_s: {{{motor}: {holds}}}");
            with(text, "joint_step", joint, 0.0, "deg")
        }
        other => return Err(TrialError::UnknownFault { name: other.to_owned(), known: FAULTS.join(", ") }),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_makes_a_world_that_can_be_read_and_tells_its_truth() {
        for (seed, fault) in (0..).zip(FAULTS) {
            let place = tempfile::tempdir().unwrap();
            new("teachmover", Some(fault), seed, place.path()).unwrap();
            let truth = open(place.path()).unwrap();
            assert_eq!(truth.hidden.is_empty(), fault == "none", "{fault}: {truth:?}");
            let text = fs::read_to_string(place.path().join(WORLD)).unwrap();
            assert!(!text.contains("truth") && !text.contains("backlash"), "{fault}: the seal hides nothing");
            assert!(!place.path().join("world-open.yaml").exists());
        }
    }

    #[test]
    fn the_arm_of_a_seed_is_the_same_whatever_is_hidden_in_it() {
        let zeros = |fault: &str| {
            let text = world_text(fault, 7, &mut Random::new(7, "cell trial")).unwrap();
            text.lines().find(|line| line.contains("zero_error")).unwrap().to_owned()
        };
        assert_eq!(zeros("none"), zeros("droop"));
    }
}
