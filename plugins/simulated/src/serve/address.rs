//! The world's address: a socket in the file system that one world at a time may hold.

use std::fs::{self, File};
use std::io;
use std::os::unix::fs::MetadataExt;
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};

use nix::errno::Errno;
use nix::fcntl::{Flock, FlockArg};

use super::clock::clock_file;
use super::error::ServeError;

/// A held address. Gives it up, and removes its files, when dropped.
pub(super) struct Address {
    socket: PathBuf,
    lock_file: PathBuf,
    _lock: Flock<File>,
}

impl Address {
    /// Takes hold of the address, prepares what has to be there before anybody connects, and listens. A socket left by a world that died is
    /// replaced; the new one appears at its place only once it listens, so that anyone who sees it can connect.
    pub(super) fn take<T>(
        socket: &Path,
        prepare: impl FnOnce() -> Result<T, ServeError>,
    ) -> Result<(Address, UnixListener, T), ServeError> {
        let trouble = |source| ServeError::Address { socket: socket.to_owned(), source };
        let lock_file = beside(socket, ".lock");
        let lock = lock(socket, &lock_file)?;
        let address = Address { socket: socket.to_owned(), lock_file, _lock: lock };
        let prepared = prepare()?;
        let unfinished = beside(socket, ".new");
        match fs::remove_file(&unfinished) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(trouble(error)),
            _ => {}
        }
        let listener = UnixListener::bind(&unfinished).map_err(trouble)?;
        listener.set_nonblocking(true).map_err(trouble)?;
        fs::rename(&unfinished, socket).map_err(trouble)?;
        Ok((address, listener, prepared))
    }
}

/// The path with something after its last name.
fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    PathBuf::from(name)
}

impl Drop for Address {
    fn drop(&mut self) {
        // What cannot be removed now is replaced by the next world; there is nobody left to inform.
        let _ = fs::remove_file(&self.socket);
        let _ = fs::remove_file(&self.lock_file);
        let _ = fs::remove_file(clock_file(&self.socket));
    }
}

/// Locks the file beside the socket. The lock ends with the process that holds it, however it ends.
fn lock(socket: &Path, lock_file: &Path) -> Result<Flock<File>, ServeError> {
    let trouble = |source| ServeError::Address { socket: socket.to_owned(), source };
    loop {
        let file =
            File::options().create(true).truncate(false).write(true).open(lock_file).map_err(trouble)?;
        let lock = match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
            Ok(lock) => lock,
            Err((_, Errno::EWOULDBLOCK)) => return Err(ServeError::Taken { socket: socket.to_owned() }),
            Err((_, error)) => return Err(trouble(error.into())),
        };
        // The world before may have removed the file between our opening and our locking it.
        let held = lock.metadata().map_err(trouble)?;
        match fs::metadata(lock_file) {
            Ok(present) if present.ino() == held.ino() && present.dev() == held.dev() => return Ok(lock),
            _ => continue,
        }
    }
}
