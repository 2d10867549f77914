//! Asking: the first valid answer wins, no matter who gives it; in an unattended run the answers file gives it or the run ends.

use std::time::Duration;

use super::Engine;
use super::inbox::Interrupt;
use super::interrupted;
use super::journal::Question;
use super::step_context::StepContext;
use super::step_error::StepError;
use crate::answer_bounds::{check_level, check_number, check_text};
use crate::command::Command;
use crate::event::{Event, NamedValue};
use crate::prompt::{Answer, Prompt, PromptKind, SIMULATED_OPERATOR};

/// How often a waiting prompt looks at the robot it is about.
const LOOK: Duration = Duration::from_millis(100);

/// What came while a prompt waited.
pub(crate) enum Received {
    /// An answer that fits the prompt's kind, and who gave it.
    Answer(Answer, String),
    /// One joint is to be moved a little.
    Jog { joint: String, by: f64 },
    /// The robot is to be handed to its pendant.
    HandOver,
    /// Nothing for a while.
    Silence,
}

impl Engine {
    /// Asks and waits for the answer. An answer given before the run was interrupted is taken without asking again.
    pub(crate) fn ask(&mut self, question: Question<'_>, at: &StepContext) -> Result<Answer, StepError> {
        if let Some(answer) = self.answer_given_before(&question)? {
            return Ok(answer);
        }
        let prompt = self.journal.ask(question)?;
        if let Some((answer, by)) = self.answer_of_nobody(&prompt, at)? {
            self.journal.answered(&prompt, &answer, &by)?;
            return Ok(answer);
        }
        loop {
            match self.receive(&prompt, at)? {
                Received::Answer(answer, by) => {
                    self.journal.answered(&prompt, &answer, &by)?;
                    return Ok(answer);
                }
                Received::Jog { .. } | Received::HandOver => {
                    self.refuse(&prompt, "nothing is jogged in this prompt");
                }
                Received::Silence => {}
            }
        }
    }

    /// An answer in the record to the same prompt of this run, given before it was killed.
    pub(crate) fn answer_given_before(
        &mut self,
        question: &Question<'_>,
    ) -> Result<Option<Answer>, StepError> {
        let last_end = self.journal.record.steps(self.journal.run)?;
        let attempts = last_end.iter().filter(|attempt| attempt.step == question.step.0);
        // Only an attempt that a killed program left open has an answer that was never used.
        let left_open = attempts.rev().nth(1).is_some_and(|attempt| attempt.ended.is_none());
        if !left_open {
            return Ok(None);
        }
        let prompts = self.journal.record.prompts(self.journal.run)?;
        let answer = prompts
            .into_iter()
            .rev()
            .find(|prompt| prompt.step == question.step.0)
            .filter(|prompt| same_kind(&prompt.description, &question.kind))
            .and_then(|prompt| prompt.answer);
        Ok(answer.and_then(|answer| serde_json::from_value(answer.answer).ok()))
    }

    /// Waits a little for something that concerns the prompt.
    pub(crate) fn receive(&mut self, prompt: &Prompt, at: &StepContext) -> Result<Received, StepError> {
        self.take_in_log(Some(&at.path))?;
        // While somebody is waited for, anybody may move the arm.
        self.pose_cache.forget();
        if at.is_patience_over() {
            self.journal.withdrawn(prompt)?;
            return Err(StepError::error("nobody answered within its time limit"));
        }
        match self.inbox.next(LOOK) {
            Some(Command::Answer { prompt: id, answer, by }) if id == prompt.id => {
                match self.fitting(answer, by, prompt) {
                    Ok((answer, by)) => return Ok(Received::Answer(answer, by)),
                    Err(reason) => self.refuse(prompt, &reason),
                }
            }
            Some(Command::Jog { prompt: id, joint, by }) if id == prompt.id => {
                return Ok(Received::Jog { joint, by });
            }
            Some(Command::HandOver { prompt: id }) if id == prompt.id => return Ok(Received::HandOver),
            Some(other) => {
                if let Some(interrupt) = self.inbox.as_interrupt(&other) {
                    self.journal.withdrawn(prompt)?;
                    return Err(interrupted(interrupt));
                }
            }
            None => return self.hear_elsewhere(prompt),
        }
        Ok(Received::Silence)
    }

