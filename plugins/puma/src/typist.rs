//! Typing at the controller's terminal: nothing counts until its carriage return, and that is sent only when all of the line came back as typed.

use std::time::{Duration, Instant};

use crate::configuration::{Configuration, Typing};
use crate::line::{Line, LineError, LineFailure, shown};
use crate::profile::Profile;
use crate::reply::{Ending, Reply, Sign, is_greeting, may_be_a_beginning, sign, unfinished};

const CONTROL_C: u8 = 3;

/// How often a control C is sent until the controller answers it.
const CANCELLATIONS: usize = 4;

/// How long what still comes behind the prompt that answers a control C is listened to: longer than a USB adapter holds bytes back (16 ms).
const LATE: Duration = Duration::from_millis(25);

/// How long a `*` has to be alone behind a control C until it says that something goes on that a control C does not end: an error that begins with one comes
/// within a character's time.
const STILL_BUSY: Duration = Duration::from_millis(300);

/// Who types.
#[derive(Debug)]
pub(crate) struct Typist {
    line: Line,
    typing: Typing,
    echo_within: Duration,
    reply_within: Duration,
    /// Whether the controller was seen to be started anew since that was asked last.
    pub(crate) rebooted: bool,
    /// Whether the controller has asked a question. A control C takes it back: what is typed then is a command.
    asked: bool,
    /// Whether a question was taken back whose answer only has to be typed once more: it has to be asked again first.
    pub(crate) unanswered: bool,
    /// What the controller has said without being asked, line by line.
    unasked: Vec<String>,
    /// The beginning of such a line, whose end has not come.
    begun: Vec<u8>,
    pub(crate) profile: Profile,
}

/// How waiting for an answer ended.
pub(crate) enum Waited {
    /// With its end.
    Answered(Reply),
    /// With the caller's wish to stop: what has come so far.
    Interrupted(Vec<u8>),
}

impl Typist {
    pub(crate) fn open(configuration: &Configuration) -> Result<Self, LineError> {
        let line = Line::open(&configuration.port, configuration.baud).map_err(|failure| LineError {
            port: configuration.port.clone(),
            command: "opening".to_owned(),
            failure,
        })?;
        Ok(Self {
            line,
            typing: configuration.typing,
            echo_within: configuration.echo_within,
            reply_within: configuration.reply_within,
            rebooted: false,
            asked: false,
            unanswered: false,
            unasked: Vec::new(),
            begun: Vec::new(),
            profile: Profile::default(),
        })
    }

    /// What the controller has said without being asked, since this was asked last. A line that has begun is waited for.
    pub(crate) fn take_unasked(&mut self) -> Result<Vec<String>, LineError> {
        self.hear_unasked("listening")?;
        Ok(std::mem::take(&mut self.unasked))
    }

    /// Takes in all that has come without being asked for, to the end of the line that has begun, if it comes while an answer may.
    fn hear_unasked(&mut self, text: &str) -> Result<(), LineError> {
        let deadline = Instant::now() + self.reply_within;
        // Thrown away as noise, the first character of a greeting would leave a line that nobody knows.
        let noise = Instant::now() + LATE;
        loop {
            let until = match unfinished(&self.begun).is_some() {
                true => deadline,
                false if may_be_a_beginning(&self.begun) => noise.min(deadline),
                false => Instant::now(),
            };
            let more = self.read(text, until.saturating_duration_since(Instant::now()))?;
            // One read does not give all that has come.
            let is_over = Instant::now() >= if more.is_empty() { until } else { deadline };
            self.begun.extend(more);
            if is_over {
                break;
            }
        }
        self.keep_unasked(&[]);
        Ok(())
    }

    /// Whether lines are typed carefully.
    pub(crate) fn is_careful(&self) -> bool {
        self.typing == Typing::Careful
    }

    /// Cancels whatever is being typed or done, and waits for the prompt. Nothing else is sent before that has come.
    pub(crate) fn cancel(&mut self) -> Result<(), LineError> {
        let begun = Instant::now();
        self.asked = false;
        for _ in 0..CANCELLATIONS {
            self.write("control C", &[CONTROL_C])?;
            let mut came = Vec::new();
            let deadline = Instant::now() + self.reply_within;
            let mut heard = Instant::now();
            while Instant::now() < deadline {
                let more = self.read("control C", Duration::from_millis(20))?;
                if !more.is_empty() {
                    heard = Instant::now();
                }
                came.extend(more);
                if sign(&came) == Some(Sign::AtDeadline(Ending::Busy)) && heard.elapsed() > STILL_BUSY {
                    self.keep_unasked(&came);
                    return self.abort();
                }
                if sign(&came) == Some(Sign::Sure(Ending::Command)) {
                    let late = self.read_for("control C", LATE)?;
                    came.extend(late);
                    if sign(&came) == Some(Sign::Sure(Ending::Command)) {
                        self.keep_unasked(&came);
                        self.profile.controller += begun.elapsed();
                        self.profile.total += begun.elapsed();
                        return Ok(());
                    }
                }
            }
            self.begun.extend(came);
        }
        self.keep_unasked(&[]);
        Err(self.error("control C", LineFailure::Silent))
    }

