//! Conversations with the controller: one command, one reply, and the way back when they fall out of step.

use std::time::Duration;

use plumb_plugin::PluginError;

use crate::configuration::PendantMode;
use crate::drive::{HalfSteps, Senses};
use crate::protocol::{
    Command, ControllerState, PrintableBytes, ProgramLine, Status, parse_program, parse_state, parse_status,
};
use crate::reply_line::{ReplyFailure, ReplyLine, SerialError};
use crate::speed_code::SpeedCode;

/// How often a reading is asked for before it is given up: reading moves nothing, so asking again is safe.
const READ_ATTEMPTS: usize = 3;

/// The characters of the longest reply line: seven numbers with sign.
const LONGEST_REPLY: usize = 50;

/// How soon the rest of a reply follows an empty line.
const AFTER_EMPTY: Duration = Duration::from_millis(100);

/// How long a program dump may pause between two lines before it is taken as ended.
const DUMP_PAUSE: Duration = Duration::from_millis(500);

/// Why the controller did not do what it was commanded.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    /// The line failed.
    #[error(transparent)]
    Line(#[from] SerialError),
    /// The controller answered 0.
    #[error("the controller refused {command} (it answered 0){hint}")]
    Refused {
        /// The command in full.
        command: String,
        /// What may be wrong with it.
        hint: &'static str,
    },
    /// The controller answered 2.
    #[error("the STOP key on the pendant ended {command}")]
    StopKey {
        /// The command as the manual writes it.
        command: String,
    },
    /// The firmware of another arm, which uses the same words.
    #[error(
        "the controller answers OK, as the firmware TCM of an Armdroid or Robko does: it takes the numbers of @STEP for places and not for ways, so this driver would drive it anywhere. Nothing was moved, and nothing will be"
    )]
    LookAlike,
    /// The half-steps are counted here, and something ended them uncounted.
    #[error(
        "the arm's position is not known any more: {why}, and without @READ nobody has counted how far it came. Bring it by hand to the pose of `registers_zero` and start anew, or declare where it is"
    )]
    Lost {
        /// What ended them.
        why: String,
    },
    /// A taught program cannot be read or written.
    #[error("{0}")]
    Program(String),
}

impl From<ControllerError> for PluginError {
    fn from(error: ControllerError) -> Self {
        match error {
            ControllerError::Line(line) => line.into(),
            ControllerError::StopKey { .. } => Self::Stopped(error.to_string()),
            ControllerError::LookAlike => Self::Refused(error.to_string()),
            ControllerError::Lost { .. } => Self::NotReady(error.to_string()),
            ControllerError::Refused { .. } | ControllerError::Program(_) => Self::Failed(error.to_string()),
        }
    }
}

/// The word of an operator who is at the pendant: once the command is given, nothing this program sends can stop the arm. Only the STOP
/// key on the pendant, or its power switch, does.
#[derive(Clone, Copy, Debug)]
pub struct OnlyThePendantStopsIt(());

impl OnlyThePendantStopsIt {
    /// Given by an operator who has read what it says.
    pub fn confirmed_by_the_operator() -> Self {
        Self(())
    }
}

/// The controller at the far end of the line.
#[derive(Debug)]
pub struct Controller {
    line: ReplyLine,
    recognition: u8,
    reply_limit: Duration,
    senses: Senses,
    /// What was sent to a controller that does not say where it is.
    dead_reckoning: Option<DeadReckoning>,
}

/// Dead reckoning: the half-steps that the controller has said to have made.
#[derive(Debug, Default)]
struct DeadReckoning {
    counts: HalfSteps,
    /// What ended a move so that nobody knows how many it made.
    lost: Option<String>,
}

impl Controller {
    /// The controller that answers to `recognition`, usually `@`. `reply_limit` is how long it may take to answer, beside the time on the line
    /// and that of the motion.
    pub fn new(line: ReplyLine, recognition: u8, reply_limit: Duration) -> Self {
        Self { line, recognition, reply_limit, senses: Senses::default(), dead_reckoning: None }
    }

