//! Cells of arms that files describe, whichever arm it is: what is hidden is drawn from what the arm's own joints can have, as large as its own
//! poses and its own tracker show.

use std::fs;
use std::path::Path;

use plumb_document::{FileKind, read_text};
use plumb_simulated::arm::ArmWorldDescription;
use plumb_simulated::arm::file::imperfection_yaml;
use plumb_simulated::physics::campaign::catalogue::Choice;
use plumb_simulated::physics::campaign::{Hidden, hide_at_poses};
use plumb_simulated::physics::random::Random;
use plumb_simulated::world_file::{self, Described};

use super::super::TrialError;
use super::{Fault, WORLD};

/// What can be hidden, and the effect that it is.
const FAULTS: [(&str, &str); 11] = [
    ("compliance", "joint_compliance"),
    ("stiffening", "joint_stiffening"),
    ("sag", "link_sag"),
    ("backlash", "joint_backlash"),
    ("harmonic", "joint_harmonic"),
    ("coupling", "joint_coupling"),
    ("gain", "joint_gain"),
    ("length", "link_length"),
    ("offset", "link_offset"),
    ("twist", "link_twist"),
    ("skew", "axis_skew"),
];

/// What slides alone have: hidden where it is asked for, or drawn for an arm with a screw.
const OF_SLIDES: [(&str, &str); 4] =
    [("screw", "screw_wave"), ("roll", "axis_roll"), ("pitch", "axis_pitch"), ("yaw", "axis_yaw")];

/// What is hidden where it is asked for and never drawn: what a seed draws stays what it was.
const ASKED: [(&str, &str); 2] = [("torsion", "link_torsion"), ("lag", "joint_lag")];

/// What can be hidden in any arm, and what in one that slides.
fn faults() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    FAULTS.iter().chain(&OF_SLIDES).chain(&ASKED)
}

/// The name with which nothing is hidden.
const NONE: &str = "none";

/// How far what is hidden moves the tip, in standard deviations of the tracker, root mean square: so much that an honest analyst of a
/// table of some fifty poses cannot miss it.
const OVER_NOISE: (f64, f64) = (6.0, 12.0);

/// How often an effect is drawn before giving up: an arm of parallel axes cannot show most of them.
const DRAWS: usize = 40;

/// The table of poses that the trial's cell measures.
const POSES: &str = "poses.csv";

/// One file of a cell.
type CellFile = (String, String);

