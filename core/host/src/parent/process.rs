//! A host process, started and ended.

use std::ffi::OsString;
use std::io::{self, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::Command;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use plumb_bus::{Bus, OpenError};
use plumb_plugin::{Description, Manifest};

use super::event::{HostEvent, Listener};
use super::lines::{read_lines, read_output};
use super::shared::{LAST_WORDS, Shared, wait_for_thread};
use super::{ExitReason, RobotClient, SensorClient, SpawnError, StopHandle, spawner};
use crate::HostArguments;
use crate::channel::{FromHost, ToHost};
use crate::time_limits::{BEAT, ENDING, FINISH_WITHIN, READY_WITHIN};

/// How a host process is started.
pub struct HostCommand {
    program: PathBuf,
    arguments: Vec<OsString>,
    environment: Vec<(OsString, OsString)>,
    /// The cell, for who lists processes.
    cell: Option<String>,
    ready_within: Duration,
    listener: Box<Listener>,
}

impl HostCommand {
    /// This program again, with the argument `host`.
    ///
    /// # Errors
    /// When the system does not say where this program lies.
    pub fn this_program() -> io::Result<Self> {
        Ok(Self::new(std::env::current_exe()?, ["host"]))
    }

    /// A program with arguments; it calls [`serve`](crate::serve) first thing. After these arguments it is given the name of its device, and that
    /// of the cell where one is [set](Self::of_cell), for who lists processes; it may pass over them.
    pub fn new<A: Into<OsString>>(program: PathBuf, arguments: impl IntoIterator<Item = A>) -> Self {
        Self {
            program,
            arguments: arguments.into_iter().map(Into::into).collect(),
            environment: Vec::new(),
            cell: None,
            ready_within: READY_WITHIN,
            listener: Box::new(|_, _| ()),
        }
    }

    /// Adds an environment variable.
    #[must_use]
    pub fn environment(mut self, name: &str, value: &str) -> Self {
        self.environment.push((name.into(), value.into()));
        self
    }

    /// Names the cell on the host's command line.
    #[must_use]
    pub fn of_cell(mut self, cell: &str) -> Self {
        self.cell = Some(cell.to_owned());
        self
    }

    /// Changes how long the device may take to be ready: 15 s unless said otherwise.
    #[must_use]
    pub fn ready_within(mut self, limit: Duration) -> Self {
        self.ready_within = limit;
        self
    }

    /// Listens to what the host reports besides its answers: the device's name and the event. Called from threads of the host's own; everything
    /// is logged through `tracing` as well.
    #[must_use]
    pub fn on_event(mut self, listener: impl Fn(&str, &HostEvent) + Send + Sync + 'static) -> Self {
        self.listener = Box::new(listener);
        self
    }
}

/// A host process with its device ready. Dropping it ends the device in good order if it can, and kills the process if not.
pub struct HostProcess {
    shared: Arc<Shared>,
    connection: Arc<Mutex<UnixStream>>,
    manifest: Manifest,
    description: Description,
    threads: Threads,
}

/// The threads that look after a host. They end with it.
struct Threads(Vec<JoinHandle<()>>);

impl Threads {
    /// Waits until none of them holds on to the bus any more.
    fn wait(&self) {
        for thread in &self.0 {
            wait_for_thread(thread, LAST_WORDS);
        }
    }
}

impl HostProcess {
    /// Starts a host and waits until its device is ready (inactive), or cannot be had.
    ///
    /// # Errors
    /// [`SpawnError`], with what the host or the plugin reported.
    pub fn spawn(bus: &Bus, arguments: &HostArguments, command: HostCommand) -> Result<Self, SpawnError> {
        let device = arguments.device.as_str();
        let failed = |cause: io::Error| SpawnError::Start { device: device.to_owned(), source: cause };
        let limit = command.ready_within;
        let (mut connection, theirs) = UnixStream::pair().map_err(failed)?;
        // A host that is frozen before it has read its arguments must not hold this up.
        connection.set_write_timeout(Some(limit)).map_err(failed)?;
        let (output, output_writer) = io::pipe().map_err(failed)?;
        let mut process = Command::new(&command.program);
        process
            .args(&command.arguments)
            .arg(device)
            .args(command.cell.iter().flat_map(|cell| ["of", cell]))
            .envs(command.environment)
            .stdin(OwnedFd::from(theirs))
            .stdout(output_writer.try_clone().map_err(failed)?)
            .stderr(output_writer)
            .process_group(0);
        let child = spawner::spawn(process).map_err(failed)?;
        let shared = Shared::new(arguments, bus.clone(), &child, command.listener);

        let output_shared = shared.clone();
        let output_thread = thread::spawn(move || read_output(output, &output_shared));
        let attending = shared.clone();
        let attendant = thread::spawn(move || attending.attend(child, &output_thread));

        let (started, how) = channel();
        let lines = connection.try_clone().map_err(failed)?;
        let (lines_shared, minds_silence) = (shared.clone(), !arguments.under_debugger);
        let reader = thread::spawn(move || read_lines(lines, &lines_shared, &started, minds_silence));
        // A host that has ended already does not read this: its end says more than the broken pipe.
        let _ = send_line(&mut connection, arguments);
        let connection = Arc::new(Mutex::new(connection));
        let (beats_shared, beats_connection) = (shared.clone(), Arc::clone(&connection));
        let heart = thread::spawn(move || beat(&beats_shared, &beats_connection));
        let threads = Threads(vec![attendant, reader, heart]);

        match how.recv_timeout(limit) {
            Ok(FromHost::Ready { manifest, description }) => {
                Ok(Self { shared, connection, manifest: *manifest, description: *description, threads })
            }
            Ok(FromHost::Failed { text }) => {
                end_of(&shared, &threads, "it did not end by itself");
                Err(SpawnError::Failed { device: device.to_owned(), text })
            }
            Ok(_) | Err(RecvTimeoutError::Timeout) => {
                shared.kill("its device was not ready in time");
                end_of(&shared, &threads, "it did not end");
                Err(SpawnError::TimedOut { device: device.to_owned(), limit })
            }
            Err(RecvTimeoutError::Disconnected) => {
                let reason = end_of(&shared, &threads, "it gave up its connection");
                Err(SpawnError::Died { device: device.to_owned(), reason })
            }
        }
    }

    /// The device's name in the cell file.
    pub fn device(&self) -> &str {
        &self.shared.device
    }

    /// The plugin's manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// What the device says about itself.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// The number of the process.
    pub fn process(&self) -> u32 {
        self.shared.process()
    }

    /// Asks the device as a robot. Each client asks one thing at a time; take one for each thread.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn robot(&self) -> Result<RobotClient, OpenError> {
        RobotClient::open(self.shared.clone())
    }

    /// Asks the device as a sensor.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn sensor(&self) -> Result<SensorClient, OpenError> {
        SensorClient::open(self.shared.clone())
    }

    /// Stops the device, from any thread and whatever else is being asked of it.
    ///
    /// # Errors
    /// [`OpenError`].
    pub fn stop_handle(&self) -> Result<StopHandle, OpenError> {
        StopHandle::open(self.shared.clone())
    }

    /// How the process ended; `None` while it runs.
    pub fn end(&self) -> Option<ExitReason> {
        self.shared.end()
    }

    /// Waits for the process to end; `None` when it still runs after `limit`.
    pub fn wait_for_end(&self, limit: Duration) -> Option<ExitReason> {
        self.shared.wait_for_end(limit)
    }

    /// Puts the device away and waits for the process to end; kills it when it has not after `limit`.
    pub fn finish(self, limit: Duration) -> ExitReason {
        self.finish_within(limit)
    }

    fn finish_within(&self, limit: Duration) -> ExitReason {
        if self.shared.end().is_none() {
            let mut connection = self.connection.lock().unwrap_or_else(PoisonError::into_inner);
            // A host that does not take the line is killed below.
            let _ = send_line(&mut connection, &ToHost::Finish);
        }
        if self.shared.wait_for_end(limit).is_none() {
            self.shared.kill("it did not put its device away in time");
        }
        end_of(&self.shared, &self.threads, "it did not end")
    }
}

