//! The checks on a device in the test's own process.

use std::sync::Mutex;
use std::sync::PoisonError;
use std::thread;
use std::time::{Duration, Instant};

use super::outcome::caught;
use super::times::{CALL_WITHIN, within};
use super::{
    CheckOutcome, CheckReport, Interruption, LISTS, ROBOT_CHECKS, RobotBench, SENSOR_CHECKS, SensorBench,
    check_quantities, check_robot_lists, not_run, run_robot_check,
};
use crate::message::Layout;
use crate::recording::RecordingHost;
use crate::{
    DeviceKind, DigitalInputs, Host, JointState, Manifest, Motion, PluginError, Reading, Robot,
    RobotDescription, Sensor, SensorDescription, StreamDescription, Value,
};

/// Runs every robot check, each on a robot of its own made by `create`, and the checks of the manifest.
///
/// ```no_run
/// # use plumb_plugin::{conformance, Host, PluginError, Robot};
/// # fn check<MyRobot: Robot>(manifest: &str) {
/// // The manifest is include_str!("../plugin.yaml").
/// let report = conformance::check_robot(manifest, |host| {
///     MyRobot::create(&serde_json::json!({"port": "/dev/ttyUSB0"}), host)
/// });
/// assert!(report.is_good(), "{report}");
/// # }
/// ```
pub fn check_robot<R: Robot>(manifest: &str, create: impl Fn(Host) -> Result<R, PluginError>) -> CheckReport {
    let mut report =
        CheckReport { rows: vec![("its manifest is good", check_manifest(manifest, DeviceKind::Robot))] };
    let mut streams = Streams::of(manifest, DeviceKind::Robot);
    let mut goes_on = true;
    for check in ROBOT_CHECKS {
        let recording = RecordingHost::new();
        let made = caught_in_create(|| create(recording.host()));
        let outcome = match made {
            _ if !goes_on => not_run(),
            Ok(robot) => {
                let mut bench =
                    RobotInProcess { robot, recording: recording.clone(), joints_seen: 0, inputs_seen: 0 };
                let (outcome, stopped) = run_robot_check(*check, &mut bench);
                goes_on = stopped;
                outcome
            }
            Err(outcome) => outcome,
        };
        streams.look(&recording);
        report.rows.push((check.0, outcome));
    }
    report.rows.push(streams.row());
    report.rows.push((
        LISTS,
        lists(
            manifest,
            || create(RecordingHost::new().host()),
            |manifest, robot: &R| check_robot_lists(manifest, &robot.describe()),
        ),
    ));
    report
}

/// Holds what a device says of itself against its manifest.
fn lists<T>(
    manifest: &str,
    create: impl FnOnce() -> Result<T, PluginError>,
    check: impl FnOnce(&Manifest, &T) -> CheckOutcome,
) -> CheckOutcome {
    let Ok(manifest) = Manifest::parse(manifest, "plugin.yaml") else {
        return CheckOutcome::Skipped("its manifest cannot be used".to_owned());
    };
    match caught_in_create(create) {
        Ok(device) => check(&manifest, &device),
        Err(outcome) => outcome,
    }
}

/// Runs every sensor check, each on a sensor of its own made by `create`, and the checks of the manifest.
pub fn check_sensor<S: Sensor>(
    manifest: &str,
    create: impl Fn(Host) -> Result<S, PluginError>,
) -> CheckReport {
    let mut report =
        CheckReport { rows: vec![("its manifest is good", check_manifest(manifest, DeviceKind::Sensor))] };
    let parsed = Manifest::parse(manifest, "plugin.yaml").ok();
    let read_within = parsed.as_ref().map_or(CALL_WITHIN, Manifest::read_time_limit);
    let inputs: Vec<String> =
        parsed.into_iter().flat_map(|manifest| manifest.inputs).map(|input| input.name).collect();
    let mut streams = Streams::of(manifest, DeviceKind::Sensor);
    for (name, check) in SENSOR_CHECKS {
        let recording = RecordingHost::new();
        let outcome = match caught_in_create(|| create(recording.host())) {
            Ok(sensor) => {
                let (recording, inputs) = (recording.clone(), inputs.clone());
                let mut bench = SensorInProcess { sensor, recording, inputs, read_within };
                caught(|| check(&mut bench))
            }
            Err(outcome) => outcome,
        };
        streams.look(&recording);
        report.rows.push((name, outcome));
    }
    report.rows.push(streams.row());
    report.rows.push((
        LISTS,
        lists(
            manifest,
            || create(RecordingHost::new().host()),
            |manifest, sensor: &S| check_quantities(manifest, &sensor.describe()),
        ),
    ));
    report
}

