//! What devices behind hosts are given, and what is made of how they end, without a host.

use std::sync::atomic::{AtomicBool, Ordering};

use plumb_host::SpawnError;
use tempfile::TempDir;

use super::super::test_cell::{CELL, cell_in, plugins};
use super::*;

/// A world that is not there.
struct Nowhere {
    ended: Arc<AtomicBool>,
    is_new: bool,
}

impl World for Nowhere {
    fn socket(&self) -> PathBuf {
        "/run/world.sock".into()
    }

    fn clock(&self) -> PathBuf {
        "/run/clock".into()
    }

    fn is_new(&self) -> bool {
        self.is_new
    }

    fn emulate(&mut self, device: &str, controller: &str) -> Result<PathBuf, String> {
        match controller {
            "none" => Err("there is no such controller".to_owned()),
            _ => Ok(format!("/run/{device}.{controller}").into()),
        }
    }

    fn operate(&mut self, act: &Act) -> Result<Option<f64>, String> {
        (act.name == "read_level").then_some(Some(0.25)).ok_or_else(|| "unknown".to_owned())
    }

    fn end(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
    }
}

impl HostedDevices {
    /// A device is lost.
    pub(in crate::device) fn lose(&mut self, device: &str, message: &str) {
        let lost = LostDevice { device: device.to_owned(), message: message.to_owned() };
        locked(&self.watch).lost.push(lost);
    }

    /// A device says something.
    pub(in crate::device) fn log(&mut self, device: &str, message: &str) {
        let line = DeviceLog {
            device: device.to_owned(),
            level: event::LogLevel::Info,
            message: message.to_owned(),
        };
        self.log_in.send(line).unwrap();
    }
}

fn devices_of(text: &str, world: Option<Nowhere>) -> (TempDir, HostedDevices) {
    let (directory, catalogue) = plugins();
    let cell = cell_in(&directory, text);
    let domain = Domain::of_cell(&cell.file).unwrap();
    let world = world.map(|world| Box::new(world) as Box<dyn World>);
    (directory, HostedDevices::new(cell, catalogue, domain, world))
}

pub(in crate::device) fn devices_in_world() -> (TempDir, HostedDevices, Arc<AtomicBool>) {
    let ended = Arc::new(AtomicBool::new(false));
    let (directory, devices) = devices_of(CELL, Some(Nowhere { ended: Arc::clone(&ended), is_new: true }));
    (directory, devices, ended)
}

pub(in crate::device) fn devices_without_world() -> (TempDir, HostedDevices) {
    devices_of(CELL, None)
}

/// The settings that the first device's plugin is given.
fn given(devices: &mut HostedDevices, emulate: Option<&str>) -> Result<Value, String> {
    let device = DeviceSetting { emulate: emulate.map(str::to_owned), ..devices.cell.devices[0].clone() };
    let schema = devices.catalogue.find(&device.plugin).unwrap().manifest.config.clone();
    devices.config_of(&device, &schema).map_err(|error| error.to_string())
}

#[test]
fn a_plugin_that_asks_for_them_is_given_the_cells_folder_its_world_and_an_emulated_port() {
    let (directory, mut devices, _) = devices_in_world();
    let folder = directory.path().display().to_string();
    assert_eq!(
        given(&mut devices, None),
        Ok(serde_json::json!({"cell_directory": folder, "world": "/run/world.sock"}))
    );
    assert_eq!(
        given(&mut devices, Some("puma")),
        Ok(
            serde_json::json!({"cell_directory": folder, "world": "/run/world.sock", "port": "/run/arm.puma"})
        )
    );
    assert_eq!(given(&mut devices, Some("none")), Err("there is no such controller".to_owned()));
    // The sensor asks for neither, and knows an address.
    let eye = DeviceSetting { emulate: Some("net".to_owned()), ..devices.cell.devices[1].clone() };
    let schema = devices.catalogue.find(&eye.plugin).unwrap().manifest.config.clone();
    let config = devices.config_of(&eye, &schema).unwrap();
    assert_eq!(config, serde_json::json!({"bit": 1, "address": "/run/eye.net"}));
    let (directory, mut devices) = devices_without_world();
    let folder = directory.path().display().to_string();
    assert_eq!(given(&mut devices, Some("puma")), Ok(serde_json::json!({"cell_directory": folder})));
}

