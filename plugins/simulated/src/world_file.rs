//! World files, whatever arm is in them.
//!
//! Which arm it is, the key under `arm:` says; what else may be in the file follows from that ([`crate::world::file`] for a TeachMover's).

use std::path::Path;

use plumb_document::{FileKind, Node, NodeValue, Problems, read_text};

use crate::arm::{ArmWorld, ArmWorldDescription, served as described};
use crate::protocol::JointFacts;
use crate::served_world::ServedWorld;
pub use crate::world::file::WorldFileError;
use crate::world::file::{no_world, of_tree, root, seal};
use crate::world::{World, WorldDescription, served as teachmover};

/// The keys under `arm:` that mean another arm than a TeachMover.
const OTHER_ARMS: [&str; 2] = ["puma560", "described"];

/// What a world file describes.
#[derive(Debug, Clone, PartialEq)]
pub enum Described {
    /// A world with a TeachMover.
    TeachMover(Box<WorldDescription>),
    /// A world with another arm: a PUMA 560, or one that files describe.
    Arm(Box<ArmWorldDescription>),
}

impl Described {
    /// Draws what is left to chance from another seed.
    pub fn set_seed(&mut self, seed: u64) {
        match self {
            Described::TeachMover(world) => world.seed = seed,
            Described::Arm(world) => world.seed = seed,
        }
    }

    /// The text of the file, if it came under a seal.
    pub fn sealed_text(&self) -> Option<&str> {
        match self {
            Described::TeachMover(world) => world.sealed_text.as_deref(),
            Described::Arm(world) => world.sealed_text.as_deref(),
        }
    }

    /// The arm as cell files name it, and how many input lines its controller has.
    pub fn arm(&self) -> (&str, u32) {
        match self {
            Described::TeachMover(_) => (teachmover::NAME, teachmover::INPUT_LINES),
            Described::Arm(world) => (&world.paper.name, described::INPUT_LINES),
        }
    }

    /// The joints of the arm, as it says of them once it is started.
    pub fn joints(&self) -> Vec<JointFacts> {
        self.clone().into_world().facts().joints
    }

    /// The world at its beginning.
    pub fn into_world(self) -> Box<dyn ServedWorld> {
        match self {
            Described::TeachMover(world) => Box::new(World::new(*world)),
            Described::Arm(world) => Box::new(ArmWorld::new(*world)),
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
    let mut described = parse_open(file, &text).map_err(|error| unsealed(file, error))?;
    match &mut described {
        Described::TeachMover(world) => world.sealed_text = Some(text),
        Described::Arm(world) => world.sealed_text = Some(text),
    }
    Ok(described)
}

/// What may be said of mistakes under a seal: messages about the sealed text would give it away, those about an arm file beside it would not.
fn unsealed(file: &str, error: WorldFileError) -> WorldFileError {
    match error {
        WorldFileError::Wrong(problems) if problems.file != Path::new(file) => {
            WorldFileError::Wrong(problems)
        }
        _ => WorldFileError::BrokenSeal { file: file.to_owned() },
    }
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
    let (file, problems) = (Path::new(file), Problems::default());
    let root = root(file, text, &problems)?;
    if is_of_another_arm(&root) {
        return crate::arm::file::read(file, text, &root, problems)
            .map(|world| Described::Arm(Box::new(world)));
    }
    let world = of_tree(file, &root, &problems);
    problems.into_result(file, text)?;
    world.map(|world| Described::TeachMover(Box::new(world))).ok_or_else(|| no_world(file))
}

/// Whether the key under `arm:` is another's than a TeachMover's; a file without any is reported so by the TeachMover's reader.
fn is_of_another_arm(root: &Node) -> bool {
    let entries = |node: &Node| match &node.value {
        NodeValue::Map(entries) => entries.clone(),
        _ => Vec::new(),
    };
    let arms = entries(root).into_iter().filter(|(key, _)| key.name == "arm");
    let mut keys = arms.flat_map(|(_, arm)| entries(&arm));
    keys.any(|(key, _)| OTHER_ARMS.contains(&key.name.as_str()))
}
