//! Reading the text of a file.

use std::path::Path;

use crate::yaml::FileProblems;

/// The file's text, without a byte order mark.
///
/// # Errors
/// A problem without a place: it is not there, cannot be read, or is no text.
pub(crate) fn read_text(file: &Path) -> Result<String, FileProblems> {
    let bytes = std::fs::read(file).map_err(|error| {
        let help = match error.kind() {
            std::io::ErrorKind::NotFound => "see whether the name and the folder are right",
            _ => "",
        };
        FileProblems::whole_file(file, format!("cannot be read: {error}"), help)
    })?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let line = error
            .as_bytes()
            .iter()
            .take(error.utf8_error().valid_up_to())
            .filter(|byte| **byte == b'\n')
            .count()
            + 1;
        FileProblems::whole_file(file, format!("line {line} is not UTF-8 text"), "save the file as UTF-8")
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}
