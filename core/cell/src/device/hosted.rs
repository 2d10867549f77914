//! Devices behind host processes, one each.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use nix::time::{ClockId, clock_gettime};
use plumb_bus::{Bus, Domain, Subscriber};
use plumb_host::{
    Catalogue, ExitReason, HostArguments, HostCommand, HostEvent, HostProcess, JointRange, RobotClient,
    SensorClient, StopHandle,
};
use plumb_plugin::{
    Description, Health, JogState, JointState, JointVector, LogLevel, Message as _, Motion, MotorState,
    PluginError, Reading, RobotDescription, SensorDescription, StreamDescription, StripeHeader, Value,
};
use plumb_record::{LoadedFile, sha256_hex};

use super::stream_link::{HostedStream, StreamLink};
use super::watcher::{JointWatcher, PoseListener};
use super::wiring::wired_inputs;
use super::{
    Act, DeviceError, DeviceLinks, DeviceLog, Link, LostDevice, RobotLink, SensorLink, StartError, Stripe,
};
use crate::event;
use crate::run_handle::StopAction;
use crate::workcell::{DeviceSetting, Workcell};

/// How long a host may take to put its device away.
const PUTTING_AWAY: Duration = Duration::from_secs(5);

/// What is left to a robot, beyond the time its plugin states, to confirm a stop before its host is killed.
const STOP_GRACE: Duration = Duration::from_millis(400);

/// A simulated world that serves a cell.
pub trait World: Send {
    /// Where it listens.
    fn socket(&self) -> PathBuf;

    /// The file in which it keeps the cell's clock ([`plumb_plugin::cell_clock`]).
    fn clock(&self) -> PathBuf;

    /// Whether it was started for this run, in place of one that an earlier run left.
    fn is_new(&self) -> bool;

    /// The port, or the address, of an emulated controller of the world's arm for a device; it is started unless it works already.
    ///
    /// # Errors
    /// A sentence that says why there is none, and what would be right.
    fn emulate(&mut self, device: &str, controller: &str) -> Result<PathBuf, String>;

    /// Does there what an operator would do in a real cell, and reports what an instrument reads.
    ///
    /// # Errors
    /// A sentence that says why it cannot be done, and what would be right.
    fn operate(&mut self, act: &Act) -> Result<Option<f64>, String>;

    /// Ends it.
    fn end(&mut self);
}

/// The devices of one cell, each behind a host process of its own.
pub struct HostedDevices {
    cell: Arc<Workcell>,
    catalogue: Catalogue,
    domain: Domain,
    bus: Option<Bus>,
    world: Option<Box<dyn World>>,
    hosts: BTreeMap<String, (HostProcess, Value)>,
    /// Started with others at once, not asked for yet.
    prepared: BTreeMap<String, (Result<HostProcess, Arc<StartError>>, Value)>,
    watch: Arc<Mutex<Watch>>,
    /// The hashes of the plugins' files as they were when the run began.
    files: Vec<LoadedFile>,
    under_debugger: bool,
    log_in: Sender<DeviceLog>,
    log_out: Receiver<DeviceLog>,
}

/// What is known of the devices' processes as they end, shared with the threads that look after them.
#[derive(Default)]
struct Watch {
    /// Devices whose process serves.
    serving: BTreeSet<String>,
    /// How each robot is stopped.
    stops: BTreeMap<String, Arc<StopHandle>>,
    lost: Vec<LostDevice>,
}

impl Watch {
    /// A process has ended. When nobody asked for that, every robot is commanded to stop at once: whatever moves then moves by what a sensor or another
    /// robot no longer sees.
    fn note_end(&mut self, device: &str, reason: &ExitReason) {
        if !self.serving.remove(device) {
            return;
        }
        self.stops.remove(device);
        self.lost.push(LostDevice {
            device: device.to_owned(),
            message: format!("{device} is lost: the host of {device} {reason}"),
        });
        for stop in self.stops.values() {
            stop.request();
        }
    }
}

fn locked(watch: &Mutex<Watch>) -> MutexGuard<'_, Watch> {
    watch.lock().unwrap_or_else(PoisonError::into_inner)
}