    /// Ends the program that goes on in the controller, which a control C did not. ABORT may ask whether one is sure (RX60L); that is answered with Y.
    fn abort(&mut self) -> Result<(), LineError> {
        let mut typed = "ABORT";
        loop {
            self.type_carefully(typed)?;
            match self.wait(typed, self.reply_within, Until::AnyEnd, &mut || false)? {
                Waited::Answered(Reply { ending: Ending::Command, lines }) => {
                    self.unasked.extend(lines);
                    return Ok(());
                }
                Waited::Answered(Reply { ending: Ending::Question, .. }) if typed == "ABORT" => typed = "Y",
                Waited::Answered(Reply { lines, .. }) => {
                    return Err(self.unexpected(typed, lines.join("|").as_bytes()));
                }
                Waited::Interrupted(came) => return Err(self.unexpected(typed, &came)),
            }
        }
    }

    /// Types a line and waits for its answer.
    pub(crate) fn ask(&mut self, text: &str) -> Result<Reply, LineError> {
        let begun = Instant::now();
        let (sent, received) = (self.line.sent, self.line.received);
        let within = self.reply_within + self.line.duration(400);
        let answered =
            self.type_line(text).and_then(|()| self.wait(text, within, Until::AnyEnd, &mut || false));
        self.account(begun, sent, received, false);
        match answered? {
            Waited::Answered(reply) => Ok(reply),
            Waited::Interrupted(came) => Err(self.unexpected(text, &came)),
        }
    }

    /// Types a line that sets the arm in motion and waits for its end; `should_stop` is asked all the while.
    pub(crate) fn ask_for_motion(
        &mut self,
        text: &str,
        within: Duration,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<Waited, LineError> {
        let begun = Instant::now();
        let (sent, received) = (self.line.sent, self.line.received);
        let typed = self.type_line(text);
        self.account(begun, sent, received, false);
        typed?;
        let begun = Instant::now();
        let (sent, received) = (self.line.sent, self.line.received);
        let waited = self.wait(text, within, Until::Command, should_stop);
        self.account(begun, sent, received, true);
        waited
    }

    fn account(&mut self, begun: Instant, sent: u32, received: u32, motion: bool) {
        let (sent, received) = (self.line.sent.wrapping_sub(sent), self.line.received.wrapping_sub(received));
        let total = begun.elapsed();
        // Careful: a character and its echo take turns. Fast: they overlap.
        let characters = if self.is_careful() { sent + received } else { sent.max(received) };
        let line = self.line.duration(characters).min(total);
        let profile = &mut self.profile;
        profile.commands += u32::from(!motion);
        profile.sent += sent;
        profile.received += received;
        profile.line += line;
        let rest = total.saturating_sub(line);
        *if motion { &mut profile.motion } else { &mut profile.controller } += rest;
        profile.total += total;
    }

    /// Nothing goes on with a controller that was started anew: its points and its calibration are lost.
    pub(crate) fn require_no_new_start(&self, text: &str) -> Result<(), LineError> {
        match self.rebooted {
            true => Err(self.error(text, LineFailure::Rebooted)),
            false => Ok(()),
        }
    }

    /// Types a line up to and with its carriage return. What does not come back as it was typed is cancelled, and does not count; a line whose echo was late
    /// is typed once more, unless it answers a question: that was cancelled with it.
    fn type_line(&mut self, text: &str) -> Result<(), LineError> {
        self.hear_unasked(text)?;
        self.require_no_new_start(text)?;
        let (answers, mut was_late) = (self.asked, false);
        loop {
            let heard = self.unasked.len();
            let error = match self.type_once(text) {
                Err(error) if error.failure.is_of_echo() => error,
                other => return other,
            };
            self.cancel()?;
            self.require_no_new_start(text)?;
            // A controller that did not keep up gets a character at a time from here on.
            let was_fast = std::mem::replace(&mut self.typing, Typing::Careful) == Typing::Fast;
            // An echo that is only late is that of a computer or a controller that is busy. Something else in its place, or a message of the controller, is not.
            let is_late =
                matches!(error.failure, LineFailure::NotEchoed { .. }) && self.unasked.len() == heard;
            let again = was_fast || (is_late && !was_late);
            self.unanswered |= again && answers;
            if !again || answers {
                return Err(error);
            }
            was_late = !was_fast;
        }
    }

    fn type_once(&mut self, text: &str) -> Result<(), LineError> {
        match self.typing {
            Typing::Careful => self.type_carefully(text),
            Typing::Fast => self.type_fast(text),
        }
    }

    fn type_carefully(&mut self, text: &str) -> Result<(), LineError> {
        for (index, byte) in text.bytes().enumerate() {
            let first = index == 0;
            self.write(text, &[byte])?;
            let mut echo = Vec::new();
            let deadline = Instant::now() + self.echo_within + self.line.duration(4);
            while after_prompt(&printable(&echo), first).is_empty() {
                let left = deadline.saturating_duration_since(Instant::now());
                if left.is_zero() {
                    return Err(self.error(text, LineFailure::NotEchoed { character: char::from(byte) }));
                }
                echo.extend(self.read(text, left)?);
            }
            if !same(after_prompt(&printable(&echo), first), &[byte]) {
                return Err(self.wrong_echo(text, &[byte], &echo));
            }
        }
        let doubled = self.read_for(text, self.line.duration(2) + Duration::from_millis(1))?;
        // Where nothing was typed, the space behind the prompt may only come now.
        if !after_prompt(&printable(&doubled), text.is_empty()).is_empty() {
            return Err(self.wrong_echo(text, b"", &doubled));
        }
        self.write(text, b"\r")
    }

    fn type_fast(&mut self, text: &str) -> Result<(), LineError> {
        self.write(text, text.as_bytes())?;
        let mut echo = Vec::new();
        let requested = text.len();
        let deadline = Instant::now() + self.echo_within + self.line.duration(2 * requested as u32 + 4);
        while after_prompt(&printable(&echo), true).len() < requested {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let missing =
                    text.as_bytes().get(after_prompt(&printable(&echo), true).len()).copied().unwrap_or(b' ');
                return Err(self.error(text, LineFailure::NotEchoed { character: char::from(missing) }));
            }
            echo.extend(self.read(text, left)?);
        }
        echo.extend(self.read_for(text, self.line.duration(2) + Duration::from_millis(1))?);
        if !same(after_prompt(&printable(&echo), true), text.as_bytes()) {
            return Err(self.wrong_echo(text, text.as_bytes(), &echo));
        }
        self.write(text, b"\r")
    }

