//! Requests to a device: checked, done by the plugin, answered.

use std::time::{Duration, Instant};

use plumb_bus::Call;
use plumb_plugin::{
    Description, DeviceState, Health, JogState, JointState, JointVector, LogLevel, Motion, PluginError,
    Reading, Reply, Request, WireError,
};

use super::rest_report::RestReport;
use super::watchdog::Watchdog;
use crate::MoveGuard;
use crate::context::Context;
use crate::guard::Limits;
use crate::load::Device;
use crate::time_limits::{UNASKED, UNDER_DEBUGGER};

/// A device in service.
pub(super) struct Service {
    name: String,
    device: Device,
    description: Description,
    /// None for a sensor.
    limits: Option<Limits>,
    guard: Box<dyn MoveGuard>,
    rest_report: RestReport,
    context: &'static Context,
    watchdog: &'static Watchdog,
    state: DeviceState,
    /// Where the joints are, as long as nothing but a move can have changed it.
    joints: Option<JointVector>,
    /// What the last poll failed with: the next reading's answer.
    poll_error: Option<PluginError>,
    health: Health,
    health_sent: Instant,
    /// Whether it takes in what other devices send.
    has_inputs: bool,
}

/// The stream on which a host reports its health.
pub(super) const HEALTH_STREAM: &str = "health";

/// How often a host reports its health when nothing changes.
pub(super) const HEALTH_PERIOD: Duration = Duration::from_secs(1);

/// How long a reading waits for its inputs before it asks the plugin again unasked: a bound on how late the end of its time is noticed.
pub(super) const INPUT_WAIT: Duration = Duration::from_millis(20);

/// The longest a reading waits for its inputs, whatever time the client allows.
const LONGEST_WAIT: Duration = UNDER_DEBUGGER;

/// How long before the end of its time a reading gives up, so that its client hears why; of a short time a fifth.
const SAYS_WHY: Duration = Duration::from_millis(200);

/// How long a request may wait for its device's inputs.
struct Wait<'a> {
    end: Instant,
    /// Waits for new messages, at most so long.
    for_input: &'a mut dyn FnMut(Duration),
}

/// An argument of a request as a function takes it.
macro_rules! argument {
    ($argument:ident: u64) => {
        *$argument
    };
    ($argument:ident: bool) => {
        *$argument
    };
    ($argument:ident: $Type:ident) => {
        $argument
    };
}

/// What the host does with a request, by the last word of its line in the table of operations.
macro_rules! route {
    ($service:ident, $wait:ident, direct $kind:ident.$name:ident($($argument:expr)?)) => {
        $service.device.$kind()?.$name($($argument)?)
    };
    ($service:ident, $wait:ident, checked $kind:ident.$name:ident($($argument:expr)?)) => {
        $service.$name($($argument)?)
    };
    ($service:ident, $wait:ident, awaited $kind:ident.$name:ident($($argument:expr)?)) => {
        $service.$name($($argument,)? $wait)
    };
}

