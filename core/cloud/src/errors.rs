//! Why a file gives no cloud, and why a cloud was not written.

use std::io;
use std::path::PathBuf;

/// Why a file gives no cloud.
#[derive(Debug, thiserror::Error)]
#[error("{}: {what}", path.display())]
pub struct ReadError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong, and what would be right.
    pub what: String,
}

/// Why a cloud was not written.
#[derive(Debug, thiserror::Error)]
#[error("{} cannot be written: {cause}", path.display())]
pub struct WriteError {
    /// The file or folder.
    pub path: PathBuf,
    /// The error of the operating system, or what no file of this kind can hold.
    pub cause: io::Error,
}