#[test]
fn a_host_is_given_its_limits_its_clock_and_the_hash_its_library_had() {
    let robots = "arm: {joints: {waist: deg, lift: mm}, initialize: [waist], limits_deg: {waist: [-20, 30]}, limits_mm: {lift: [5, 40]}}";
    let text = CELL.replace("arm: {joints: {waist: deg, lift: mm}}", robots);
    let world = Nowhere { ended: Arc::default(), is_new: false };
    let (folder, devices) = devices_of(&text, Some(world));
    let mut devices = devices.under_debugger(true);
    let arm = DeviceSetting { memory_limit_mb: Some(321), ..devices.cell.devices[0].clone() };
    let (arguments, _) = devices.order(&arm, serde_json::json!("guard")).unwrap();
    assert_eq!((arguments.device.as_str(), &arguments.guard), ("arm", &serde_json::json!("guard")));
    assert_eq!(arguments.clock.as_deref(), Some(Path::new("/run/clock")));
    assert_eq!((arguments.memory_limit_mb, arguments.under_debugger), (321, true));
    assert_eq!(arguments.library_sha256, Some(sha256_hex(b"robot")));
    let ranges: Vec<_> =
        arguments.joint_ranges.iter().map(|range| (range.joint.as_str(), range.lower, range.upper)).collect();
    assert_eq!(
        ranges,
        [("lift", 5.0, 40.0)],
        "the zero of the waist is kept here, so its limits are checked here"
    );
    // The library is exchanged while the run goes on: the host is given the hash of the one that was there.
    std::fs::write(folder.path().join("robot/libtest_robot.so"), "another").unwrap();
    let eye = devices.cell.devices[1].clone();
    let (again, _) = devices.order(&devices.cell.devices[0].clone(), Value::Null).unwrap();
    assert_eq!(again.library_sha256, Some(sha256_hex(b"robot")));
    let (arguments, _) = devices.order(&eye, Value::Null).unwrap();
    let wired: Vec<_> =
        arguments.inputs.iter().map(|wire| (wire.input.as_str(), wire.device.as_str())).collect();
    assert_eq!(wired, [("line", "arm")]);
    assert!(arguments.joint_ranges.is_empty() && arguments.memory_limit_mb != 321);
    assert_eq!(devices.hash_at_start(Path::new("/elsewhere.so")), None);
}

#[test]
fn the_world_is_asked_and_ended_unless_it_is_kept() {
    for (keep, is_new) in [(true, false), (false, true)] {
        let ended = Arc::new(AtomicBool::new(false));
        let (_directory, mut devices) = devices_of(CELL, Some(Nowhere { ended: Arc::clone(&ended), is_new }));
        assert_eq!(devices.simulate(&Act { name: "read_level".into(), ..Act::default() }), Ok(Some(0.25)));
        assert_eq!(devices.simulate(&Act::default()), Err("unknown".to_owned()));
        assert_eq!(devices.is_new_world(), is_new);
        assert_eq!((devices.clock_ns(), devices.world_socket().as_deref()), (None, Some("/run/world.sock")));
        devices.lose("arm", "lost");
        devices.shut_down(keep);
        assert_eq!(ended.load(Ordering::Relaxed), !keep);
        assert_eq!(devices.lost(), None, "it is over");
    }
}

#[test]
fn without_a_world_nothing_is_simulated_and_the_clock_is_the_systems() {
    let (_directory, mut devices) = devices_without_world();
    assert_eq!(devices.simulate(&Act::default()), Ok(None));
    assert!(!devices.is_new_world());
    assert_eq!(devices.world_socket(), None);
    let (first, second) = (devices.clock_ns().unwrap(), devices.clock_ns().unwrap());
    assert!(first > 1 && second >= first && second - first < 5_000_000_000, "{first} {second}");
}

#[test]
fn a_device_that_was_not_connected_has_no_link_and_no_stream() {
    let (_directory, mut devices) = devices_without_world();
    let arm = devices.cell.devices[0].clone();
    let error = devices.link(&arm).err().unwrap().to_string();
    assert!(error.contains("arm") && error.contains("it has no host"), "{error}");
    let error = devices.listen("arm", "joints").err().unwrap().to_string();
    assert!(error.contains("arm") && error.contains("it is not connected"), "{error}");
    devices.shut_down(false);
    assert!(!Domain::all().contains(&devices.domain), "nothing is left in shared memory");
}

fn ended(code: Option<i32>, killed_because: Option<&str>) -> ExitReason {
    ExitReason {
        code,
        signal: None,
        killed_because: killed_because.map(str::to_owned),
        last_output: Vec::new(),
    }
}

