//! What the controller does with what it hears, second by second: it knows no line and no clock, but is given the time.

use std::collections::VecDeque;

use super::event::Key;
use super::motors::{End, Ending, Motors, MotorsError};
use super::order::{self, Order};
use super::program::{Program, Target};

/// Half-steps the motors were sent since the last reset: base, shoulder, elbow, right wrist, left wrist, gripper.
pub type Registers = [i32; 6];

/// The longest line the controller keeps.
const LONGEST_LINE: usize = 120;

/// What the arm is driven with by hand, and what it closes its hand with: the speed of number 140, and the slowest.
const HAND_SPEED: u8 = 140;
const GRASP_SPEED: u8 = 0;

/// How often the controller looks whether the operator still has the arm, ns.
const PENDANT_LOOK: u64 = 20_000_000;

/// Half-steps after which a hand that closes on nothing is given up: more than its whole opening.
const LONGEST_GRASP: u32 = 1500;

/// ns in one unit of the pause between the characters of a reply; that it is a millisecond is assumed.
const REPLY_DELAY_UNIT: u64 = 1_000_000;

/// The digits replies begin with.
const UNSUCCESSFUL: u8 = b'0';
const SUCCESSFUL: u8 = b'1';
const STOP_PRESSED: u8 = b'2';

/// Half-steps a second for a speed number: 141 for 183, and a period in proportion to 255 less the number.
fn rate(speed: u8) -> f64 {
    141.0 * 72.0 / f64::from(255 - speed)
}

/// What the controller is busy with. It listens only when it is busy with nothing: what arrives meanwhile is lost (assumed: nothing known shows that
/// it queues commands).
#[derive(Debug)]
enum Activity {
    Idle,
    /// A move from the line.
    Turning,
    /// Closing the hand, so many half-steps yet at most.
    Grasping(u32),
    /// A taught program, with what is left of it.
    Performing(VecDeque<Target>),
    /// The operator has the arm.
    Teaching,
}

/// What happens in the midst of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Midway {
    /// The operator presses STOP.
    Stop,
    /// The plug is pulled; the controller moves on.
    Unplug,
}

/// The first part of a motion that was cut in two.
struct FirstPart {
    ends_with: Midway,
    /// Half-steps of each motor that are left after it.
    rest: [i32; 6],
    speed: u8,
}

/// The controller.
pub(super) struct Controller {
    motors: Box<dyn Motors>,
    recognition: u8,
    /// What was heard since the recognition character; nothing while none was heard.
    line: Option<Vec<u8>>,
    key: u8,
    program: Program,
    reply_delay: u8,
    activity: Activity,
    /// Whether the motors turn.
    turning: bool,
    /// What will happen after so many half-steps of the next motion.
    midway: Option<(Midway, u32)>,
    /// The first part of a motion is under way, at whose end something happens.
    first_part: Option<FirstPart>,
    /// Whether the plug is to be pulled now.
    pull: bool,
    reply: Vec<u8>,
    last_half_step: Option<u64>,
    turned_ns: u64,
    /// When the motion under way began, and where.
    began: (u64, [i32; 6]),
    /// When to look at the world's pendant next, while the operator has the arm; never where the world has none.
    pendant_look: Option<u64>,
    /// Whether it reports registers and inputs; one owner's TeachMover II did not (github kelvinzheng3317/leapMotion_TeachMover).
    supports_read: bool,
}

impl Controller {
    /// A controller just switched on.
    pub(super) fn new(motors: Box<dyn Motors>) -> Controller {
        Controller {
            motors,
            recognition: b'@',
            line: None,
            key: 0,
            program: Program::default(),
            reply_delay: 0,
            activity: Activity::Idle,
            turning: false,
            midway: None,
            first_part: None,
            pull: false,
            reply: Vec::new(),
            last_half_step: None,
            turned_ns: 0,
            began: (0, [0; 6]),
            pendant_look: None,
            supports_read: true,
        }
    }

    /// Takes a byte from the line.
    pub(super) fn hear(&mut self, byte: u8, now: u64) -> Result<(), MotorsError> {
        if !matches!(self.activity, Activity::Idle) {
            return Ok(());
        }
        // That the recognition character begins a line anew, wherever it is but as a new name, is assumed; so is that nothing is answered
        // before it.
        let names_the_arm = self.line.as_ref().is_some_and(|line| line.trim_ascii_end() == b"ARM");
        if byte == self.recognition && !names_the_arm {
            self.line = Some(Vec::new());
        } else if let Some(line) = &mut self.line {
            if byte == b'\r' {
                let line = self.line.take().unwrap_or_default();
                return self.obey(&line, now);
            }
            line.push(byte);
            line.truncate(LONGEST_LINE);
        }
        Ok(())
    }

