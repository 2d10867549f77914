//! The terminal program as a person meets it: started in a real pseudo-terminal, worked with keys, looked at.

mod adding;
mod bench;
mod exploring;
mod newcomer;
mod operating;
mod scanning;
mod terminal;
mod watching;

use std::path::{Path, PathBuf};

/// The program under test.
fn plumb() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_plumb"))
}

/// A file of this folder.
fn beside(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/screens").join(name)
}
