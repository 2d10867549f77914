//! `plumb stripe study`: sealed worlds, each measured as a user measures them: by runs of the cell, and by the lab.

use std::fmt::Write as _;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

use plumb_model::stripe::StripeVerdict;
use serde_json::Value;

use super::lab::{Chosen, Lab, LabError};
use super::study_world::{Hidden, world};
use super::{adjust, diagnose, study_figure};
use crate::failure::CommandResult;

/// Options of `study`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The cell with a light stripe: procedures `direction-error` and `gather`, and a `scene.yaml` beside it.
    #[arg(default_value = "workcells/light-stripe/cell.yaml")]
    cell: PathBuf,
    /// What is hidden, one after the other; each of them if left out.
    #[arg(long, value_enum)]
    hidden: Vec<Hidden>,
    /// So many worlds each.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    worlds: u64,
    /// The first world's seed.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// Where worlds, runs and results go; must not be there yet.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

/// Why a world could not be studied.
#[derive(Debug, thiserror::Error)]
pub(crate) enum StudyError {
    #[error("{}: {cause}", path.display())]
    File { path: PathBuf, cause: io::Error },
    #[error("{}: {what}", path.display())]
    Content { path: PathBuf, what: &'static str },
    #[error("`plumb run {} {procedure}` failed: {said}", cell.display())]
    Run { cell: PathBuf, procedure: &'static str, said: String },
    #[error(transparent)]
    Lab(#[from] LabError),
}

/// What came out for one world.
#[derive(Debug, Clone)]
pub(crate) struct Outcome {
    pub(crate) hidden: Hidden,
    pub(crate) seed: u64,
    /// The direction-dependent error as the drawings have arm and rig, mm.
    pub(crate) on_paper_mm: f64,
    /// After zeros and rig were adjusted, mm.
    pub(crate) classical_mm: f64,
    /// After what was named was added, mm.
    pub(crate) added_mm: f64,
    pub(crate) verdict: StripeVerdict,
    pub(crate) named: String,
}

/// Named effects are added, one after the other, so many at most.
const MOST_ADDED: usize = 2;

/// Studies the worlds and tells.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let hidden = if arguments.hidden.is_empty() { Hidden::ALL.to_vec() } else { arguments.hidden.clone() };
    fs::create_dir_all(&arguments.output)?;
    let mut outcomes = Vec::new();
    println!("{}", HEADER);
    for hidden in hidden {
        for seed in arguments.seed..arguments.seed + arguments.worlds {
            let outcome = study(arguments, hidden, seed)?;
            println!("{}", line(&outcome));
            outcomes.push(outcome);
        }
    }
    let write = |name: &str, text: &str| {
        let path = arguments.output.join(name);
        fs::write(&path, text).map_err(|cause| StudyError::File { path, cause })
    };
    write("direction-error.csv", &table(&outcomes))?;
    write("direction-error.svg", &study_figure::svg(&outcomes)?)?;
    print!("\n{}", summary(&outcomes));
    Ok(ExitCode::SUCCESS)
}

const HEADER: &str = "hidden               seed  on paper mm  zeros+rig mm  with it mm  verdict    named";

fn line(outcome: &Outcome) -> String {
    format!(
        "{:<20} {:>4} {:>12.2} {:>13.2} {:>11.2}  {:<9}  {}",
        outcome.hidden.name(),
        outcome.seed,
        outcome.on_paper_mm,
        outcome.classical_mm,
        outcome.added_mm,
        outcome.verdict.word(),
        outcome.named
    )
}

fn table(outcomes: &[Outcome]) -> String {
    let mut text = "hidden,seed,on_paper_mm,zeros_and_rig_mm,with_effect_mm,verdict,named\n".to_owned();
    for one in outcomes {
        let _ = writeln!(
            text,
            "{},{},{:.4},{:.4},{:.4},{},\"{}\"",
            one.hidden.name(),
            one.seed,
            one.on_paper_mm,
            one.classical_mm,
            one.added_mm,
            one.verdict.word(),
            one.named
        );
    }
    text
}

/// The 90th percentile: of few values the greatest.
fn percentile_90(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let place = (0.9 * values.len() as f64).ceil() as usize;
    values.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

fn summary(outcomes: &[Outcome]) -> String {
    let mut text = "90th percentile of the direction-dependent error, mm\n".to_owned();
    for hidden in Hidden::ALL {
        let of: Vec<&Outcome> = outcomes.iter().filter(|outcome| outcome.hidden == hidden).collect();
        if of.is_empty() {
            continue;
        }
        let share = |value: fn(&Outcome) -> f64| percentile_90(of.iter().map(|outcome| value(outcome)));
        let right = of.iter().filter(|outcome| hidden.is_named_by(&outcome.named)).count();
        let told = match hidden {
            Hidden::Nothing => {
                let silent = of.iter().filter(|outcome| outcome.named.is_empty()).count();
                format!("{silent} of {} rightly named nothing", of.len())
            }
            _ => format!("{right} of {} named", of.len()),
        };
        let _ = writeln!(
            text,
            "{:<20} on paper {:>6.2}   zeros and rig {:>6.2}   with it {:>6.2}   {told}",
            hidden.name(),
            share(|one| one.on_paper_mm),
            share(|one| one.classical_mm),
            share(|one| one.added_mm)
        );
    }
    text
}

/// One world, from its making to the error measured afresh.
fn study(arguments: &Arguments, hidden: Hidden, seed: u64) -> Result<Outcome, StudyError> {
    let folder = arguments.output.join(format!("{}-{seed}", hidden.name().replace(' ', "-")));
    let cell = make_cell(arguments, &folder, hidden, seed)?;
    let on_paper_mm = error_of(&cell, &folder)?;
    let scans = gather(&cell, &folder)?;
    let opened = |add: &[String]| {
        Chosen { cell: cell.clone(), scans: scans.clone(), scene: None, add: add.to_vec() }.open()
    };
    let measured_with = |lab: &Lab, name: &str| -> Result<f64, StudyError> {
        let found = adjust::of(lab)?;
        let other = cell.with_file_name(format!("{name}.yaml"));
        adjust::write(lab, &found, &cell, &other)?;
        error_of(&other, &folder)
    };
    let classical_mm = measured_with(&opened(&[])?, "cell-zeros-and-rig")?;
    let mut added: Vec<String> = Vec::new();
    let mut first = None;
    while added.len() < MOST_ADDED {
        let diagnosis = diagnose::of(&opened(&added)?)?;
        let verdict = diagnosis.verdict;
        first.get_or_insert(verdict);
        match diagnosis.tried.first() {
            Some(best) if verdict == StripeVerdict::Named => added.push(best.suspect.name.clone()),
            _ => break,
        }
    }
    let added_mm = match added.is_empty() {
        true => classical_mm,
        false => measured_with(&opened(&added)?, "cell-true")?,
    };
    let named = added.first().cloned().unwrap_or_default();
    let verdict = first.unwrap_or(StripeVerdict::Unknown);
    Ok(Outcome { hidden, seed, on_paper_mm, classical_mm, added_mm, verdict, named })
}

/// A copy of the cell's folder with this world, and of the models beside it.
fn make_cell(arguments: &Arguments, to: &Path, hidden: Hidden, seed: u64) -> Result<PathBuf, StudyError> {
    let from = &arguments.cell;
    let beside = from.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let inside = to.join("cell");
    copy(beside, &inside, &arguments.output)?;
    copy(&beside.join("../arms"), &to.join("arms"), &arguments.output)?;
    let path = inside.join("world.yaml");
    let failed = |cause| StudyError::File { path: path.clone(), cause };
    let text = fs::read_to_string(&path).map_err(failed)?;
    let what = "`seed`, `resolution: encoder`, `blur_px` and both `in_flange` must stand in it once each";
    let changed = world(&text, hidden, seed).ok_or(StudyError::Content { path: path.clone(), what })?;
    fs::write(&path, changed).map_err(failed)?;
    Ok(inside.join(from.file_name().unwrap_or_default()))
}

/// Copies the YAML files of a folder and those below it, but not what the study itself has written.
fn copy(from: &Path, to: &Path, output: &Path) -> Result<(), StudyError> {
    let failed = |path: &Path, cause| StudyError::File { path: path.to_owned(), cause };
    fs::create_dir_all(to).map_err(|cause| failed(to, cause))?;
    for entry in fs::read_dir(from).map_err(|cause| failed(from, cause))? {
        let path = entry.map_err(|cause| failed(from, cause))?.path();
        let target = to.join(path.file_name().unwrap_or_default());
        let own =
            matches!((path.canonicalize(), output.canonicalize()), (Ok(one), Ok(other)) if one == other);
        if path.is_dir() && !own {
            copy(&path, &target, output)?;
        } else if path.extension().is_some_and(|ending| ending == "yaml") {
            fs::copy(&path, &target).map(drop).map_err(|cause| failed(&path, cause))?;
        }
    }
    Ok(())
}

/// The direction-dependent error, measured by a run of the cell, mm.
fn error_of(cell: &Path, folder: &Path) -> Result<f64, StudyError> {
    let procedure = "direction-error";
    let events = run_cell(cell, folder, procedure, &["--set", "most_mm=100"])?;
    let finished = |event: &&Value| event["event"] == "step_finished" && event["step"] == "spread";
    let error = events.iter().find(finished).and_then(|event| event["values"][0]["value"].as_f64());
    let said = "it told no spread".to_owned();
    error.ok_or(StudyError::Run { cell: cell.to_owned(), procedure, said })
}

/// Gathers stripes; the folder they lie in.
fn gather(cell: &Path, folder: &Path) -> Result<PathBuf, StudyError> {
    let procedure = "gather";
    let events = run_cell(cell, folder, procedure, &[])?;
    let run = events.iter().find_map(|event| event["run"].as_u64());
    let said = "it told no number of its run".to_owned();
    let run = run.ok_or(StudyError::Run { cell: cell.to_owned(), procedure, said })?;
    Ok(folder.join("record").join(format!("run-{run}")))
}

/// Runs a procedure as a user would; its events.
fn run_cell(
    cell: &Path,
    folder: &Path,
    procedure: &'static str,
    more: &[&str],
) -> Result<Vec<Value>, StudyError> {
    let program =
        std::env::current_exe().map_err(|cause| StudyError::File { path: PathBuf::from("plumb"), cause })?;
    let output = Command::new(&program)
        .arg("run")
        .arg(cell)
        .arg(procedure)
        .args(["--headless", "--json", "--record"])
        .arg(folder.join("record"))
        .args(more)
        .stdin(Stdio::null())
        .output()
        .map_err(|cause| StudyError::File { path: program, cause })?;
    let text = String::from_utf8_lossy(&output.stdout);
    let events: Vec<Value> = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    if output.status.success() {
        return Ok(events);
    }
    let last = events.last().and_then(|event| event["message"].as_str()).unwrap_or_default();
    let said = format!("{last} {}", String::from_utf8_lossy(&output.stderr)).trim().to_owned();
    Err(StudyError::Run { cell: cell.to_owned(), procedure, said })
}