impl HostedDevices {
    /// Nothing is started yet.
    pub fn new(
        cell: Arc<Workcell>,
        catalogue: Catalogue,
        domain: Domain,
        world: Option<Box<dyn World>>,
    ) -> Self {
        let (log_in, log_out) = channel();
        let files = plugin_files(&cell, &catalogue);
        Self {
            watch: Arc::default(),
            files,
            under_debugger: false,
            cell,
            catalogue,
            domain,
            bus: None,
            world,
            hosts: BTreeMap::new(),
            prepared: BTreeMap::new(),
            log_in,
            log_out,
        }
    }

    /// Lets a debugger hold this program or a host: nobody minds silence, and requests have a day.
    #[must_use]
    pub fn under_debugger(mut self, yes: bool) -> Self {
        self.under_debugger = yes;
        self
    }

    fn bus(&mut self) -> Result<Bus, StartError> {
        match &self.bus {
            Some(bus) => Ok(bus.clone()),
            None => Ok(self.bus.insert(Bus::open(&self.domain, "plumb")?).clone()),
        }
    }

    /// What a device's host is given, and how it is started.
    fn order(
        &mut self,
        device: &DeviceSetting,
        guard: Value,
    ) -> Result<(HostArguments, HostCommand), StartError> {
        let plugin = self.catalogue.find(&device.plugin)?.clone();
        let mut arguments = HostArguments::new(&device.name, &self.domain, &plugin);
        arguments.config = self.config_of(device, &plugin.manifest.config)?;
        arguments.guard = guard;
        arguments.clock = self.world.as_ref().map(|world| world.clock());
        arguments.under_debugger = self.under_debugger;
        arguments.library_sha256 = self.hash_at_start(&plugin.library_path);
        if let Some(limit) = device.memory_limit_mb {
            arguments.memory_limit_mb = limit;
        }
        arguments.inputs =
            wired_inputs(&self.cell, device, &self.catalogue).map_err(StartError::Unsuitable)?;
        if let Some(robot) = self.cell.robot(&device.name) {
            let range = |(joint, lower, upper): &(String, f64, f64)| JointRange {
                joint: joint.clone(),
                lower: *lower,
                upper: *upper,
            };
            // The host knows the drive's numbers. Where this program keeps a joint's zero, the cell's limits are of corrected numbers, which a run may
            // change: there the cell alone can check them.
            let is_the_drives = |(joint, ..): &&(String, f64, f64)| !robot.initialize.contains(joint);
            arguments.joint_ranges = robot.limits.iter().filter(is_the_drives).map(range).collect();
        }
        let log = Mutex::new(self.log_in.clone());
        let watch = Arc::clone(&self.watch);
        let command = HostCommand::this_program().map_err(StartError::Program)?;
        let command = command.of_cell(&self.cell.name).on_event(move |device, event| {
            if let HostEvent::Ended { reason } = event {
                locked(&watch).note_end(device, reason);
            }
            if let Some(line) = log_line(device, event) {
                let _ = log.lock().unwrap_or_else(PoisonError::into_inner).send(line);
            }
        });
        Ok((arguments, command))
    }

    /// The hash a file had when the run began.
    fn hash_at_start(&self, path: &Path) -> Option<String> {
        let path = path.display().to_string();
        self.files.iter().find(|file| file.path == path).map(|file| file.sha256.clone())
    }

    fn spawn(&mut self, device: &DeviceSetting, guard: Value) -> Result<HostProcess, StartError> {
        let (arguments, command) = self.order(device, guard)?;
        Ok(HostProcess::spawn(&self.bus()?, &arguments, command)?)
    }

    /// The device's configuration, with the cell file's directory and the world's socket for a plugin that asks for them, and the port of an
    /// emulated controller.
    fn config_of(&mut self, device: &DeviceSetting, schema: &Value) -> Result<Value, StartError> {
        let mut config = device.config.clone();
        let asks = |key: &str| schema.get("properties").and_then(|properties| properties.get(key)).is_some();
        let mut set = |key: &str, path: PathBuf| {
            if config.is_null() {
                config = Value::Object(serde_json::Map::new());
            }
            if let Some(entries) = config.as_object_mut() {
                entries.insert(key.to_owned(), path.display().to_string().into());
            }
        };
        if asks("cell_directory")
            && let Some(directory) = self.cell.file.parent()
        {
            set("cell_directory", std::path::absolute(directory).unwrap_or_else(|_| directory.to_owned()));
        }
        let Some(world) = &mut self.world else { return Ok(config) };
        if asks("world") {
            set("world", world.socket());
        }
        if let Some(controller) = &device.emulate {
            // A driver of a controller on the network asks for an address.
            let key = if asks("address") { "address" } else { "port" };
            set(key, world.emulate(&device.name, controller).map_err(StartError::Unsuitable)?);
        }
        Ok(config)
    }
}

