//! Trials in a cell: `plumb trial new --cell NAME` builds a whole cell around a sealed world. What is hidden has to be found with the cell's own
//! sensors and instruments, by runs.

mod arm_faults;
mod described;
pub(super) mod light_stripe;
pub(super) mod puma;
pub(super) mod teachmover;

use std::fs;
use std::path::Path;

use plumb_simulated::physics::campaign::{Hidden, Truth, Verdict};
use plumb_simulated::physics::random::Random;
use plumb_simulated::world_file;

use crate::commands::trial::error::TrialError;
use crate::commands::trial::files::write;
use crate::commands::trial::outcome::Outcome;

/// Hides a fault in a world by the trial's seed: the world's text, and what is true.
type MakeWorld = fn(&Fault, u64, &mut Random) -> Result<(String, Truth), TrialError>;

/// A cell in which something can be hidden.
pub(super) struct TrialCell {
    /// As `--cell` names it.
    pub(super) name: &'static str,
    /// What can be hidden, as `--fault` names it: a bare name draws its site at random.
    pub(super) faults: &'static [&'static str],
    /// Its files, but for the world.
    files: fn() -> Vec<(&'static str, String)>,
    /// The text of the world in which this is hidden, and the truth.
    world: MakeWorld,
    /// What to do in it, for a directory of this name.
    commands: fn(&str) -> String,
}

/// The cells there are.
static CELLS: [TrialCell; 3] = [teachmover::CELL, puma::CELL, light_stripe::CELL];

/// The sealed world of a cell's trial.
pub(super) const WORLD: &str = "world.yaml";

/// With which the line of a world's text begins that holds the truth.
const TRUTH: &str = "# truth: ";

/// What to hide, as a person asks for it: `backlash`, or `backlash(elbow)`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fault {
    /// Its name.
    pub(super) name: String,
    /// Where, if not at random.
    pub(super) site: Option<String>,
}

impl Fault {
    fn read(text: &str) -> Self {
        let (name, rest) = text.split_once('(').unwrap_or((text, ""));
        let site = rest.trim_end().trim_end_matches(')').trim();
        Self { name: name.trim().to_owned(), site: (!site.is_empty()).then(|| site.to_owned()) }
    }
}

/// A cell by its name.
pub(super) fn find(name: &str) -> Result<&'static TrialCell, TrialError> {
    CELLS.iter().find(|cell| cell.name == name).ok_or_else(|| TrialError::UnknownCell {
        name: name.to_owned(),
        known: CELLS.iter().map(|cell| cell.name).chain(described::names()).collect::<Vec<_>>().join(", "),
    })
}

/// Whether something of this name can be hidden in a cell.
pub(super) fn check(cell: &TrialCell, fault: &str) -> Result<Fault, TrialError> {
    let fault = Fault::read(fault);
    match cell.faults.contains(&fault.name.as_str()) {
        true => Ok(fault),
        false => Err(TrialError::UnknownFault { name: fault.name, known: cell.faults.join(", ") }),
    }
}

/// One hidden thing; its sizes over the noise are not known beforehand.
pub(super) fn hidden(effect: &str, site: &str, size: f64, unit: &str) -> Hidden {
    Hidden {
        effect: effect.to_owned(),
        site: site.to_owned(),
        size,
        unit: unit.to_owned(),
        over_noise: 0.0,
        visible_over_noise: 0.0,
        standard_errors: 0.0,
        details: serde_json::Map::new(),
    }
}

/// The truth about a world in which these are hidden; the first by its plain name, the others by names that are the same thing in this cell's readings.
pub(super) fn truth(seed: u64, noise: f64, hidden: Vec<Hidden>) -> Truth {
    let accept_verdict = match hidden.is_empty() {
        true => vec![Verdict::AtFloor],
        false => vec![Verdict::Named, Verdict::Tied, Verdict::Located],
    };
    Truth {
        seed,
        effects: hidden.iter().take(1).map(|one| (one.effect.clone(), one.site.clone())).collect(),
        hidden,
        accept_verdict,
        grow: false,
        noise,
        outlier_rows: Vec::new(),
    }
}