/// A device; or why there is none, as the outcome of its check.
fn caught_in_create<T>(create: impl FnOnce() -> Result<T, PluginError>) -> Result<T, CheckOutcome> {
    let mut made = None;
    let outcome = caught(|| {
        made = Some(create()?);
        Ok(CheckOutcome::Passed)
    });
    made.ok_or(outcome)
}

/// What a device may emit, and what it emitted beside that.
struct Streams {
    /// None without a manifest to hold it against, of which another check says.
    declared: Option<Vec<StreamDescription>>,
    wrong: Option<String>,
}

impl Streams {
    fn of(manifest: &str, kind: DeviceKind) -> Self {
        let parsed = Manifest::parse(manifest, "plugin.yaml").ok().filter(|manifest| manifest.kind == kind);
        Self { declared: parsed.map(|manifest| manifest.streams), wrong: None }
    }

    /// Looks at what was emitted during one check.
    fn look(&mut self, recording: &RecordingHost) {
        let Some(all) = &self.declared else { return };
        for name in recording.streams() {
            let declared = all.iter().find(|stream| stream.name == name);
            let length = declared.and_then(Layout::of).and_then(|layout| layout.length());
            let off = recording
                .emitted_bytes(&name)
                .into_iter()
                .find(|message| length.is_some_and(|length| message.len() != length));
            let wrong = match (declared, off) {
                (None, _) => Some(format!("it emits on '{name}', which its manifest does not declare")),
                (Some(stream), Some(message)) => Some(format!(
                    "a message on '{name}' has {} bytes; the layout of {} has {}",
                    message.len(),
                    stream.message,
                    length.unwrap_or_default()
                )),
                (Some(_), None) => None,
            };
            self.wrong = self.wrong.take().or(wrong);
        }
    }

    fn row(self) -> (&'static str, CheckOutcome) {
        let outcome = match (self.declared, self.wrong) {
            (None, _) => CheckOutcome::Skipped("its manifest cannot be used".to_owned()),
            (Some(_), None) => CheckOutcome::Passed,
            (Some(_), Some(wrong)) => CheckOutcome::Failed(wrong),
        };
        ("it emits what its manifest declares", outcome)
    }
}

fn check_manifest(text: &str, kind: DeviceKind) -> CheckOutcome {
    match Manifest::parse(text, "plugin.yaml") {
        Ok(manifest) if manifest.kind != kind => {
            CheckOutcome::Failed(format!("it says it is a {}, and is a {kind}", manifest.kind))
        }
        Ok(manifest) => manifest_is_good(&manifest),
        Err(error) => CheckOutcome::Failed(error.to_string()),
    }
}

/// Whether a manifest that can be read says what one of its kind has to.
pub fn manifest_is_good(manifest: &Manifest) -> CheckOutcome {
    if manifest.kind == DeviceKind::Robot && !manifest.streams.iter().any(|stream| stream.name == "joints") {
        return CheckOutcome::Failed("a robot has a stream 'joints'".to_owned());
    }
    if !manifest.config.is_null() && !manifest.config.is_object() {
        return CheckOutcome::Failed("config is a JSON Schema, or left out".to_owned());
    }
    CheckOutcome::Passed
}

struct RobotInProcess<R> {
    robot: R,
    recording: RecordingHost,
    joints_seen: usize,
    inputs_seen: usize,
}

