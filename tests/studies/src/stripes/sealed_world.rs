//! A world of the study: it is made, measured as a user measures it, diagnosed by the lab, and measured afresh.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use plumb_document::{FileKind, read_text};
use serde_json::Value;

use super::outcome::{NAMED, Outcome, read_row, row};
use plumb::commands::stripe::study_world::{Hidden, world};

/// Why a world could not be studied.
#[derive(Debug, thiserror::Error)]
pub(super) enum StudyError {
    #[error("{}: {cause}", path.display())]
    File { path: PathBuf, cause: io::Error },
    #[error("{}: {what}", path.display())]
    Content { path: PathBuf, what: &'static str },
    #[error("`plumb run {} {procedure}` failed: {diagnosed}", cell.display())]
    Run { cell: PathBuf, procedure: &'static str, diagnosed: String },
    #[error("`plumb stripe {command}` failed: {diagnosed}")]
    Stripe { command: &'static str, diagnosed: String },
}

/// Named effects are added, one after the other, so many at most.
const MOST_ADDED: usize = 2;

/// The result of a world, in its folder.
const RESULT: &str = "result.csv";

/// One world of the study.
#[derive(Debug, Clone, Copy)]
pub(super) struct SealedWorld<'a> {
    pub(super) cell: &'a Path,
    pub(super) hidden: Hidden,
    pub(super) seed: u64,
    pub(super) output: &'a Path,
}

impl SealedWorld<'_> {
    /// The cell file's name without its ending.
    fn rig(&self) -> String {
        self.cell.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }

    fn folder(&self) -> PathBuf {
        let hidden = self.hidden.name().replace(' ', "-");
        self.output.join(format!("{}-{hidden}-{}", self.rig(), self.seed))
    }

    /// Its result, if it lies there.
    pub(super) fn known(&self) -> Option<Outcome> {
        fs::read_to_string(self.folder().join(RESULT)).ok().and_then(|text| read_row(text.trim()))
    }

    /// Its result, by studying it.
    ///
    /// # Errors
    /// [`StudyError`]
    pub(super) fn studied(&self) -> Result<Outcome, StudyError> {
        let folder = self.folder();
        let result = folder.join(RESULT);
        let failed = |path: &Path, cause| StudyError::File { path: path.to_owned(), cause };
        if folder.exists() {
            // What was begun and not ended is begun anew.
            fs::remove_dir_all(&folder).map_err(|cause| failed(&folder, cause))?;
        }
        let outcome = self.study(&folder)?;
        fs::write(&result, row(&outcome)).map_err(|cause| failed(&result, cause))?;
        Ok(outcome)
    }

    /// From its making to the error measured afresh.
    fn study(&self, folder: &Path) -> Result<Outcome, StudyError> {
        let cell = self.make_cell(folder)?;
        let on_paper_mm = self.error_of(&cell, folder)?;
        let scans = self.gather(&cell, folder)?;
        let classical_mm = self.measured_with(&cell, &scans, folder, "cell-zeros-and-rig", &[])?;
        let mut added: Vec<String> = Vec::new();
        let mut first = None;
        while added.len() < MOST_ADDED {
            let (verdict, best) = diagnosis(&cell, &scans, &added)?;
            let named = verdict == NAMED;
            first.get_or_insert(verdict);
            match best {
                Some(best) if named => added.push(best),
                _ => break,
            }
        }
        let added_mm = match added.is_empty() {
            true => classical_mm,
            false => self.measured_with(&cell, &scans, folder, "cell-true", &added)?,
        };
        Ok(Outcome {
            rig: self.rig(),
            hidden: self.hidden,
            seed: self.seed,
            on_paper_mm,
            classical_mm,
            added_mm,
            verdict: first.unwrap_or_else(|| "unknown".to_owned()),
            named: added.join(" + "),
        })
    }

    /// The direction-dependent error of a cell that uses what the scans give with these effects added, mm.
    fn measured_with(
        &self,
        cell: &Path,
        scans: &Path,
        folder: &Path,
        name: &str,
        added: &[String],
    ) -> Result<f64, StudyError> {
        let other = cell.with_file_name(format!("{name}.yaml"));
        stripe("adjust", cell, scans, added, &["--output".as_ref(), other.as_os_str()])?;
        self.error_of(&other, folder)
    }

    /// A copy of the cell's folder with this world, and of the models beside it.
    fn make_cell(&self, to: &Path) -> Result<PathBuf, StudyError> {
        let from = self.cell;
        let beside = from.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let inside = to.join("cell");
        copy(beside, &inside, self.output)?;
        copy(&beside.join("../arms"), &to.join("arms"), self.output)?;
        let cell = inside.join(from.file_name().unwrap_or_default());
        let read = |path: &Path| {
            read_text(path, FileKind::WORLD)
                .map_err(|cause| StudyError::File { path: path.to_owned(), cause: cause.into() })
        };
        let content = |path: &Path, what| StudyError::Content { path: path.to_owned(), what };
        let cell_text = read(&cell)?;
        let name = world_of(&cell_text);
        let path =
            inside.join(name.ok_or_else(|| content(&cell, "`world: {file: NAME` does not stand in it"))?);
        let what = "`seed`, `resolution: encoder`, `camera:`, `blur_px` and both `in_flange` must stand in it once each";
        let changed = world(&read(&path)?, self.hidden, self.seed).ok_or_else(|| content(&path, what))?;
        fs::write(&path, changed).map_err(|cause| StudyError::File { path, cause })?;
        Ok(cell)
    }

    /// The direction-dependent error, measured by a run of the cell, mm.
    fn error_of(&self, cell: &Path, folder: &Path) -> Result<f64, StudyError> {
        let procedure = "direction-error";
        let events = self.run_cell(cell, folder, procedure, &["most_mm=100".to_owned()])?;
        let finished = |event: &&Value| event["event"] == "step_finished" && event["step"] == "spread";
        let error = events.iter().find(finished).and_then(|event| event["values"][0]["value"].as_f64());
        let diagnosed = "it reported no spread".to_owned();
        error.ok_or(StudyError::Run { cell: cell.to_owned(), procedure, diagnosed })
    }

    /// Gathers stripes; the folder they lie in.
    fn gather(&self, cell: &Path, folder: &Path) -> Result<PathBuf, StudyError> {
        let procedure = "gather";
        let events = self.run_cell(cell, folder, procedure, &[])?;
        let run = events.iter().find_map(|event| event["run"].as_u64());
        let diagnosed = "it reported no number of its run".to_owned();
        let run = run.ok_or(StudyError::Run { cell: cell.to_owned(), procedure, diagnosed })?;
        Ok(folder.join("record").join(format!("run-{run}")))
    }

    /// Runs a procedure as a user would; its events.
    fn run_cell(
        &self,
        cell: &Path,
        folder: &Path,
        procedure: &'static str,
        set: &[String],
    ) -> Result<Vec<Value>, StudyError> {
        let program = std::env::current_exe()
            .map_err(|cause| StudyError::File { path: PathBuf::from("plumb"), cause })?;
        let fly = self.hidden.fly_mm_s();
        let fly = (fly > 0.0).then(|| format!("fly_mm_s={fly}"));
        let output = Command::new(&program)
            .arg("run")
            .arg(cell)
            .arg(procedure)
            .args(["--headless", "--json", "--record"])
            .arg(folder.join("record"))
            .args(set.iter().chain(&fly).flat_map(|set| ["--set", set]))
            .stdin(Stdio::null())
            .output()
            .map_err(|cause| StudyError::File { path: program, cause })?;
        let text = String::from_utf8_lossy(&output.stdout);
        let events: Vec<Value> = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        if output.status.success() {
            return Ok(events);
        }
        let last = events.last().and_then(|event| event["message"].as_str()).unwrap_or_default();
        let diagnosed = format!("{last} {}", String::from_utf8_lossy(&output.stderr)).trim().to_owned();
        Err(StudyError::Run { cell: cell.to_owned(), procedure, diagnosed })
    }
}

/// Runs `plumb stripe COMMAND` as a user would; what it prints.
fn stripe(
    command: &'static str,
    cell: &Path,
    scans: &Path,
    added: &[String],
    options: &[&OsStr],
) -> Result<Vec<u8>, StudyError> {
    let failed = |diagnosed: String| StudyError::Stripe { command, diagnosed };
    let program = std::env::current_exe().map_err(|cause| failed(cause.to_string()))?;
    let output = Command::new(program)
        .args(["stripe", command])
        .arg(cell)
        .arg("--scans")
        .arg(scans)
        .args(added.iter().flat_map(|effect| ["--add", effect]))
        .args(options)
        .stdin(Stdio::null())
        .output()
        .map_err(|cause| failed(cause.to_string()))?;
    match output.status.success() {
        true => Ok(output.stdout),
        false => Err(failed(String::from_utf8_lossy(&output.stderr).trim().to_owned())),
    }
}

/// The verdict of the diagnosis with these effects added already, and what it names.
fn diagnosis(cell: &Path, scans: &Path, added: &[String]) -> Result<(String, Option<String>), StudyError> {
    let printed = stripe("diagnose", cell, scans, added, &["--json".as_ref()])?;
    let no_json = |diagnosed: String| StudyError::Stripe { command: "diagnose", diagnosed };
    let diagnosis: Value = serde_json::from_slice(&printed).map_err(|error| no_json(error.to_string()))?;
    let text = |pointer: &str| diagnosis.pointer(pointer).and_then(Value::as_str).map(str::to_owned);
    let verdict = text("/verdict").ok_or_else(|| no_json("its JSON has no `verdict`".to_owned()))?;
    // Of the candidates the one that is named alone was not rejected.
    let candidates = diagnosis["candidates"].as_array().into_iter().flatten();
    let mut named = candidates.filter(|one| one["rejected"].is_null());
    Ok((verdict, named.next().and_then(|one| one["label"].as_str()).map(str::to_owned)))
}

/// The world file a cell file names.
fn world_of(cell: &str) -> Option<&str> {
    let (_, rest) = cell.split_once("world: {file: ")?;
    rest.split([',', '}']).next().map(str::trim)
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