    /// Waits for the end of an answer. However the line pauses, nothing else ends it but the deadline.
    fn wait(
        &mut self,
        text: &str,
        within: Duration,
        until: Until,
        should_stop: &mut dyn FnMut() -> bool,
    ) -> Result<Waited, LineError> {
        let deadline = Instant::now() + within;
        let mut came = Vec::new();
        loop {
            if should_stop() {
                return Ok(Waited::Interrupted(came));
            }
            let late = Instant::now() > deadline;
            match sign(&came) {
                Some(Sign::Sure(ending)) => return self.ended(text, &came, ending),
                Some(Sign::AtDeadline(ending)) if late && until == Until::AnyEnd => {
                    return self.ended(text, &came, ending);
                }
                _ => {}
            }
            if late {
                let failure = LineFailure::Unfinished { waited: within, came: shown(&came) };
                return Err(self.error(text, failure));
            }
            came.extend(self.read(text, Duration::from_millis(5))?);
        }
    }

    fn ended(&mut self, text: &str, came: &[u8], ending: Ending) -> Result<Waited, LineError> {
        let reply = Reply::of(came, ending);
        self.asked = ending == Ending::Question;
        if reply.is_greeting() {
            self.rebooted = true;
            return Err(self.error(text, LineFailure::Rebooted));
        }
        Ok(Waited::Answered(reply))
    }

    /// What comes within a time, all of it.
    fn read_for(&mut self, text: &str, time: Duration) -> Result<Vec<u8>, LineError> {
        let deadline = Instant::now() + time;
        let mut came = Vec::new();
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(came);
            }
            came.extend(self.read(text, left)?);
        }
    }

    /// Keeps what has come without being asked for, and what had begun before it, as lines.
    fn keep_unasked(&mut self, came: &[u8]) {
        self.begun.extend(came);
        let all = std::mem::take(&mut self.begun);
        for line in Reply::of(&all, Ending::Command).lines.iter().map(|line| line.trim()) {
            if line.len() > 1 {
                self.rebooted |= is_greeting(line);
                self.unasked.push(line.to_owned());
            }
        }
    }

    fn write(&mut self, text: &str, bytes: &[u8]) -> Result<(), LineError> {
        self.line.write(bytes).map_err(|failure| self.error(text, failure))
    }

    fn read(&mut self, text: &str, limit: Duration) -> Result<Vec<u8>, LineError> {
        self.line.read(limit).map_err(|failure| self.error(text, failure))
    }

    fn wrong_echo(&mut self, text: &str, sent: &[u8], came: &[u8]) -> LineError {
        // A message that has begun in place of the echo goes on while the line is cancelled.
        self.begun.extend(came);
        self.error(text, LineFailure::WrongEcho { sent: shown(sent), came: shown(came) })
    }

    pub(crate) fn unexpected(&self, text: &str, came: &[u8]) -> LineError {
        self.error(text, LineFailure::Unexpected { came: shown(came) })
    }

    fn error(&self, command: &str, failure: LineFailure) -> LineError {
        LineError { port: self.line.name().to_owned(), command: command.to_owned(), failure }
    }
}