/// Waits for a host that is ending, and kills it when it does not.
fn end_of(shared: &Shared, threads: &Threads, why_killed: &str) -> ExitReason {
    let reason = shared.wait_for_end(ENDING).or_else(|| {
        shared.kill(why_killed);
        shared.wait_for_end(ENDING)
    });
    threads.wait();
    reason.unwrap_or_else(|| ExitReason {
        code: None,
        signal: None,
        killed_because: Some(why_killed.to_owned()),
        last_output: shared.tail.lines(),
    })
}

impl Drop for HostProcess {
    fn drop(&mut self) {
        self.finish_within(FINISH_WITHIN);
    }
}

/// Sends a host again and again that this program runs, until the host has ended.
fn beat(shared: &Shared, connection: &Mutex<UnixStream>) {
    while shared.wait_for_end(BEAT).is_none() {
        let mut connection = connection.lock().unwrap_or_else(PoisonError::into_inner);
        // A host that cannot be reached is ending, or frozen: the reader of its lines notices.
        let _ = send_line(&mut connection, &ToHost::Alive);
    }
}

fn send_line(connection: &mut UnixStream, message: &impl serde::Serialize) -> io::Result<()> {
    let mut line = serde_json::to_vec(message)?;
    line.push(b'\n');
    connection.write_all(&line)
}