    /// Of an arm some of whose motors turn the other way: counts and registers are turned over here, and nowhere else.
    #[must_use]
    pub fn with_senses(self, senses: Senses) -> Self {
        Self { senses, ..self }
    }

    /// Of a controller without `@READ`: from now on the half-steps that were made are counted here, and it is asked nothing.
    #[must_use]
    pub fn by_dead_reckoning(self) -> Self {
        Self { dead_reckoning: Some(DeadReckoning::default()), ..self }
    }

    /// The arm was found again: somebody has said where it is.
    pub fn found(&mut self) {
        if let Some(dead_reckoning) = &mut self.dead_reckoning {
            dead_reckoning.lost = None;
        }
    }

    /// Speaks to an arm that answers to another character from now on.
    pub fn call_it(&mut self, recognition: u8) {
        self.recognition = recognition;
    }

    /// The line it is on.
    pub fn line(&self) -> &ReplyLine {
        &self.line
    }

    /// The bytes of a command as they go out.
    pub fn bytes(&self, command: &Command) -> Vec<u8> {
        command.bytes(self.recognition)
    }

    /// Reads registers, inputs and the last pendant key. Asks again after silence or garbage, once the line is quiet. By dead reckoning nothing is asked:
    /// the registers are what was counted, and there are no inputs.
    ///
    /// # Errors
    /// [`ControllerError`], of the last attempt.
    pub fn read(&mut self) -> Result<ControllerState, ControllerError> {
        match &self.dead_reckoning {
            None => {}
            Some(DeadReckoning { lost: Some(why), .. }) => {
                return Err(ControllerError::Lost { why: why.clone() });
            }
            Some(DeadReckoning { counts, lost: None }) => {
                return Ok(ControllerState { registers: *counts, ..ControllerState::default() });
            }
        }
        let mut attempt = 1;
        loop {
            match self.read_once() {
                Err(ControllerError::Line(SerialError::ReadReply { failure, .. }))
                    if failure.may_pass() && attempt < READ_ATTEMPTS =>
                {
                    attempt += 1;
                    self.line.drain_late()?;
                }
                result => return result,
            }
        }
    }

