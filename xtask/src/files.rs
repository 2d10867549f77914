//! Files and folders that are read, written and copied.

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::PackageError;

pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), PackageError> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(PackageError::io(folder))?;
    }
    fs::write(path, bytes).map_err(PackageError::io(path))
}

pub(crate) fn copy(from: &Path, to: &Path) -> Result<(), PackageError> {
    write(to, &fs::read(from).map_err(PackageError::io(from))?)
}

pub(crate) fn copy_tree(from: &Path, to: &Path) -> Result<(), PackageError> {
    for path in sorted(from)? {
        let target = to.join(path.file_name().unwrap_or_default());
        if path.is_dir() { copy_tree(&path, &target)? } else { copy(&path, &target)? }
    }
    Ok(())
}

/// What lies in a folder, in order of name.
pub(crate) fn sorted(folder: &Path) -> Result<Vec<PathBuf>, PackageError> {
    let entries = fs::read_dir(folder).map_err(PackageError::io(folder))?;
    let mut paths = Vec::new();
    for entry in entries {
        paths.push(entry.map_err(PackageError::io(folder))?.path());
    }
    paths.sort();
    Ok(paths)
}
