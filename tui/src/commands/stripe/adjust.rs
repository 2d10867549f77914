//! `plumb stripe adjust`

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use plumb_calibration::file::model_text;
use plumb_diagnosis::stripe::Adjustment;
use plumb_light_stripe::geometry::write_rig;

use super::cell_text::with_value;
use super::diagnose::numbers;
use super::lab::{Chosen, DELAY, Lab, from_lab};
use super::lab_error::LabError;
use crate::failure::CommandResult;
use crate::progress::watched;

/// Options of `adjust`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    chosen: Chosen,
    /// Write this cell beside the other, with the model and the rig that were found beside it; nothing is overwritten.
    #[arg(short, long, value_name = "CELL")]
    output: Option<PathBuf>,
}

/// Adjusts, reports, and writes.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let lab = arguments.chosen.open()?;
    let found = watched(|progress| lab.adjusted(progress)).map_err(LabError::from)?;
    let mut text = format!("{} points, {:.3} mm are left\n{}", found.points, found.rms_mm, numbers(&found));
    if let Some(output) = &arguments.output {
        for file in write(&lab, &found, &arguments.chosen.cell, output)? {
            text.push_str(&format!("written: {}\n", file.display()));
        }
    }
    io::stdout().lock().write_all(text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a cell that uses what was found, with its model and rig; the files.
pub(super) fn write(lab: &Lab, found: &Adjustment, from: &Path, to: &Path) -> Result<Vec<PathBuf>, LabError> {
    let failed = |path: &Path, what: String| LabError::Write { path: path.to_owned(), what };
    if from.parent() != to.parent() {
        return Err(failed(to, format!("the new cell must lie beside {}", from.display())));
    }
    let mut model = lab.model.clone();
    model.effects = found.of_arm();
    let rig = write_rig(&from_lab(&found.rig, &lab.rig)).map_err(|what| failed(to, what))?;
    let name = |ending: &str| {
        let stem = to.file_stem().unwrap_or_default().to_string_lossy();
        format!("{stem}.{ending}.yaml")
    };
    let (arm_name, rig_name) = (name("arm"), name("rig"));
    let cell = plumb_document::read_text(from, plumb_document::FileKind::CELL)
        .map_err(|cause| failed(from, cause.to_string()))?;
    let changed = with_value(&cell, "model", &arm_name).and_then(|cell| with_value(&cell, "rig", &rig_name));
    let what = "`model:` and `rig:` must appear in it once each, for them to be replaced".to_owned();
    let mut changed = changed.ok_or_else(|| failed(from, what))?;
    if found.late_s() != 0.0 {
        let delay_ms = lab.exposure_delay_ms + 1000.0 * found.late_s();
        let what = format!(
            "`{DELAY}:` must appear in the light stripe's `config` once, if only as 0, for {delay_ms:.4} to be written"
        );
        changed = with_value(&changed, DELAY, &format!("{delay_ms:.5}")).ok_or_else(|| failed(from, what))?;
    }
    let files = [
        (to.with_file_name(&arm_name), model_text(&model)),
        (to.with_file_name(&rig_name), rig),
        (to.to_owned(), changed),
    ];
    for (path, text) in &files {
        let mut file = fs::File::create_new(path).map_err(|cause| failed(path, cause.to_string()))?;
        file.write_all(text.as_bytes()).map_err(|cause| failed(path, cause.to_string()))?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}