    /// Whether it knows how to report registers and inputs from now on.
    pub(super) fn know_read(&mut self, known: bool) {
        self.supports_read = known;
    }

    /// The operator presses a key.
    pub(super) fn press(&mut self, key: Key, now: u64) -> Result<(), MotorsError> {
        self.key = key.0;
        self.motors.press(key)?;
        if key == Key::STOP {
            self.break_off(now)?;
        }
        Ok(())
    }

    /// STOP was pressed.
    fn break_off(&mut self, now: u64) -> Result<(), MotorsError> {
        self.key = Key::STOP.0;
        self.first_part = None;
        if self.turning {
            let at = self.motors.halt(now)?;
            self.settle(at);
        }
        match self.activity {
            Activity::Idle => {}
            // That leaving hand control by STOP is answered with success is assumed.
            Activity::Teaching => self.finish(SUCCESSFUL),
            Activity::Turning | Activity::Grasping(_) | Activity::Performing(_) => self.finish(STOP_PRESSED),
        }
        Ok(())
    }

    /// Has this happen when the next motion has come so far.
    pub(super) fn midway(&mut self, what: Midway, half_steps: u32) {
        self.midway = Some((what, half_steps));
    }

    /// Whether the plug is to be pulled now; true once for each time.
    pub(super) fn take_pull(&mut self) -> bool {
        std::mem::take(&mut self.pull)
    }

    /// The operator drives a motor by hand; nothing happens unless they have the arm and it is at rest.
    pub(super) fn drive(&mut self, motor: usize, half_steps: i32, now: u64) -> Result<(), MotorsError> {
        if !matches!(self.activity, Activity::Teaching) || self.turning {
            return Ok(());
        }
        let mut all = [0; 6];
        if let Some(entry) = all.get_mut(motor) {
            *entry = half_steps;
        }
        self.turn(all, HAND_SPEED, now)
    }

    /// The motors, for what happens to their lines.
    pub(super) fn motors(&mut self) -> &mut dyn Motors {
        self.motors.as_mut()
    }

    /// Lets everything happen that is due by `now`.
    pub(super) fn run(&mut self, now: u64) -> Result<(), MotorsError> {
        while self.turning {
            let Some(End { at, ending }) = self.motors.end(now)? else { return Ok(()) };
            self.settle(at);
            match ending {
                Ending::Made => self.go_on(at)?,
                Ending::CutShort => self.break_off(at)?,
                Ending::Refused => self.finish(UNSUCCESSFUL),
            }
        }
        if self.pendant_look.is_some_and(|due| due <= now) {
            self.look_at_the_pendant(now)?;
        }
        Ok(())
    }

    /// When something is due next.
    pub(super) fn next(&self, now: u64) -> Option<u64> {
        let end = self.turning.then(|| self.motors.look_again(now));
        end.into_iter().chain(self.pendant_look).min()
    }

    /// Ends hand control once the operator has ended it at the world's pendant.
    fn look_at_the_pendant(&mut self, now: u64) -> Result<(), MotorsError> {
        self.pendant_look = Some(now + PENDANT_LOOK);
        if let Some(pendant) = self.motors.pendant()?
            && !pendant.drives
        {
            self.key = pendant.key;
            self.finish(SUCCESSFUL);
        }
        Ok(())
    }

    /// What the controller has to say, with the pause before each byte, ns.
    pub(super) fn take_reply(&mut self) -> (Vec<u8>, u64) {
        (std::mem::take(&mut self.reply), u64::from(self.reply_delay) * REPLY_DELAY_UNIT)
    }

    /// The registers, with what a motion under way has come to as far as it is known.
    pub(super) fn registers(&self, now: u64) -> Registers {
        self.motors.position(now)
    }

    /// Whether it is busy.
    pub(super) fn is_busy(&self) -> bool {
        !matches!(self.activity, Activity::Idle)
    }

    /// When the last half-step was made, and how long the motors have turned in all.
    pub(super) fn turned(&self) -> (Option<u64>, u64) {
        (self.last_half_step, self.turned_ns)
    }

