//! Where a test's processes meet: a domain of its own, and the plugins of this crate's examples.

use std::env;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use plumb_bus::{Bus, Domain};
use plumb_host::{HostArguments, HostCommand, HostEvent, HostProcess, Plugin, SpawnError, WiredInput};
use plumb_plugin::{JointVector, Motion, StreamDescription, Value};
use tempfile::TempDir;

/// Longer than anything here may take.
pub(crate) const LONG: Duration = Duration::from_secs(20);

pub(crate) struct TestFolder {
    pub(crate) bus: Option<Bus>,
    pub(crate) domain: Domain,
    pub(crate) directory: TempDir,
}

impl TestFolder {
    pub(crate) fn new() -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let directory = tempfile::Builder::new().prefix("ph").tempdir_in("/dev/shm").unwrap();
        let prefix = format!("plumbhost_{}_{}_", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let domain = Domain::new(&prefix, &directory.path().join("r")).unwrap();
        let bus = Some(Bus::open(&domain, "test").unwrap());
        Self { bus, domain, directory }
    }

    pub(crate) fn bus(&self) -> &Bus {
        self.bus.as_ref().unwrap()
    }

    /// What a host of an example's plugin is given.
    pub(crate) fn arguments(&self, device: &str, example: &str, config: Value) -> HostArguments {
        HostArguments { config, ..HostArguments::new(device, &self.domain, &plugin(example)) }
    }

    pub(crate) fn robot(&self, config: Value) -> HostProcess {
        self.spawn(&self.arguments("arm", "misbehaving_robot", config)).unwrap()
    }

    /// A robot that goes wrong in one of its calls.
    pub(crate) fn robot_with(&self, fault: &str, call: &str) -> HostProcess {
        self.robot(serde_json::json!({"fault": fault, "in": call}))
    }

    /// A sensor on the robot's input lines.
    pub(crate) fn watcher(&self) -> HostProcess {
        let mut arguments = self.arguments("eye", "line_watcher", Value::Null);
        arguments.inputs = vec![WiredInput {
            input: "line".to_owned(),
            device: "arm".to_owned(),
            stream: stream("misbehaving_robot", "inputs"),
        }];
        self.spawn(&arguments).unwrap()
    }

    pub(crate) fn spawn(&self, arguments: &HostArguments) -> Result<HostProcess, SpawnError> {
        HostProcess::spawn(self.bus(), arguments, command())
    }

    /// A host with everything it says.
    pub(crate) fn spawn_listening(&self, arguments: &HostArguments) -> (HostProcess, Receiver<HostEvent>) {
        let (events, received) = channel();
        let command = command().on_event(move |_, event| drop(events.send(event.clone())));
        (HostProcess::spawn(self.bus(), arguments, command).unwrap(), received)
    }

    /// The sentence with which a host could not be had.
    pub(crate) fn refusal(&self, arguments: &HostArguments) -> String {
        self.spawn(arguments).map(|host| host.process()).unwrap_err().to_string()
    }
}

impl Drop for TestFolder {
    fn drop(&mut self) {
        self.bus = None;
        // What a failed test leaves is not worth a second failure.
        let _ = self.domain.remove();
    }
}

pub(crate) fn command() -> HostCommand {
    HostCommand::new(example_file("host_process"), [] as [&str; 0])
}

/// A file that cargo built from this crate's examples: beside the directory of this test program.
pub(crate) fn example_file(name: &str) -> PathBuf {
    let file = env::current_exe().unwrap().parent().unwrap().join("../examples").join(name);
    assert!(file.is_file(), "{} is not there: `cargo test -p plumb-host` builds it", file.display());
    file
}

pub(crate) fn plugin(example: &str) -> Plugin {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(example).join("plugin.yaml");
    Plugin::at_library(&manifest, &example_file(&format!("lib{example}.so"))).unwrap()
}

pub(crate) fn stream(example: &str, name: &str) -> StreamDescription {
    plugin(example).manifest.streams.into_iter().find(|stream| stream.name == name).unwrap()
}

/// A move of the waist (rad) at full speed.
pub(crate) fn waist_to(angle: f64) -> Motion {
    Motion::absolute(JointVector::from_slice(&[angle, 0.0]).unwrap(), 1.0).only(0b01)
}

pub(crate) fn until<T>(what: &str, mut condition: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + LONG;
    loop {
        if let Some(value) = condition() {
            return value;
        }
        assert!(Instant::now() < end, "{what} did not happen in {LONG:?}");
        thread::sleep(Duration::from_millis(2));
    }
}
