//! One program at a time runs a cell.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read as _, Write as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::RecordError;
use crate::owner_only::create_owner_only_directory;

/// How often a lock that is held is tried again: somebody may only be looking whether it is.
const TRIES: u32 = 5;

/// How long between two tries.
const BETWEEN_TRIES: Duration = Duration::from_millis(20);

/// Held while a cell is run; given back when the program ends, however it ends. The file goes with it, unless the program is killed.
#[derive(Debug)]
pub struct CellLock {
    path: PathBuf,
    _file: File,
}

/// Who held a lock last, as it wrote itself down.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LockHolder {
    /// Its process number.
    pub process: String,
    /// What it ran: the path of the cell file.
    pub runs: String,
}

impl CellLock {
    /// Takes the lock of `cell` in the record's `directory`.
    ///
    /// # Errors
    /// [`RecordError::CellLocked`] with the process that holds it, [`RecordError::Lock`] when the file cannot be made.
    pub fn take(directory: &Path, cell: &str) -> Result<Self, RecordError> {
        let name: String =
            cell.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
        Self::take_file(&directory.join(format!("{name}.lock")), cell, cell)
    }

    /// Takes the lock that is the file `path`, and writes down what is run under it.
    ///
    /// # Errors
    /// As [`CellLock::take`].
    pub fn take_file(path: &Path, cell: &str, runs: &str) -> Result<Self, RecordError> {
        let failed = |cause| RecordError::Lock { path: path.to_owned(), cause };
        if let Some(directory) = path.parent() {
            create_owner_only_directory(directory).map_err(failed)?;
        }
        let mut tries = 1;
        loop {
            let mut file = OpenOptions::new()
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .mode(0o600)
                .open(path)
                .map_err(failed)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) if tries < TRIES => {
                    tries += 1;
                    std::thread::sleep(BETWEEN_TRIES);
                    continue;
                }
                Err(TryLockError::WouldBlock) => {
                    let process = Self::holder(path).map(|holder| holder.process).unwrap_or_default();
                    return Err(RecordError::CellLocked { cell: cell.to_owned(), process });
                }
                Err(TryLockError::Error(cause)) => return Err(failed(cause)),
            }
            // Who held it before may have removed the file between our opening and our locking it.
            if !is_the_file_at(&file, path) {
                continue;
            }
            file.set_len(0).map_err(failed)?;
            writeln!(file, "{}\n{runs}", std::process::id()).map_err(failed)?;
            return Ok(Self { path: path.to_owned(), _file: file });
        }
    }

    /// Whether a program holds the lock that is the file `path` now.
    pub fn is_held(path: &Path) -> bool {
        let Ok(file) = File::open(path) else { return false };
        matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock))
    }

    /// Who holds the lock, or held it when it was killed; none when the file is not there.
    pub fn holder(path: &Path) -> Option<LockHolder> {
        let mut text = String::new();
        File::open(path).ok()?.read_to_string(&mut text).ok()?;
        let (process, runs) = text.trim_end().split_once('\n').unwrap_or((text.trim_end(), ""));
        Some(LockHolder { process: process.to_owned(), runs: runs.to_owned() })
    }
}

impl Drop for CellLock {
    fn drop(&mut self) {
        // Removed while it is still held. What cannot be removed is taken over by the next.
        let _ = fs::remove_file(&self.path);
    }
}

fn is_the_file_at(file: &File, path: &Path) -> bool {
    match (file.metadata(), fs::metadata(path)) {
        (Ok(held), Ok(present)) => held.ino() == present.ino() && held.dev() == present.dev(),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_run_by_one_program_at_a_time_and_others_learn_which() {
        let directory = tempfile::tempdir().expect("a directory");
        let held = CellLock::take(directory.path(), "teachmover").expect("free");
        let error = CellLock::take(directory.path(), "teachmover").expect_err("held").to_string();
        assert!(error.contains("teachmover") && error.contains(&std::process::id().to_string()), "{error}");
        CellLock::take(directory.path(), "puma").expect("another cell is free");
        drop(held);
        CellLock::take(directory.path(), "teachmover").expect("free again");
    }

    #[test]
    fn a_lock_says_what_is_run_under_it_and_leaves_nothing() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("cell.lock");
        assert!(!CellLock::is_held(&path));
        let held = CellLock::take_file(&path, "teachmover", "/cells/cell.yaml").expect("free");
        assert!(CellLock::is_held(&path));
        let holder = CellLock::holder(&path).expect("somebody holds it");
        assert_eq!(
            (holder.process, holder.runs),
            (std::process::id().to_string(), "/cells/cell.yaml".to_owned())
        );
        drop(held);
        assert!(!path.exists() && CellLock::holder(&path).is_none());
    }

    /// Somebody who only looks whether it is held holds it for a moment.
    #[test]
    fn a_lock_that_is_held_is_tried_again_before_it_is_given_up() {
        let directory = tempfile::tempdir().expect("a directory");
        let _held = CellLock::take(directory.path(), "teachmover").expect("free");
        let begun = std::time::Instant::now();
        CellLock::take(directory.path(), "teachmover").expect_err("held");
        assert!(begun.elapsed() >= BETWEEN_TRIES * (TRIES - 1));
    }

    #[test]
    fn a_lock_file_that_another_replaced_is_not_the_one_held() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("cell.lock");
        let held = File::create(&path).expect("a file");
        assert!(is_the_file_at(&held, &path));
        fs::remove_file(&path).expect("removed");
        assert!(!is_the_file_at(&held, &path), "nothing is there");
        File::create(&path).expect("another file");
        assert!(!is_the_file_at(&held, &path), "another is there");
    }

    #[test]
    fn the_name_of_a_lock_keeps_letters_digits_and_hyphens() {
        let directory = tempfile::tempdir().expect("a directory");
        let _held = CellLock::take(directory.path(), "two-arms/2 b").expect("free");
        assert!(directory.path().join("two-arms_2_b.lock").is_file());
    }
}
