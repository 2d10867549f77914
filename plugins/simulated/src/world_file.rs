//! World files, whatever arm stands in them.
//!
//! Which arm it is, the key under `arm:` says; what else may stand in the file follows from that ([`crate::world::file`] for a TeachMover's).

use std::path::Path;

use plumb_document::{FileKind, read_text};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

use crate::puma::{PumaDescription, PumaWorld};
use crate::served_world::ServedWorld;
pub use crate::world::file::WorldFileError;
use crate::world::file::{parse as parse_teachmover, seal};
use crate::world::{World, WorldDescription};

/// What a world file describes.
#[derive(Debug, Clone, PartialEq)]
pub enum Described {
    /// A world with a TeachMover.
    TeachMover(Box<WorldDescription>),
    /// A world with a PUMA 560.
    Puma(Box<PumaDescription>),
}

impl Described {
    /// Draws what is left to chance from another seed.
    pub fn set_seed(&mut self, seed: u64) {
        match self {
            Described::TeachMover(world) => world.seed = seed,
            Described::Puma(world) => world.seed = seed,
        }
    }

    /// The text of the file, if it came under a seal.
    pub fn sealed_text(&self) -> Option<&str> {
        match self {
            Described::TeachMover(world) => world.sealed_text.as_deref(),
            Described::Puma(world) => world.sealed_text.as_deref(),
        }
    }

    /// The world at its beginning.
    pub fn into_world(self) -> Box<dyn ServedWorld> {
        match self {
            Described::TeachMover(world) => Box::new(World::new(*world)),
            Described::Puma(world) => Box::new(PumaWorld::new(*world)),
        }
    }
}

/// Reads and checks a world file.
///
/// # Errors
/// [`WorldFileError`]: where, what, and what would be right.
pub fn read(path: &Path) -> Result<Described, WorldFileError> {
    let file = path.display().to_string();
    let text = read_text(path, FileKind::WORLD)
        .map_err(|source| WorldFileError::Unreadable { file: file.clone(), source: source.into() })?;
    parse(&file, &text)
}

/// Checks the text of a world file, sealed or open; `file` is the name its errors bear.
///
/// # Errors
/// [`WorldFileError`]
pub fn parse(file: &str, text: &str) -> Result<Described, WorldFileError> {
    if !crate::world::file::seal::is_sealed(text) {
        return parse_open(file, text);
    }
    let text = crate::world::file::seal::open(file, text)?;
    // A message about the text would give it away.
    let mut described =
        parse_open(file, &text).map_err(|_| WorldFileError::BrokenSeal { file: file.to_owned() })?;
    match &mut described {
        Described::TeachMover(world) => world.sealed_text = Some(text),
        Described::Puma(world) => world.sealed_text = Some(text),
    }
    Ok(described)
}

/// Writes a world file under a seal, after checking it.
///
/// # Errors
/// [`WorldFileError`]
pub fn write_sealed(path: &Path, sealed: &Path) -> Result<(), WorldFileError> {
    let text = match read(path)?.sealed_text() {
        Some(text) => text.to_owned(),
        None => read_text(path, FileKind::WORLD).map_err(|source| WorldFileError::Unreadable {
            file: path.display().to_string(),
            source: source.into(),
        })?,
    };
    std::fs::write(sealed, seal(&text))
        .map_err(|source| WorldFileError::Unwritable { file: sealed.display().to_string(), source })
}

fn parse_open(file: &str, text: &str) -> Result<Described, WorldFileError> {
    if is_of_a_puma(text) {
        return crate::puma::file::parse(file, text).map(|world| Described::Puma(Box::new(world)));
    }
    parse_teachmover(file, text).map(|world| Described::TeachMover(Box::new(world)))
}

/// Whether the key under `arm:` is a PUMA's; a text that cannot be read so far is told its mistakes elsewhere.
fn is_of_a_puma(text: &str) -> bool {
    #[derive(Deserialize)]
    struct Beginning {
        arm: BTreeMap<String, IgnoredAny>,
    }
    let beginning: Result<Beginning, _> = serde_yaml::from_str(text);
    beginning.is_ok_and(|beginning| beginning.arm.contains_key("puma560"))
}
