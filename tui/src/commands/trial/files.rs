//! The files of a trial.

use std::fs;
use std::path::Path;

use plumb_document::{FileKind, read_text};
use plumb_simulated::physics::campaign::seal::{self, Sealed};
use plumb_simulated::physics::campaign::{Case, Truth};

use super::error::TrialError;

pub(super) const TABLE: &str = "table.csv";
pub(super) const MODEL: &str = "model.yaml";
pub(super) const SEALED: &str = "answer.sealed";
pub(super) const ANSWERS: &str = "answers.json";

/// The truth as answers.json holds it.
pub(super) fn answer(truth: &Truth) -> serde_json::Value {
    serde_json::to_value(truth).unwrap_or_default()
}

pub(super) fn write_case(case: &Case, directory: &Path) -> Result<(), TrialError> {
    fs::create_dir_all(directory)
        .map_err(|source| TrialError::Write { path: directory.to_owned(), source })?;
    let files = [(TABLE, case.table_csv()), (MODEL, case.model_yaml()), (SEALED, seal::seal(case))];
    if let Some((name, _)) = files.iter().find(|(name, _)| directory.join(name).exists()) {
        return Err(TrialError::Exists(directory.join(name)));
    }
    files.iter().try_for_each(|(name, text)| write(&directory.join(name), text))
}

pub(super) fn open(path: &Path) -> Result<Sealed, TrialError> {
    seal::open(&read(path)?).map_err(|source| TrialError::Open { path: path.to_owned(), source })
}

pub(super) fn read(path: &Path) -> Result<String, TrialError> {
    read_text(path, FileKind::TRIAL)
        .map_err(|source| TrialError::Read { path: path.to_owned(), source: source.into() })
}

pub(super) fn write(path: &Path, text: &str) -> Result<(), TrialError> {
    fs::write(path, text).map_err(|source| TrialError::Write { path: path.to_owned(), source })
}
