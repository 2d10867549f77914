//! Where one cell's shared memory lies.

use std::collections::BTreeSet;
use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use iceoryx2::config::Config;
use iceoryx2::prelude::{FileName, Path as IceoryxPath, SemanticString};

use crate::node_in_use::nodes_in_use;
use crate::{DomainError, OpenError};

/// The directory of POSIX shared memory.
const SHARED_MEMORY: &str = "/dev/shm";

/// What the directories of cells' domains begin with.
const DIRECTORY_PREFIX: &str = "plumb-cell-";

/// How many digits the number of a cell's domain has.
const DIGITS: usize = 16;

/// The longest directory of a domain: the sockets in it have long names, and a socket's path ends at 108 bytes.
const LONGEST_ROOT: usize = 60;

/// How long a process may take between making a piece of shared memory and giving it its size, on a machine with much to do.
const TIME_TO_GET_A_SIZE: Duration = Duration::from_secs(1);

/// Where one cell's shared memory lies: a prefix of its own in `/dev/shm`, and a directory for sockets and locks. Every process of the cell is
/// given the same.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Domain {
    prefix: String,
    root: PathBuf,
}

impl Domain {
    /// A domain of a given prefix and directory. The directory is made when the domain is opened.
    ///
    /// # Errors
    /// [`DomainError::Prefix`] and [`DomainError::Directory`], saying what would be right.
    pub fn new(prefix: &str, root: &Path) -> Result<Self, DomainError> {
        let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-' || c == '_';
        if prefix.is_empty() || prefix.len() > 32 || !prefix.chars().all(allowed) {
            return Err(DomainError::Prefix(prefix.to_owned()));
        }
        let wrong = |right| Err(DomainError::Directory { directory: root.to_owned(), right });
        if !root.is_absolute() {
            return wrong("give an absolute path");
        }
        match root.to_str() {
            None => wrong("its name must be UTF-8"),
            Some(text) if text.len() > LONGEST_ROOT => {
                wrong("give a path of at most 60 bytes; sockets have long names")
            }
            Some(_) => Ok(Self { prefix: prefix.to_owned(), root: root.to_owned() }),
        }
    }

    /// The domain of a cell file, the same each time: a crashed run's leftovers are found and removed by the next.
    ///
    /// # Errors
    /// [`DomainError::Directory`] when the system's directory for such files has too long a name.
    pub fn of_cell(cell_file: &Path) -> Result<Self, DomainError> {
        let path = fs::canonicalize(cell_file).unwrap_or_else(|_| cell_file.to_owned());
        let user = fs::metadata("/proc/self").map_or(0, |process| process.uid());
        let number = fnv1a(&[&user.to_le_bytes(), path.as_os_str().as_encoded_bytes()].concat());
        Self::numbered(&format!("{number:016x}"))
    }

    /// The domain of a number written in hexadecimal. Its directory lies in memory as well: locks and sockets are made there by the hundred, and
    /// a disk would be waited for at each.
    fn numbered(number: &str) -> Result<Self, DomainError> {
        let memory = Path::new(SHARED_MEMORY);
        let directory = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        Self::new(&format!("plumb_{number}_"), &directory.join(format!("{DIRECTORY_PREFIX}{number}")))
    }

    /// The domains of cells of which something is on this machine now, in use or left behind: shared memory, the directory, or what lies
    /// beside the directory under its name.
    pub fn all() -> Vec<Self> {
        let Ok(entries) = fs::read_dir(SHARED_MEMORY) else { return Vec::new() };
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let numbers: BTreeSet<String> =
            names.filter_map(|name| number_of(&name).map(str::to_owned)).collect();
        numbers.iter().filter_map(|number| Self::numbered(number).ok()).collect()
    }

    /// The beginning of the names in shared memory.
    pub fn prefix(&self) -> &str {
        &self.prefix
    }

    /// The directory for sockets and locks.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The files of this domain in shared memory, in order of name.
    pub fn shared_memory(&self) -> Vec<PathBuf> {
        let Ok(entries) = fs::read_dir(SHARED_MEMORY) else { return Vec::new() };
        let ours = |path: &PathBuf| {
            path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(self.prefix.as_bytes()))
        };
        let mut files: Vec<PathBuf> =
            entries.filter_map(|entry| Some(entry.ok()?.path())).filter(ours).collect();
        files.sort();
        files
    }

    /// Removes pieces of shared memory that were made but given no size, once they have had time to get one: their maker was killed in between. The
    /// layer below waits for the size of such a piece without end (`open_impl` of posix_shared_memory in iceoryx2-cal 0.10).
    pub(crate) fn remove_stillborn(&self) {
        let is_empty = |piece: &PathBuf| fs::metadata(piece).is_ok_and(|piece| piece.len() == 0);
        let mut empty = self.shared_memory();
        let begin = Instant::now();
        loop {
            empty.retain(is_empty);
            if empty.is_empty() || begin.elapsed() >= TIME_TO_GET_A_SIZE {
                break;
            }
            thread::sleep(TIME_TO_GET_A_SIZE / 100);
        }
        for piece in empty {
            tracing::debug!("removing {}, whose maker was killed before it had a size", piece.display());
            // What cannot be removed belongs to somebody else, or has gone.
            let _ = fs::remove_file(piece);
        }
    }

    /// Removes everything of this domain from shared memory and the disk.
    ///
    /// # Errors
    /// [`DomainError::InUse`] while a process still uses it; then nothing is removed.
    pub fn remove(&self) -> Result<(), DomainError> {
        if self.root.exists() {
            let users = self.config().map_or_else(|_| Vec::new(), |config| nodes_in_use(&config));
            if !users.is_empty() {
                return Err(DomainError::InUse(users.iter().map(ToString::to_string).collect()));
            }
        }
        for file in self.shared_memory() {
            removed(&file, fs::remove_file(&file))?;
        }
        removed(&self.root, fs::remove_dir_all(&self.root))
    }

    /// The settings of the layer below: nothing is read from a file, nothing is left to its defaults that matters here.
    pub(crate) fn config(&self) -> Result<Config, OpenError> {
        let what = || format!("the shared memory of '{}'", self.prefix);
        let mut config = Config::default();
        config.global.prefix =
            FileName::new(self.prefix.as_bytes()).map_err(|error| OpenError::new(&what(), error))?;
        let root = IceoryxPath::new(self.root.as_os_str().as_encoded_bytes())
            .map_err(|error| OpenError::new(&what(), error))?;
        config.global.set_root_path(&root);
        Ok(config)
    }
}

