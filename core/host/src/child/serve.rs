//! The life of a host: arguments read, device ready, serving, ended.

use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

use nix::sys::prctl;
use nix::sys::signal::Signal as SystemSignal;
use nix::unistd::{dup, dup2_stdin};
use plumb_bus::{Bus, IncomingRequest, Listener, Server, Signal, wait_any};
use plumb_plugin::{
    Description, DeviceKind, Health, PluginError, RobotDescription, StreamDescription, Value,
};
use sha2::{Digest as _, Sha256};

use super::ending::end_at_once;
use super::lifeline::{Ending, EndingFlag};
use super::rest_report::RestReport;
use super::service::{HEALTH_PERIOD, HEALTH_STREAM, Service};
use super::watchdog::Watchdog;
use super::{lifeline, memory, output, own_log, stop};
use crate::channel::{FromHost, exit_code};
use crate::context::{Clock, Context, Lines};
use crate::guard::Limits;
use crate::load::{Device, load};
use crate::{HostArguments, MoveGuard, Plugin};

/// Serves one device: the whole life of a host process. `make_guard` makes the check of moves from [`HostArguments::guard`].
///
/// Called first thing in a process that [`HostProcess::spawn`](crate::HostProcess::spawn) has started, before any thread.
pub fn serve(
    make_guard: impl FnOnce(&Value, &RobotDescription) -> Result<Box<dyn MoveGuard>, String>,
) -> ExitCode {
    let (arguments, connection) = match read_arguments() {
        Ok(read) => read,
        Err(error) => {
            eprintln!("plumb host is started by plumb itself: {error}");
            return ExitCode::from(exit_code::FAILED);
        }
    };
    let lines = match connection.get_ref().try_clone() {
        Ok(stream) => Lines::start(stream),
        Err(error) => {
            eprintln!("the connection to the orchestrator cannot be used: {error}");
            return ExitCode::from(exit_code::FAILED);
        }
    };
    let (clock, no_clock) = match Clock::of(arguments.clock.as_deref()) {
        Ok(clock) => (clock, None),
        Err(error) => (Clock::default(), Some(format!("the clock of the cell's simulated world: {error}"))),
    };
    let context: &'static Context = Box::leak(Box::new(Context::new(lines, &arguments.device, clock)));
    own_log::pass_on(context);
    if let Some(text) = no_clock {
        context.send(FromHost::Failed { text });
        end_at_once(context, exit_code::FAILED);
    }
    output::write_at_once();
    let code = match Host::start(&arguments, context, connection, make_guard) {
        Ok(host) => host.run(),
        Err(text) => {
            context.send(FromHost::Failed { text });
            exit_code::FAILED
        }
    };
    // A plugin's threads and destructors may hang: the process ends without them.
    end_at_once(context, code)
}

/// Takes the connection from descriptor 0, leaves nothing there for a plugin to read, and reads the arguments.
fn read_arguments() -> io::Result<(HostArguments, BufReader<UnixStream>)> {
    lifeline::block_termination()?;
    prctl::set_pdeathsig(SystemSignal::SIGTERM)?;
    let mut connection = BufReader::new(UnixStream::from(dup(io::stdin().as_fd())?));
    dup2_stdin(File::open("/dev/null")?)?;
    let mut line = String::new();
    connection.read_line(&mut line)?;
    let arguments =
        serde_json::from_str(&line).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
    Ok((arguments, connection))
}

/// A host in service.
struct Host {
    service: Service,
    server: Server,
    inputs: Vec<Listener>,
    stopped: Signal,
    context: &'static Context,
    ending: &'static EndingFlag,
}