    /// Takes an answer that another program has put into the record, or says there why it cannot be taken.
    fn hear_elsewhere(&mut self, prompt: &Prompt) -> Result<Received, StepError> {
        let Some(offer) = self.journal.record.offer_to(prompt.id.0)? else { return Ok(Received::Silence) };
        let answer = serde_json::from_value::<Answer>(offer.answer)
            .map_err(|error| error.to_string())
            .and_then(|answer| self.fitting(answer, offer.by, prompt));
        match answer {
            Ok((answer, by)) => {
                self.offered = Some((prompt.id, offer.id));
                Ok(Received::Answer(answer, by))
            }
            Err(reason) => {
                self.journal.record.refuse_offer(offer.id, &reason)?;
                self.journal.show(Event::AnswerRefused { prompt: prompt.id, reason });
                Ok(Received::Silence)
            }
        }
    }

    /// An answer that fits a prompt's kind, and who is said to give it; of what is left to the simulated world, what that does or reads.
    fn fitting(&mut self, answer: Answer, by: String, prompt: &Prompt) -> Result<(Answer, String), String> {
        if answer != Answer::Simulated {
            return check_answer(&answer, &prompt.kind).map(|()| (answer, by));
        }
        let of_world = world_answer(prompt, &by).ok_or("nothing here is simulated: it needs an answer")?;
        self.left_to_world_by = Some(by);
        Ok(of_world)
    }

    /// Says why an answer is not taken, to the one who gave it.
    pub(crate) fn refuse(&mut self, prompt: &Prompt, reason: &str) {
        if let Some((_, offer)) = self.offered.take().filter(|(asked, _)| *asked == prompt.id)
            && let Err(error) = self.journal.record.refuse_offer(offer, reason)
        {
            tracing::error!("a refusal cannot be written down: {error}");
        }
        self.journal.show(Event::AnswerRefused { prompt: prompt.id, reason: reason.to_owned() });
    }

    /// The answer that is there without anybody being asked, and who is said to have given it: of the answers file in an unattended run, of the world where
    /// it was left to that.
    pub(crate) fn answer_of_nobody(
        &mut self,
        prompt: &Prompt,
        at: &StepContext,
    ) -> Result<Option<(Answer, String)>, StepError> {
        if self.unattended {
            return self.answer_from_file(prompt, at).map(Some);
        }
        let Some(answer) = self.answer_of_world(prompt) else { return Ok(None) };
        if let Some(interrupt) = self.inbox.interrupt() {
            self.journal.withdrawn(prompt)?;
            return Err(interrupted(interrupt));
        }
        Ok(Some(answer))
    }

    /// What the simulated world has done or read for a prompt that was left to it.
    fn answer_of_world(&self, prompt: &Prompt) -> Option<(Answer, String)> {
        world_answer(prompt, self.left_to_world_by.as_ref()?)
    }

    /// The answer of the answers file, and who is said to have given it.
    pub(crate) fn answer_from_file(
        &mut self,
        prompt: &Prompt,
        at: &StepContext,
    ) -> Result<(Answer, String), StepError> {
        if let Some(interrupt) = self.inbox.interrupt() {
            self.journal.withdrawn(prompt)?;
            return Err(interrupted(interrupt));
        }
        let times = self.times_answered(&at.answer_name)?;
        let name = &at.answer_name;
        let found = self
            .answers
            .as_ref()
            .and_then(|answers| Some((answers.find(name, times)?.clone(), answers.by.clone())));
        let Some((written, by)) = found else {
            self.journal.withdrawn(prompt)?;
            let message =
                format!("step `{name}` asks \"{}\" and the answers hold no answer to it", prompt.title);
            return Err(StepError::NeedsOperator(message));
        };
        let answer = written.for_prompt(&prompt.kind).and_then(|answer| {
            check_answer(&answer, &prompt.kind)?;
            Ok(answer)
        });
        match answer {
            Ok(answer) => Ok((answer, by)),
            Err(reason) => {
                self.journal.withdrawn(prompt)?;
                Err(StepError::error(format!("the answer to step `{name}` cannot be taken: {reason}")))
            }
        }
    }

