//! Pictures of a run: how the error of its arms' models fell, and the clouds it has scanned. They are drawn here when somebody looks.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use plumb_calibration::measurement::RmsError;
use plumb_calibration::revision::{Family, RevisionError};
use plumb_record::{Record, RecordError, RunId};
use serde::Serialize;

use crate::screens::scan::{PictureSize, ScanState, picture};
use crate::web::escaped;

/// The ending of a stored cloud.
const CLOUD: &str = "ply";

/// A picture of a cloud, pixels: its words fit on it.
const SIZE: PictureSize = PictureSize { width: 1280, height: 960 };

/// Clouds of a run that are listed.
const MOST_CLOUDS: usize = 24;

/// A row of the error's fall, in the picture's own units.
const ROW: f64 = 24.0;

/// Width of the picture, and where its bars begin and end.
const WIDTH: f64 = 640.0;
const LEFT: f64 = 290.0;
const RIGHT: f64 = 560.0;

/// Characters of a sentence beside a bar.
const MOST_CHARACTERS: usize = 42;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub(super) enum DrawingError {
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error("the revisions of the model cannot be read: {0}")]
    Revisions(#[from] RevisionError),
    #[error("run {run} has no such picture; /api/drawings?run={run} lists them")]
    Unknown { run: i64 },
    #[error("{name} cannot be drawn: {reason}")]
    Cloud { name: String, reason: String },
}

/// What there is to be seen of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Drawings {
    /// Arms' models of which there are revisions, by the number that asks for them.
    models: Vec<Listed>,
    /// Clouds by their name.
    clouds: Vec<String>,
}

/// A model that can be asked for.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Listed {
    model: usize,
    name: String,
}

/// Lists it.
pub(super) fn list(directory: &Path, run: i64) -> Result<Drawings, DrawingError> {
    let models = models(directory, run)?;
    let listed = models.iter().enumerate().filter_map(|(model, path)| {
        // A model that was moved since, or was never worked on, has nothing to show.
        let history = Family::of(path).and_then(|family| family.history()).ok()?;
        let fitted =
            history.iter().filter(|entry| entry.model.revision.as_ref().is_some_and(|one| one.rms.is_some()));
        let name = path.file_name()?.to_string_lossy().into_owned();
        (fitted.count() > 0).then_some(Listed { model, name })
    });
    Ok(Drawings { models: listed.collect(), clouds: clouds(directory, run) })
}

/// The model files that a run used.
fn models(directory: &Path, run: i64) -> Result<Vec<PathBuf>, RecordError> {
    let record = Record::open(directory)?;
    record.run(RunId(run))?;
    let loaded = record.loaded(RunId(run))?;
    Ok(loaded.into_iter().filter(|file| file.role == "model").map(|file| PathBuf::from(file.path)).collect())
}

/// The clouds that a run has stored.
fn clouds(directory: &Path, run: i64) -> Vec<String> {
    let entries = fs::read_dir(folder(directory, run)).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| Path::new(name).extension().is_some_and(|ending| ending == CLOUD))
        .collect();
    names.sort();
    names.truncate(MOST_CLOUDS);
    names
}

fn folder(directory: &Path, run: i64) -> PathBuf {
    directory.join(format!("run-{run}"))
}

/// How the error of a model fell, revision by revision, as SVG.
pub(super) fn error_steps(directory: &Path, run: i64, model: usize) -> Result<String, DrawingError> {
    let models = models(directory, run)?;
    let path = models.get(model).ok_or(DrawingError::Unknown { run })?;
    let history = Family::of(path)?.history()?;
    let rows: Vec<(String, RmsError)> = history
        .iter()
        .filter_map(|entry| entry.model.revision.as_ref())
        .filter_map(|revision| Some((revision.did.clone(), revision.rms?)))
        .collect();
    Ok(bars(&rows))
}

/// A bar a row, from 0 on one scale.
fn bars(rows: &[(String, RmsError)]) -> String {
    let most = rows.iter().map(|(_, rms)| rms.value).fold(f64::MIN_POSITIVE, f64::max);
    let height = ROW * rows.len().max(1) as f64 + 8.0;
    let mut svg = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="12"><rect width="{WIDTH}" height="{height}" fill="#fff"/>"##
    );
    for (row, (did, rms)) in rows.iter().enumerate() {
        let y = ROW * row as f64 + 4.0;
        let short: String = did.chars().take(MOST_CHARACTERS).collect();
        // Writing to a string cannot fail.
        let _ = write!(
            svg,
            r##"<text x="{:.0}" y="{:.1}" text-anchor="end" fill="#222">{}</text><rect x="{LEFT}" y="{:.1}" width="{:.1}" height="{:.1}" fill="#1f5fa8"/><text x="{:.1}" y="{:.1}" fill="#222">{rms}</text>"##,
            LEFT - 8.0,
            y + 15.0,
            escaped(&short),
            y + 4.0,
            (RIGHT - LEFT) * rms.value / most,
            ROW - 8.0,
            LEFT + (RIGHT - LEFT) * rms.value / most + 6.0,
            y + 15.0
        );
    }
    svg.push_str("</svg>");
    svg
}

/// A cloud of a run, as PNG. Only a name that is listed is opened.
pub(super) fn cloud(directory: &Path, run: i64, name: &str) -> Result<Vec<u8>, DrawingError> {
    if !clouds(directory, run).iter().any(|known| known == name) {
        return Err(DrawingError::Unknown { run });
    }
    let failed = |reason: String| DrawingError::Cloud { name: name.to_owned(), reason };
    let cloud =
        plumb_cloud::read(&folder(directory, run).join(name)).map_err(|error| failed(error.to_string()))?;
    picture(&ScanState::of_cloud(name.to_owned(), cloud), SIZE, false).map_err(failed)
}

#[cfg(test)]
mod tests {
    use plumb_calibration::measurement::ReadingUnit;

    use super::*;

    #[test]
    fn the_longest_bar_is_the_largest_error_and_words_stay_words() {
        let rms = |value: f64| RmsError { value, unit: ReadingUnit::Mm };
        let svg = bars(&[("add <x>".to_owned(), rms(0.5)), ("add y".to_owned(), rms(0.25))]);
        assert!(
            svg.contains("add &lt;x&gt;")
                && svg.contains(r#"width="270.0""#)
                && svg.contains(r#"width="135.0""#),
            "{svg}"
        );
        assert!(!bars(&[]).contains("NaN"));
    }
}
