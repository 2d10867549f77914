//! The controller itself: modes, the program, and the joints it leads, cycle by cycle.

use std::time::Instant;

use super::arm::{ArmError, Led, LedArm};
use super::event::Event;
use super::motion::Way;
use super::running_time::RunningTime;
use super::script::{Program, ScriptError, Statement, WatchdogAction};
use super::states::{AXES, CYCLE_S, REGISTERS, RobotMode, RuntimeState, SafetyMode, Series};
use crate::physics::random::Random;

/// The greatest acceleration of a joint, rad/s2: what is asked beyond it is not done.
const MOST_ACCELERATION: f64 = 40.0;

/// How hard the arm stops when its safety system says so, rad/s2.
const SAFETY_DECELERATION: f64 = 30.0;

/// How hard a program that is taken away leaves its motion, rad/s2.
const LEFT_DECELERATION: f64 = 4.0;

/// From the end of a program's text to its first statement, cycles: it is compiled meanwhile.
const COMPILING: u32 = 4;

/// The measured speed of a joint at rest scatters by this, rad/s.
const SPEED_NOISE: f64 = 4e-4;

/// How often an arm at rest is looked at, cycles: others may have moved it.
const LOOKED_AT: u32 = 12;

/// A program that runs.
#[derive(Debug)]
struct Running {
    program: Program,
    next: usize,
    compiling: u32,
    /// What is left of a `sleep`, s.
    sleeping: f64,
    watchdogs: Vec<(usize, f64, WatchdogAction)>,
}

/// The controller.
#[derive(Debug)]
pub(super) struct Controller {
    arm: LedArm,
    pub(super) series: Series,
    pub(super) remote: bool,
    pub(super) robot_mode: RobotMode,
    pub(super) safety_mode: SafetyMode,
    pub(super) runtime: RuntimeState,
    pub(super) output_registers: [i32; REGISTERS],
    pub(super) input_registers: [i32; REGISTERS],
    /// When each input was written last, s of the running time.
    written: [Option<f64>; REGISTERS],
    running_time: RunningTime,
    pub(super) actual: [f64; AXES],
    pub(super) actual_speed: [f64; AXES],
    pub(super) target: [f64; AXES],
    pub(super) target_speed: [f64; AXES],
    running: Option<Running>,
    way: Option<Way>,
    /// The arm still goes to the end of the last cycle.
    settling: bool,
    /// Whether the program goes on where it was once the arm is at rest.
    resumes: bool,
    since_look: u32,
    /// Whether a motion takes no time of the wall's clock.
    fast: bool,
    /// How far the controller's time is ahead of the wall's, s.
    jumped: f64,
    began: Instant,
    noise: Random,
    /// Runtime errors and texts that have not been reported yet: line, column, text; a line of 0 for a text.
    pub(super) messages: Vec<(i32, i32, String)>,
}

impl Controller {
    pub(super) fn new(arm: LedArm, series: Series, fast: bool, seed: u64) -> Self {
        let zeros = [0.0; AXES];
        Self {
            arm,
            series,
            remote: true,
            robot_mode: RobotMode::Running,
            safety_mode: SafetyMode::Normal,
            runtime: RuntimeState::Stopped,
            output_registers: [0; REGISTERS],
            input_registers: [0; REGISTERS],
            written: [None; REGISTERS],
            running_time: RunningTime::default(),
            actual: zeros,
            actual_speed: zeros,
            target: zeros,
            target_speed: zeros,
            running: None,
            way: None,
            settling: true,
            resumes: false,
            since_look: LOOKED_AT,
            fast,
            jumped: 0.0,
            began: Instant::now(),
            noise: Random::new(seed, "speeds of joints at rest"),
            messages: Vec::new(),
        }
    }

    /// Since the controller was started, s.
    pub(super) fn time_s(&self) -> f64 {
        self.began.elapsed().as_secs_f64() + self.jumped
    }

    /// Whether the next cycle is due at once.
    pub(super) fn hurries(&self) -> bool {
        self.fast && (self.way.is_some() || self.settling || self.running.is_some())
    }

    /// Whether the joints move.
    pub(super) fn is_moving(&self) -> bool {
        self.way.is_some() || self.settling
    }

    /// Whether the safety system and the power allow a motion.
    fn may_move(&self) -> bool {
        self.robot_mode == RobotMode::Running && self.safety_mode == SafetyMode::Normal
    }

