//! World files: YAML a person writes, read in two stages. What was typed ([`raw`]) keeps its places in the file; what is true
//! ([`super::WorldDescription`]) has been checked and is in the world's own units.
//!
//! Every key carries its unit. Unknown and missing keys, values out of range and things that contradict each other are
//! refused with file, line and column.

mod check;
mod error;
mod raw;

use std::path::Path;

pub use error::WorldFileError;

use super::WorldDescription;

/// Reads and checks a world file.
pub fn read(path: &Path) -> Result<WorldDescription, WorldFileError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|source| WorldFileError::Unreadable { file: file.clone(), source })?;
    parse(&file, &text)
}

/// Checks the text of a world file; `file` is the name its errors bear.
pub fn parse(file: &str, text: &str) -> Result<WorldDescription, WorldFileError> {
    let options = serde_yaml::options! {
        strict_booleans: true,
        with_snippet: false,
        budget: serde_yaml::budget! { max_nodes: 20_000, max_depth: 32 },
    };
    let raw: raw::World = serde_yaml::from_str_with_options(text, options)
        .map_err(|error| WorldFileError::from_yaml(file, text, &error))?;
    check::Checker { file }.world(raw)
}
