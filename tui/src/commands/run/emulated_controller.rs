//! The process of an emulated controller, as a run starts and ends it.

use std::io::{self, BufRead as _, BufReader, Read as _};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plumb_cell::workcell::Pace;

/// The controllers there are.
const CONTROLLERS: [&str; 5] = ["dobot", "feetech", "teachmover", "universal-robots", "val2"];

/// How long a controller may take to end.
const ENDED_WITHIN: Duration = Duration::from_secs(5);

/// Why there is no controller.
#[derive(Debug, thiserror::Error)]
pub(super) enum ControllerError {
    /// There is none of that name.
    #[error("there is no emulated controller `{requested}`; there are `{}`", CONTROLLERS.join("`, `"))]
    Unknown {
        /// What was asked for.
        requested: String,
    },
    /// Its process cannot be started.
    #[error("the emulated controller cannot be started: {0}")]
    Start(#[from] io::Error),
    /// It ended at once.
    #[error("the emulated controller ended at once: {message}")]
    Ended {
        /// What it said.
        message: String,
    },
}

/// A controller that runs as a process of its own, over the arm of a world. It ends with the run; where this program is killed, with its world.
pub(super) struct EmulatedController {
    /// The device it is behind.
    pub(super) device: String,
    /// The path of its port, or its address on the network.
    pub(super) port: PathBuf,
    child: Child,
}

impl EmulatedController {
    /// Starts a controller over the arm of the world at `world`. In real time it keeps the time of its line.
    pub(super) fn start(
        device: &str,
        controller: &str,
        world: &Path,
        pace: Pace,
    ) -> Result<Self, ControllerError> {
        // As it would be typed: `feetech --reversed 2`.
        let mut words = controller.split_whitespace();
        let name = words.next().unwrap_or_default();
        if !CONTROLLERS.contains(&name) {
            return Err(ControllerError::Unknown { requested: name.to_owned() });
        }
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("emulate").arg(name).args(words).arg("--world").arg(world).arg("--ends-with-parent");
        if pace == Pace::Fast {
            command.arg("--as-fast-as-possible");
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // A group of its own: the keyboard's interrupt, meant for this program, does not end it.
        command.process_group(0);
        let mut started = Self { device: device.to_owned(), port: PathBuf::new(), child: command.spawn()? };
        let mut first_line = String::new();
        if let Some(output) = started.child.stdout.take() {
            BufReader::new(output).read_line(&mut first_line)?;
        }
        if first_line.trim().is_empty() {
            let mut message = String::new();
            if let Some(errors) = &mut started.child.stderr {
                errors.read_to_string(&mut message)?;
            }
            return Err(ControllerError::Ended { message: message.trim().to_owned() });
        }
        started.port = PathBuf::from(first_line.trim());
        Ok(started)
    }

    /// Whether it still works.
    pub(super) fn is_working(&mut self) -> bool {
        self.child.try_wait().is_ok_and(|ended| ended.is_none())
    }
}

impl Drop for EmulatedController {
    fn drop(&mut self) {
        let pid = i32::try_from(self.child.id()).map(Pid::from_raw);
        let asked = pid.is_ok_and(|pid| kill(pid, Signal::SIGTERM).is_ok());
        let begin = Instant::now();
        while asked && self.is_working() && begin.elapsed() < ENDED_WITHIN {
            std::thread::sleep(Duration::from_millis(5));
        }
        // One that ended takes no notice.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
