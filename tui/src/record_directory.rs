//! Where the record lies.

use std::path::PathBuf;

use plumb_record::default_directory;

/// The directory given, or the default.
pub(crate) fn record_directory(given: Option<&PathBuf>) -> Result<PathBuf, plumb_record::RecordError> {
    match given {
        Some(directory) => Ok(directory.clone()),
        None => default_directory(),
    }
}
