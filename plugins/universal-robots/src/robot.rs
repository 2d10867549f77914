//! The arm as a robot of plumb.

use std::f64::consts::TAU;
use std::time::{Duration, Instant};

use plumb_plugin::{
    Host, JointDescription, JointState, JointUnit, JointVector, LogLevel, Motion, PluginError, Robot,
    RobotCapabilities, RobotDescription, Value,
};

use crate::configuration::Configuration;
use crate::dashboard;
use crate::link::{Link, Received};
use crate::modes::{self, RuntimeState};
use crate::primary::PrimaryMessage;
use crate::program;
use crate::rtde::{AXES, State};
use crate::scripts::Scripts;

/// The joints, and where the arm is upright, deg. On the pendant they are called base, shoulder, elbow, wrist 1 to 3.
const JOINTS: [(&str, f64); AXES] =
    [("pan", 0.0), ("lift", -90.0), ("elbow", 0.0), ("wrist1", -90.0), ("wrist2", 0.0), ("wrist3", 0.0)];

/// How near a joint comes to where it is sent, rad: what its servo leaves at rest, some counts of its encoder.
const SERVO_LEAVES: f64 = 1e-4;

/// A joint slower than this is at rest, rad/s: the noise of the speeds that controllers report is under a tenth of it.
const AT_REST: f64 = 0.01;

/// A state older than this says nothing of where a moving arm is: the move is ended.
const OLDEST: Duration = Duration::from_millis(500);

/// A state older than this is not taken for a reading.
const FRESH: Duration = Duration::from_millis(200);

/// How long a fresh state is waited for.
const FRESH_WITHIN: Duration = Duration::from_millis(1500);

/// How long a program may take to begin: it is compiled first.
const BEGINS_WITHIN: Duration = Duration::from_secs(2);

/// How long what came while this computer was held up is read before a move is ended for its age.
const CATCHES_UP_WITHIN: Duration = Duration::from_millis(100);

/// How often a stop is looked for while the arm moves.
const STOP_LOOK: Duration = Duration::from_millis(5);

/// How long the controller's own reason for an ended program is waited for: it comes on another connection than the states.
const REASON_WITHIN: Duration = Duration::from_millis(100);

/// What the network, the controller's compiler and a cycle take before a stop takes hold, ms.
const STOP_DELAY_MS: u32 = 150;

/// How hard a controller leaves a program that a new one takes the place of, rad/s2: the least that is assumed.
const LEAVES_PROGRAM: f64 = 4.0;

/// A Universal Robots arm.
#[derive(Debug)]
pub struct UniversalRobot {
    configuration: Configuration,
    host: Host,
    link: Link,
    scripts: Scripts,
    /// The number of the last program that was sent.
    program: i32,
    /// The number of the last state that was looked at.
    seen: u64,
    /// The time of the last state that was reported, ns.
    reported_ns: u64,
    /// Why the arm is not moved, if so.
    doubt: Option<String>,
}

impl Robot for UniversalRobot {
    fn create(config: &Value, host: Host) -> Result<Self, PluginError> {
        let configuration = Configuration::read(config)?;
        let (link, scripts) = connections(&configuration)?;
        let [major, minor, bugfix, build] = link.version;
        let text = format!(
            "Universal Robots controller at {}, software {major}.{minor}.{bugfix}.{build}",
            configuration.address
        );
        host.log(LogLevel::Info, &text);
        Ok(Self { configuration, host, link, scripts, program: 0, seen: 0, reported_ns: 0, doubt: None })
    }

    fn describe(&self) -> RobotDescription {
        let joints = JOINTS.iter().map(|(name, home)| JointDescription {
            name: (*name).to_owned(),
            unit: JointUnit::Radian,
            lower: -TAU,
            upper: TAU,
            resolution: SERVO_LEAVES,
            max_speed: self.configuration.full_speed,
            home: home.to_radians(),
        });
        let slowing =
            self.configuration.full_speed / LEAVES_PROGRAM.min(self.configuration.stop_deceleration);
        RobotDescription {
            model: "Universal Robots, RTDE".to_owned(),
            joints: joints.collect(),
            inputs: Vec::new(),
            outputs: Vec::new(),
            capabilities: RobotCapabilities {
                interruptible: true,
                stop_time_ms: STOP_DELAY_MS + (slowing * 1e3).ceil() as u32,
                jog: false,
                only_pendant_ends_jog: false,
                set_zero: false,
            },
        }
    }

    fn activate(&mut self) -> Result<(), PluginError> {
        self.doubt = None;
        if self.link.ended().is_some() || self.scripts.ended().is_some() {
            self.connect_anew()?;
        }
        let received = self.fresh()?;
        require_running(&received.state)?;
        self.require_remote()?;
        self.require_no_program(&received.state)
    }