/// The shipped cells of this kind.
const SHIPPED: [(&str, &[(&str, &str)]); 3] = [
    (
        "ur5",
        &[
            ("cell.yaml", include_str!("../../../../../workcells/ur5/cell.yaml")),
            ("answers.yaml", include_str!("../../../../../workcells/ur5/answers.yaml")),
            ("ur5.arm.yaml", include_str!("../../../../../workcells/ur5/ur5.arm.yaml")),
            ("ur5.model.yaml", include_str!("../../../../../workcells/ur5/ur5.model.yaml")),
            (POSES, include_str!("../../../../../workcells/ur5/poses.csv")),
            (WORLD, include_str!("../../../../../workcells/ur5/world.yaml")),
            (
                "procedures/measure-tip.yaml",
                include_str!("../../../../../workcells/ur5/procedures/measure-tip.yaml"),
            ),
            (
                "procedures/read-tip.yaml",
                include_str!("../../../../../workcells/ur5/procedures/read-tip.yaml"),
            ),
            ("procedures/verify.yaml", include_str!("../../../../../workcells/ur5/procedures/verify.yaml")),
        ],
    ),
    (
        "scara",
        &[
            ("cell.yaml", include_str!("../../../../../workcells/scara/cell.yaml")),
            ("answers.yaml", include_str!("../../../../../workcells/scara/answers.yaml")),
            ("scara.arm.yaml", include_str!("../../../../../workcells/scara/scara.arm.yaml")),
            ("scara.model.yaml", include_str!("../../../../../workcells/scara/scara.model.yaml")),
            (POSES, include_str!("../../../../../workcells/scara/poses.csv")),
            (WORLD, include_str!("../../../../../workcells/scara/world.yaml")),
            (
                "procedures/measure-tip.yaml",
                include_str!("../../../../../workcells/scara/procedures/measure-tip.yaml"),
            ),
            (
                "procedures/read-tip.yaml",
                include_str!("../../../../../workcells/scara/procedures/read-tip.yaml"),
            ),
            ("procedures/verify.yaml", include_str!("../../../../../workcells/scara/procedures/verify.yaml")),
        ],
    ),
    (
        "gantry",
        &[
            ("cell.yaml", include_str!("../../../../../workcells/gantry/cell.yaml")),
            ("answers.yaml", include_str!("../../../../../workcells/gantry/answers.yaml")),
            ("gantry.arm.yaml", include_str!("../../../../../workcells/gantry/gantry.arm.yaml")),
            ("gantry.model.yaml", include_str!("../../../../../workcells/gantry/gantry.model.yaml")),
            (POSES, include_str!("../../../../../workcells/gantry/poses.csv")),
            (WORLD, include_str!("../../../../../workcells/gantry/world.yaml")),
            (
                "procedures/measure-tip.yaml",
                include_str!("../../../../../workcells/gantry/procedures/measure-tip.yaml"),
            ),
            (
                "procedures/read-tip.yaml",
                include_str!("../../../../../workcells/gantry/procedures/read-tip.yaml"),
            ),
            (
                "procedures/verify.yaml",
                include_str!("../../../../../workcells/gantry/procedures/verify.yaml"),
            ),
        ],
    ),
];

/// The names of the shipped cells, for messages.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    SHIPPED.iter().map(|(name, _)| *name)
}

/// The files of a shipped cell by its name, or of a folder of a user's own with a `cell.yaml` in it; none where neither is meant.
pub(super) fn find(name: &str) -> Result<Option<Vec<CellFile>>, TrialError> {
    if let Some((_, files)) = SHIPPED.iter().find(|(known, _)| *known == name) {
        return Ok(Some(files.iter().map(|(file, text)| ((*file).to_owned(), (*text).to_owned())).collect()));
    }
    let folder = Path::new(name);
    if !folder.join("cell.yaml").is_file() {
        return Ok(None);
    }
    let mut files = Vec::new();
    for part in ["", "procedures"] {
        files.extend(files_of(folder, part)?);
    }
    Ok(Some(files))
}

/// The texts of a cell's folder: YAML, tables and URDF.
fn files_of(folder: &Path, part: &str) -> Result<Vec<CellFile>, TrialError> {
    let path = folder.join(part);
    let unread = |source| TrialError::Read { path: path.clone(), source };
    let entries = match fs::read_dir(&path) {
        Ok(entries) => entries.collect::<Result<Vec<_>, _>>().map_err(unread)?,
        Err(_) if !part.is_empty() => return Ok(Vec::new()),
        Err(error) => return Err(unread(error)),
    };
    let mut files = Vec::new();
    for path in entries.iter().map(fs::DirEntry::path) {
        let known = path.extension().is_some_and(|end| end == "yaml" || end == "csv" || end == "urdf");
        let Some(name) = path.file_name().filter(|_| known && path.is_file()) else { continue };
        let text = read_text(&path, FileKind::URDF)
            .map_err(|source| TrialError::Read { path: path.clone(), source: source.into() })?;
        files.push((Path::new(part).join(name).display().to_string(), text));
    }
    Ok(files)
}