impl Host {
    fn start(
        arguments: &HostArguments,
        context: &'static Context,
        connection: BufReader<UnixStream>,
        make_guard: impl FnOnce(&Value, &RobotDescription) -> Result<Box<dyn MoveGuard>, String>,
    ) -> Result<Self, String> {
        let text = |error: &dyn std::fmt::Display| error.to_string();
        let name = arguments.device.as_str();
        let plugin =
            Plugin::at_library(&arguments.manifest, &arguments.library).map_err(|error| text(&error))?;
        let domain = arguments.domain().map_err(|error| text(&error))?;
        let bus = Bus::open(&domain, &format!("host of {name}")).map_err(|error| text(&error))?;

        // Stops are received from here on, whatever the plugin does.
        let wake = || bus.request_signal(name).map_err(|error| text(&error));
        let listener = bus.listener(&crate::signal_names::stop_signal(name)).map_err(|error| text(&error))?;
        stop::listen(context, listener, wake()?);
        let ending: &'static EndingFlag = Box::leak(Box::default());
        lifeline::hold(context, ending, connection, wake()?, arguments.under_debugger);
        memory::limit(context, arguments.memory_limit_mb, wake()?);
        let watchdog = Watchdog::start(context, Duration::from_millis(arguments.watchdog_grace_ms));

        let inputs = open_streams(&bus, arguments, &plugin, context)?;
        if let Some(expected) = &arguments.library_sha256 {
            check_unchanged(&plugin.library_path, expected)?;
        }
        let loaded = load(&plugin).map_err(|error| text(&error))?;
        let device = loaded
            .create(&creation_config(&plugin, &arguments.config), context)
            .map_err(|error| text(&error))?;
        let description = described(&device, &plugin).map_err(|error| text(&error))?;
        let (limits, guard) = match &description {
            Description::Robot(robot) => (
                Some(Limits::new(robot, &arguments.joint_ranges).map_err(|error| text(&error))?),
                make_guard(&arguments.guard, robot)?,
            ),
            Description::Sensor(_) => (None, Box::new(crate::NoGuard) as Box<dyn MoveGuard>),
        };
        let server = bus.server(name).map_err(|error| text(&error))?;
        let stopped = bus.signal(&crate::signal_names::stopped_signal(name)).map_err(|error| text(&error))?;
        let rest_report = RestReport::of(&plugin.manifest);
        context.send(FromHost::Ready {
            manifest: Box::new(plugin.manifest),
            description: Box::new(description.clone()),
        });
        let mut service =
            Service::new(name, device, description, limits, guard, rest_report, context, watchdog)
                .with_inputs(!inputs.is_empty());
        service.report_health();
        Ok(Self { service, server, inputs, stopped, context, ending })
    }

    /// Serves until asked to end; the exit code.
    fn run(mut self) -> u8 {
        loop {
            if let Err(error) = self.serve_once() {
                self.context.announce(plumb_plugin::LogLevel::Error, &error);
                self.service.stop();
                return exit_code::BUS;
            }
            match self.ending.get() {
                None => {}
                Some(Ending::Finish) => {
                    self.service.finish();
                    return 0;
                }
                Some(Ending::Orphaned) => {
                    // A stop was asked for before this was set; there is no reader for its confirmation.
                    let _ = self.stop_if_asked();
                    self.service.finish();
                    return exit_code::ORPHANED;
                }
            }
        }
    }

    /// Waits for something to do, and does it.
    fn serve_once(&mut self) -> Result<(), String> {
        let text = |error: &dyn std::fmt::Display| error.to_string();
        let mut listeners: Vec<&Listener> = self.inputs.iter().collect();
        listeners.push(self.server.listener());
        wait_any(&listeners, HEALTH_PERIOD).map_err(|error| text(&error))?;
        self.server.listener().drain().map_err(|error| text(&error))?;
        self.stop_if_asked()?;
        if drain(&self.inputs).map_err(|error| text(&error))? > 0 {
            self.service.poll();
        }
        while self.ending.get().is_none() {
            let Some(IncomingRequest { request, call, answer }) =
                self.server.receive().map_err(|error| text(&error))?
            else {
                break;
            };
            let inputs = &self.inputs;
            let mut wait_for_input = |limit: Duration| {
                // An error here comes again in the next iteration, which ends the host.
                let listeners: Vec<&Listener> = inputs.iter().collect();
                if listeners.is_empty() {
                    std::thread::sleep(limit);
                }
                let _ = wait_any(&listeners, if listeners.is_empty() { Duration::ZERO } else { limit });
                let _ = drain(inputs);
            };
            let result = self.service.serve(request, call, &mut wait_for_input);
            // An answer that cannot be sent is the asker's loss: it sees its time run out.
            if let Err(error) = self.server.answer(answer, &result) {
                self.context.report(plumb_plugin::LogLevel::Warn, &text(&error));
            }
            self.stop_if_asked()?;
        }
        self.service.report_health_in_time();
        Ok(())
    }

