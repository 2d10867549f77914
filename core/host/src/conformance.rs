//! The conformance suite on devices behind the contract, each check in a fresh host.

use std::thread;
use std::time::{Duration, Instant};

use plumb_bus::{Bus, OpenError, Subscriber};
use plumb_plugin::conformance::{
    CheckOutcome, CheckReport, Interruption, LISTS, ROBOT_CHECKS, RobotBench, RobotCheck, SENSOR_CHECKS,
    SensorBench, check_quantities, check_robot_lists, leaves_at_rest, manifest_is_good, not_run,
    run_robot_check,
};
use plumb_plugin::{
    DeviceKind, DigitalInputs, JointState, Manifest, Message, Motion, PluginError, Reading, RobotDescription,
    SensorDescription, Value,
};

use crate::load::verify;
use crate::{
    DeviceError, HostArguments, HostCommand, HostProcess, Plugin, RobotClient, SensorClient, StopHandle,
    StopOutcome,
};

/// How long a move of a check may take.
const MOVE: Duration = Duration::from_secs(60);

/// How long a stop of a check may take before the host is killed.
const STOP: Duration = Duration::from_secs(5);

/// How long a reading of a check waits for its inputs, of which there are none.
const READ: Duration = Duration::from_millis(100);

/// How long after its answer a device's last messages may take to arrive.
const ARRIVAL: Duration = Duration::from_millis(50);

/// What a robot behind a host must do beside what it must do in any case.
const IN_A_HOST: RobotCheck = ("a device wired to it learns of it at rest", heard_at_rest);

