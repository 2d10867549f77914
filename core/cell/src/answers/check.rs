//! Whether answers fit a procedure, and which are missing.

use super::{AnswerEntry, Answers, Given, WrittenAnswer};
use crate::procedure::Procedure;
use crate::step::{Inside, PromptQuestion, Step, StepQuestion};
use plumb_document::{Problems, did_you_mean};

/// A prompt a procedure may ask.
struct Asked<'a> {
    /// As answers name it.
    name: String,
    kind: StepQuestion<'a>,
    /// It may be left out, so that its answer may be missing.
    optional: bool,
}

/// Checks that every answer belongs to a prompt of one of the procedures and is of its kind.
pub(super) fn check_answers(answers: &Answers, procedures: &[&Procedure], problems: &Problems) {
    let asked: Vec<Asked<'_>> = procedures.iter().flat_map(|procedure| asked_by(procedure)).collect();
    for entry in &answers.entries {
        let prompts = asked.iter().filter(|asked| asked.name == entry.step);
        match prompts.map(|asked| check_entry(entry, asked)).min_by_key(Result::is_err) {
            Some(Ok(())) => {}
            Some(Err(help)) => {
                let message = format!("this is no answer to the prompt of step `{}`", entry.step);
                problems.add(entry.place, message, help);
            }
            None => {
                let help = did_you_mean(&entry.step, asked.iter().map(|asked| asked.name.as_str()));
                problems.add(entry.place, format!("nothing is asked in a step `{}`", entry.step), help);
            }
        }
    }
    let steps: Vec<String> = procedures.iter().flat_map(|procedure| all_steps(procedure)).collect();
    for (step, _, place) in &answers.on_error {
        if !steps.contains(step) {
            let help = did_you_mean(step, steps.iter().map(String::as_str));
            problems.add(*place, format!("there is no step `{step}`"), help);
        }
    }
}

/// The steps whose prompts have no answer and are sure to be asked.
pub fn missing_answers(answers: Option<&Answers>, procedure: &Procedure) -> Vec<String> {
    let has =
        |name: &str| answers.is_some_and(|answers| answers.entries.iter().any(|entry| entry.step == name));
    asked_by(procedure)
        .into_iter()
        .filter(|asked| !asked.optional && !has(&asked.name))
        .map(|asked| asked.name)
        .collect()
}

fn check_entry(entry: &AnswerEntry, asked: &Asked<'_>) -> Result<(), String> {
    let given: &[WrittenAnswer] = match &entry.given {
        Given::Always(answer) => std::slice::from_ref(answer),
        Given::InTurn(answers) => answers,
    };
    given.iter().try_for_each(|answer| fits(answer, &asked.kind))
}

fn fits(answer: &WrittenAnswer, kind: &StepQuestion<'_>) -> Result<(), String> {
    let word_of = |word: &str, keys: &[&str]| match keys.contains(&word) {
        true => Ok(()),
        false => Err(did_you_mean(word, keys.iter().copied())),
    };
    match (kind, answer) {
        (StepQuestion::Acceptance, WrittenAnswer::Word(word)) => word_of(word, &["accept", "reject"]),
        (StepQuestion::Acceptance, _) => Err("write `accept` or `reject`".to_owned()),
        (StepQuestion::Prompt(question), answer) => match (question, answer) {
            (PromptQuestion::Acknowledge { .. }, WrittenAnswer::Word(word)) => word_of(word, &["done"]),
            (PromptQuestion::Acknowledge { .. }, _) => Err("write `done`".to_owned()),
            (PromptQuestion::Choice { options, .. }, WrittenAnswer::Word(word)) => {
                let keys: Vec<&str> = options.iter().map(|option| option.key.as_str()).collect();
                word_of(word, &keys)
            }
            (PromptQuestion::Choice { .. }, _) => Err("write the key of one of its options".to_owned()),
            (PromptQuestion::Number { .. }, WrittenAnswer::Number(_)) => Ok(()),
            (PromptQuestion::Number { .. }, WrittenAnswer::Word(word)) if word == "offered" => Ok(()),
            (PromptQuestion::Number { .. }, _) => {
                Err("write a number, or `offered` for the one the prompt offers".to_owned())
            }
            (PromptQuestion::Text { .. }, WrittenAnswer::Word(_) | WrittenAnswer::Number(_)) => Ok(()),
            (PromptQuestion::Text { .. }, _) => Err("write a line of text".to_owned()),
            (PromptQuestion::Level { .. }, WrittenAnswer::Word(readings)) => {
                super::level_readings(readings).map(drop)
            }
            (PromptQuestion::Level { .. }, _) => super::level_readings("").map(drop),
            (PromptQuestion::Photo, WrittenAnswer::Word(_)) => Ok(()),
            (PromptQuestion::Photo, _) => Err("write the path of a PNG or JPEG file".to_owned()),
            (PromptQuestion::JogTo { .. }, WrittenAnswer::Pose(_)) => Ok(()),
            (PromptQuestion::JogTo { .. }, WrittenAnswer::Word(word)) => word_of(word, &["done"]),
            (PromptQuestion::JogTo { .. }, _) => {
                Err("write a pose, as in `{pose_deg: {shoulder: 45}}`".to_owned())
            }
        },
    }
}

fn asked_by(procedure: &Procedure) -> Vec<Asked<'_>> {
    let mut asked = Vec::new();
    collect(procedure, &procedure.steps, "", false, &mut asked);
    asked
}

fn collect<'a>(
    procedure: &'a Procedure,
    steps: &'a [Step],
    prefix: &str,
    optional: bool,
    asked: &mut Vec<Asked<'a>>,
) {
    for step in steps {
        let name = format!("{prefix}{}", step.id);
        let optional = optional || step.when.is_some();
        if let Some(question) = step.action.question() {
            asked.push(Asked { name: name.clone(), kind: question, optional });
        }
        match step.action.inside() {
            Inside::Repeated { steps, .. } => collect(procedure, steps, prefix, optional, asked),
            Inside::Called { file, .. } => {
                if let Some(called) = procedure.called(file) {
                    collect(called, &called.steps, &format!("{name}."), optional, asked);
                }
            }
            Inside::Nothing => {}
        }
    }
}

fn all_steps(procedure: &Procedure) -> Vec<String> {
    let mut names = Vec::new();
    collect_names(procedure, &procedure.steps, "", &mut names);
    names
}

fn collect_names(procedure: &Procedure, steps: &[Step], prefix: &str, names: &mut Vec<String>) {
    for step in steps {
        let name = format!("{prefix}{}", step.id);
        match step.action.inside() {
            Inside::Repeated { steps, .. } => collect_names(procedure, steps, prefix, names),
            Inside::Called { file, .. } => {
                if let Some(called) = procedure.called(file) {
                    collect_names(called, &called.steps, &format!("{name}."), names);
                }
            }
            Inside::Nothing => {}
        }
        names.push(name);
    }
}