#[test]
fn only_a_device_that_serves_can_be_lost_and_is_reported_once() {
    let (_directory, mut devices) = devices_without_world();
    let note = |devices: &HostedDevices, device: &str| {
        locked(&devices.watch).note_end(device, &ended(Some(3), None));
    };
    note(&devices, "arm");
    assert_eq!(devices.lost(), None, "it was put away, or never there");
    for device in ["arm", "eye"] {
        locked(&devices.watch).serving.insert(device.to_owned());
    }
    note(&devices, "arm");
    note(&devices, "arm");
    let lost = devices.lost().unwrap();
    assert_eq!(lost.message, "arm is lost: the host of arm ended with code 3");
    assert_eq!(devices.lost(), None);
    note(&devices, "eye");
    devices.lose("arm", "again");
    devices.forget("eye");
    assert_eq!(devices.lost().map(|lost| lost.device), Some("arm".to_owned()), "the eye is put away");
    assert_eq!(devices.lost(), None);
}

#[test]
fn a_device_that_froze_is_named_before_one_that_failed_because_of_it() {
    let (_directory, mut devices) = devices_without_world();
    let failed = StartError::Unsuitable("no room".to_owned());
    devices.prepared.insert("arm".into(), (Err(Arc::new(failed)), Value::Null));
    assert!(devices.first_frozen().is_none());
    let late = SpawnError::TimedOut { device: "eye".into(), limit: Duration::from_secs(15) };
    devices.prepared.insert("eye".into(), (Err(Arc::new(late.into())), Value::Null));
    let named = devices.first_frozen().unwrap().to_string();
    assert!(named.starts_with("eye"), "{named}");
}

/// The level and text of the line a host's event becomes.
fn line(event: &HostEvent) -> Option<(event::LogLevel, String)> {
    log_line("arm", event).map(|line| {
        assert_eq!(line.device, "arm");
        (line.level, line.message)
    })
}

#[test]
fn what_a_host_says_becomes_a_line_of_its_level_and_a_good_end_becomes_none() {
    for (level, expected) in [
        (LogLevel::Debug, event::LogLevel::Debug),
        (LogLevel::Info, event::LogLevel::Info),
        (LogLevel::Warn, event::LogLevel::Warning),
        (LogLevel::Error, event::LogLevel::Error),
    ] {
        let logged = HostEvent::Log { level, text: "so".into() };
        assert_eq!(line(&logged), Some((expected, "so".to_owned())));
    }
    let printed = HostEvent::Output { text: "oops".into() };
    assert_eq!(line(&printed), Some((event::LogLevel::Warning, "oops".to_owned())));
    let end = |code| line(&HostEvent::Ended { reason: ended(code, None) });
    assert_eq!(end(Some(0)), None, "in good order");
    assert_eq!(end(Some(3)), Some((event::LogLevel::Error, "its host ended with code 3".to_owned())));
    let reported = (0..=255).filter(|code| ended(Some(*code), None).is_reported());
    let reported: Vec<i32> = reported.collect();
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert_eq!(end(Some(reported[0])), None, "it has said the reason itself");
    assert_eq!(line(&HostEvent::Progress { fraction: 0.5, text: "half".into() }), None);
}

#[test]
fn a_robot_has_the_time_its_plugin_states_and_some_more_to_confirm_a_stop() {
    let mut description = RobotDescription {
        model: "arm".into(),
        joints: Vec::new(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        capabilities: plumb_plugin::RobotCapabilities::default(),
    };
    description.capabilities.stop_time_ms = 600;
    assert_eq!(stop_limit(&description), Duration::from_millis(1000));
    description.capabilities.stop_time_ms = 0;
    assert_eq!(stop_limit(&description), Duration::from_millis(400));
}

#[test]
fn the_files_of_the_plugins_a_cell_uses_are_hashed_once_each() {
    let (folder, catalogue) = plugins();
    let cell = cell_in(&folder, &CELL.replace("  eye:", "  spare: {plugin: missing}\n  eye:"));
    let mut found: Vec<_> =
        plugin_files(&cell, &catalogue).into_iter().map(|file| (file.role, file.path, file.sha256)).collect();
    found.sort();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let manifest = |name: &str| sha256_hex(&std::fs::read(folder.path().join(name)).unwrap());
    let role = || "plugin".to_owned();
    let expected = [
        (role(), file("robot/libtest_robot.so"), sha256_hex(b"robot")),
        (role(), file("robot/plugin.yaml"), manifest("robot/plugin.yaml")),
        (role(), file("sensor/libtest_sensor.so"), sha256_hex(b"sensor")),
        (role(), file("sensor/plugin.yaml"), manifest("sensor/plugin.yaml")),
    ];
    assert_eq!(found, expected);
    assert_eq!(hashed("plugin", Path::new("/nowhere.so")), None);
}
