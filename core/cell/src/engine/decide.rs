//! What to do about a step that went wrong.

use super::Engine;
use super::journal::Question;
use super::step_context::StepContext;
use super::step_error::StepError;
use super::ways_out::WaysOut;
use crate::prompt::{Answer, Decision, PromptKind};
use crate::step::{OnError, Step};

impl Engine {
    /// Decides by what the step says, what the answers say, or by asking.
    pub(crate) fn decide(
        &mut self,
        step: &Step,
        at: &StepContext,
        error: &str,
        ways_out: &WaysOut,
    ) -> Result<Decision, StepError> {
        let decided = match step.on_error {
            Some(OnError::Decide(decision)) => Some(decision),
            Some(OnError::Ask) | None if self.unattended => {
                let from_file = self.answers.as_ref().and_then(|answers| answers.decision(&at.answer_name));
                Some(from_file.unwrap_or(Decision::Abort))
            }
            Some(OnError::Ask) | None => None,
        };
        match decided {
            Some(Decision::Retry) if at.attempt.number > step.retries => Ok(Decision::Abort),
            Some(decision) => Ok(decision),
            None => {
                let (options, labels) = self.offered_decisions(ways_out);
                let lines: Vec<String> = [Some(error.to_owned()), ways_out.what_going_back_undoes()]
                    .into_iter()
                    .flatten()
                    .collect();
                let question = Question {
                    step: &at.path,
                    title: &at.title,
                    text: lines.join("\n"),
                    help: None,
                    kind: PromptKind::Decision { error: error.to_owned(), options, labels },
                    simulated: false,
                };
                let prompt = self.journal.ask(question)?;
                let patient = StepContext { limit: None, ..at.clone() };
                loop {
                    if let super::prompting::Received::Answer(answer, by) = self.receive(&prompt, &patient)? {
                        self.journal.answered(&prompt, &answer, &by)?;
                        if let Answer::Decision { decision } = answer {
                            return Ok(decision);
                        }
                    }
                }
            }
        }
    }
}
