//! Reading the text of a file that a person wrote.

use std::path::Path;

use plumb_document::{FileKind, read_text as read_bounded};

use crate::yaml::FileProblems;

/// The file's text, without a byte order mark.
///
/// # Errors
/// A problem without a place: it is not there, no regular file, too large, or no text.
pub(crate) fn read_text(file: &Path) -> Result<String, FileProblems> {
    read_bounded(file, FileKind::CELL).map_err(|error| {
        let help = match error.is_not_found() {
            true => "see whether the name and the folder are right",
            false => "",
        };
        FileProblems::whole_file(file, error.to_string(), help)
    })
}