    /// A program has come over the network. A controller in local control takes none, and says nothing.
    pub(super) fn load(&mut self, text: &str) {
        if self.series == Series::E && !self.remote {
            return;
        }
        match Program::read(text) {
            Ok(program) if program.secondary => self.run_secondary(&program),
            Ok(program) => self.start(program),
            Err(ScriptError { line, text }) => self.messages.push((line, 1, text)),
        }
    }

    fn start(&mut self, program: Program) {
        self.leave_program(LEFT_DECELERATION);
        if !self.may_move() {
            return;
        }
        self.running =
            Some(Running { program, next: 0, compiling: COMPILING, sleeping: 0.0, watchdogs: Vec::new() });
        self.runtime = RuntimeState::Playing;
    }

    fn run_secondary(&mut self, program: &Program) {
        for statement in &program.statements {
            if let Statement::WriteRegister { register, value } = statement {
                self.write_output(*register, *value);
            }
        }
    }

    /// Takes the program away; the joints come to rest.
    pub(super) fn leave_program(&mut self, deceleration: f64) {
        self.resumes = false;
        if self.running.take().is_some() || self.runtime == RuntimeState::Paused {
            self.runtime = RuntimeState::Stopping;
        }
        if let Some(way) = &mut self.way {
            way.stop(deceleration);
        }
    }

    /// As the dashboard's `stop` does.
    pub(super) fn stop_program(&mut self) {
        self.leave_program(LEFT_DECELERATION);
    }

    /// A client has written an input register.
    pub(super) fn write_input(&mut self, register: usize, value: i32) {
        if let (Some(input), Some(written)) =
            (self.input_registers.get_mut(register), self.written.get_mut(register))
        {
            *input = value;
            *written = Some(self.running_time.seconds());
        }
    }

    fn write_output(&mut self, register: usize, value: i32) {
        if let Some(output) = self.output_registers.get_mut(register) {
            *output = value;
        }
    }

    /// Lets something happen; what concerns the connections alone is not the controller's.
    pub(super) fn happen(&mut self, event: &Event) {
        match event {
            Event::ProtectiveStop => self.protective_stop("C157A0: the safety system says so"),
            Event::UnlockProtectiveStop => self.unlock(),
            Event::EmergencyStop => {
                self.safety_mode = SafetyMode::RobotEmergencyStop;
                self.robot_mode = RobotMode::PowerOff;
                self.leave_program(SAFETY_DECELERATION);
            }
            Event::ReleaseEmergencyStop => self.safety_mode = SafetyMode::Normal,
            Event::Fault => {
                self.safety_mode = SafetyMode::Fault;
                self.robot_mode = RobotMode::Idle;
                self.leave_program(SAFETY_DECELERATION);
            }
            Event::Power(on) => {
                self.robot_mode = if *on { RobotMode::Running } else { RobotMode::PowerOff };
                if !on {
                    self.leave_program(SAFETY_DECELERATION);
                }
            }
            Event::Remote(on) => {
                self.remote = *on;
                if !on {
                    // Who takes the pendant takes the arm.
                    self.leave_program(LEFT_DECELERATION);
                }
            }
            Event::StopProgram => self.stop_program(),
            _ => {}
        }
    }

    /// The arm stops, the program is paused. <https://forum.universal-robots.com/t/rtde-runtime-state-enumeration/6634>
    fn protective_stop(&mut self, why: &str) {
        self.safety_mode = SafetyMode::ProtectiveStop;
        self.messages.push((0, 0, format!("protective stop: {why}")));
        if self.running.is_some() {
            self.runtime = RuntimeState::Paused;
        }
        if let Some(way) = &mut self.way {
            way.stop(SAFETY_DECELERATION);
        }
    }

    pub(super) fn unlock(&mut self) {
        if self.safety_mode == SafetyMode::ProtectiveStop {
            self.safety_mode = SafetyMode::Normal;
        }
    }

    /// One cycle.
    pub(super) fn cycle(&mut self) -> Result<(), ArmError> {
        if self.hurries() {
            self.jumped += CYCLE_S;
        }
        self.running_time.cycle(Instant::now());
        self.watch_inputs();
        if self.way.is_none() && !self.settling {
            self.run_statements();
        }
        self.lead()?;
        if self.runtime == RuntimeState::Stopping && !self.is_moving() {
            self.runtime = RuntimeState::Stopped;
        }
        for speed in &mut self.actual_speed {
            *speed += SPEED_NOISE * self.noise.between(-1.0, 1.0);
        }
        Ok(())
    }

