//! The process of a simulated world, as a run starts and ends it.

use std::fs::{self, File};
use std::io::{self, Read as _, Seek as _};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::emulated_controller::EmulatedController;
use super::simulated_operator;
use plumb_cell::device::{Act, World};
use plumb_cell::workcell::{Pace, WorldSetting};
use plumb_record::create_owner_only_directory;
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::{self, WorldCommand};
use plumb_simulated::serve::clock_file;

/// How long a world may take to listen.
const READY_WITHIN: Duration = Duration::from_secs(15);

/// Why there is no world.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// Its process cannot be started.
    #[error("the simulated world cannot be started: {0}")]
    Start(#[from] io::Error),
    /// It ended at once.
    #[error("the simulated world of {file} ended at once: {message}")]
    Ended {
        /// The world file.
        file: String,
        /// What it said.
        message: String,
    },
    /// It does not listen.
    #[error("the simulated world did not listen at {socket} within {} s", READY_WITHIN.as_secs())]
    Silent {
        /// Where it was to listen.
        socket: String,
    },
}

/// A world that runs as a process of its own. It outlives this program, unless it is ended.
pub struct SimulatedWorld {
    socket: PathBuf,
    pace: Pace,
    is_new: bool,
    controllers: Vec<EmulatedController>,
}

impl SimulatedWorld {
    /// The world a resumed run left, when it still lives.
    pub fn found(socket: &str, pace: Pace) -> Option<Self> {
        let socket = PathBuf::from(socket);
        let mut client = WorldClient::connect(&socket, "plumb").ok()?;
        client.call(WorldCommand::Pace { pace: spoken(pace) }, || false, |_| ()).ok()?;
        Some(Self { socket, pace, is_new: false, controllers: Vec::new() })
    }

    /// A new world, in place of one that still listens there.
    pub fn start(setting: &WorldSetting, pace: Pace, socket: &Path) -> Result<Self, WorldError> {
        let mut world = Self { socket: socket.to_owned(), pace, is_new: true, controllers: Vec::new() };
        let started = world.start_process(setting);
        if started.is_err() {
            World::end(&mut world);
        }
        started.map(|()| world)
    }

    fn start_process(&self, setting: &WorldSetting) -> Result<(), WorldError> {
        let socket = &self.socket;
        if socket.exists() {
            self.shut_down();
        }
        if let Some(parent) = socket.parent() {
            create_owner_only_directory(parent)?;
        }
        let mut log = File::options()
            .create(true)
            .read(true)
            .write(true)
            .truncate(true)
            .open(socket.with_extension("log"))?;
        let mut command = Command::new(std::env::current_exe()?);
        command
            .arg("world")
            .arg("--file")
            .arg(&setting.file)
            .arg("--socket")
            .arg(socket)
            .arg("--pace")
            .arg(self.pace.name())
            .arg("--owns-directory");
        command.stdin(Stdio::null()).stdout(log.try_clone()?).stderr(log.try_clone()?);
        // A group of its own: the keyboard's interrupt, meant for this program, does not end the world.
        command.process_group(0);
        let mut child = command.spawn()?;
        let begin = Instant::now();
        while begin.elapsed() < READY_WITHIN {
            if socket.exists() && WorldClient::connect(socket, "plumb").is_ok() {
                reap_later(child);
                return Ok(());
            }
            if child.try_wait()?.is_some() {
                let mut text = String::new();
                log.rewind()?;
                log.read_to_string(&mut text)?;
                return Err(WorldError::Ended {
                    file: setting.file.display().to_string(),
                    message: text.trim().to_owned(),
                });
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ = child.kill();
        let _ = child.wait();
        Err(WorldError::Silent { socket: socket.display().to_string() })
    }

    /// Ends the world that listens at `socket`, and removes its directory. One that has gone leaves only that.
    pub fn end_at(socket: &Path) {
        World::end(&mut Self {
            socket: socket.to_owned(),
            pace: Pace::Fast,
            is_new: false,
            controllers: Vec::new(),
        });
    }

    fn shut_down(&self) {
        match WorldClient::connect(&self.socket, "plumb") {
            Ok(mut client) => {
                let process = client.welcome().pid;
                if let Err(error) = client.call(WorldCommand::Shutdown {}, || false, |_| ()) {
                    tracing::debug!("the simulated world did not confirm its end: {error}");
                }
                let begin = Instant::now();
                while is_alive(process) && begin.elapsed() < Duration::from_secs(5) {
                    std::thread::sleep(Duration::from_millis(2));
                }
            }
            Err(error) => tracing::debug!("the simulated world had gone: {error}"),
        }
    }
}

impl World for SimulatedWorld {
    fn socket(&self) -> PathBuf {
        self.socket.clone()
    }

    fn is_new(&self) -> bool {
        self.is_new
    }

    fn clock(&self) -> PathBuf {
        clock_file(&self.socket)
    }

    fn emulate(&mut self, device: &str, controller: &str) -> Result<PathBuf, String> {
        self.controllers.retain_mut(EmulatedController::is_working);
        if let Some(working) = self.controllers.iter().find(|known| known.device == device) {
            return Ok(working.port.clone());
        }
        let started = EmulatedController::start(device, controller, &self.socket, self.pace);
        let started = started.map_err(|error| error.to_string())?;
        let port = started.port.clone();
        self.controllers.push(started);
        Ok(port)
    }

    fn operate(&mut self, act: &Act) -> Result<Option<f64>, String> {
        simulated_operator::operate(&self.socket, act)
    }

    fn end(&mut self) {
        self.controllers.clear();
        self.shut_down();
        // What cannot be removed now is found by `plumb doctor`.
        if let Some(parent) = self.socket.parent() {
            let _ = fs::remove_dir_all(parent);
        }
    }
}

/// Whether a process is there and has not ended; one that nobody has waited for has ended all the same.
pub fn is_alive(process: u32) -> bool {
    let Ok(state) = fs::read_to_string(format!("/proc/{process}/stat")) else { return false };
    !matches!(state.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next()), Some('Z' | 'X'))
}

/// Waits for the end of a child in the background, so that it leaves no zombie while this program lives.
fn reap_later(mut child: Child) {
    std::thread::spawn(move || child.wait());
}

fn spoken(pace: Pace) -> protocol::Pace {
    match pace {
        Pace::Real => protocol::Pace::Real,
        Pace::Fast => protocol::Pace::Fast,
    }
}
