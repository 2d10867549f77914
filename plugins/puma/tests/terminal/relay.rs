//! A cable between the driver and the controller on which the controller's answers come in pieces.

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::pty::openpty;
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};
use nix::unistd::ttyname;
use plumb_serial_line::SerialLine;

/// Passes every byte on, and pauses behind certain words of the controller.
pub(crate) struct Relay {
    /// What the driver opens.
    pub(crate) path: PathBuf,
    ended: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// Kept open, so that the line exists before the driver opens it.
    _driver: File,
}

impl Relay {
    /// A cable to the controller at `port`, which pauses for so long behind each of these words.
    pub(crate) fn to(port: &Path, pauses: &[(&'static str, Duration)]) -> Self {
        let pair = openpty(None, None).unwrap();
        let mut settings = tcgetattr(&pair.master).unwrap();
        cfmakeraw(&mut settings);
        tcsetattr(&pair.master, SetArg::TCSANOW, &settings).unwrap();
        let path = ttyname(&pair.slave).unwrap();
        let controller = SerialLine::open(&port.display().to_string(), 9600).unwrap();
        let ended = Arc::new(AtomicBool::new(false));
        let passing = Passing {
            driver: pair.master.into(),
            controller,
            pauses: pauses.to_vec(),
            message: String::new(),
        };
        let thread = std::thread::spawn({
            let ended = Arc::clone(&ended);
            move || passing.run(&ended)
        });
        Self { path, ended, thread: Some(thread), _driver: pair.slave.into() }
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Passing {
    driver: File,
    controller: SerialLine,
    pauses: Vec<(&'static str, Duration)>,
    /// What the controller has said.
    message: String,
}

impl Passing {
    fn run(mut self, ended: &AtomicBool) {
        while !ended.load(Ordering::Relaxed) {
            if self.driver_has_written() {
                let mut bytes = [0; 64];
                let Ok(count) = self.driver.read(&mut bytes) else { return };
                if self.controller.write(&bytes[..count], Duration::from_secs(1)).is_err() {
                    return;
                }
            }
            let Ok(message) = self.controller.read(Duration::from_micros(500)) else { return };
            for byte in message {
                if self.driver.write_all(&[byte]).is_err() {
                    return;
                }
                self.message.push(char::from(byte));
                if let Some((_, pause)) = self.pauses.iter().find(|(word, _)| self.message.ends_with(word)) {
                    std::thread::sleep(*pause);
                }
            }
        }
    }

    fn driver_has_written(&self) -> bool {
        let mut polled = [PollFd::new(self.driver.as_fd(), PollFlags::POLLIN)];
        poll(&mut polled, PollTimeout::ZERO).is_ok_and(|ready| ready > 0)
    }
}