    /// What a program does whose inputs no longer come.
    fn watch_inputs(&mut self) {
        let Some(running) = &self.running else { return };
        let now = self.running_time.seconds();
        let violated = running.watchdogs.iter().find(|(register, hz, _)| {
            let written = self.written.get(*register).copied().flatten();
            written.is_none_or(|written| now - written > 1.0 / hz)
        });
        match violated.map(|(_, _, action)| *action) {
            Some(WatchdogAction::Stop) => {
                self.messages.push((0, 0, "RTDE watchdog: the program is stopped".to_owned()));
                self.leave_program(LEFT_DECELERATION);
            }
            Some(WatchdogAction::Pause) => {
                self.runtime = RuntimeState::Paused;
                if let Some(way) = &mut self.way {
                    way.stop(LEFT_DECELERATION);
                }
            }
            Some(WatchdogAction::Ignore) | None => {}
        }
    }

    /// Runs the program up to what takes time.
    fn run_statements(&mut self) {
        while self.runtime == RuntimeState::Playing && self.way.is_none() {
            let Some(running) = &mut self.running else { return };
            if running.compiling > 0 {
                running.compiling -= 1;
                return;
            }
            if running.sleeping > 0.0 {
                running.sleeping -= CYCLE_S;
                return;
            }
            let Some(statement) = running.program.statements.get(running.next).cloned() else {
                self.running = None;
                self.runtime = RuntimeState::Stopped;
                return;
            };
            running.next += 1;
            match statement {
                Statement::MoveJ { joints, acceleration, speed } => self.set_out(joints, acceleration, speed),
                Statement::WriteRegister { register, value } => self.write_output(register, value),
                Statement::Watchdog { register, hz, action } => {
                    running.watchdogs.push((register, hz, action));
                    // It counts from when it is set.
                    if let Some(written) = self.written.get_mut(register) {
                        *written = Some(self.running_time.seconds());
                    }
                }
                Statement::Sleep { seconds } => running.sleeping = seconds,
                Statement::Message(text) => self.messages.push((0, 0, text)),
                // The joints rest already where it is their turn.
                Statement::StopJ { .. } | Statement::Nothing => {}
            }
        }
    }

    fn set_out(&mut self, joints: [f64; AXES], acceleration: f64, speed: f64) {
        if acceleration <= 0.0 || speed <= 0.0 {
            self.messages.push((1, 1, "movej: speed and acceleration are positive".to_owned()));
            self.leave_program(LEFT_DECELERATION);
            return;
        }
        let slowest = self.arm.top_speeds().into_iter().fold(f64::MAX, f64::min);
        let way = Way::new(self.target, joints, speed.min(slowest), acceleration.min(MOST_ACCELERATION));
        self.way = Some(way);
    }

    /// Leads the joints on.
    fn lead(&mut self) -> Result<(), ArmError> {
        let Some(way) = &mut self.way else { return self.rest() };
        let motion_state = way.advance(CYCLE_S);
        match self.arm.lead(motion_state.joints, CYCLE_S)? {
            Led::At(joints, _) => {
                self.actual = joints;
                self.target = motion_state.joints;
                (self.actual_speed, self.target_speed) = (motion_state.speeds, motion_state.speeds);
            }
            Led::Refused(why) => {
                self.way = None;
                self.settling = true;
                self.protective_stop(&why);
                return Ok(());
            }
        }
        if motion_state.ended {
            self.way = None;
            self.settling = true;
        }
        Ok(())
    }

    /// Nothing is led: the last cycle ends, or others move the arm.
    fn rest(&mut self) -> Result<(), ArmError> {
        self.actual_speed = [0.0; AXES];
        self.target_speed = [0.0; AXES];
        self.since_look += 1;
        if self.settling || self.since_look >= LOOKED_AT {
            self.since_look = 0;
            let (joints, moving) = self.arm.read()?;
            (self.actual, self.settling) = (joints, moving);
            if !moving {
                self.target = joints;
            }
        }
        Ok(())
    }
}