impl HostedDevices {
    /// As [`DeviceLinks::connect`], to the host that serves the device already if it lives and makes the same check of moves.
    ///
    /// # Errors
    /// [`DeviceError::Start`]
    pub fn connect_kept(&mut self, device: &DeviceSetting, guard: Value) -> Result<Link, DeviceError> {
        let lives = |(host, known): &(HostProcess, Value)| host.end().is_none() && *known == guard;
        match self.hosts.get(&device.name).is_some_and(lives) {
            true => self.link(device),
            false => self.connect(device, guard),
        }
    }

    /// A device that is put away on purpose: its end is no loss.
    fn forget(&self, device: &str) {
        let mut watch = locked(&self.watch);
        watch.serving.remove(device);
        watch.stops.remove(device);
        watch.lost.retain(|lost| lost.device != device);
    }

    /// A device that did not get ready in time. What it held in shared memory may be why another one failed, so it is named first.
    fn first_frozen(&self) -> Option<DeviceError> {
        self.prepared.iter().find_map(|(device, (host, _))| match host {
            Err(error) if error.is_frozen() => Some(DeviceError::start(device, Arc::clone(error))),
            _ => None,
        })
    }

    /// The link to a device whose host serves.
    fn link(&mut self, device: &DeviceSetting) -> Result<Link, DeviceError> {
        self.try_link(device).map_err(|error| DeviceError::start(&device.name, error))
    }

    fn try_link(&mut self, device: &DeviceSetting) -> Result<Link, StartError> {
        let bus = self.bus()?;
        let Some((host, _)) = self.hosts.get(&device.name) else {
            return Err(StartError::Unsuitable("it has no host".to_owned()));
        };
        let streams = &host.manifest().streams;
        Ok(match host.description().clone() {
            Description::Robot(description) => {
                let (client, stop) = (host.robot()?, Arc::new(host.stop_handle()?));
                let stream = streams.iter().find(|stream| stream.name == "joints").cloned();
                locked(&self.watch).stops.insert(device.name.clone(), Arc::clone(&stop));
                Link::Robot(Box::new(HostedRobot { client, description, stop, bus, stream, watcher: None }))
            }
            Description::Sensor(description) => {
                let client = host.sensor()?;
                let read_within = host.manifest().read_time_limit();
                let stream = streams.iter().find(|stream| stream.message == StripeHeader::TYPE_NAME);
                let stripes = stream.map(|stream| bus.subscriber(&device.name, stream)).transpose()?;
                Link::Sensor(Box::new(HostedSensor { client, description, read_within, stripes }))
            }
        })
    }
}