macro_rules! answers {
    (
        common { $($common:tt)* }
        operations { $(
            $kind:ident $(#[doc = $doc:literal])* $code:literal $Variant:ident $title:literal
            $name:ident($($argument:ident: $Argument:ident)?) -> $Answer:tt within $limit:ident $way:ident;
        )* }
    ) => {
        impl Service {
            /// Does a request.
            fn answer(&mut self, request: &Request, wait: &mut Wait<'_>) -> Result<Reply, PluginError> {
                match request {
                    Request::Describe => Ok(Reply::Described(Box::new(self.description.clone()))),
                    Request::State => Ok(Reply::State(self.state)),
                    Request::Activate => {
                        let context = self.context;
                        context.while_moving(|| self.activate())?;
                        Ok(Reply::State(self.state))
                    }
                    Request::Deactivate => {
                        self.deactivate()?;
                        Ok(Reply::State(self.state))
                    }
                    $(Request::$Variant$(($argument))? => {
                        route!(self, wait, $way $kind.$name($(argument!($argument: $Argument))?)).map(Reply::from)
                    })*
                }
            }
        }
    };
}

plumb_abi::device_requests!(answers);

impl Service {
    #[allow(clippy::too_many_arguments, reason = "a host is put together once, from its parts")]
    pub(super) fn new(
        name: &str,
        device: Device,
        description: Description,
        limits: Option<Limits>,
        guard: Box<dyn MoveGuard>,
        rest_report: RestReport,
        context: &'static Context,
        watchdog: &'static Watchdog,
    ) -> Self {
        Self {
            name: name.to_owned(),
            device,
            description,
            limits,
            guard,
            rest_report,
            context,
            watchdog,
            state: DeviceState::Inactive,
            joints: None,
            poll_error: None,
            health: Health::default(),
            health_sent: Instant::now(),
            has_inputs: false,
        }
    }

    /// The device takes in what others send.
    pub(super) fn with_inputs(mut self, has_inputs: bool) -> Self {
        self.has_inputs = has_inputs;
        self
    }

    /// Does one request. `wait_for_input` waits a little for new messages on the inputs.
    pub(super) fn serve(
        &mut self,
        request: Result<Request, WireError>,
        call: Call,
        wait_for_input: &mut dyn FnMut(Duration),
    ) -> Result<Reply, PluginError> {
        let begin = Instant::now();
        self.context.serve_under(call.span);
        let result = match request {
            Ok(request) => {
                let watchdog = self.watchdog;
                let limit = call.time_limit.min(LONGEST_WAIT);
                let end = begin + limit.saturating_sub(SAYS_WHY.min(limit / 5));
                let mut wait = Wait { end, for_input: wait_for_input };
                watchdog.watch(request.name(), call.time_limit, || self.answer(&request, &mut wait))
            }
            Err(error) => Err(PluginError::Refused(error.to_string())),
        };
        let result = match self.context.take_misdated() {
            Some(why) => Err(PluginError::Failed(why)),
            None => result.and_then(|reply| self.check_time_of(reply)),
        };
        // A move that was stopped because the host ends was not stopped by anybody's wish.
        let result = self.context.ends_because().map_or(result, |why| Err(PluginError::Failed(why)));
        self.context.serve_under(0);
        count(&mut self.health, result.is_err(), begin.elapsed());
        result
    }

    /// A reply whose time is of the cell's clock; one that another clock has dated is refused.
    fn check_time_of(&self, reply: Reply) -> Result<Reply, PluginError> {
        let Some((what, time_ns)) = time_of(&reply, self.context.clock.now_ns()) else { return Ok(reply) };
        self.context.check_time(what, time_ns).map(|()| reply).map_err(PluginError::Failed)
    }

    fn deactivate(&mut self) -> Result<(), PluginError> {
        self.device.deactivate()?;
        self.enter(DeviceState::Inactive);
        Ok(())
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        if !self.context.stop.take_back() {
            return Err(PluginError::Stopped(format!("{} is being stopped", self.name)));
        }
        self.joints = None;
        self.device.activate()?;
        self.enter(DeviceState::Active);
        Ok(())
    }

    fn must_be_active(&self, what: &str) -> Result<(), PluginError> {
        let name = &self.name;
        if self.context.stop.is_asked() {
            return Err(PluginError::Stopped(format!(
                "{name} was stopped; activate it before it may {what} again"
            )));
        }
        match self.state {
            DeviceState::Active => Ok(()),
            state => {
                Err(PluginError::NotReady(format!("{name} is {state}; activate it before it may {what}")))
            }
        }
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        let state = self.device.robot()?.read_joints()?;
        self.joints = joints_at_rest(&state);
        self.rest_report.emit(&state, &self.device, self.context);
        Ok(state)
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let context = self.context;
        context.while_moving(|| self.move_within_limits(motion))
    }

    fn move_within_limits(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let limits = self
            .limits
            .as_ref()
            .ok_or_else(|| PluginError::Unsupported(format!("{} is no robot", self.name)))?;
        limits.check_motion(motion)?;
        self.must_be_active("move")?;
        let from = match self.joints {
            Some(joints) => joints,
            None => self.device.robot()?.read_joints()?.joints,
        };
        let end = limits.check_end(motion, &from)?;
        self.guard.check(&from, &end).map_err(PluginError::OutOfRange)?;
        self.joints = None;
        let state = self.device.robot()?.move_joints(motion)?;
        self.joints = joints_at_rest(&state);
        Ok(state)
    }

    fn jog(&mut self, on: bool) -> Result<JogState, PluginError> {
        self.joints = None;
        if on {
            self.must_be_active("be jogged")?;
        }
        self.device.robot()?.jog(on)
    }

    fn set_zero(&mut self, joints: &JointVector) -> Result<(), PluginError> {
        self.joints = None;
        self.context.while_moving(|| self.device.robot()?.set_zero(joints))
    }

    fn arm(&mut self) -> Result<(), PluginError> {
        self.poll_error = None;
        self.device.sensor()?.arm()
    }

    /// Takes in what has come until the sensor has seen far enough, or time is up.
    fn read(&mut self, after_ns: u64, wait: &mut Wait<'_>) -> Result<Reading, PluginError> {
        loop {
            if let Some(error) = self.poll_error.take() {
                return Err(error);
            }
            self.device.poll()?;
            if let Some(reading) = self.device.sensor()?.read(after_ns)? {
                return Ok(reading);
            }
            let left = wait.end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(PluginError::TimedOut(self.nothing_seen(after_ns)));
            }
            if self.context.stop.is_asked() {
                return Err(PluginError::Stopped(format!(
                    "{} was stopped while it waited for its inputs",
                    self.name
                )));
            }
            (wait.for_input)(left.min(INPUT_WAIT));
        }
    }

    /// Why a reading gave up: its plugin had nothing as new as it was asked for.
    fn nothing_seen(&self, after_ns: u64) -> String {
        let (name, after_s) = (&self.name, after_ns as f64 * 1e-9);
        if self.has_inputs {
            return format!("{name} has not seen its inputs up to {after_s:.3} s of the cell's clock");
        }
        format!(
            "{name} says that it has nothing to read yet, nothing as new as {after_s:.3} s of the cell's clock, and has no inputs to wait for"
        )
    }

    /// Lets the plugin take in what has come on its inputs.
    pub(super) fn poll(&mut self) {
        let polled = self.watchdog.watch("poll", UNASKED, || self.device.poll());
        let polled = self.context.take_misdated().map_or(polled, |why| Err(PluginError::Failed(why)));
        if let Err(error) = polled {
            self.context.report(LogLevel::Warn, &format!("taking in its inputs failed: {error}"));
            self.poll_error = Some(error);
        }
    }

    /// Brings the device to rest after a stop, and leaves it inactive. False when the robot does not confirm that it is at rest.
    pub(super) fn stop(&mut self) -> bool {
        self.joints = None;
        let stopped = self.watchdog.watch("stop", UNASKED, || self.device.stop());
        self.enter(state_after_stop(self.state, self.limits.is_some()));
        match stopped {
            Ok(()) => {
                self.context.report(LogLevel::Info, "stopped");
                true
            }
            Err(error) => {
                self.context.report(LogLevel::Error, &format!("the stop was not confirmed: {error}"));
                false
            }
        }
    }

    /// Puts the device away.
    pub(super) fn finish(mut self) {
        let (context, watchdog) = (self.context, self.watchdog);
        let ended = watchdog.watch("its end", UNASKED, || {
            let rested = if self.state == DeviceState::Active { self.device.deactivate() } else { Ok(()) };
            self.enter(DeviceState::Finalized);
            rested.and(self.device.destroy())
        });
        if let Err(error) = ended {
            context.report(LogLevel::Warn, &format!("the device did not end in good order: {error}"));
        }
    }

    fn enter(&mut self, state: DeviceState) {
        if self.state != state {
            self.state = state;
            self.report_health();
        }
    }

    /// Reports the health of the device when it is time to.
    pub(super) fn report_health_in_time(&mut self) {
        if self.health_sent.elapsed() >= HEALTH_PERIOD {
            self.report_health();
        }
    }

    /// Reports the health of the device.
    pub(super) fn report_health(&mut self) {
        self.health_sent = Instant::now();
        self.health.time_ns = self.context.clock.now_ns();
        self.health.state = self.state.code();
        // A health message that cannot be sent has been logged by the context.
        let _ = self.context.emit(HEALTH_STREAM, bytemuck::bytes_of(&self.health));
    }
}