    fn stop_if_asked(&mut self) -> Result<(), String> {
        while let Some(round) = self.context.stop.pending() {
            let is_at_rest = self.service.stop();
            self.context.stop.done(round);
            if is_at_rest {
                self.stopped.notify().map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    }
}

/// What `create` is given: the device's configuration. The bridge is given beside it whose driver to run.
fn creation_config(plugin: &Plugin, config: &Value) -> Value {
    if plugin.manifest.driver.is_empty() {
        return config.clone();
    }
    let folder = plugin.manifest_path.parent().map(Path::to_owned).unwrap_or_default();
    serde_json::json!({"manifest": plugin.manifest, "folder": folder, "config": config})
}

/// A library that was exchanged while the run goes on is not loaded: what the record says of the run would not be true of it.
fn check_unchanged(library: &Path, expected: &str) -> Result<(), String> {
    let path = library.display();
    let bytes = std::fs::read(library).map_err(|error| format!("{path}: cannot be read: {error}"))?;
    let digest = Sha256::digest(&bytes);
    let found: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    if found == expected {
        return Ok(());
    }
    let short = |hash: &str| hash.get(..12).unwrap_or(hash).to_owned();
    Err(format!(
        "{path} was changed while the run goes on (SHA-256 {} when it began, {} now): put the old file back, or begin a new run",
        short(expected),
        short(&found)
    ))
}

/// Opens the plugin's streams, the host's own, and the wired inputs; their listeners.
fn open_streams(
    bus: &Bus,
    arguments: &HostArguments,
    plugin: &Plugin,
    context: &Context,
) -> Result<Vec<Listener>, String> {
    let text = |error: &dyn std::fmt::Display| error.to_string();
    for stream in plugin.manifest.streams.iter().chain([&StreamDescription::of::<Health>(HEALTH_STREAM)]) {
        let publisher = bus.publisher(&arguments.device, stream).map_err(|error| text(&error))?;
        context.add_stream(&stream.name, publisher);
    }
    for input in &plugin.manifest.inputs {
        if !input.optional && !arguments.inputs.iter().any(|wired| wired.input == input.name) {
            return Err(format!("input '{}' of {} is not wired to any stream", input.name, arguments.device));
        }
    }
    let mut listeners = Vec::new();
    for wired in &arguments.inputs {
        let device = &arguments.device;
        let Some(input) = plugin.manifest.inputs.iter().find(|input| input.name == wired.input) else {
            return Err(format!(
                "plugin '{}' of {device} has no input '{}'",
                plugin.manifest.id, wired.input
            ));
        };
        if input.message != wired.stream.message {
            return Err(format!(
                "input '{}' of {device} takes {} messages; {}/{} carries {}",
                input.name, input.message, wired.device, wired.stream.name, wired.stream.message
            ));
        }
        listeners.push(bus.stream_listener(&wired.device, &wired.stream).map_err(|error| text(&error))?);
        let subscriber = bus.subscriber(&wired.device, &wired.stream).map_err(|error| text(&error))?;
        context.add_input(&wired.input, subscriber);
    }
    Ok(listeners)
}

/// What the device says about itself, which must fit what its manifest says.
fn described(device: &Device, plugin: &Plugin) -> Result<Description, PluginError> {
    let description = device.describe()?;
    match (&description, plugin.manifest.kind) {
        (Description::Robot(robot), DeviceKind::Robot) => {
            let joints = robot.joints.len();
            if joints == 0 || joints > plumb_plugin::MAX_JOINTS {
                let most = plumb_plugin::MAX_JOINTS;
                return Err(PluginError::Refused(format!(
                    "the robot has {joints} joints; 1 to {most} are possible"
                )));
            }
            Ok(description)
        }
        _ => Ok(description),
    }
}

fn drain(listeners: &[Listener]) -> Result<u64, plumb_bus::SignalError> {
    listeners.iter().map(Listener::drain).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of `abc` in FIPS 180-2, appendix B.1.
    const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn a_library_that_was_exchanged_while_the_run_goes_on_is_not_loaded() {
        let directory = tempfile::tempdir().expect("a directory");
        let library = directory.path().join("libarm.so");
        let missing = check_unchanged(&library, ABC).expect_err("there is no file");
        assert!(missing.contains("libarm.so: cannot be read"), "{missing}");
        std::fs::write(&library, "abc").expect("written");
        assert_eq!(check_unchanged(&library, ABC), Ok(()));
        std::fs::write(&library, "abd").expect("written");
        let changed = check_unchanged(&library, ABC).expect_err("it is another");
        assert!(changed.contains("(SHA-256 ba7816bf8f01 when it began, "), "{changed}");
        assert!(changed.contains("put the old file back, or begin a new run"), "{changed}");
    }
}