impl DeviceLinks for HostedDevices {
    /// Loading a library, opening its streams and reaching its device take most of a start, and each host does that by itself.
    fn prepare(&mut self, devices: &[(&DeviceSetting, Value)]) {
        let Ok(bus) = self.bus() else { return };
        let orders: Vec<_> = devices
            .iter()
            .map(|(device, guard)| (device.name.clone(), guard.clone(), self.order(device, guard.clone())))
            .collect();
        let run = tracing::Span::current();
        self.prepared = thread::scope(|scope| {
            let (bus, run) = (&bus, &run);
            let starts: Vec<_> = orders
                .into_iter()
                .map(|(name, guard, order)| {
                    let start = scope.spawn(move || -> Result<HostProcess, StartError> {
                        let _in_run = run.enter();
                        let (arguments, command) = order?;
                        Ok(HostProcess::spawn(bus, &arguments, command)?)
                    });
                    (name, guard, start)
                })
                .collect();
            let panicked = || StartError::Unsuitable("its host could not be started".to_owned());
            let ended = |start: thread::ScopedJoinHandle<'_, Result<HostProcess, StartError>>| {
                start.join().unwrap_or_else(|_| Err(panicked())).map_err(Arc::new)
            };
            starts.into_iter().map(|(name, guard, start)| (name, (ended(start), guard))).collect()
        });
    }

    fn connect(&mut self, device: &DeviceSetting, guard: Value) -> Result<Link, DeviceError> {
        if let Some((old, _)) = self.hosts.remove(&device.name) {
            self.forget(&device.name);
            old.finish(PUTTING_AWAY);
        }
        let prepared = self.prepared.remove(&device.name).filter(|(_, known)| *known == guard);
        let host = match prepared {
            Some((host, _)) => host,
            None => self.spawn(device, guard.clone()).map_err(Arc::new),
        };
        let failed = |error| DeviceError::start(&device.name, error);
        let host = host.map_err(|error| self.first_frozen().unwrap_or_else(|| failed(error)))?;
        locked(&self.watch).serving.insert(device.name.clone());
        if let Some(reason) = host.end() {
            locked(&self.watch).serving.remove(&device.name);
            return Err(failed(Arc::new(StartError::Ended(Box::new(reason)))));
        }
        self.hosts.insert(device.name.clone(), (host, guard));
        self.link(device)
    }

    fn lost(&mut self) -> Option<LostDevice> {
        let mut watch = locked(&self.watch);
        (!watch.lost.is_empty()).then(|| watch.lost.remove(0))
    }

    fn listen(&mut self, device: &str, stream: &str) -> Result<Box<dyn StreamLink>, DeviceError> {
        let refused = |cause: String| DeviceError::refused(device, "listen", PluginError::Failed(cause));
        let bus = self.bus().map_err(|error| DeviceError::start(device, error))?;
        let Some((host, _)) = self.hosts.get(device) else {
            return Err(refused("it is not connected".to_owned()));
        };
        let health = StreamDescription::of::<Health>("health");
        let mut emitted = host.manifest().streams.iter().chain([&health]);
        let Some(description) = emitted.find(|known| known.name == stream) else {
            return Err(refused(format!("it has no stream `{stream}`")));
        };
        let clock = self.world.as_ref().map(|world| world.clock());
        Ok(Box::new(HostedStream::open(&bus, device, description, clock.as_deref())?))
    }

    fn simulate(&mut self, act: &Act) -> Result<Option<f64>, String> {
        self.world.as_mut().map_or(Ok(None), |world| world.operate(act))
    }

    fn is_new_world(&self) -> bool {
        self.world.as_ref().is_some_and(|world| world.is_new())
    }

    fn clock_ns(&self) -> Option<u64> {
        if self.world.is_some() {
            return None;
        }
        let time = clock_gettime(ClockId::CLOCK_MONOTONIC).ok()?;
        u64::try_from(Duration::from(time).as_nanos()).ok()
    }

    fn world_socket(&self) -> Option<String> {
        self.world.as_ref().map(|world| world.socket().display().to_string())
    }

    fn log_lines(&mut self) -> Vec<DeviceLog> {
        self.log_out.try_iter().collect()
    }

    fn shut_down(&mut self, keep_world: bool) {
        *locked(&self.watch) = Watch::default();
        let unasked = std::mem::take(&mut self.prepared).into_values().filter_map(|(host, _)| host.ok());
        let asked = std::mem::take(&mut self.hosts).into_values().map(|(host, _)| host);
        for host in asked.chain(unasked) {
            host.finish(PUTTING_AWAY);
        }
        self.bus = None;
        if let Err(error) = self.domain.remove() {
            tracing::debug!("shared memory is left behind: {error}");
        }
        if let Some(mut world) = self.world.take().filter(|_| !keep_world) {
            world.end();
        }
    }
}

/// The files of the plugins a cell uses, by their hashes, for the record.
pub fn plugin_files(cell: &Workcell, catalogue: &Catalogue) -> Vec<LoadedFile> {
    let mut files: Vec<LoadedFile> = Vec::new();
    for device in &cell.devices {
        let Ok(plugin) = catalogue.find(&device.plugin) else { continue };
        let own = [plugin.manifest_path.clone(), plugin.library_path.clone()];
        for path in own.iter().chain(&plugin.driver_files()) {
            let path_text = path.display().to_string();
            if files.iter().all(|known| known.path != path_text) {
                files.extend(hashed("plugin", path));
            }
        }
    }
    files
}

/// A file by its hash; none when it cannot be read.
pub fn hashed(role: &str, path: &Path) -> Option<LoadedFile> {
    let bytes = plumb_document::read_bytes(path, plumb_document::FileKind::LIBRARY).ok()?;
    Some(LoadedFile {
        role: role.to_owned(),
        path: path.display().to_string(),
        sha256: sha256_hex(&bytes),
        content: None,
    })
}