fn removed(path: &Path, result: std::io::Result<()>) -> Result<(), DomainError> {
    match result {
        Err(cause) if cause.kind() != ErrorKind::NotFound => {
            Err(DomainError::Remove { path: path.to_owned(), cause })
        }
        _ => Ok(()),
    }
}

/// The number of the domain that a file in shared memory belongs to.
fn number_of(name: &str) -> Option<&str> {
    let after = name.strip_prefix(DIRECTORY_PREFIX).or_else(|| name.strip_prefix("plumb_"))?;
    let (number, rest) = after.split_at_checked(DIGITS)?;
    let hexadecimal = number.chars().all(|c| matches!(c, '0'..='9' | 'a'..='f'));
    (hexadecimal && (rest.is_empty() || rest.starts_with(['.', '_']))).then_some(number)
}

/// The 64-bit FNV-1a hash (Fowler, Noll, Vo): the same in every build, which the standard library's hash does not promise.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Bus;

    #[test]
    fn a_prefix_with_a_slash_is_refused() {
        let error = Domain::new("a/b", Path::new("/tmp/x")).unwrap_err();
        assert_eq!(
            error.to_string(),
            "'a/b' cannot be the prefix of a cell's shared memory: use 1 to 32 lower-case letters, digits, '-' and '_'"
        );
    }

    #[test]
    fn a_directory_too_long_for_sockets_is_refused() {
        let long = Path::new("/tmp").join("x".repeat(80));
        let message = Domain::new("a", &long).unwrap_err().to_string();
        assert!(message.ends_with("give a path of at most 60 bytes; sockets have long names"), "{message}");
    }

    #[test]
    fn a_cell_file_has_the_same_domain_each_time_and_another_file_another() {
        let first = Domain::of_cell(Path::new("/a/cell.yaml")).unwrap();
        assert_eq!(first, Domain::of_cell(Path::new("/a/cell.yaml")).unwrap());
        assert_ne!(first, Domain::of_cell(Path::new("/b/cell.yaml")).unwrap());
    }

    #[test]
    fn files_give_the_number_of_their_cell() {
        assert_eq!(number_of("plumb-cell-0123456789abcdef.lock"), Some("0123456789abcdef"));
        assert_eq!(number_of("plumb_0123456789abcdef_x.data"), Some("0123456789abcdef"));
        assert_eq!(number_of("plumb-cell-0123456789abcdef0"), None, "a longer number is another's");
        assert_eq!(number_of("plumb_hello"), None);
    }

    #[test]
    fn a_piece_that_never_got_its_size_is_removed_in_the_time_it_has_and_no_other() {
        let directory = tempfile::tempdir().unwrap();
        let domain = Domain::of_cell(&directory.path().join("cell.yaml")).unwrap();
        let piece = |name: &str| Path::new(SHARED_MEMORY).join(format!("{}{name}", domain.prefix));
        let (stillborn, sound) = (piece("stillborn"), piece("sound"));
        fs::write(&stillborn, "").unwrap();
        fs::write(&sound, "x").unwrap();
        let begin = Instant::now();
        domain.remove_stillborn();
        let took = begin.elapsed();
        let left = domain.shared_memory();
        for piece in [&stillborn, &sound] {
            // The first is gone already where all is well.
            let _ = fs::remove_file(piece);
        }
        assert_eq!(left, [sound]);
        assert!(took >= TIME_TO_GET_A_SIZE && took < 10 * TIME_TO_GET_A_SIZE, "{took:?}");
        // With nothing empty there is nothing to wait for.
        let begin = Instant::now();
        domain.remove_stillborn();
        assert!(begin.elapsed() < TIME_TO_GET_A_SIZE / 2);
    }

    #[test]
    fn a_cells_domain_is_found_again_while_it_is_there() {
        let directory = tempfile::tempdir().unwrap();
        let domain = Domain::of_cell(&directory.path().join("cell.yaml")).unwrap();
        assert!(!Domain::all().contains(&domain));
        let bus = Bus::open(&domain, "test").unwrap();
        assert!(Domain::all().contains(&domain));
        drop(bus);
        domain.remove().unwrap();
        assert!(!Domain::all().contains(&domain));
    }

    #[test]
    fn the_hash_is_fnv_1a_of_64_bits() {
        // Test vectors of the authors of FNV.
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn what_is_gone_already_is_removed_and_what_cannot_be_is_named() {
        let path = Path::new("/dev/shm/piece");
        assert!(removed(path, Ok(())).is_ok());
        assert!(removed(path, Err(ErrorKind::NotFound.into())).is_ok());
        let error = removed(path, Err(ErrorKind::PermissionDenied.into())).unwrap_err();
        assert!(error.to_string().contains("/dev/shm/piece"), "{error}");
    }
}
