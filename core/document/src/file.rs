//! The text of a file, or why there is none, as any other mistake of the file is shown.

use std::path::Path;

use crate::{FileKind, FileProblems, read_text};

/// The text of a file that a person wrote, without a byte order mark.
///
/// # Errors
/// A problem without a position: it is not there, no regular file, too large, or no text.
pub fn read_document(file: &Path, kind: FileKind) -> Result<String, FileProblems> {
    read_text(file, kind).map_err(|error| {
        let help = if error.is_not_found() { "see whether the name and the folder are right" } else { "" };
        FileProblems::whole_file(file, error.to_string(), help)
    })
}
