//! Files and directories that nobody but their owner may read.

use std::fs::{DirBuilder, OpenOptions};
use std::io;
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _};
use std::path::Path;

/// Makes a directory, and those above it that are missing, for its owner alone. One that is there stays as it is.
///
/// # Errors
/// What the system says.
pub fn create_owner_only_directory(path: &Path) -> io::Result<()> {
    DirBuilder::new().recursive(true).mode(0o700).create(path)
}

/// Makes an empty file for its owner alone. One that is there stays as it is.
///
/// # Errors
/// What the system says.
pub(crate) fn create_owner_only_file(path: &Path) -> io::Result<()> {
    match OpenOptions::new().write(true).create_new(true).mode(0o600).open(path) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;
    use crate::Record;

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).expect("it is there").permissions().mode() & 0o777
    }

    #[test]
    fn a_new_record_is_its_owners_alone_with_all_its_files() {
        let folder = tempfile::tempdir().expect("a directory");
        let directory = folder.path().join("state/plumb");
        let record = Record::open(&directory).expect("a new record");
        record
            .connection
            .execute_batch("CREATE TABLE more (number INTEGER); INSERT INTO more VALUES (1)")
            .expect("written");
        assert_eq!(mode(&directory), 0o700);
        let files: Vec<_> =
            fs::read_dir(&directory).expect("read").map(|entry| entry.expect("read").path()).collect();
        assert!(files.len() >= 2, "the database and its log: {files:?}");
        for file in files {
            assert_eq!(mode(&file), 0o600, "{}", file.display());
        }
    }

    #[test]
    fn a_directory_that_somebody_shares_stays_shared_and_the_record_in_it_does_not() {
        let folder = tempfile::tempdir().expect("a directory");
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).expect("changed");
        drop(Record::open(folder.path()).expect("a new record"));
        assert_eq!(mode(folder.path()), 0o755);
        assert_eq!(mode(&folder.path().join("plumb.sqlite3")), 0o600);
    }

    #[test]
    fn a_file_that_is_there_stays_as_it_is_and_one_that_cannot_be_made_is_an_error() {
        let folder = tempfile::tempdir().expect("a directory");
        let path = folder.path().join("file");
        fs::write(&path, "kept").expect("written");
        create_owner_only_file(&path).expect("it is there");
        assert_eq!(fs::read_to_string(&path).expect("read"), "kept");
        let missing =
            create_owner_only_file(&folder.path().join("nowhere/file")).expect_err("no such folder");
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