    fn deactivate(&mut self) -> Result<(), PluginError> {
        self.stop()
    }

    fn read_joints(&mut self) -> Result<JointState, PluginError> {
        self.report_texts();
        let received = self.fresh()?;
        require_running(&received.state)?;
        Ok(self.joint_state(&received, moves(&received.state)))
    }

    fn move_joints(&mut self, motion: &Motion) -> Result<JointState, PluginError> {
        self.refuse_in_doubt()?;
        let start = self.fresh()?;
        require_running(&start.state)?;
        self.require_no_program(&start.state)?;
        let target = target(motion, &start.state.joints)?;
        if self.host.should_stop() {
            return Err(PluginError::stopped());
        }
        // What was said before is not about this move.
        self.report_texts();
        self.program = self.program.wrapping_add(1).max(1);
        let speed = (self.configuration.full_speed * motion.speed_fraction).max(1e-4);
        let text = program::move_joints(
            self.program,
            &target,
            speed,
            self.configuration.acceleration,
            self.configuration.first_register,
            self.configuration.watchdog,
        );
        self.link.begin_signs_of_life();
        self.link
            .sign_of_life(self.program)
            .and_then(|()| self.scripts.send(&text))
            .map_err(|error| self.doubted(error))?;
        match self.follow() {
            Ok(state) => Ok(state),
            Err(error @ PluginError::Stopped(_)) => Err(error),
            Err(error) => Err(self.give_up(error)),
        }
    }

    fn stop(&mut self) -> Result<(), PluginError> {
        let at_rest = self.fresh().is_ok_and(|received| !moves(&received.state));
        if at_rest { Ok(()) } else { self.halt().map(drop) }
    }
}

/// Both connections that last.
fn connections(configuration: &Configuration) -> Result<(Link, Scripts), PluginError> {
    let link = Link::connect(&configuration.address, configuration.rtde_port, configuration.first_register)?;
    let scripts = Scripts::connect(&configuration.address, configuration.script_port)?;
    Ok((link, scripts))
}

/// Whether the arm moves, or is about to.
fn moves(state: &State) -> bool {
    state.runtime != RuntimeState::STOPPED || state.fastest() > AT_REST
}

/// What keeps the robot from being read and moved, if anything does.
fn require_running(state: &State) -> Result<(), PluginError> {
    modes::require_running(state.safety_mode, state.robot_mode)
}

/// Where a motion leads, rad.
fn target(motion: &Motion, here: &[f64; AXES]) -> Result<[f64; AXES], PluginError> {
    let given: &[f64; AXES] = motion.target.as_slice().try_into().map_err(|_| {
        PluginError::Refused(format!(
            "a target of {} joint values for an arm of six joints",
            motion.target.len()
        ))
    })?;
    let mut target = *here;
    for (index, (target, given)) in target.iter_mut().zip(given).enumerate() {
        if motion.moves(index) {
            *target = if motion.relative != 0 { *target + given } else { *given };
        }
    }
    match target.iter().all(|value| value.is_finite()) {
        true => Ok(target),
        false => Err(PluginError::Refused("a joint's target is not a finite number".to_owned())),
    }
}

impl UniversalRobot {
    fn connect_anew(&mut self) -> Result<(), PluginError> {
        (self.link, self.scripts) = connections(&self.configuration)?;
        self.seen = 0;
        Ok(())
    }

    /// A state that has come since this was called, and that is as new as it came.
    fn fresh(&mut self) -> Result<Received, PluginError> {
        let begin = Instant::now();
        let mut seen = self.link.latest().map_or(0, |latest| latest.number);
        let mut oldest = Duration::ZERO;
        while begin.elapsed() < FRESH_WITHIN {
            if let Some(received) = self.link.newer(seen, FRESH_WITHIN.saturating_sub(begin.elapsed()))? {
                seen = received.number;
                oldest = received.age();
                if oldest <= FRESH {
                    self.seen = seen;
                    return Ok(received);
                }
            }
        }
        Err(self.too_old(oldest))
    }

    /// Why what comes is not used: nothing does, or what comes is old.
    fn too_old(&self, age: Duration) -> PluginError {
        let silent = self.link.latest().map_or(FRESH_WITHIN, |latest| latest.arrived.elapsed());
        let text = if silent > FRESH {
            format!(
                "the controller has sent nothing for {:.1} s: is it on, and is the network sound?",
                silent.as_secs_f64()
            )
        } else {
            format!(
                "the controller's states are {:.1} s old when they come: they are late, or its clock has stopped; is the network sound?",
                age.as_secs_f64()
            )
        };
        PluginError::TimedOut(text)
    }