/// Builds the cell: one of those with files of their own here, a shipped one of an arm that files describe, or a copy of a folder with such a cell.
pub(super) fn new(
    cell: &str,
    fault: Option<&str>,
    seed: u64,
    directory: &Path,
) -> Result<Outcome, TrialError> {
    let mut random = Random::new(seed, "cell trial");
    if let Some(files) = described::find(cell)? {
        let fault = described::fault(fault, &mut random)?;
        write_files(directory, &files)?;
        let (world, noise, hidden) = described::world(directory, fault.as_ref(), seed, &mut random)?;
        seal_world(directory, &world, &truth(seed, noise, hidden))?;
        return Ok(created(directory, |at| described::commands(at, &files)));
    }
    let cell = find(cell)?;
    let drawn = random.pick(cell.faults).copied().unwrap_or("none");
    let fault = check(cell, fault.unwrap_or(drawn))?;
    let (world, truth) = (cell.world)(&fault, seed, &mut random)?;
    let files: Vec<(String, String)> =
        (cell.files)().into_iter().map(|(name, text)| (name.to_owned(), text)).collect();
    write_files(directory, &files)?;
    seal_world(directory, &world, &truth)?;
    Ok(created(directory, cell.commands))
}

/// Writes a cell's files into a directory that has no world yet.
fn write_files(directory: &Path, files: &[(String, String)]) -> Result<(), TrialError> {
    if directory.join(WORLD).exists() {
        return Err(TrialError::Exists(directory.join(WORLD)));
    }
    for (name, text) in files {
        let path = directory.join(name);
        let folder = path.parent().unwrap_or(directory);
        fs::create_dir_all(folder).map_err(|source| TrialError::Write { path: folder.to_owned(), source })?;
        write(&path, text)?;
    }
    Ok(())
}

/// Writes the world under its seal, the truth in its first line.
fn seal_world(directory: &Path, world: &str, truth: &Truth) -> Result<(), TrialError> {
    let world = format!("{TRUTH}{}\n{world}", serde_json::to_string(truth).unwrap_or_default());
    let open = directory.join("world-open.yaml");
    write(&open, &world)?;
    let sealed = world_file::write_sealed(&open, &directory.join(WORLD));
    let removed = fs::remove_file(&open);
    sealed.map_err(|source| TrialError::World(Box::new(source)))?;
    removed.map_err(|source| TrialError::Write { path: open, source })
}

