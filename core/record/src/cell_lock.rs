//! One program at a time runs a cell.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read as _, Seek as _, Write as _};
use std::path::Path;

use crate::RecordError;

/// Held while a cell is run; given back by the system when the program ends, however it ends.
#[derive(Debug)]
pub struct CellLock {
    _file: File,
}

impl CellLock {
    /// Takes the lock of `cell` in the record's `directory`.
    ///
    /// # Errors
    /// [`RecordError::CellLocked`] with the process that holds it, [`RecordError::Lock`] when the file cannot be made.
    pub fn take(directory: &Path, cell: &str) -> Result<Self, RecordError> {
        let name: String =
            cell.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
        Self::take_file(&directory.join(format!("{name}.lock")), cell)
    }

    /// Takes the lock that is the file `path`.
    ///
    /// # Errors
    /// As [`CellLock::take`].
    pub fn take_file(path: &Path, cell: &str) -> Result<Self, RecordError> {
        let failed = |cause| RecordError::Lock { path: path.to_owned(), cause };
        if let Some(directory) = path.parent() {
            std::fs::create_dir_all(directory).map_err(failed)?;
        }
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut process = String::new();
                let _ = file.read_to_string(&mut process);
                return Err(RecordError::CellLocked {
                    cell: cell.to_owned(),
                    process: process.trim().to_owned(),
                });
            }
            Err(TryLockError::Error(cause)) => return Err(failed(cause)),
        }
        file.set_len(0).map_err(failed)?;
        file.rewind().map_err(failed)?;
        writeln!(file, "{}", std::process::id()).map_err(failed)?;
        Ok(Self { _file: file })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_run_by_one_program_at_a_time_and_others_are_told_which() {
        let directory = tempfile::tempdir().expect("a directory");
        let held = CellLock::take(directory.path(), "teachmover").expect("free");
        let error = CellLock::take(directory.path(), "teachmover").expect_err("held").to_string();
        assert!(error.contains("teachmover") && error.contains(&std::process::id().to_string()), "{error}");
        CellLock::take(directory.path(), "puma").expect("another cell is free");
        drop(held);
        CellLock::take(directory.path(), "teachmover").expect("free again");
    }
}