fn log_line(device: &str, event: &HostEvent) -> Option<DeviceLog> {
    let (level, message) = match event {
        HostEvent::Log { level, text } => {
            let level = match level {
                LogLevel::Debug => event::LogLevel::Debug,
                LogLevel::Info => event::LogLevel::Info,
                LogLevel::Warn => event::LogLevel::Warning,
                LogLevel::Error => event::LogLevel::Error,
            };
            (level, text.clone())
        }
        HostEvent::Output { text } => (event::LogLevel::Warning, text.clone()),
        HostEvent::Ended { reason } if !reason.is_orderly() && !reason.is_reported() => {
            (event::LogLevel::Error, format!("its host {reason}"))
        }
        HostEvent::Progress { .. } | HostEvent::Ended { .. } => return None,
    };
    Some(DeviceLog { device: device.to_owned(), level, message })
}

/// A robot behind its host.
struct HostedRobot {
    client: RobotClient,
    description: RobotDescription,
    stop: Arc<StopHandle>,
    bus: Bus,
    stream: Option<plumb_plugin::StreamDescription>,
    watcher: Option<JointWatcher>,
}

impl RobotLink for HostedRobot {
    fn description(&self) -> &RobotDescription {
        &self.description
    }

    fn activate(&mut self) -> Result<(), DeviceError> {
        self.client.activate().map(drop)
    }

    fn deactivate(&mut self) -> Result<(), DeviceError> {
        self.client.deactivate().map(drop)
    }

    fn read_joints(&mut self) -> Result<JointState, DeviceError> {
        self.client.read_joints()
    }

    fn move_joints(&mut self, motion: &Motion, limit: Duration) -> Result<JointState, DeviceError> {
        let moved = self.client.move_joints(motion, limit);
        if let Err(DeviceError::TimedOut { .. }) = &moved {
            // It may still be moving: what cannot be awaited is stopped.
            self.stop.stop(stop_limit(&self.description));
        }
        moved
    }

    fn jog(&mut self, on: bool) -> Result<JogState, DeviceError> {
        self.client.jog(on)
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), DeviceError> {
        self.client.set_zero(joints)
    }

    fn read_motors(&mut self) -> Result<MotorState, DeviceError> {
        self.client.read_motors()
    }

    fn stop_action(&self) -> StopAction {
        let (stop, limit) = (Arc::clone(&self.stop), stop_limit(&self.description));
        Box::new(move || {
            stop.request();
            let stop = Arc::clone(&stop);
            thread::spawn(move || stop.stop(limit));
        })
    }

    fn watch(&mut self, listener: PoseListener) {
        let Some(stream) = &self.stream else { return };
        match JointWatcher::start(&self.bus, self.client.device(), stream, listener) {
            Ok(watcher) => self.watcher = Some(watcher),
            Err(error) => {
                tracing::warn!(device = self.client.device(), "its movement cannot be watched: {error}")
            }
        }
    }
}

fn stop_limit(description: &RobotDescription) -> Duration {
    Duration::from_millis(u64::from(description.capabilities.stop_time_ms)) + STOP_GRACE
}

/// A sensor behind its host.
struct HostedSensor {
    client: SensorClient,
    description: SensorDescription,
    /// How long a reading may take, which its plugin says.
    read_within: Duration,
    /// The stripes of a light stripe sensor.
    stripes: Option<Subscriber>,
}

impl SensorLink for HostedSensor {
    fn description(&self) -> &SensorDescription {
        &self.description
    }

    fn activate(&mut self) -> Result<(), DeviceError> {
        self.client.activate().map(drop)
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        self.client.arm()
    }

    fn read(&mut self, after_ns: u64) -> Result<Reading, DeviceError> {
        self.client.read(after_ns, self.read_within)
    }

    fn configure(&mut self, settings: &Value) -> Result<(), DeviceError> {
        self.client.configure(settings)
    }

    fn stripes(&mut self) -> Result<Vec<Stripe>, DeviceError> {
        let device = self.client.device().to_owned();
        let lost = |cause: String| DeviceError::refused(&device, "stripes", PluginError::InputLost(cause));
        let mut stripes = Vec::new();
        let Some(subscriber) = &mut self.stripes else { return Ok(stripes) };
        while let Some(read) =
            subscriber.receive_with(StripeHeader::read).map_err(|error| lost(error.to_string()))?
        {
            stripes.push(read.map_err(|error| lost(error.to_string()))?);
        }
        Ok(stripes)
    }
}

#[cfg(test)]
pub(super) mod tests;
