//! `plumb stripe correct`: the rig in force becomes a rig file, for another cell or another record (Agin 1985, section 4: "the user may write").

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use plumb_cell::expression::Calculator;
use plumb_cell::give_or_take;
use plumb_cell::workcell::load_workcell;
use plumb_light_stripe::geometry::{Rig, read_rig, write_rig};
use plumb_record::AppliedCorrection;

use super::cell_text::with_value;
use super::lab::rig_of;
use super::lab_error::LabError;
use super::rig_in_force::{in_force, rig_with};
use crate::failure::CommandResult;
use crate::record_directory::record_directory;

/// Options of `correct`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The cell whose rig was calibrated.
    cell: PathBuf,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Write this cell beside the other, with its rig file beside it; nothing is overwritten.
    #[arg(short, long, value_name = "CELL")]
    output: PathBuf,
}

/// Why nothing was written.
#[derive(Debug, thiserror::Error)]
enum CorrectError {
    #[error(
        "{}: no correction of `{sensor}` is in force for cell `{cell}`: the rig file's numbers are used as they are. \
         Run camera-aim, camera-scale, projector or calibrate-rig, and apply what they find",
        record.display()
    )]
    Nothing { record: PathBuf, cell: String, sensor: String },
    #[error("{}: {what}", path.display())]
    Write { path: PathBuf, what: String },
}

/// Prints what is in force, and writes it.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let cell = load_workcell(&arguments.cell, &Calculator::new())
        .map_err(|problems| LabError::Cell(problems.iter().map(ToString::to_string).collect::<String>()))?;
    let (sensor, rig) = rig_of(&cell, &arguments.cell)?;
    let drawn =
        read_rig(&arguments.cell.parent().unwrap_or(Path::new("")).join(rig)).map_err(LabError::from)?;
    let record = record_directory(arguments.record.as_ref())?;
    let corrections = in_force(&record, &cell, &sensor)?;
    if corrections.is_empty() {
        return Err(CorrectError::Nothing { record, cell: cell.name.clone(), sensor: sensor.name }.into());
    }
    let corrected = rig_with(&drawn, &corrections)?;
    let mut text: String = corrections.iter().map(line).collect();
    for file in write(&corrected, &arguments.cell, &arguments.output)? {
        text.push_str(&format!("written: {}\n", file.display()));
    }
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// One correction in force, for people.
fn line(one: &AppliedCorrection) -> String {
    let by = one.run.map_or_else(|| "rolled back".to_owned(), |run| format!("run {run}"));
    format!(
        "{} {:.4} {} ({}), revision {}, {by}\n",
        one.key.site.replace('_', " "),
        one.value,
        one.unit,
        give_or_take(one.uncertainty, &one.unit),
        one.revision
    )
    .replace("  (", " (")
}

/// Writes the rig, and a cell that uses it; the files.
fn write(rig: &Rig, from: &Path, to: &Path) -> Result<Vec<PathBuf>, CorrectError> {
    let failed = |path: &Path, what: String| CorrectError::Write { path: path.to_owned(), what };
    if from.parent() != to.parent() {
        return Err(failed(to, format!("the new cell must lie beside {}", from.display())));
    }
    let name = format!("{}.rig.yaml", to.file_stem().unwrap_or_default().to_string_lossy());
    let cell = plumb_document::read_text(from, plumb_document::FileKind::CELL)
        .map_err(|cause| failed(from, cause.to_string()))?;
    let what = "`rig:` must appear in it once, for it to be replaced".to_owned();
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