/// What to hide: as it was asked for, else drawn.
pub(super) fn fault(asked: Option<&str>, random: &mut Random) -> Result<Option<Fault>, TrialError> {
    let Some(asked) = asked else {
        // One time in so many there is nothing to be found.
        return Ok((random.below(FAULTS.len() + 1) == 0).then(|| Fault { name: NONE.to_owned(), site: None }));
    };
    let fault = Fault::read(asked);
    let known = || faults().flat_map(|(name, effect)| [*name, *effect]);
    match fault.name == NONE || known().any(|name| name == fault.name) {
        true => Ok(Some(fault)),
        false => {
            let names: Vec<&str> = [NONE].into_iter().chain(faults().map(|(name, _)| *name)).collect();
            Err(TrialError::UnknownFault { name: fault.name, known: names.join(", ") })
        }
    }
}

/// The world in which a fault is hidden, and what it is. `directory` holds the cell's files, the world's own among them.
pub(super) fn world(
    directory: &Path,
    fault: Option<&Fault>,
    seed: u64,
    random: &mut Random,
) -> Result<(String, f64, Vec<Hidden>), TrialError> {
    let path = directory.join(WORLD);
    let open = read_text(&path, FileKind::WORLD)
        .map_err(|source| TrialError::Read { path: path.clone(), source: source.into() })?;
    let described = world_file::read(&path).map_err(|source| TrialError::World(Box::new(source)))?;
    let Described::Arm(arm) = described else { return Err(TrialError::NotDescribed(path)) };
    let noise = arm.tracker.error;
    if fault.is_some_and(|fault| fault.name == NONE) {
        return Ok((changed(&open, seed, None).ok_or(TrialError::NotDescribed(path))?, noise, Vec::new()));
    }
    let poses = poses(directory, &arm)?;
    let (line, hidden) = draw(&arm, &poses, fault, random)?;
    let text = changed(&open, seed, Some(&line)).ok_or(TrialError::NotDescribed(path))?;
    Ok((text, noise, vec![hidden]))
}

/// Draws what is hidden: its line in the world's file, and its words in the diagnosis.
fn draw(
    arm: &ArmWorldDescription,
    poses: &[Vec<f64>],
    fault: Option<&Fault>,
    random: &mut Random,
) -> Result<(String, Hidden), TrialError> {
    let over_noise = random.between(OVER_NOISE.0, OVER_NOISE.1);
    let mut refused = None;
    let has_a_screw = arm.paper.shape.joints.iter().any(|joint| joint.screw_pitch.is_some());
    let all: Vec<_> = FAULTS.iter().chain(OF_SLIDES.iter().filter(|_| has_a_screw)).collect();
    for _ in 0..DRAWS {
        let drawn = random.pick(&all).map_or("joint_backlash", |(_, effect)| *effect);
        let choice = match fault {
            Some(fault) => {
                let effect = faults().find(|(name, _)| *name == fault.name);
                let name = effect.map_or(fault.name.as_str(), |(_, effect)| effect);
                Choice { site: fault.site.clone(), ..Choice::named(name) }
            }
            None => Choice::named(drawn),
        };
        let found = hide_at_poses(arm.with_tip(), poses, arm.tracker.error, (choice, over_noise), random);
        match found.map(|(one, hidden)| (imperfection_yaml(&one, &arm.paper), hidden)) {
            Ok((Some(line), hidden)) => return Ok((line, hidden)),
            Ok((None, _)) => {}
            Err(error) if fault.is_some() => return Err(error.into()),
            Err(error) => refused = Some(error),
        }
    }
    Err(refused.map_or(TrialError::NothingToHide, TrialError::from))
}