/// The time of a reply that has one, ns, and what it is the time of. What a sensor saw last may be long ago; it is not later than now.
fn time_of(reply: &Reply, now_ns: u64) -> Option<(&'static str, u64)> {
    match reply {
        Reply::Joints(state) => Some(("its answer where the joints are", state.time_ns)),
        Reply::Jog(jog) => Some(("its answer where the joints are", jog.state.time_ns)),
        Reply::Inputs(inputs) => Some(("its answer how the input lines are", inputs.time_ns)),
        Reply::Motors(motors) => Some(("what the motors report", motors.time_ns)),
        Reply::Reading(reading) => Some(("a reading", reading.time_ns.max(now_ns))),
        Reply::Done | Reply::Described(_) | Reply::State(_) => None,
    }
}

/// Where the joints are until the next move; not known of a robot that moves.
fn joints_at_rest(state: &JointState) -> Option<JointVector> {
    (!state.is_moving()).then_some(state.joints)
}

/// The state of a device after a stop: a robot must be activated again, a sensor need not.
fn state_after_stop(state: DeviceState, is_robot: bool) -> DeviceState {
    if is_robot && state == DeviceState::Active { DeviceState::Inactive } else { state }
}

/// Counts a request that was served.
fn count(health: &mut Health, has_failed: bool, took: Duration) {
    health.requests += 1;
    health.failures += u64::from(has_failed);
    health.longest_ns = health.longest_ns.max(u64::try_from(took.as_nanos()).unwrap_or(u64::MAX));
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::{DigitalInputs, MotorState};

    const NOW: u64 = 100;

    fn state(time_ns: u64) -> JointState {
        JointState::new(time_ns, JointVector::zeros(2), false)
    }

    #[test]
    fn every_reply_with_a_time_is_held_to_the_cells_clock() {
        let time = |reply: Reply| time_of(&reply, NOW).map(|(_, time_ns)| time_ns);
        assert_eq!(time(state(7).into()), Some(7));
        assert_eq!(time(JogState { state: state(8), ..Default::default() }.into()), Some(8));
        assert_eq!(time(DigitalInputs { time_ns: 9, ..Default::default() }.into()), Some(9));
        assert_eq!(time(MotorState::unreported(10, 2).into()), Some(10));
        assert_eq!(time(Reply::Done), None);
        assert_eq!(time(DeviceState::Active.into()), None);
    }

    #[test]
    fn a_reading_may_be_old_and_not_of_the_future() {
        let time =
            |time_ns| time_of(&Reading { time_ns, ..Default::default() }.into(), NOW).map(|(_, time)| time);
        assert_eq!(time(3), Some(NOW));
        assert_eq!(time(NOW + 5), Some(NOW + 5));
    }

    #[test]
    fn where_a_moving_robot_is_is_not_kept_for_the_next_move() {
        assert_eq!(joints_at_rest(&state(1)), Some(JointVector::zeros(2)));
        assert_eq!(joints_at_rest(&JointState::new(1, JointVector::zeros(2), true)), None);
    }

    #[test]
    fn a_stop_takes_a_robot_out_of_service_and_leaves_a_sensor_in_it() {
        use DeviceState::{Active, Finalized, Inactive};
        assert_eq!(state_after_stop(Active, true), Inactive);
        assert_eq!(state_after_stop(Active, false), Active);
        assert_eq!(state_after_stop(Finalized, true), Finalized);
        assert_eq!(state_after_stop(Inactive, false), Inactive);
    }

    #[test]
    fn requests_and_failures_are_counted_with_the_longest() {
        let mut health = Health::default();
        for (has_failed, milliseconds) in [(false, 1), (true, 3), (true, 2)] {
            count(&mut health, has_failed, Duration::from_millis(milliseconds));
        }
        assert_eq!((health.requests, health.failures, health.longest_ns), (3, 2, 3_000_000));
    }
}