    fn obey(&mut self, line: &[u8], now: u64) -> Result<(), MotorsError> {
        match order::read(line) {
            Some(Order::Read) if !self.supports_read => self.answer(UNSUCCESSFUL),
            None => self.answer(UNSUCCESSFUL),
            Some(Order::Turn { speed, half_steps, outputs }) => {
                if let Some(levels) = outputs {
                    self.motors.set_outputs(levels)?;
                }
                self.activity = Activity::Turning;
                self.turn(half_steps, speed, now)?;
                self.run(now)?;
            }
            Some(Order::Read) => self.answer_read(now)?,
            Some(Order::Grasp) => {
                self.activity = Activity::Grasping(LONGEST_GRASP);
                self.go_on(now)?;
            }
            Some(Order::Teach) => {
                self.activity = Activity::Teaching;
                self.motors.hand_over()?;
                self.pendant_look = self.motors.pendant()?.map(|_| now + PENDANT_LOOK);
            }
            Some(Order::Forget) => {
                self.motors.reset()?;
                self.answer(SUCCESSFUL);
            }
            Some(Order::Perform) => self.perform(now)?,
            Some(Order::List) => self.list(),
            Some(Order::Keep(words)) => {
                self.program.keep(words);
                self.answer(SUCCESSFUL);
            }
            Some(Order::Rename(character)) => {
                self.recognition = character;
                self.answer(SUCCESSFUL);
            }
            Some(Order::ReplyDelay(units)) => {
                self.reply_delay = units;
                self.answer(SUCCESSFUL);
            }
        }
        Ok(())
    }

    fn answer(&mut self, digit: u8) {
        self.reply.extend([digit, b'\r']);
    }

    fn answer_read(&mut self, now: u64) -> Result<(), MotorsError> {
        if let Some(pendant) = self.motors.pendant()? {
            self.key = pendant.key;
        }
        let last = i32::from(self.key) * 256 + i32::from(self.motors.inputs()?);
        self.answer(SUCCESSFUL);
        let numbers: Vec<String> = self.registers(now).iter().chain([&last]).map(i32::to_string).collect();
        self.reply.extend(numbers.join(",").bytes().chain([b'\r']));
        Ok(())
    }

    fn list(&mut self) {
        self.answer(SUCCESSFUL);
        for words in self.program.lines() {
            let words: Vec<String> = words.iter().map(u16::to_string).collect();
            self.reply.extend(words.join(",").bytes().chain([b'\r']));
        }
    }

    fn perform(&mut self, now: u64) -> Result<(), MotorsError> {
        let targets = self.program.targets();
        if targets.is_empty() {
            self.answer(UNSUCCESSFUL);
            return Ok(());
        }
        self.activity = Activity::Performing(targets.into());
        self.go_on(now)
    }

    /// Sets the motors going.
    fn turn(&mut self, mut half_steps: [i32; 6], speed: u8, now: u64) -> Result<(), MotorsError> {
        let most = half_steps.iter().map(|count| count.unsigned_abs()).fold(0, u32::max);
        if most > 0
            && let Some((what, after)) = self.midway.take()
        {
            let part = f64::from(after.min(most)) / f64::from(most);
            let first = half_steps.map(|count| (f64::from(count) * part).round() as i32);
            let rest = std::array::from_fn(|motor| half_steps[motor] - first[motor]);
            self.first_part = Some(FirstPart { ends_with: what, rest, speed });
            half_steps = first;
        }
        self.began = (now, self.motors.position(now));
        self.motors.start(half_steps, rate(speed), now)?;
        self.turning = true;
        Ok(())
    }

    /// The motors are at rest: their half-steps are counted.
    fn settle(&mut self, at: u64) {
        self.turning = false;
        let (began, from) = self.began;
        if self.motors.position(at) != from {
            self.last_half_step = Some(at);
            self.turned_ns += at.saturating_sub(began);
        }
    }

    /// What follows once the motors are at rest.
    fn go_on(&mut self, now: u64) -> Result<(), MotorsError> {
        if let Some(part) = self.first_part.take() {
            match part.ends_with {
                Midway::Stop => {
                    self.motors.press(Key::STOP)?;
                    return self.break_off(now);
                }
                Midway::Unplug => {
                    self.pull = true;
                    return self.turn(part.rest, part.speed, now);
                }
            }
        }
        match &mut self.activity {
            Activity::Idle | Activity::Teaching => Ok(()),
            Activity::Turning => {
                self.finish(SUCCESSFUL);
                Ok(())
            }
            Activity::Grasping(left) => {
                if *left == 0 {
                    self.finish(UNSUCCESSFUL);
                    return Ok(());
                }
                *left -= 1;
                if self.motors.inputs()? & 0x80 != 0 {
                    self.finish(SUCCESSFUL);
                    return Ok(());
                }
                self.turn([0, 0, 0, 0, 0, -1], GRASP_SPEED, now)
            }
            Activity::Performing(targets) => {
                let Some(target) = targets.pop_front() else {
                    self.finish(SUCCESSFUL);
                    return Ok(());
                };
                let mut half_steps = target.registers;
                let here = self.registers(now);
                for (there, here) in half_steps.iter_mut().zip(here) {
                    *there -= here;
                }
                self.turn(half_steps, target.speed, now)
            }
        }
    }

    fn finish(&mut self, digit: u8) {
        self.activity = Activity::Idle;
        self.pendant_look = None;
        self.answer(digit);
    }
}
