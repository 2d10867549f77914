//! A pseudo-terminal in place of the cable.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;

/// The controller's end of the cable.
pub(crate) struct PseudoTerminal {
    /// The path of the end that a driver opens.
    pub(crate) path: PathBuf,
    /// The controller's end; `None` once it is unplugged.
    controller: Option<File>,
    /// The other end is kept open, so that the line exists whether or not a driver has it.
    _driver: Option<File>,
}

impl PseudoTerminal {
    /// A line that passes every byte as it is.
    pub(crate) fn open() -> Self {
        let pair = openpty(None, None).unwrap();
        let mut settings = tcgetattr(&pair.master).unwrap();
        cfmakeraw(&mut settings);
        tcsetattr(&pair.master, SetArg::TCSANOW, &settings).unwrap();
        let path = ttyname(&pair.slave).unwrap();
        Self { path, controller: Some(pair.master.into()), _driver: Some(pair.slave.into()) }
    }

    /// Bytes from the driver: what is there, once something is; empty when nothing comes within `limit`.
    pub(crate) fn receive(&mut self, limit: Duration) -> Vec<u8> {
        let Some(file) = &mut self.controller else { return Vec::new() };
        let deadline = Instant::now() + limit;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let mut polled = [PollFd::new(file.as_fd(), PollFlags::POLLIN)];
            let timeout = PollTimeout::try_from(left).unwrap();
            if poll(&mut polled, timeout).unwrap() > 0 {
                let mut bytes = [0; 256];
                let count = file.read(&mut bytes).unwrap();
                return bytes[..count].to_vec();
            }
            if left.is_zero() {
                return Vec::new();
            }
        }
    }

    /// Sends bytes to the driver.
    pub(crate) fn send(&mut self, bytes: &[u8]) {
        if let Some(file) = &mut self.controller {
            file.write_all(bytes).unwrap();
        }
    }

    /// Sends bytes to the driver if the line takes them soon.
    pub(crate) fn send_if_taken(&mut self, bytes: &[u8]) {
        let Some(file) = &mut self.controller else { return };
        for byte in bytes {
            let mut polled = [PollFd::new(file.as_fd(), PollFlags::POLLOUT)];
            if poll(&mut polled, PollTimeout::from(5_u8)).unwrap() > 0 {
                file.write_all(&[*byte]).unwrap();
            }
        }
    }

    /// Pulls the plug.
    pub(crate) fn unplug(&mut self) {
        self.controller = None;
        self._driver = None;
    }
}
