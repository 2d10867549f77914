//! World files: YAML a person writes, read in two stages. What was typed (`raw`) keeps its positions in the file; what is true
//! ([`super::WorldDescription`]) has been checked and is in the world's own units.
//!
//! Every key carries its unit. Unknown and missing keys, values out of range and things that contradict each other are
//! refused, all of a file at once, with file, line and column.

mod check;
pub(crate) mod error;
mod firmness;
mod raw;
pub(crate) mod seal;
pub(crate) mod typed;

use std::path::Path;

use plumb_document::{
    DocumentKind, FileKind, FileProblems, Node, Problems, parse_as, read_text, typed as typed_as,
};

pub use error::WorldFileError;
pub use seal::seal;
use typed::Typed;

use super::WorldDescription;

/// Reads and checks a world file.
pub fn read(path: &Path) -> Result<WorldDescription, WorldFileError> {
    let file = path.display().to_string();
    let text = read_text(path, FileKind::WORLD)
        .map_err(|source| WorldFileError::Unreadable { file: file.clone(), source: source.into() })?;
    parse(&file, &text)
}

/// Checks the text of a world file, sealed or open; `file` is the name its errors bear.
pub fn parse(file: &str, text: &str) -> Result<WorldDescription, WorldFileError> {
    if !seal::is_sealed(text) {
        return parse_open(file, text);
    }
    let text = seal::open(file, text)?;
    // A message about the text would give it away.
    let world = parse_open(file, &text).map_err(|_| WorldFileError::BrokenSeal { file: file.to_owned() })?;
    Ok(WorldDescription { sealed_text: Some(text), ..world })
}

/// Writes a world file under a seal, after checking it.
pub fn write_sealed(path: &Path, sealed: &Path) -> Result<(), WorldFileError> {
    let text = match read(path)?.sealed_text {
        Some(text) => text,
        None => read_text(path, FileKind::WORLD).map_err(|source| WorldFileError::Unreadable {
            file: path.display().to_string(),
            source: source.into(),
        })?,
    };
    std::fs::write(sealed, seal(&text))
        .map_err(|source| WorldFileError::Unwritable { file: sealed.display().to_string(), source })
}

fn parse_open(file: &str, text: &str) -> Result<WorldDescription, WorldFileError> {
    let (file, problems) = (Path::new(file), Problems::default());
    let root = root(file, text, &problems)?;
    let world = of_tree(file, &root, &problems);
    problems.into_result(file, text)?;
    world.ok_or_else(|| no_world(file))
}

/// The tree of a text that is a world.
pub(crate) fn root(file: &Path, text: &str, problems: &Problems) -> Result<Node, WorldFileError> {
    Ok(parse_as(DocumentKind::World, file, text, problems)?)
}

/// The JSON Schema of a world with a TeachMover.
pub(crate) fn schema() -> serde_json::Value {
    plumb_document::schema_of::<raw::World>()
}

/// A world with a TeachMover; all mistakes are among `problems`, and what is found with some of them is good for nothing.
pub(crate) fn of_tree(file: &Path, root: &Node, problems: &Problems) -> Option<WorldDescription> {
    let raw = typed_as(root, "a world", problems)?;
    check::Checker { typed: Typed { file, problems } }.world(raw)
}

/// What is said where nothing better is known.
pub(crate) fn no_world(file: &Path) -> WorldFileError {
    FileProblems::whole_file(file, "this is no world", "").into()
}
