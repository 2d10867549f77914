//! The checks on a device in the test's own process.

use std::sync::Mutex;
use std::sync::PoisonError;
use std::thread;
use std::time::{Duration, Instant};

use super::{CheckOutcome, CheckReport, Interruption, ROBOT_CHECKS, RobotBench, SENSOR_CHECKS, SensorBench};
use crate::recording::RecordingHost;
use crate::{
    DeviceKind, DigitalInputs, Host, JointState, Manifest, Motion, PluginError, Reading, Robot,
    RobotDescription, Sensor, SensorDescription, Value,
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
    for (name, check) in ROBOT_CHECKS {
        let recording = RecordingHost::new();
        let outcome = create(recording.host()).and_then(|robot| {
            check(&mut RobotInProcess { robot, recording, joints_seen: 0, inputs_seen: 0 })
        });
        report.rows.push((name, settled(outcome)));
    }
    report
}

/// Runs every sensor check, each on a sensor of its own made by `create`, and the checks of the manifest.
pub fn check_sensor<S: Sensor>(
    manifest: &str,
    create: impl Fn(Host) -> Result<S, PluginError>,
) -> CheckReport {
    let mut report =
        CheckReport { rows: vec![("its manifest is good", check_manifest(manifest, DeviceKind::Sensor))] };
    let parsed = Manifest::parse(manifest, "plugin.yaml");
    let inputs: Vec<String> = parsed
        .map(|manifest| manifest.inputs.into_iter().map(|input| input.name).collect())
        .unwrap_or_default();
    for (name, check) in SENSOR_CHECKS {
        let recording = RecordingHost::new();
        let outcome = create(recording.host())
            .and_then(|sensor| check(&mut SensorInProcess { sensor, recording, inputs: inputs.clone() }));
        report.rows.push((name, settled(outcome)));
    }
    report
}

fn settled(outcome: Result<CheckOutcome, PluginError>) -> CheckOutcome {
    outcome.unwrap_or_else(|error| CheckOutcome::Failed(error.to_string()))
}

fn check_manifest(text: &str, kind: DeviceKind) -> CheckOutcome {
    let manifest = match Manifest::parse(text, "plugin.yaml") {
        Ok(manifest) => manifest,
        Err(error) => return CheckOutcome::Failed(error.to_string()),
    };
    if manifest.kind != kind {
        return CheckOutcome::Failed(format!("it says it is a {}, and is a {kind}", manifest.kind));
    }
    if kind == DeviceKind::Robot && !manifest.streams.iter().any(|stream| stream.name == "joints") {
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
        self.robot.read_joints()
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
}

impl<S: Sensor> SensorBench for SensorInProcess<S> {
    fn describe(&mut self) -> Result<SensorDescription, PluginError> {
        Ok(self.sensor.describe())
    }

    fn has_inputs(&self) -> bool {
        !self.inputs.is_empty()
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        self.sensor.arm()
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        self.sensor.poll()
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        self.sensor.configure(settings)
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        self.sensor.read(after_ns)
    }

    fn lose_messages(&mut self) -> bool {
        for input in &self.inputs {
            self.recording.feed_loss(input);
        }
        true
    }
}