/// What is said of a cell that was built.
fn created(directory: &Path, commands: impl Fn(&str) -> String) -> Outcome {
    let at = directory.display().to_string();
    Outcome::done(format!(
        "A cell with something hidden in it, or nothing, is in {at}.\n{}  plumb trial reveal {at}\n",
        commands(&at)
    ))
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

/// A site among those where something can be: the one that was asked for, else the one that was drawn.
pub(super) fn site_for<'p, T>(
    fault: &Fault,
    sites: &'p [(&'static str, T)],
    drawn: usize,
) -> Result<&'p (&'static str, T), TrialError> {
    let known = || sites.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let found = match &fault.site {
        Some(requested) => sites.iter().find(|(name, _)| name == requested),
        None => sites.get(drawn % sites.len().max(1)),
    };
    found.ok_or_else(|| TrialError::UnknownSite {
        fault: fault.name.clone(),
        site: fault.site.clone().unwrap_or_default(),
        known: known(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_of_every_cell_makes_a_world_that_can_be_read_and_reveals_its_truth() {
        for cell in &CELLS {
            for (seed, fault) in (0..).zip(cell.faults) {
                let folder = tempfile::tempdir().unwrap();
                new(cell.name, Some(fault), seed, folder.path()).unwrap();
                let truth = open(folder.path()).unwrap();
                assert_eq!(truth.hidden.is_empty(), *fault == "none", "{} {fault}: {truth:?}", cell.name);
                let text = fs::read_to_string(folder.path().join(WORLD)).unwrap();
                assert!(
                    !text.contains("truth") && !text.contains("backlash"),
                    "{fault}: the seal hides nothing"
                );
                assert!(!folder.path().join("world-open.yaml").exists());
            }
        }
    }

    #[test]
    fn any_arm_that_files_describe_hides_what_its_joints_can_have() {
        for (cell, fault, effect, joint) in [
            ("ur5", Some("backlash(elbow)"), "joint_backlash", "elbow"),
            ("ur5", Some("joint_compliance(lift)"), "joint_compliance", "lift"),
            ("scara", Some("gain(slide)"), "joint_gain", "slide"),
            ("scara", Some("backlash(slide)"), "joint_backlash", "slide"),
        ] {
            let folder = tempfile::tempdir().unwrap();
            new(cell, fault, 3, folder.path()).unwrap();
            let truth = open(folder.path()).unwrap();
            assert_eq!(truth.effects, [(effect.to_owned(), joint.to_owned())], "{cell} {fault:?}");
            assert!(truth.hidden[0].visible_over_noise > 0.5, "{:?}", truth.hidden);
            let text = fs::read_to_string(folder.path().join(WORLD)).unwrap();
            assert!(!text.contains(joint) && !text.contains("imperfection"), "the seal hides nothing");
        }
        for seed in 0..12 {
            let folder = tempfile::tempdir().unwrap();
            new(if seed % 2 == 0 { "ur5" } else { "scara" }, None, seed, folder.path()).unwrap();
            open(folder.path()).unwrap();
        }
    }

    #[test]
    fn a_gantry_hides_what_only_slides_have() {
        for (fault, effect, joint) in [
            ("screw(z)", "screw_wave", "z"),
            ("roll(x)", "axis_roll", "x"),
            ("pitch(x)", "axis_pitch", "x"),
            ("axis_yaw(y)", "axis_yaw", "y"),
        ] {
            let folder = tempfile::tempdir().unwrap();
            new("gantry", Some(fault), 3, folder.path()).unwrap();
            let truth = open(folder.path()).unwrap();
            assert_eq!(truth.effects, [(effect.to_owned(), joint.to_owned())], "{fault}");
            assert!(truth.hidden[0].visible_over_noise > 0.5, "{:?}", truth.hidden);
        }
    }

    #[test]
    fn a_copy_of_a_folder_is_a_cell_to_hide_something_in() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells/scara");
        let directory = tempfile::tempdir().unwrap();
        let built = new(&folder.display().to_string(), Some("none"), 1, directory.path()).unwrap();
        assert!(built.message.contains("scara.model.yaml"), "{}", built.message);
        assert!(open(directory.path()).unwrap().hidden.is_empty());
        assert!(directory.path().join("procedures/verify.yaml").exists());
    }

    #[test]
    fn what_an_arm_cannot_have_is_refused_with_what_it_can() {
        let refused = |cell: &str, fault: &str| {
            let folder = tempfile::tempdir().unwrap();
            new(cell, Some(fault), 1, folder.path()).err().unwrap().to_string()
        };
        assert!(refused("scara", "harmonic(slide)").contains("cannot sit at `slide`"));
        assert!(refused("gantry", "screw(y)").contains("cannot sit at `y`; on this arm it can at x, z"));
        assert!(refused("ur5", "yaw").contains("the arm ur5 has no joint at which `axis_yaw` could show"));
        assert!(refused("ur5", "rust").contains("known are none, compliance"));
        assert!(refused("nowhere", "none").contains("teachmover, puma, light-stripe, ur5, scara"));
    }

    #[test]
    fn a_fault_is_put_where_it_is_asked_for_or_the_sites_there_are_are_named() {
        let folder = tempfile::tempdir().unwrap();
        new("teachmover", Some("droop(shoulder)"), 5105, folder.path()).unwrap();
        let truth = open(folder.path()).unwrap();
        assert_eq!(truth.effects, [("joint_compliance".to_owned(), "shoulder".to_owned())]);
        let refused = |fault: &str| {
            let folder = tempfile::tempdir().unwrap();
            new("teachmover", Some(fault), 1, folder.path()).err().unwrap().to_string()
        };
        assert!(
            refused("droop(knee)").contains("shoulder, elbow, wrist_pitch"),
            "{}",
            refused("droop(knee)")
        );
        assert!(refused("rust").contains("known are none, spot"), "{}", refused("rust"));
    }

    #[test]
    fn over_many_seeds_every_joint_gets_its_faults() {
        let mut effects = std::collections::BTreeSet::new();
        for seed in 0..60 {
            for name in ["droop", "backlash", "coupling", "length", "lost_steps"] {
                let fault = Fault { name: name.to_owned(), site: None };
                let mut rng = Random::new(seed, "cell trial");
                let (_, truth) = (teachmover::CELL.world)(&fault, seed, &mut rng).unwrap();
                effects.extend(truth.effects);
            }
        }
        let count = |effect: &str| effects.iter().filter(|(name, _)| name == effect).count();
        assert_eq!([count("joint_compliance"), count("joint_backlash"), count("joint_coupling")], [3, 4, 2]);
        assert_eq!([count("link_length"), count("link_offset"), count("joint_step")], [2, 2, 3]);
    }
}
