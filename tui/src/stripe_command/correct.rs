//! `plumb stripe correct`: what a calibration of camera or projector found goes into a rig file, as the user wishes (Agin 1985, section 4).

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use plumb_cell::expression::Calculator;
use plumb_cell::workcell::load_workcell;
use plumb_light_stripe::geometry::{Rig, read_rig, write_rig};
use plumb_record::{Record, RunEnd, RunId, RunState};
use serde_json::Value;

use super::cell_text::with_value;
use super::lab::{LabError, rig_of};
use crate::failure::CommandResult;
use crate::history_command::record_directory;

/// Options of `correct`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The cell the procedure was run in.
    cell: PathBuf,
    /// The run whose step `correction` found something, as `plumb history` numbers it; the newest if left out.
    #[arg(long, value_name = "RUN")]
    from: Option<i64>,
    /// Where the record lies.
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Write this cell beside the other, with its rig file beside it; nothing is overwritten.
    #[arg(short, long, value_name = "CELL")]
    output: PathBuf,
}

/// Why nothing was corrected.
#[derive(Debug, thiserror::Error)]
enum CorrectError {
    #[error(
        "run {0} has no step `correction` that passed: run camera-aim, camera-scale or projector to its end first"
    )]
    NoCorrection(i64),
    #[error("run {run} failed ({why}): what it found is no correction")]
    Failed { run: i64, why: String },
    #[error("run {run} corrects nothing of a rig: its step `correction` has {there}")]
    Nothing { run: i64, there: String },
    #[error("{}: {what}", path.display())]
    Write { path: PathBuf, what: String },
}

/// Corrects, tells, and writes.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let record = Record::open(&record_directory(arguments.record.as_ref())?)?;
    let newest = record.history(1)?.first().map_or(0, |run| run.run.0);
    let run = arguments.from.unwrap_or(newest);
    let ended = record.run(RunId(run))?;
    if let Some(why) = ended.message.filter(|_| ended.state != RunState::Ended(RunEnd::Passed)) {
        return Err(CorrectError::Failed { run, why }.into());
    }
    let steps = record.steps(RunId(run))?;
    let passed = |step: &&plumb_record::StoredStep| {
        step.step == "correction" && step.outcome.as_deref() == Some("passed")
    };
    let found = steps.iter().rev().find(passed).ok_or(CorrectError::NoCorrection(run))?;
    let path = rig_path(&arguments.cell)?;
    let before = read_rig(&path)?;
    let (rig, told) = corrected(&before, &found.result);
    if told.is_empty() {
        return Err(CorrectError::Nothing { run, there: found.result.to_string() }.into());
    }
    let mut text = told.concat();
    for file in write(&rig, &arguments.cell, &arguments.output)? {
        text.push_str(&format!("written: {}\n", file.display()));
    }
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

fn rig_path(cell: &Path) -> Result<PathBuf, LabError> {
    let read = load_workcell(cell, &Calculator::new())
        .map_err(|problems| LabError::Cell(problems.iter().map(ToString::to_string).collect::<String>()))?;
    let (_, rig) = rig_of(&read, cell)?;
    Ok(cell.parent().unwrap_or(Path::new("")).join(rig))
}

/// The rig with what a step `correction` found, and a line for each thing that changed.
fn corrected(before: &Rig, found: &Value) -> (Rig, Vec<String>) {
    let mut rig = before.clone();
    let mut told = Vec::new();
    let number = |name: &str| found.get(name).and_then(Value::as_f64).filter(|number| number.is_finite());
    if let (Some(x), Some(y)) = (number("aim_x_deg"), number("aim_y_deg")) {
        rig = rig.aimed(x.to_radians(), y.to_radians());
        told.push(format!(
            "the camera is turned by {x:+.4} deg about the hand's x and {y:+.4} deg about its y\n"
        ));
    }
    if let (Some(u), Some(v)) = (number("scale_u"), number("scale_v")) {
        rig.camera.fx_px *= u;
        rig.camera.fy_px *= v;
        told.push(format!(
            "the scale is {u:.5} times what it was across and {v:.5} times down: {:.2} and {:.2} px\n",
            rig.camera.fx_px, rig.camera.fy_px
        ));
    }
    if let Some(roll) = number("roll_deg") {
        rig = rig.rolled(roll.to_radians());
        told.push(format!("the camera is turned by {roll:+.4} deg about its principal ray\n"));
    }
    let normal = [number("normal_x"), number("normal_y"), number("normal_z")];
    if let ([Some(x), Some(y), Some(z)], Some(d_mm)) = (normal, number("d_mm"))
        && let Some((with_sheet, angle)) = rig.clone().with_sheet([x, y, z], d_mm)
    {
        rig = with_sheet;
        told.push(format!(
            "the sheet of light is turned by {:.4} deg, its d is {:+.4} mm more\n",
            angle.to_degrees(),
            rig.plane.d_mm - before.plane.d_mm
        ));
    }
    (rig, told)
}

/// Writes the rig, and a cell that uses it; the files.
fn write(rig: &Rig, from: &Path, to: &Path) -> Result<Vec<PathBuf>, CorrectError> {
    let failed = |path: &Path, what: String| CorrectError::Write { path: path.to_owned(), what };
    if from.parent() != to.parent() {
        return Err(failed(to, format!("the new cell must lie beside {}", from.display())));
    }
    let name = format!("{}.rig.yaml", to.file_stem().unwrap_or_default().to_string_lossy());
    let cell = fs::read_to_string(from).map_err(|cause| failed(from, cause.to_string()))?;
    let what = "`rig:` must stand in it once, for it to be replaced".to_owned();
    let cell = with_value(&cell, "rig", &name).ok_or_else(|| failed(from, what))?;
    let rig_file = to.with_file_name(name);
    let text = write_rig(rig).map_err(|what| failed(&rig_file, what))?;
    let files = [(rig_file, text), (to.to_owned(), cell)];
    for (path, text) in &files {
        let mut file = fs::File::create_new(path).map_err(|cause| failed(path, cause.to_string()))?;
        file.write_all(text.as_bytes()).map_err(|cause| failed(path, cause.to_string()))?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}