    /// Whether it answers `@READ` with registers, asked once; `false` where it answers 0.
    ///
    /// # Errors
    /// [`ControllerError`] for any other answer, or none.
    pub fn can_read_registers(&mut self) -> Result<bool, ControllerError> {
        match self.read_once() {
            Ok(_) => Ok(true),
            Err(ControllerError::Refused { .. }) => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn read_once(&mut self) -> Result<ControllerState, ControllerError> {
        let command = Command::Read;
        self.expect_done(&command, self.reply_limit)?;
        let line = self.reply_line(&command, self.reply_limit)?;
        let state = parse_state(&line);
        let turned = |state: ControllerState| ControllerState {
            registers: state.registers.turned(self.senses),
            ..state
        };
        state
            .map(turned)
            .map_err(|fault| self.error(&command, ReplyFailure::Garbled { received: line, fault }).into())
    }

    /// Moves all motors together; returns when the arm is at rest again. A move that the pendant ended is distinguished by its status.
    ///
    /// # Errors
    /// [`ControllerError`]; then the arm may have moved by any part of `counts`, and is at rest or will be within the time they take.
    pub fn step(
        &mut self,
        speed: SpeedCode,
        counts: HalfSteps,
        outputs: Option<u8>,
    ) -> Result<MoveEnd, ControllerError> {
        let command = Command::Step { speed, counts: counts.turned(self.senses), outputs };
        // The rate of the speed code rests on one figure, so twice the time is no fault.
        let status = self.exchange(&command, self.reply_limit + 2 * speed.duration(counts.largest()));
        self.count_move(counts, &status);
        match status? {
            Status::Done => Ok(MoveEnd::Done),
            Status::StopKey => Ok(MoveEnd::StopKey),
            Status::Refused => Err(refused(&command)),
        }
    }

    /// Counts a move whose end was said. Any other end leaves open how far it came, unless it went nowhere.
    fn count_move(&mut self, made: HalfSteps, status: &Result<Status, ControllerError>) {
        let Some(dead_reckoning) = &mut self.dead_reckoning else { return };
        match status {
            Ok(Status::Done) => dead_reckoning.counts = made.after(dead_reckoning.counts),
            _ if made == HalfSteps::default() => {}
            Ok(Status::StopKey) => {
                dead_reckoning.lost = Some("the STOP key on the pendant ended a move".to_owned());
            }
            Ok(Status::Refused) => {
                dead_reckoning.lost = Some("the controller answered a move with 0".to_owned());
            }
            Err(error) => dead_reckoning.lost = Some(error.to_string()),
        }
    }

    /// Closes the gripper until its switch trips: slow, and nothing but the pendant stops it.
    ///
    /// # Errors
    /// [`ControllerError`].
    pub fn close_gripper(&mut self, _: OnlyThePendantStopsIt) -> Result<(), ControllerError> {
        // From 3 in open at 40 half-steps a second, the slowest there is.
        self.expect_done(&Command::Close, Duration::from_secs(60))
    }

    /// Sets the registers to zero and switches the motor current off: an arm that is not supported may sag.
    ///
    /// # Errors
    /// [`ControllerError`].
    pub fn reset(&mut self) -> Result<(), ControllerError> {
        self.expect_done(&Command::Reset, self.reply_limit)
    }

    /// Hands the arm to its pendant. The reply comes when the operator ends it: see [`Controller::reply_at_hand`].
    ///
    /// # Errors
    /// [`ControllerError`].
    pub fn begin_hand_control(&mut self, _: OnlyThePendantStopsIt) -> Result<(), ControllerError> {
        self.send(&Command::HandControl)
    }

    /// Starts the taught program. The reply comes when it ends: see [`Controller::reply_at_hand`].
    ///
    /// # Errors
    /// [`ControllerError`].
    pub fn begin_program(&mut self, _: OnlyThePendantStopsIt) -> Result<(), ControllerError> {
        self.send(&Command::RunProgram)
    }

    /// Begins what only the pendant stops: the reply comes when it ends, see [`Controller::reply_at_hand`].
    ///
    /// # Errors
    /// [`ControllerError`].
    pub fn begin(
        &mut self,
        mode: PendantMode,
        confirmed: OnlyThePendantStopsIt,
    ) -> Result<(), ControllerError> {
        match mode {
            PendantMode::HandControl => self.begin_hand_control(confirmed),
            PendantMode::TaughtProgram => self.begin_program(confirmed),
        }
    }

    /// The reply to a command begun earlier, if it has come.
    ///
    /// # Errors
    /// [`ControllerError::Line`] for a reply that is none, or a line that failed.
    pub fn reply_at_hand(&mut self, command: &Command) -> Result<Option<Status>, ControllerError> {
        match self.line.line_at_hand().map_err(|failure| self.error(command, failure))? {
            Some(line) => Ok(Some(self.status(command, line)?)),
            None => Ok(None),
        }
    }

    /// The taught program in the controller's memory.
    ///
    /// # Errors
    /// [`ControllerError`].
    pub fn dump_program(&mut self) -> Result<Vec<ProgramLine>, ControllerError> {
        let command = Command::DumpProgram;
        self.expect_done(&command, self.reply_limit)?;
        let mut text = Vec::new();
        loop {
            match self.line.read_line(DUMP_PAUSE + self.line.duration(LONGEST_REPLY)) {
                Ok(line) => text.extend(line.into_iter().chain([b'\r'])),
                // Nothing announces the end of a dump but that no more comes.
                Err(ReplyFailure::Silent { .. }) => break,
                Err(failure) => return Err(self.error(&command, failure).into()),
            }
        }
        parse_program(&text)
            .map_err(|fault| self.error(&command, ReplyFailure::Garbled { received: text, fault }).into())
    }

    /// Writes a program to the controller's memory, line by line.
    ///
    /// # Errors
    /// [`ControllerError`]; lines before the one that failed have been written.
    pub fn write_program(&mut self, program: &[ProgramLine]) -> Result<(), ControllerError> {
        for line in program {
            self.expect_done(&Command::WriteProgram(*line), self.reply_limit)?;
        }
        Ok(())
    }

    /// Makes the controller answer to another character from now on.
    ///
    /// # Errors
    /// [`ControllerError`]; [`ControllerError::Program`] for a character that is not printable.
    pub fn change_recognition(&mut self, character: u8) -> Result<(), ControllerError> {
        if !character.is_ascii_graphic() {
            let text = format!("'{}' cannot be typed on every terminal", PrintableBytes(&[character]));
            return Err(ControllerError::Program(format!(
                "{text}; choose a printable recognition character"
            )));
        }
        self.expect_done(&Command::Recognition(character), self.reply_limit)?;
        self.recognition = character;
        Ok(())
    }

    /// Makes the controller wait between the characters of its replies.
    ///
    /// # Errors
    /// [`ControllerError`].
    pub fn delay_replies(&mut self, amount: u8) -> Result<(), ControllerError> {
        self.expect_done(&Command::Delay(amount), self.reply_limit)
    }

    /// Throws away what is on the line until it is quiet.
    ///
    /// # Errors
    /// [`ControllerError::Line`] when it does not become quiet.
    pub fn resynchronise(&mut self) -> Result<(), ControllerError> {
        self.line.drain()?;
        Ok(())
    }

    fn expect_done(&mut self, command: &Command, limit: Duration) -> Result<(), ControllerError> {
        match self.exchange(command, limit)? {
            Status::Done => Ok(()),
            Status::Refused => Err(refused(command)),
            Status::StopKey => Err(ControllerError::StopKey { command: command.name() }),
        }
    }

    /// Sends a command and waits for its status: for the time on the line, and `limit` beyond.
    fn exchange(&mut self, command: &Command, limit: Duration) -> Result<Status, ControllerError> {
        self.send(command)?;
        let on_the_line = self.line.duration(self.bytes(command).len());
        let line = self.reply_line(command, limit + on_the_line)?;
        if self.is_look_alike(&line) {
            return Err(ControllerError::LookAlike);
        }
        self.status(command, line)
    }

    /// Whether this is the answer of a firmware that begins each with an empty line, and then says OK.
    fn is_look_alike(&mut self, line: &[u8]) -> bool {
        let is_ok = |line: &[u8]| line.eq_ignore_ascii_case(b"OK");
        is_ok(line) || line.is_empty() && self.line.read_line(AFTER_EMPTY).is_ok_and(|next| is_ok(&next))
    }

    fn send(&mut self, command: &Command) -> Result<(), ControllerError> {
        let stray = self.line.take_stray().map_err(|failure| self.error(command, failure))?;
        if !stray.is_empty() {
            return Err(self.error(command, ReplyFailure::Stray { received: stray }).into());
        }
        let bytes = self.bytes(command);
        let limit = self.reply_limit + 2 * self.line.duration(bytes.len());
        Ok(self.line.write(&command.name(), &bytes, limit)?)
    }

    fn reply_line(&mut self, command: &Command, limit: Duration) -> Result<Vec<u8>, ControllerError> {
        let limit = limit + self.line.duration(LONGEST_REPLY);
        self.line.read_line(limit).map_err(|failure| self.error(command, failure).into())
    }

    fn status(&self, command: &Command, line: Vec<u8>) -> Result<Status, ControllerError> {
        parse_status(&line)
            .map_err(|fault| self.error(command, ReplyFailure::Garbled { received: line, fault }).into())
    }

    fn error(&self, command: &Command, failure: ReplyFailure) -> SerialError {
        SerialError::ReadReply { port: self.line.name().to_owned(), command: command.name(), failure }
    }
}

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MoveEnd {
    /// As commanded.
    Done,
    /// Somewhere on its way, by the STOP key of the pendant.
    StopKey,
}

fn refused(command: &Command) -> ControllerError {
    let hint = if command.is_seen_on_an_arm() {
        ""
    } else {
        "; no source shows this form of the command, so this arm may want another"
    };
    ControllerError::Refused { command: command.to_string(), hint }
}
