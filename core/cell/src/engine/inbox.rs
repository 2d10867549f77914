//! Commands as the engine takes them in.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use crate::command::{Command, PauseWhen};
use crate::prompt::PromptId;

/// What ends or interrupts what the engine does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interrupt {
    /// Wait now; the step in hand begins again.
    Pause,
    /// All motion stopped; wait.
    Stop,
    /// End as aborted.
    Abort,
    /// End early, in good order.
    Finish,
    /// Leave the run as it is, to be resumed.
    Keep,
    /// A signal asks the program to end, or nobody can follow the run any more.
    FromOutside {
        /// Which signal and who sent it, or what is gone.
        by: &'static str,
        /// The run is left to be resumed.
        keep: bool,
    },
}

/// Most answers that wait for the prompt they are meant for; more at once come from no person.
const MOST_ANSWERS_WAITING: usize = 100;

/// The queue of commands.
pub(crate) struct Inbox {
    receiver: Receiver<Command>,
    /// Answers, and wishes for the pendant, that came while the engine was busy: one may be for the prompt that is open.
    answers: VecDeque<Command>,
    /// A pause before the next step was asked for.
    pub(crate) pause_before_next: bool,
}

impl Inbox {
    pub(crate) fn new(receiver: Receiver<Command>) -> Self {
        Self { receiver, answers: VecDeque::new(), pause_before_next: false }
    }

    /// Takes in what has come while the engine was busy. Answers are kept for the prompt that is asked next. Jogs are not: a jog moves the arm at
    /// once or not at all, so that no motion waits in a queue. A resume of what runs is ignored.
    pub(crate) fn interrupt(&mut self) -> Option<Interrupt> {
        while let Ok(command) = self.receiver.try_recv() {
            if let Some(interrupt) = self.as_interrupt(&command) {
                return Some(interrupt);
            }
            let is_kept = matches!(command, Command::Answer { .. } | Command::HandOver { .. });
            if is_kept && self.answers.len() < MOST_ANSWERS_WAITING {
                self.answers.push_back(command);
            }
        }
        None
    }

    /// Drops every jog and answer that came while the arm was moving; whether an answer to `prompt` was among them.
    ///
    /// # Errors
    /// The interrupt that came meanwhile.
    pub(crate) fn drop_what_came_during_a_jog(&mut self, prompt: PromptId) -> Result<bool, Interrupt> {
        if let Some(interrupt) = self.interrupt() {
            return Err(interrupt);
        }
        let answers_it = |command: &Command| match command {
            Command::Answer { prompt: to, .. } | Command::HandOver { prompt: to } => *to == prompt,
            _ => false,
        };
        let answered = self.answers.iter().any(answers_it);
        self.answers.retain(|command| !answers_it(command));
        Ok(answered)
    }

    /// What a command interrupts, if it does.
    pub(crate) fn as_interrupt(&mut self, command: &Command) -> Option<Interrupt> {
        match command {
            Command::Pause { when: PauseWhen::Now } => Some(Interrupt::Pause),
            Command::Pause { when: PauseWhen::BeforeNextStep } => {
                self.pause_before_next = true;
                None
            }
            Command::Stop => Some(Interrupt::Stop),
            Command::Abort => Some(Interrupt::Abort),
            Command::Finish => Some(Interrupt::Finish),
            Command::Keep => Some(Interrupt::Keep),
            // Once in the life of a program, which ends by it: nothing is gained by freeing the text before.
            Command::EndFromOutside { by, keep } => {
                Some(Interrupt::FromOutside { by: String::leak(by.clone()), keep: *keep })
            }
            Command::Answer { .. } | Command::Jog { .. } | Command::HandOver { .. } | Command::Resume => None,
        }
    }

    /// The next command, or none when `time` has passed. When nobody can command any more, the time is waited out.
    pub(crate) fn next(&mut self, time: Duration) -> Option<Command> {
        if let Some(command) = self.answers.pop_front() {
            return Some(command);
        }
        match self.receiver.recv_timeout(time) {
            Ok(command) => Some(command),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                std::thread::sleep(time);
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;
    use crate::prompt::Answer;

    fn jog() -> Command {
        Command::Jog { prompt: PromptId(1), joint: "waist".to_owned(), by: 1.0 }
    }

    fn answer(prompt: i64) -> Command {
        Command::Answer { prompt: PromptId(prompt), answer: Answer::Done, by: "ada".to_owned() }
    }

    #[test]
    fn no_jog_waits_while_the_engine_is_busy() {
        let (sender, receiver) = channel();
        let mut inbox = Inbox::new(receiver);
        for command in [jog(), jog(), answer(2), jog()] {
            sender.send(command).unwrap();
        }
        assert_eq!(inbox.interrupt(), None);
        assert_eq!(inbox.next(Duration::ZERO), Some(answer(2)));
        assert_eq!(inbox.next(Duration::ZERO), None);
    }

    #[test]
    fn an_answer_given_during_a_jog_is_dropped_and_one_to_another_prompt_is_kept() {
        let (sender, receiver) = channel();
        let mut inbox = Inbox::new(receiver);
        for command in [jog(), answer(1), jog(), answer(2)] {
            sender.send(command).unwrap();
        }
        assert_eq!(inbox.drop_what_came_during_a_jog(PromptId(1)), Ok(true));
        assert_eq!(inbox.next(Duration::ZERO), Some(answer(2)));
        assert_eq!(inbox.drop_what_came_during_a_jog(PromptId(1)), Ok(false));
    }

    #[test]
    fn a_stop_that_came_during_a_jog_is_not_dropped() {
        let (sender, receiver) = channel();
        let mut inbox = Inbox::new(receiver);
        for command in [jog(), Command::Stop, jog()] {
            sender.send(command).unwrap();
        }
        assert_eq!(inbox.drop_what_came_during_a_jog(PromptId(1)), Err(Interrupt::Stop));
    }
}