/// What ends an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Until {
    /// The prompt for a command, a question, and at the deadline a `*` behind which nothing has come.
    AnyEnd,
    /// The prompt for a command (or a question that is known): a `*` says that the motion goes on.
    Command,
}

/// What can be seen of an echo.
fn printable(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().copied().filter(|byte| matches!(byte, b' '..=b'~')).collect()
}

/// An echo without the space that may still come behind the prompt before the first character typed.
fn after_prompt(echo: &[u8], first: bool) -> &[u8] {
    if first { echo.trim_ascii_start() } else { echo }
}

/// Whether an echo is what was sent, in whatever case.
fn same(echo: &[u8], sent: &[u8]) -> bool {
    echo.eq_ignore_ascii_case(sent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_an_echo_what_can_be_seen_counts_but_for_the_space_behind_the_prompt() {
        assert_eq!(printable(b"\0 A~\x7f\r\n\x1f"), b" A~");
        assert_eq!(after_prompt(b"  W", true), b"W");
        assert_eq!(after_prompt(b"  W", false), b"  W");
        assert!(same(b"where", b"WHERE") && !same(b"wher", b"WHERE") && !same(b"", b"W"));
    }

    /// Who types at a line of which nobody holds the other end.
    fn typist(typing: &str) -> (Typist, nix::pty::OpenptyResult) {
        let pair = nix::pty::openpty(None, None).unwrap();
        let port = nix::unistd::ttyname(&pair.slave).unwrap().display().to_string();
        let config = serde_json::json!({"port": port, "typing": typing});
        (Typist::open(&Configuration::read(&config).unwrap()).unwrap(), pair)
    }

    #[test]
    fn a_message_of_which_one_character_has_come_is_heard_to_its_end_and_noise_is_not_waited_for() {
        use std::io::Write;
        let (mut typist, pair) = typist("careful");
        let mut controller = std::fs::File::from(pair.master);
        controller.write_all(b"\r\nV").unwrap();
        let rest = std::thread::spawn(move || {
            std::thread::sleep(LATE / 5);
            controller.write_all(b"AL-II 2.0 (C) UNIMATION\r\n. ").unwrap();
            controller
        });
        assert_eq!(typist.take_unasked().unwrap(), ["VAL-II 2.0 (C) UNIMATION"]);
        assert!(typist.rebooted);
        let mut controller = rest.join().unwrap();
        typist.read_for("listening", LATE).unwrap();
        controller.write_all(b"x").unwrap();
        let begun = Instant::now();
        assert!(typist.take_unasked().unwrap().is_empty());
        assert!(begun.elapsed() < typist.reply_within, "noise is nothing to wait for");
    }

    #[test]
    fn all_that_has_come_is_heard_and_not_only_what_one_read_gives() {
        use std::io::Write;
        let (mut typist, pair) = typist("careful");
        // One read gives 256 bytes.
        let first = format!("*{:<252}*", "Robot power off");
        let message = format!("{first}\r\nVAL-II 2.0 (C) UNIMATION\r\n. ");
        let mut controller = std::fs::File::from(pair.master);
        controller.write_all(message.as_bytes()).unwrap();
        assert_eq!(typist.take_unasked().unwrap(), [first.as_str(), "VAL-II 2.0 (C) UNIMATION"]);
        assert!(typist.rebooted);
    }

    #[test]
    fn lines_are_typed_as_the_cell_file_says_and_errors_name_the_port() {
        assert!(typist("careful").0.is_careful() && !typist("fast").0.is_careful());
        let (typist, pair) = typist("careful");
        let port = nix::unistd::ttyname(&pair.slave).unwrap().display().to_string();
        let error = typist.error("WHERE", LineFailure::Silent);
        assert_eq!(
            (error.port, error.command, error.failure),
            (port, "WHERE".to_owned(), LineFailure::Silent)
        );
        assert!(typist.require_no_new_start("WHERE").is_ok());
        let begun_anew = Typist { rebooted: true, ..typist };
        let error = begun_anew.require_no_new_start("WHERE").unwrap_err();
        assert_eq!(error.failure, LineFailure::Rebooted);
    }
}