    /// How often prompts of a step were answered in this run, turns of repetitions taken together.
    fn times_answered(&mut self, answer_name: &str) -> Result<usize, StepError> {
        let prompts = self.journal.record.prompts(self.journal.run)?;
        let mine = |path: &str| without_turns(path) == answer_name || path == answer_name;
        let in_plan = |path: &str| {
            let entry = self.plan.entries.iter().find(|entry| entry.path.0 == path);
            entry.map_or_else(|| mine(path), |entry| entry.answer_name == answer_name)
        };
        Ok(prompts.iter().filter(|prompt| prompt.answer.is_some() && in_plan(&prompt.step)).count())
    }
}

/// What the simulated world does or reads for a prompt that somebody left to it, and who is said to have answered; nothing where a person is needed.
fn world_answer(prompt: &Prompt, left_by: &str) -> Option<(Answer, String)> {
    let answer = match &prompt.kind {
        _ if !prompt.simulated => return None,
        PromptKind::Acknowledge { .. } | PromptKind::JogTo { .. } => Answer::Done,
        PromptKind::Number { default: Some(value), .. } => Answer::Number { value: *value },
        _ => return None,
    };
    Some((answer, format!("{SIMULATED_OPERATOR}, for {left_by}")))
}

fn without_turns(path: &str) -> String {
    let mut name = String::new();
    let mut inside = false;
    for character in path.chars() {
        match character {
            '[' => inside = true,
            ']' => inside = false,
            other if !inside => name.push(other),
            _ => {}
        }
    }
    name
}

fn same_kind(description: &serde_json::Value, kind: &PromptKind) -> bool {
    let name = serde_json::to_value(kind).ok().and_then(|kind| kind.get("kind").cloned());
    description.get("kind").and_then(|stored| stored.get("kind").cloned()) == name
}

/// Whether an answer can be taken; if not, what would be right.
pub(crate) fn check_answer(answer: &Answer, kind: &PromptKind) -> Result<(), String> {
    match (kind, answer) {
        (PromptKind::Acknowledge { .. } | PromptKind::JogTo { .. }, Answer::Done) => Ok(()),
        (PromptKind::JogTo { joints, .. }, Answer::Pose { joints: target }) => check_pose(target, joints),
        (PromptKind::Choice { options, .. }, Answer::Choice { key }) => {
            let mut keys = options.iter().map(|option| option.key.as_str());
            match keys.clone().any(|known| known == key) {
                true => Ok(()),
                false => Err(plumb_document::did_you_mean(key, keys.by_ref())),
            }
        }
        (PromptKind::Number { unit, minimum, maximum, .. }, Answer::Number { value }) => {
            check_number(*value, unit, *minimum, *maximum)
        }
        (PromptKind::Text { longest }, Answer::Text { text }) => check_text(text, *longest),
        (PromptKind::Level { most }, Answer::Level { x, y }) => check_level(*x, *y, *most),
        (PromptKind::Photo, Answer::Photo { file }) => crate::photo::examine(file).map(drop),
        (PromptKind::ConfirmPose { .. }, Answer::Confirmed) => Ok(()),
        (PromptKind::Decision { options, .. }, Answer::Decision { decision }) => {
            match options.contains(decision) {
                true => Ok(()),
                false => Err(format!("`{}` is not to be chosen here", decision.name())),
            }
        }
        _ => Err("this is another kind of answer than the prompt asks for".to_owned()),
    }
}

/// Whether a pose names joints that the robot has, each in its unit.
fn check_pose(target: &[NamedValue], joints: &[NamedValue]) -> Result<(), String> {
    let is_known =
        |joint: &&NamedValue| joints.iter().any(|known| known.name == joint.name && known.unit == joint.unit);
    let Some(joint) = target.iter().find(|joint| !is_known(joint)) else { return Ok(()) };
    let names: Vec<String> = joints.iter().map(|joint| format!("{} ({})", joint.name, joint.unit)).collect();
    Err(format!("there is no joint {} in {}; there are {}", joint.name, joint.unit, names.join(", ")))
}

