//! The pseudo-terminal in place of the serial port.

use std::fs::File;
use std::io::{self, ErrorKind, Read, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::path::{Path, PathBuf};

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;

/// Why there is no port to offer.
#[derive(Debug, thiserror::Error)]
pub enum TerminalError {
    /// The system has no pseudo-terminal.
    #[error("no pseudo-terminal can be made: {0}")]
    Make(io::Error),
    /// The link cannot be made.
    #[error("the link {} cannot be made: {cause}", link.display())]
    Link {
        /// Where it was to be.
        link: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
    /// Something else is where the link was to be.
    #[error("{} exists and is no link: choose another --link, or move it away", .0.display())]
    Occupied(PathBuf),
}

/// A pseudo-terminal, with a link to it if wanted.
#[derive(Debug)]
pub(in crate::emulate) struct Terminal {
    ours: File,
    /// The host's end is kept open, so that the line exists and keeps its settings whether or not a host has it.
    _theirs: File,
    path: PathBuf,
    link: Option<PathBuf>,
}

impl Terminal {
    /// A terminal that passes every byte as it is, made so before any host can open it.
    pub(in crate::emulate) fn open(link: Option<&Path>) -> Result<Terminal, TerminalError> {
        let make = |error: nix::Error| TerminalError::Make(error.into());
        let pair = openpty(None, None).map_err(make)?;
        let mut settings = tcgetattr(&pair.master).map_err(make)?;
        cfmakeraw(&mut settings);
        tcsetattr(&pair.master, SetArg::TCSANOW, &settings).map_err(make)?;
        let flags = OFlag::from_bits_retain(fcntl(&pair.master, FcntlArg::F_GETFL).map_err(make)?);
        fcntl(&pair.master, FcntlArg::F_SETFL(flags | OFlag::O_NONBLOCK)).map_err(make)?;
        let path = ttyname(&pair.slave).map_err(make)?;
        if let Some(link) = link {
            make_link(link, &path)?;
        }
        Ok(Terminal {
            ours: pair.master.into(),
            _theirs: pair.slave.into(),
            path,
            link: link.map(Path::to_owned),
        })
    }

    /// The path a host opens.
    pub(in crate::emulate) fn path(&self) -> &Path {
        &self.path
    }

    /// What a host has sent.
    pub(in crate::emulate) fn receive(&mut self) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; 1024];
        match self.ours.read(&mut bytes) {
            Ok(count) => {
                bytes.truncate(count);
                Ok(bytes)
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                Ok(Vec::new())
            }
            Err(error) => Err(error),
        }
    }

    /// Sends a byte to the host. A host that does not read loses it, as on a real line.
    pub(in crate::emulate) fn send(&mut self, byte: u8) -> io::Result<()> {
        match self.ours.write(&[byte]) {
            Ok(_) => Ok(()),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// What to wait on for bytes from the host.
    pub(in crate::emulate) fn wait_on(&self) -> BorrowedFd<'_> {
        self.ours.as_fd()
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|there| there == self.path)
        {
            // A link that cannot be taken away leads nowhere: nothing is lost.
            let _ = std::fs::remove_file(link);
        }
    }
}

fn make_link(link: &Path, path: &Path) -> Result<(), TerminalError> {
    let error = |cause| TerminalError::Link { link: link.to_owned(), cause };
    match std::fs::symlink_metadata(link) {
        Ok(there) if !there.file_type().is_symlink() => return Err(TerminalError::Occupied(link.to_owned())),
        Ok(_) => std::fs::remove_file(link).map_err(error)?,
        Err(_) => {}
    }
    std::os::unix::fs::symlink(path, link).map_err(error)
}