    /// Follows the program that was sent to its end.
    fn follow(&mut self) -> Result<JointState, PluginError> {
        let sent = Instant::now();
        let mut begun = false;
        loop {
            if self.host.should_stop() {
                return self.stopped();
            }
            let Some(received) = self.next_recent()? else { continue };
            self.link.sign_of_life(self.program)?;
            let state = received.state;
            self.emit(&received, true)?;
            require_running(&state).map_err(|error| self.with_what_it_says(error))?;
            begun |= state.begun == self.program;
            if !begun {
                if sent.elapsed() > BEGINS_WITHIN {
                    return Err(self.did_not_begin());
                }
                continue;
            }
            if state.runtime.is_pause() {
                let text =
                    "the move was paused at the controller: somebody pressed pause, or its safety system did";
                return Err(PluginError::NotReady(text.to_owned()));
            }
            let arrived = state.ended == self.program;
            if state.runtime.is_over() && !arrived {
                return Err(self.was_ended());
            }
            if arrived && !moves(&state) {
                let state = self.joint_state(&received, false);
                self.host.emit("joints", &state)?;
                return Ok(state);
            }
        }
    }

    /// The next state of a move; nothing where none has come yet and the last one is not too old.
    fn next_recent(&mut self) -> Result<Option<Received>, PluginError> {
        let next = self.link.newer(self.seen, STOP_LOOK)?;
        let age = next.or_else(|| self.link.latest()).map(|last| last.age());
        if age.is_some_and(|age| age <= OLDEST) {
            self.seen = next.map_or(self.seen, |next| next.number);
            return Ok(next);
        }
        let begin = Instant::now();
        while begin.elapsed() < CATCHES_UP_WITHIN {
            let left = CATCHES_UP_WITHIN.saturating_sub(begin.elapsed());
            let Some(received) = self.link.newer(self.seen, left)? else { break };
            self.seen = received.number;
            if received.age() <= OLDEST {
                return Ok(Some(received));
            }
        }
        Err(self.too_old(age.unwrap_or(OLDEST)))
    }

    /// A stop was asked for in mid-move.
    fn stopped(&mut self) -> Result<JointState, PluginError> {
        let received = self.halt()?;
        self.emit(&received, false)?;
        Err(PluginError::Stopped("stopped; the arm is at rest".to_owned()))
    }

    /// Brings the arm to rest, by a program that stops and, where that does not help, by the dashboard.
    fn halt(&mut self) -> Result<Received, PluginError> {
        let limit = Duration::from_millis(self.describe().capabilities.stop_time_ms.into());
        if self.send_stop().is_ok()
            && let Ok(Some(received)) = self.comes_to_rest(limit, Some(self.program))
        {
            return Ok(received);
        }
        self.dashboard("stop").map_err(|error| self.doubted(error))?;
        match self.comes_to_rest(limit, None).map_err(|error| self.doubted(error))? {
            Some(received) => Ok(received),
            None => {
                let text = "the controller does not confirm that the arm is at rest after a stop: use its emergency stop, and look";
                Err(self.doubted(PluginError::Failed(text.to_owned())))
            }
        }
    }

    fn send_stop(&mut self) -> Result<(), PluginError> {
        self.program = self.program.wrapping_add(1).max(1);
        let Configuration { stop_deceleration, first_register, .. } = self.configuration;
        self.scripts.send(&program::stop(self.program, stop_deceleration, first_register))
    }

    /// Waits until no program runs and nothing moves; where a program was sent to that end, until it has.
    fn comes_to_rest(&mut self, within: Duration, by: Option<i32>) -> Result<Option<Received>, PluginError> {
        let begin = Instant::now();
        while begin.elapsed() < within {
            let Some(received) = self.link.newer(self.seen, within.saturating_sub(begin.elapsed()))? else {
                break;
            };
            self.seen = received.number;
            let moving = moves(&received.state);
            let by_it = by.is_none_or(|program| received.state.ended == program);
            // A state from before the stop was sent says nothing of it.
            if !moving && by_it && received.age() < begin.elapsed().min(FRESH) {
                return Ok(Some(received));
            }
            self.emit(&received, moving)?;
        }
        Ok(None)
    }

    /// A move has failed: whatever is left of it is taken from the controller, so that nothing goes on by itself once the cause is gone.
    fn give_up(&mut self, error: PluginError) -> PluginError {
        // Both ways at once: which of them still works is not known. What they answer changes nothing of what is reported.
        let _ = self.send_stop();
        let _ = self.dashboard("stop");
        self.doubted(error)
    }

    /// Notes an error that leaves open what the arm does.
    fn doubted(&mut self, error: PluginError) -> PluginError {
        self.doubt = Some(error.text().to_owned());
        error
    }