/// Who hears of each check as it is done.
type OnOutcome<'t> = &'t mut dyn FnMut(&'static str, &CheckOutcome);

/// Runs every robot check, each on a robot in a host of its own.
pub fn check_robot(bus: &Bus, arguments: &HostArguments, command: impl Fn() -> HostCommand) -> CheckReport {
    let mut report = CheckReport::default();
    robot_rows(bus, arguments, true, &command, &mut report, &mut |_, _| ());
    report
}

/// Runs every sensor check, each on a sensor in a host of its own. Its inputs are wired as the arguments say; nothing need come on them.
pub fn check_sensor(bus: &Bus, arguments: &HostArguments, command: impl Fn() -> HostCommand) -> CheckReport {
    let mut report = CheckReport::default();
    sensor_rows(bus, arguments, &command, &mut report, &mut |_, _| ());
    report
}

/// Checks a plugin of any language from its manifest to its last check. A robot is moved only when it `may_move`. `on_outcome` hears of each check as it
/// is done.
pub fn check_plugin(
    bus: &Bus,
    plugin: &Plugin,
    arguments: &HostArguments,
    may_move: bool,
    command: impl Fn() -> HostCommand,
    on_outcome: OnOutcome<'_>,
) -> CheckReport {
    let mut report = CheckReport::default();
    add(&mut report, on_outcome, "its manifest is good", manifest_is_good(&plugin.manifest));
    let made = HostProcess::spawn(bus, arguments, command()).map(drop);
    let outcome =
        made.map_or_else(|error| CheckOutcome::Failed(error.to_string()), |()| CheckOutcome::Passed);
    let is_made = outcome == CheckOutcome::Passed;
    add(&mut report, on_outcome, "it is loaded and its device is made", outcome);
    if !is_made {
        return report;
    }
    // It was loaded in a process of its own before: what harms a process has shown there.
    let whole = match verify(plugin) {
        Ok(notes) if notes.is_empty() => CheckOutcome::Passed,
        Ok(notes) => CheckOutcome::Failed(notes.join("; ")),
        Err(error) => CheckOutcome::Failed(error.to_string()),
    };
    add(&mut report, on_outcome, "its functions are whole", whole);
    let listed = lists(bus, plugin, arguments, command());
    add(
        &mut report,
        on_outcome,
        LISTS,
        listed.unwrap_or_else(|error| CheckOutcome::Failed(error.to_string())),
    );
    match plugin.manifest.kind {
        DeviceKind::Robot => robot_rows(bus, arguments, may_move, &command, &mut report, on_outcome),
        DeviceKind::Sensor => sensor_rows(bus, arguments, &command, &mut report, on_outcome),
    }
    report
}

/// Holds what a device says of itself against what its manifest lists.
fn lists(
    bus: &Bus,
    plugin: &Plugin,
    arguments: &HostArguments,
    command: HostCommand,
) -> Result<CheckOutcome, PluginError> {
    let manifest = &plugin.manifest;
    Ok(match manifest.kind {
        DeviceKind::Robot => {
            check_robot_lists(manifest, &RobotInHost::start(bus, arguments, command)?.describe()?)
        }
        DeviceKind::Sensor => {
            check_quantities(manifest, &SensorInHost::start(bus, arguments, command)?.describe()?)
        }
    })
}

fn add(report: &mut CheckReport, on_outcome: OnOutcome<'_>, name: &'static str, outcome: CheckOutcome) {
    on_outcome(name, &outcome);
    report.rows.push((name, outcome));
}

fn robot_rows(
    bus: &Bus,
    arguments: &HostArguments,
    may_move: bool,
    command: &impl Fn() -> HostCommand,
    report: &mut CheckReport,
    on_outcome: OnOutcome<'_>,
) {
    let mut goes_on = true;
    for check in ROBOT_CHECKS.iter().chain([&IN_A_HOST]) {
        let outcome = if !goes_on {
            not_run()
        } else if !may_move && !leaves_at_rest(check.0) {
            CheckOutcome::Skipped("it would move the robot, or make it ready to".to_owned())
        } else {
            match RobotInHost::start(bus, arguments, command()) {
                Ok(mut bench) => {
                    let (outcome, stopped) = run_robot_check(*check, &mut bench);
                    goes_on = stopped;
                    outcome
                }
                Err(error) => CheckOutcome::Failed(error.to_string()),
            }
        };
        add(report, on_outcome, check.0, outcome);
    }
}

fn sensor_rows(
    bus: &Bus,
    arguments: &HostArguments,
    command: &impl Fn() -> HostCommand,
    report: &mut CheckReport,
    on_outcome: OnOutcome<'_>,
) {
    for (name, check) in SENSOR_CHECKS {
        let outcome = SensorInHost::start(bus, arguments, command()).and_then(|mut bench| check(&mut bench));
        add(
            report,
            on_outcome,
            name,
            outcome.unwrap_or_else(|error| CheckOutcome::Failed(error.to_string())),
        );
    }
}

/// A sensor that is wired to the robot's streams can answer for the moment at which the robot was read.
fn heard_at_rest(bench: &mut dyn RobotBench) -> Result<CheckOutcome, PluginError> {
    let robot = bench.describe()?;
    bench.activate()?;
    bench.emitted_joints();
    bench.emitted_inputs();
    let time_ns = bench.read_joints()?.time_ns;
    let failed = |stream: &str| {
        Ok(CheckOutcome::Failed(format!(
            "it was read at {time_ns} ns, and nothing as new as that came on its stream `{stream}`"
        )))
    };
    if !bench.emitted_joints().iter().any(|state| state.time_ns >= time_ns) {
        return failed("joints");
    }
    if !robot.inputs.is_empty() && !bench.emitted_inputs().iter().any(|inputs| inputs.time_ns >= time_ns) {
        return failed("inputs");
    }
    Ok(CheckOutcome::Passed)
}

/// What a device answered, or what kept it from answering.
fn answered<T>(result: Result<T, DeviceError>) -> Result<T, PluginError> {
    result.map_err(|error| match error {
        DeviceError::Refused { source, .. } => source,
        other => PluginError::Failed(other.to_string()),
    })
}

fn opened<T>(result: Result<T, OpenError>) -> Result<T, PluginError> {
    result.map_err(|error| PluginError::Failed(error.to_string()))
}

struct RobotInHost {
    robot: RobotClient,
    stop: StopHandle,
    joints: Option<Subscriber>,
    inputs: Option<Subscriber>,
    // Last, so that the handles go before the process.
    _host: HostProcess,
}

impl RobotInHost {
    fn start(bus: &Bus, arguments: &HostArguments, command: HostCommand) -> Result<Self, PluginError> {
        let manifest =
            Manifest::read(&arguments.manifest).map_err(|error| PluginError::Refused(error.to_string()))?;
        let receiver = |name: &str| {
            let stream = manifest.streams.iter().find(|stream| stream.name == name);
            stream.map(|stream| opened(bus.subscriber(&arguments.device, stream))).transpose()
        };
        let (joints, inputs) = (receiver("joints")?, receiver("inputs")?);
        let host = HostProcess::spawn(bus, arguments, command)
            .map_err(|error| PluginError::Failed(error.to_string()))?;
        Ok(Self {
            robot: opened(host.robot())?,
            stop: opened(host.stop_handle())?,
            joints,
            inputs,
            _host: host,
        })
    }
}

/// What has come on a stream, if there is one.
fn emitted<M: Message>(receiver: &mut Option<Subscriber>) -> Vec<M> {
    let mut messages = Vec::new();
    let end = Instant::now() + ARRIVAL;
    while let Some(receiver) = receiver {
        match receiver.receive::<M>() {
            Ok(Some(message)) => messages.push(message),
            // Lost messages are no fault of the device's.
            Err(_) => {}
            Ok(None) if messages.is_empty() && Instant::now() < end => {
                thread::sleep(Duration::from_millis(1))
            }
            Ok(None) => break,
        }
    }
    messages
}

impl RobotBench for RobotInHost {
    fn describe(&mut self) -> Result<RobotDescription, PluginError> {
        answered(self.robot.describe())
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        answered(self.robot.activate()).map(drop)
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        answered(self.robot.read_joints())
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        answered(self.robot.move_joints(motion, MOVE))
    }

    fn read_inputs(&mut self) -> Result<DigitalInputs, PluginError> {
        answered(self.robot.read_inputs())
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        match self.stop.stop(STOP) {
            StopOutcome::Stopped { .. } | StopOutcome::HostGone => Ok(()),
            StopOutcome::Killed => {
                Err(PluginError::Failed("it did not confirm the stop, and its host was killed".to_owned()))
            }
        }
    }

    fn interrupt(&mut self, motion: &Motion) -> Interruption {
        let Self { robot, stop, joints, .. } = self;
        emitted::<JointState>(joints);
        thread::scope(|scope| {
            let robot = &*robot;
            let moving = scope.spawn(move || answered(robot.move_joints(motion, MOVE)));
            let begin = Instant::now();
            while !moving.is_finished() && begin.elapsed() < STOP {
                if emitted::<JointState>(joints).iter().any(JointState::is_moving) {
                    break;
                }
            }
            let was_moving = !moving.is_finished();
            let outcome = if was_moving { stop.stop(STOP) } else { StopOutcome::HostGone };
            let result = moving
                .join()
                .unwrap_or_else(|_| Err(PluginError::Failed("the thread of the move panicked".to_owned())));
            match outcome {
                StopOutcome::Stopped { after } => {
                    // A move that ended well just as the stop came had no time to take notice of it.
                    let too_late = result.is_ok() && after < Duration::from_millis(10);
                    Interruption { result, after: (!too_late).then_some(after) }
                }
                StopOutcome::HostGone => Interruption { result, after: None },
                StopOutcome::Killed => {
                    let text = "it did not confirm the stop, and its host was killed".to_owned();
                    Interruption { result: Err(PluginError::Failed(text)), after: Some(STOP) }
                }
            }
        })
    }

    fn emitted_joints(&mut self) -> Vec<JointState> {
        emitted(&mut self.joints)
    }

    fn emitted_inputs(&mut self) -> Vec<DigitalInputs> {
        emitted(&mut self.inputs)
    }
}

struct SensorInHost {
    sensor: SensorClient,
    wired: bool,
    read_within: Duration,
    _host: HostProcess,
}

impl SensorInHost {
    fn start(bus: &Bus, arguments: &HostArguments, command: HostCommand) -> Result<Self, PluginError> {
        let host = HostProcess::spawn(bus, arguments, command)
            .map_err(|error| PluginError::Failed(error.to_string()))?;
        let wired = !arguments.inputs.is_empty();
        let read_within = host.manifest().read_time_limit();
        Ok(Self { sensor: opened(host.sensor())?, wired, read_within, _host: host })
    }
}

impl SensorBench for SensorInHost {
    fn describe(&mut self) -> Result<SensorDescription, PluginError> {
        answered(self.sensor.describe())
    }

    fn has_inputs(&self) -> bool {
        self.wired
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        answered(self.sensor.arm())
    }

    fn poll(&mut self) -> Result<(), PluginError> {
        // The host polls by itself, before every reading.
        Ok(())
    }

    fn configure(&mut self, settings: &Value) -> Result<(), PluginError> {
        answered(self.sensor.configure(settings))
    }

    fn read(&mut self, after_ns: u64) -> Result<Option<Reading>, PluginError> {
        // A sensor without inputs has nothing to wait for but its own instrument.
        let limit = if self.wired { READ } else { self.read_within };
        match self.sensor.read(after_ns, limit) {
            Ok(reading) => Ok(Some(reading)),
            Err(DeviceError::Refused { source: PluginError::TimedOut(_), .. }) => Ok(None),
            // Its inputs did not come, and the host says so a little late; or the plugin is still at it.
            Err(DeviceError::TimedOut { .. }) if self.wired => answered(self.sensor.state()).map(|_| None),
            Err(error) => answered(Err(error)),
        }
    }

    fn lose_messages(&mut self) -> bool {
        // Only the sender's side of a stream can lose them, and nobody sends here.
        false
    }
}

#[cfg(test)]
mod tests;
