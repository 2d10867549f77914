//! Where the processes of one cell meet on this machine, and what is left there when they were killed.

use std::fs;
use std::path::{Path, PathBuf};

use plumb_bus::{Bus, Domain, DomainError, NodeInUse};
use plumb_record::{CellLock, LockHolder, RecordError};

/// What one cell has on this machine: its shared memory, its lock, and the directory of its simulated world.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CellResources {
    domain: Domain,
}

/// Who runs a cell, or did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Occupancy {
    /// Nobody, and nothing is left.
    Empty,
    /// A program runs the cell.
    InUse(LockHolder),
    /// The program that ran the cell has gone and left this.
    LeftBehind(Remains),
}

/// What a program that was killed left behind.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Remains {
    /// The program, where it could still write itself down.
    pub holder: Option<LockHolder>,
    /// Files in shared memory.
    pub files: usize,
    /// Processes that still use the shared memory: hosts that have not finished.
    pub users: Vec<NodeInUse>,
    /// The socket of a simulated world, which may still live.
    pub world: Option<PathBuf>,
}

impl CellResources {
    /// That of a cell file, the same each time.
    ///
    /// # Errors
    /// [`DomainError`].
    pub fn of_cell(cell_file: &Path) -> Result<Self, DomainError> {
        Domain::of_cell(cell_file).map(|domain| Self { domain })
    }

    /// Of all cells of which something is on this machine now, in use or left behind.
    pub fn all() -> Vec<Self> {
        Domain::all().into_iter().map(|domain| Self { domain }).collect()
    }

    /// Its shared memory.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// The file that the process that runs the cell holds locked.
    pub fn lock_file(&self) -> PathBuf {
        self.beside("lock")
    }

    /// Where the cell's simulated world listens, in a directory of its own.
    pub fn world_socket(&self) -> PathBuf {
        self.beside("world").join("socket")
    }

    /// Takes the cell for this program.
    ///
    /// # Errors
    /// [`RecordError::CellLocked`] while another program runs it.
    pub fn lock(&self, cell: &str, cell_file: &str) -> Result<CellLock, RecordError> {
        CellLock::take_file(&self.lock_file(), cell, cell_file)
    }

    /// Who runs the cell, or what was left.
    pub fn state(&self) -> Occupancy {
        let lock_file = self.lock_file();
        let holder = CellLock::holder(&lock_file);
        if CellLock::is_held(&lock_file) {
            let unknown = || LockHolder { process: String::new(), runs: String::new() };
            return Occupancy::InUse(holder.unwrap_or_else(unknown));
        }
        let socket = self.world_socket();
        let world_directory = socket.parent().is_some_and(Path::exists);
        let has_root = self.domain.root().exists();
        let remains = Remains {
            files: self.domain.shared_memory().len() + usize::from(has_root) + usize::from(holder.is_some()),
            users: if has_root { Bus::users(&self.domain) } else { Vec::new() },
            world: world_directory.then_some(socket),
            holder,
        };
        if remains.files == 0 && remains.world.is_none() {
            return Occupancy::Empty;
        }
        Occupancy::LeftBehind(remains)
    }

    /// Removes everything of a cell that nobody runs. Its world has to be ended before.
    ///
    /// # Errors
    /// [`DomainError::InUse`] while a process still uses its shared memory, [`DomainError::Remove`]; then it may be tried again.
    pub fn remove(&self) -> Result<(), DomainError> {
        self.domain.remove()?;
        for path in [self.lock_file(), self.beside("world")] {
            let removed = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
            match removed {
                Err(cause) if cause.kind() != std::io::ErrorKind::NotFound => {
                    return Err(DomainError::Remove { path, cause });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// A path beside the directory of sockets, which is removed when a run ends.
    fn beside(&self, ending: &str) -> PathBuf {
        let mut name = self.domain.root().as_os_str().to_owned();
        name.push(".");
        name.push(ending);
        PathBuf::from(name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_shows_who_runs_the_cell_and_what_was_left_and_is_empty_after_a_removal() {
        let directory = tempfile::tempdir().expect("a directory");
        let file = directory.path().join("cell.yaml");
        let resources = CellResources::of_cell(&file).expect("a domain");
        assert_eq!(resources.state(), Occupancy::Empty);
        let lock = resources.lock("teachmover", "/cells/cell.yaml").expect("free");
        assert!(matches!(resources.state(), Occupancy::InUse(holder) if holder.runs == "/cells/cell.yaml"));
        drop(lock);
        assert_eq!(resources.state(), Occupancy::Empty, "an ended run leaves nothing");

        fs::write(resources.lock_file(), "1\n/cells/cell.yaml\n").expect("a file");
        fs::create_dir(resources.world_socket().parent().expect("a directory")).expect("a directory");
        let Occupancy::LeftBehind(remains) = resources.state() else {
            panic!("a killed run leaves something")
        };
        assert_eq!((remains.world, remains.files), (Some(resources.world_socket()), 1), "the lock's file");
        fs::create_dir(resources.domain.root()).expect("a directory");
        let Occupancy::LeftBehind(remains) = resources.state() else {
            panic!("a killed run leaves something")
        };
        assert_eq!(remains.files, 2, "and the directory of the sockets");
        assert!(CellResources::all().contains(&resources));
        resources.remove().expect("removed");
        assert_eq!(resources.state(), Occupancy::Empty);
        assert!(!CellResources::all().contains(&resources));
    }
}