/// How often a move is looked at for its beginning, and how long it may take to begin.
const LOOK: Duration = Duration::from_millis(1);
const BEGINNING: Duration = Duration::from_secs(10);

impl<R: Robot> RobotBench for RobotInProcess<R> {
    fn describe(&mut self) -> Result<RobotDescription, PluginError> {
        Ok(self.robot.describe())
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        self.recording.set_stop(false);
        self.robot.activate()
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        within(CALL_WITHIN, "read joints", || self.robot.read_joints())
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        within(CALL_WITHIN, "read inputs", || self.robot.read_inputs())
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        self.recording.set_stop(true);
        within(CALL_WITHIN, "stop", || self.robot.stop())
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        self.robot.move_joints(motion)
    }

    fn interrupt(&mut self, motion: &Motion) -> Interruption {
        self.emitted_joints();
        let seen = self.joints_seen;
        let (robot, recording) = (&mut self.robot, &self.recording);
        let result: Mutex<Option<(Result<JointState, PluginError>, Instant)>> = Mutex::new(None);
        let ended = || result.lock().unwrap_or_else(PoisonError::into_inner).is_some();
        let mut asked = None;
        thread::scope(|scope| {
            scope.spawn(|| {
                let moved = robot.move_joints(motion);
                *result.lock().unwrap_or_else(PoisonError::into_inner) = Some((moved, Instant::now()));
            });
            let begin = Instant::now();
            while !ended() && begin.elapsed() < BEGINNING {
                if recording.emitted::<JointState>("joints").iter().skip(seen).any(JointState::is_moving) {
                    break;
                }
                thread::sleep(LOOK);
            }
            if !ended() {
                asked = Some(Instant::now());
                recording.set_stop(true);
            }
        });
        let outcome = result.into_inner().unwrap_or_else(PoisonError::into_inner);
        let (result, end) = outcome
            .unwrap_or_else(|| (Err(PluginError::Failed("the move never ended".to_owned())), Instant::now()));
        if matches!(result, Err(PluginError::Stopped(_)))
            && let Err(error) = self.robot.stop()
        {
            return Interruption { result: Err(error), after: asked.map(|asked| end - asked) };
        }
        // A move that ended well just as the stop came had no time to take notice of it.
        let too_late =
            result.is_ok() && asked.is_some_and(|asked| end.saturating_duration_since(asked) < LOOK * 10);
        Interruption {
            after: asked.filter(|_| !too_late).map(|asked| end.saturating_duration_since(asked)),
            result,
        }
    }

    fn emitted_joints(&mut self) -> Vec<JointState> {
        let all = self.recording.emitted::<JointState>("joints");
        let new = all.get(self.joints_seen..).unwrap_or_default().to_vec();
        self.joints_seen = all.len();
        new
    }

    fn emitted_inputs(&mut self) -> Vec<DigitalInputs> {
        let all = self.recording.emitted::<DigitalInputs>("inputs");
        let new = all.get(self.inputs_seen..).unwrap_or_default().to_vec();
        self.inputs_seen = all.len();
        new
    }
}

struct SensorInProcess<S> {
    sensor: S,
    recording: RecordingHost,
    inputs: Vec<String>,
    read_within: Duration,
}

impl<S: Sensor> SensorBench for SensorInProcess<S> {
    fn describe(&mut self) -> Result<SensorDescription, PluginError> {
        Ok(self.sensor.describe())
    }

    fn has_inputs(&self) -> bool {
        !self.inputs.is_empty()
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        within(CALL_WITHIN, "arm", || self.sensor.arm())
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        within(CALL_WITHIN, "poll", || self.sensor.poll())
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        within(CALL_WITHIN, "configure", || self.sensor.configure(settings))
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        within(self.read_within, "read", || self.sensor.read(after_ns))
    }

    fn lose_messages(&mut self) -> bool {
        for input in &self.inputs {
            self.recording.feed_loss(input);
        }
        true
    }
}