/// An interruption that means: go on asking afterwards.
pub(crate) fn is_pause(interrupt: Interrupt) -> bool {
    matches!(interrupt, Interrupt::Pause | Interrupt::Stop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prompt::{ChoiceOption, Decision};

    fn refused(answer: Answer, kind: &PromptKind) -> String {
        check_answer(&answer, kind).unwrap_err()
    }

    #[test]
    fn a_pose_names_joints_of_the_robot_in_their_units() {
        let joint = |name: &str, unit: &str| NamedValue {
            name: name.to_owned(),
            value: 1.0,
            unit: unit.to_owned(),
            uncertainty: None,
        };
        let joints = [joint("waist", "deg"), joint("slide", "mm")];
        assert_eq!(check_pose(&[joint("slide", "mm")], &joints), Ok(()));
        let wrong = check_pose(&[joint("waist", "deg"), joint("slide", "deg")], &joints).unwrap_err();
        assert_eq!(wrong, "there is no joint slide in deg; there are waist (deg), slide (mm)");
    }

    #[test]
    fn a_choice_is_one_of_those_offered() {
        let option = |key: &str| ChoiceOption { key: key.to_owned(), label: String::new() };
        let kind = PromptKind::Choice { options: vec![option("accept"), option("reject")], default: None };
        assert_eq!(check_answer(&Answer::Choice { key: "reject".into() }, &kind), Ok(()));
        assert!(refused(Answer::Choice { key: "acept".into() }, &kind).contains("accept"));
        let decision =
            PromptKind::Decision { error: String::new(), options: vec![Decision::Abort], labels: Vec::new() };
        assert_eq!(check_answer(&Answer::Decision { decision: Decision::Abort }, &decision), Ok(()));
        assert_eq!(
            refused(Answer::Decision { decision: Decision::Skip }, &decision),
            "`skip` is not to be chosen here"
        );
    }

    #[test]
    fn an_answer_of_another_kind_is_refused() {
        let kind = PromptKind::Acknowledge { label: "Done".to_owned() };
        assert_eq!(check_answer(&Answer::Done, &kind), Ok(()));
        assert!(refused(Answer::Number { value: 1.0 }, &kind).starts_with("this is another kind of answer"));
        assert!(check_answer(&Answer::Done, &PromptKind::Photo).is_err());
    }

    #[test]
    fn a_text_is_taken_up_to_its_greatest_length() {
        let kind = PromptKind::Text { longest: 5 };
        let text = |text: &str| Answer::Text { text: text.to_owned() };
        assert_eq!(check_answer(&text("eight"), &kind), Ok(()));
        assert_ne!(check_answer(&text("eleven"), &kind), Ok(()));
        assert_ne!(refused(text("eleven"), &kind), refused(Answer::Done, &kind), "the kind was right");
    }

    #[test]
    fn a_step_is_the_same_in_every_turn() {
        assert_eq!(without_turns("again[12].inner[3].hand"), "again.inner.hand");
        assert_eq!(without_turns("hand"), "hand");
        assert_eq!(without_turns("again[2]"), "again");
    }

    #[test]
    fn an_answer_from_before_fits_a_prompt_of_its_kind_only() {
        let number = |unit: &str| PromptKind::Number {
            unit: unit.to_owned(),
            minimum: None,
            maximum: None,
            default: None,
            decimals: None,
        };
        let stored = serde_json::json!({"kind": number("mm")});
        assert!(same_kind(&stored, &number("deg")));
        assert!(!same_kind(&stored, &PromptKind::Photo));
        assert!(!same_kind(&serde_json::Value::Null, &PromptKind::Photo), "nothing is known of it");
    }

    #[test]
    fn a_number_is_taken_up_to_its_bounds_and_a_level_up_to_the_most_it_shows() {
        let number = PromptKind::Number {
            unit: "mm".to_owned(),
            minimum: Some(1.0),
            maximum: Some(2.0),
            default: None,
            decimals: None,
        };
        for (value, is_taken) in [(0.99, false), (1.0, true), (2.0, true), (2.01, false), (f64::NAN, false)] {
            assert_eq!(check_answer(&Answer::Number { value }, &number).is_ok(), is_taken, "{value}");
        }
        let level = PromptKind::Level { most: 0.5 };
        for (x, is_taken) in [(0.5, true), (-0.5, true), (0.51, false), (-0.51, false), (f64::NAN, false)] {
            assert_eq!(check_answer(&Answer::Level { x, y: 0.0 }, &level).is_ok(), is_taken, "{x}");
            assert_eq!(check_answer(&Answer::Level { x: 0.0, y: x }, &level).is_ok(), is_taken, "{x}");
        }
    }
}