/// The poses of the cell's table, rad or mm.
fn poses(directory: &Path, arm: &ArmWorldDescription) -> Result<Vec<Vec<f64>>, TrialError> {
    let path = directory.join(POSES);
    let text = read_text(&path, FileKind::POSES)
        .map_err(|source| TrialError::Read { path: path.clone(), source: source.into() })?;
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').map(str::trim).collect();
    let joints = &arm.paper.drive.joints;
    let requested = |number: usize| joints.get(number).map_or("deg", |joint| joint.unit());
    let names: Vec<String> =
        (0..joints.len()).map(|number| format!("q{}_{}", number + 1, requested(number))).collect();
    let columns: Option<Vec<usize>> =
        names.iter().map(|name| header.iter().position(|column| column == name)).collect();
    let unfit = || TrialError::PoseTable { path: path.clone(), columns: names.join(", ") };
    let columns = columns.ok_or_else(unfit)?;
    let pose = |line: &str| -> Option<Vec<f64>> {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let value = |(joint, column): (usize, &usize)| -> Option<f64> {
            let number: f64 = cells.get(*column)?.parse().ok()?;
            Some(joints.get(joint)?.read(number)).filter(|number| number.is_finite())
        };
        columns.iter().enumerate().map(value).collect()
    };
    lines.filter(|line| !line.trim().is_empty()).map(|line| pose(line).ok_or_else(unfit)).collect()
}

/// The world's text with another seed and other imperfections; none where its arm's file is not named on a line of its own.
fn changed(open: &str, seed: u64, imperfection: Option<&str>) -> Option<String> {
    let mut lines: Vec<String> = vec![format!("seed: {seed}")];
    let mut placed = false;
    // The indentation of a list of imperfections that is left out.
    let mut skipping: Option<usize> = None;
    for line in open.lines() {
        let text = line.trim_start();
        let indent = line.len() - text.len();
        if let Some(above) = skipping {
            if text.is_empty() || indent > above || (indent == above && text.starts_with('-')) {
                continue;
            }
            skipping = None;
        }
        if text.starts_with("imperfections:") {
            skipping = Some(indent);
            continue;
        }
        if line.starts_with("seed:") || text.starts_with('#') {
            continue;
        }
        lines.push(line.to_owned());
        if text.starts_with("by:") {
            placed = true;
            lines.extend(imperfection.map(|one| format!("{}imperfections: [{{{one}}}]", " ".repeat(indent))));
        }
    }
    placed.then(|| lines.join("\n") + "\n")
}

/// What to do in the cell, which is at this path.
pub(super) fn commands(at: &str, files: &[CellFile]) -> String {
    let model = files.iter().map(|(name, _)| name.as_str()).find(|name| name.ends_with(".model.yaml"));
    let model = model.unwrap_or("MODEL");
    let record = format!("--record {at}/record");
    format!(
        "  plumb run {at}/cell.yaml verify --headless {record}\n  \
         plumb run {at}/cell.yaml measure-tip --headless {record}\n  \
         plumb show --procedure measure-tip --table {record} > {at}/table.csv\n  \
         plumb model diagnose {at}/{model} --data {at}/table.csv\n  \
         plumb model grow {at}/{model} --data {at}/table.csv\n  \
         plumb run {at}/cell.yaml verify --headless {record}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_imperfections_is_replaced_however_it_is_written() {
        let begin = "world: w\nseed: 4\narm:\n  described:\n    by: a.yaml\n";
        let end = "    base: {x_mm: 1}\ntool: {}\n";
        let hidden = "joint_gain: {joint: slide, mm_per_mm: 0.002}";
        let expected = "seed: 9\nworld: w\narm:\n  described:\n    by: a.yaml\n    imperfections: [{joint_gain: {joint: slide, mm_per_mm: 0.002}}]\n    base: {x_mm: 1}\ntool: {}\n";
        for list in [
            "",
            "    imperfections: [{joint_zero: {joint: a, deg: 1}}]\n",
            "    imperfections:\n      - {joint_zero: {joint: a, deg: 1}}\n      - {joint_zero: {joint: b, deg: 1}}\n",
            "    imperfections:\n    - joint_zero:\n        joint: a\n        deg: 1\n",
        ] {
            let open = format!("{begin}{list}{end}");
            assert_eq!(changed(&open, 9, Some(hidden)).unwrap(), expected, "{list}");
        }
        assert!(changed("world: w\narm: {described: {by: a.yaml}}\n", 9, Some(hidden)).is_none());
    }
}