    fn refuse_in_doubt(&self) -> Result<(), PluginError> {
        match &self.doubt {
            None => Ok(()),
            Some(reason) => Err(PluginError::NotReady(format!(
                "the arm is not moved after this ({reason}): look where it is, then activate it again"
            ))),
        }
    }

    fn require_no_program(&self, state: &State) -> Result<(), PluginError> {
        if !moves(state) {
            return Ok(());
        }
        let text = "a program runs on the controller, or the arm is moved by hand: end that at the pendant";
        Err(PluginError::NotReady(text.to_owned()))
    }

    /// e-Series controllers take programs in remote control only, and say nothing otherwise; earlier ones have no such switch.
    fn require_remote(&self) -> Result<(), PluginError> {
        let Some(port) = self.configuration.dashboard_port else { return Ok(()) };
        let [major, ..] = self.link.version;
        if major < 5 {
            return Ok(());
        }
        match dashboard::ask(&self.configuration.address, port, "is in remote control")?.as_str() {
            "false" => Err(PluginError::NotReady(
                "the controller is in local control and takes no programs: switch it to remote control, at the top right of the pendant".to_owned(),
            )),
            // Early 5.x software does not know the question; a program that does not begin is noticed all the same.
            _ => Ok(()),
        }
    }

    fn dashboard(&self, command: &str) -> Result<String, PluginError> {
        match self.configuration.dashboard_port {
            Some(port) => dashboard::ask(&self.configuration.address, port, command),
            None => Err(PluginError::unsupported("be asked at a dashboard server")),
        }
    }

    /// A program was sent, and the controller did nothing.
    fn did_not_begin(&self) -> PluginError {
        if let Err(error) = self.require_remote() {
            return error;
        }
        let errors = self.error_messages();
        let why = if errors.is_empty() {
            "look at the pendant for what it wants".to_owned()
        } else {
            format!("it says: {errors}")
        };
        PluginError::Failed(format!(
            "the controller did not begin the move within {} s; {why}",
            BEGINS_WITHIN.as_secs()
        ))
    }

    /// The program has ended before the move did.
    fn was_ended(&self) -> PluginError {
        self.scripts.await_message(REASON_WITHIN);
        let errors = self.error_messages();
        let (silence, watchdog) = (self.link.longest_silence(), self.configuration.watchdog);
        let why = if silence > watchdog {
            format!(
                "this computer gave no sign of life for {:.2} s, and after {:.2} s (`watchdog_ms`) the controller ends a move: look what keeps the computer busy",
                silence.as_secs_f64(),
                watchdog.as_secs_f64()
            )
        } else if errors.is_empty() {
            "somebody stopped it at the pendant, or another program took its place".to_owned()
        } else {
            format!("the controller says: {errors}")
        };
        PluginError::Failed(format!("the move was ended before the arm arrived; {why}"))
    }

    /// An error of the arm's modes, with the controller's own reason where it has reported one.
    fn with_what_it_says(&self, error: PluginError) -> PluginError {
        let errors = self.error_messages();
        if errors.is_empty() {
            return error;
        }
        PluginError::NotReady(format!("{}; the controller says: {errors}", error.text()))
    }

    fn error_messages(&self) -> String {
        let messages = self.scripts.take_messages();
        let words = messages.into_iter().map(|message| match message {
            PrimaryMessage::Error { line, column, text } => format!("line {line}, column {column}: {text}"),
            PrimaryMessage::Text(text) => text,
        });
        words.collect::<Vec<_>>().join("; ")
    }

    /// Puts what the controller has said into the log.
    fn report_texts(&self) {
        let errors = self.error_messages();
        for text in self.link.take_texts().into_iter().chain(Some(errors).filter(|errors| !errors.is_empty()))
        {
            self.host.log(LogLevel::Info, &format!("the controller says: {text}"));
        }
    }

    /// A state as the cell takes it, dated by the cell's clock.
    fn joint_state(&mut self, received: &Received, moving: bool) -> JointState {
        let age_ns = u64::try_from(received.age().as_nanos()).unwrap_or(u64::MAX);
        // Where the cell's clock is stopped between motions, a state is not from before the last that was reported.
        self.reported_ns = self.host.now_ns().saturating_sub(age_ns).max(self.reported_ns);
        let mut joints = JointVector::zeros(AXES);
        joints.as_mut_slice().copy_from_slice(&received.state.joints);
        JointState::new(self.reported_ns, joints, moving)
    }

    fn emit(&mut self, received: &Received, moving: bool) -> Result<(), PluginError> {
        let state = self.joint_state(received, moving);
        self.host.emit("joints", &state)
    }
}
