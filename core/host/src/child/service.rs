//! Requests to a device: checked, done by the plugin, answered.

use std::time::{Duration, Instant};

use plumb_bus::Call;
use plumb_plugin::{
    Description, DeviceState, Health, JointState, JointVector, LogLevel, Motion, PluginError, Reply, Request,
    WireError,
};

use super::Context;
use super::rest_report::RestReport;
use super::watchdog::Watchdog;
use crate::MoveGuard;
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
    /// Where the joints stand, as long as nothing but a move can have changed it.
    joints: Option<JointVector>,
    /// What the last poll failed with: the next reading's answer.
    poll_error: Option<PluginError>,
    health: Health,
    health_sent: Instant,
}

/// How often a host tells how it is when nothing changes.
pub(super) const HEALTH_PERIOD: Duration = Duration::from_secs(1);

/// How long a reading waits for its inputs before it asks the plugin again unasked: a bound on how late the end of its time is noticed.
pub(super) const INPUT_WAIT: Duration = Duration::from_millis(20);

/// The longest a reading waits for its inputs, whatever its asker allows.
const LONGEST_WAIT: Duration = UNDER_DEBUGGER;

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
        }
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
                watchdog.watch(request.name(), call.time_limit, || {
                    self.answer(&request, begin + call.time_limit.min(LONGEST_WAIT), wait_for_input)
                })
            }
            Err(error) => Err(PluginError::Refused(error.to_string())),
        };
        let result = match self.context.take_misdated() {
            Some(why) => Err(PluginError::Failed(why)),
            None => result.and_then(|reply| self.dated_well(reply)),
        };
        // A move that was stopped because the host ends was not stopped by anybody's wish.
        let result = self.context.ends_because().map_or(result, |why| Err(PluginError::Failed(why)));
        self.context.serve_under(0);
        self.health.requests += 1;
        self.health.failures += u64::from(result.is_err());
        self.health.longest_ns = self.health.longest_ns.max(begin.elapsed().as_nanos() as u64);
        result
    }

    /// A reply whose time is the cell's; what another clock has dated is believed by nobody.
    fn dated_well(&self, reply: Reply) -> Result<Reply, PluginError> {
        let (what, time_ns) = match &reply {
            Reply::Joints(state) => ("its answer where the joints are", state.time_ns),
            Reply::Jog(jog) => ("its answer where the joints are", jog.state.time_ns),
            Reply::Inputs(inputs) => ("its answer how the input lines are", inputs.time_ns),
            // What a sensor saw last may be long ago; it is not later than now.
            Reply::Reading(reading) => ("a reading", reading.time_ns.max(self.context.clock.now_ns())),
            _ => return Ok(reply),
        };
        self.context.check_time(what, time_ns).map(|()| reply).map_err(PluginError::Failed)
    }

    fn answer(
        &mut self,
        request: &Request,
        end: Instant,
        wait_for_input: &mut dyn FnMut(Duration),
    ) -> Result<Reply, PluginError> {
        let context = self.context;
        match request {
            Request::Describe => Ok(Reply::Described(Box::new(self.description.clone()))),
            Request::State => Ok(Reply::State(self.state)),
            Request::Activate => context.while_moving(|| self.activate()),
            Request::Deactivate => {
                self.device.deactivate()?;
                self.enter(DeviceState::Inactive);
                Ok(Reply::State(self.state))
            }
            Request::ReadJoints => self.read_joints().map(Reply::Joints),
            Request::MoveJoints(motion) => {
                context.while_moving(|| self.move_joints(motion)).map(Reply::Joints)
            }
            Request::ReadInputs => self.device.read_inputs().map(Reply::Inputs),
            Request::WriteOutputs(levels) => self.device.write_outputs(*levels).map(|()| Reply::Done),
            Request::Jog { on } => {
                self.joints = None;
                if *on {
                    self.must_be_active("be jogged")?;
                }
                self.device.jog(*on).map(Reply::Jog)
            }
            Request::SetZero(joints) => {
                self.joints = None;
                context.while_moving(|| self.device.set_zero(joints)).map(|()| Reply::Done)
            }
            Request::Configure(settings) => self.device.configure(settings).map(|()| Reply::Done),
            Request::Arm => {
                self.poll_error = None;
                self.device.arm().map(|()| Reply::Done)
            }
            Request::Read { after_ns } => self.read(*after_ns, end, wait_for_input).map(Reply::Reading),
        }
    }

    fn activate(&mut self) -> Result<Reply, PluginError> {
        if !self.context.stop.take_back() {
            return Err(PluginError::Stopped(format!("{} is being stopped", self.name)));
        }
        self.joints = None;
        self.device.activate()?;
        self.enter(DeviceState::Active);
        Ok(Reply::State(self.state))
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
        let state = self.device.read_joints()?;
        self.joints = (!state.is_moving()).then_some(state.joints);
        self.rest_report.emit(&state, &mut self.device, self.context);
        Ok(state)
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        let limits = self
            .limits
            .as_ref()
            .ok_or_else(|| PluginError::Unsupported(format!("{} is no robot", self.name)))?;
        limits.check_motion(motion)?;
        self.must_be_active("move")?;
        let from = match self.joints {
            Some(joints) => joints,
            None => self.device.read_joints()?.joints,
        };
        let end = limits.check_end(motion, &from)?;
        self.guard.check(&from, &end).map_err(PluginError::OutOfRange)?;
        self.joints = None;
        let state = self.device.move_joints(motion)?;
        self.joints = (!state.is_moving()).then_some(state.joints);
        Ok(state)
    }

    /// Takes in what has come until the sensor has seen far enough, or time is up.
    fn read(
        &mut self,
        after_ns: u64,
        end: Instant,
        wait_for_input: &mut dyn FnMut(Duration),
    ) -> Result<plumb_plugin::Reading, PluginError> {
        loop {
            if let Some(error) = self.poll_error.take() {
                return Err(error);
            }
            self.device.poll()?;
            if let Some(reading) = self.device.read(after_ns)? {
                return Ok(reading);
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(PluginError::TimedOut(format!(
                    "{} has not seen its inputs up to {:.3} s of the cell's clock",
                    self.name,
                    after_ns as f64 * 1e-9
                )));
            }
            if self.context.stop.is_asked() {
                return Err(PluginError::Stopped(format!(
                    "{} was stopped while it waited for its inputs",
                    self.name
                )));
            }
            wait_for_input(left.min(INPUT_WAIT));
        }
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

    /// Brings the device to rest after a stop, and leaves it inactive. False when the robot does not confirm that it stands.
    pub(super) fn stop(&mut self) -> bool {
        self.joints = None;
        let stopped = self.watchdog.watch("stop", UNASKED, || self.device.stop());
        if self.state == DeviceState::Active && self.limits.is_some() {
            self.enter(DeviceState::Inactive);
        }
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

    /// Tells how the device is when it is time to.
    pub(super) fn report_health_in_time(&mut self) {
        if self.health_sent.elapsed() >= HEALTH_PERIOD {
            self.report_health();
        }
    }

    /// Tells how the device is.
    pub(super) fn report_health(&mut self) {
        self.health_sent = Instant::now();
        self.health.time_ns = self.context.clock.now_ns();
        self.health.state = self.state.code();
        // A health message that cannot be sent has been logged by the context.
        let _ = self.context.emit(super::serve::HEALTH_STREAM, bytemuck::bytes_of(&self.health));
    }
}
