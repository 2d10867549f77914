//! Whether answers fit a procedure, and which are missing.

use super::{AnswerEntry, AnswerSpans, Answers, Given, WrittenAnswer, level_readings};
use crate::answer_bounds::{check_level, check_number, check_text};
use crate::expression::Expression;
use crate::named_value::NamedValue;
use crate::procedure::Procedure;
use crate::step::{Inside, PromptQuestion, Step, StepQuestion};
use crate::workcell::RobotSetting;
use plumb_document::{Problems, Span, did_you_mean};

/// A prompt a procedure may ask.
struct Asked<'a> {
    /// As answers name it.
    name: String,
    kind: StepQuestion<'a>,
    /// It may be left out, so that its answer may be missing.
    optional: bool,
}

/// Checks that every answer belongs to a prompt of one of the procedures and is one that it takes. `robots` are those of the procedures' cell.
pub(super) fn check_answers(
    answers: &Answers,
    procedures: &[&Procedure],
    robots: &[RobotSetting],
    problems: &Problems,
) {
    let asked: Vec<Asked<'_>> = procedures.iter().flat_map(|procedure| asked_by(procedure)).collect();
    for entry in &answers.entries {
        let prompts = asked.iter().filter(|asked| asked.name == entry.step);
        // Two procedures may ask for different things in steps of one name: the one that is meant is that which the answers fit best.
        match prompts.map(|asked| mistakes(entry, asked, robots)).min_by_key(Vec::len) {
            Some(found) => {
                found.into_iter().for_each(|(span, message, help)| problems.add(span, message, help))
            }
            None => {
                let help =
                    did_you_mean(&entry.step, each_once(asked.iter().map(|asked| asked.name.as_str())));
                problems.add(entry.span, format!("nothing is asked in a step `{}`", entry.step), help);
            }
        }
    }
    let steps: Vec<String> = procedures.iter().flat_map(|procedure| all_steps(procedure)).collect();
    for (step, _, span) in &answers.on_error {
        if !steps.contains(step) {
            let help = did_you_mean(step, each_once(steps.iter().map(String::as_str)));
            problems.add(*span, format!("there is no step `{step}`"), help);
        }
    }
}

/// Names in their order, none twice: procedures of a cell often have steps of the same name.
fn each_once<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut once: Vec<&str> = Vec::new();
    for name in names {
        if !once.contains(&name) {
            once.push(name);
        }
    }
    once
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

/// A mistake: where it is, what it is, and what would be right.
type Mistake = (Span, String, String);

/// What is wrong with the answers to one prompt, each where it is.
fn mistakes(entry: &AnswerEntry, asked: &Asked<'_>, robots: &[RobotSetting]) -> Vec<Mistake> {
    let given: &[WrittenAnswer] = match &entry.given {
        Given::Always(answer) => std::slice::from_ref(answer),
        Given::InTurn(answers) => answers,
    };
    let of_answer = |(answer, spans): (&WrittenAnswer, &AnswerSpans)| match fits(answer, &asked.kind) {
        Err(help) => {
            vec![(spans.whole, format!("this is no answer to the prompt of step `{}`", entry.step), help)]
        }
        Ok(()) => wrong_joints(answer, spans, &asked.kind, robots),
    };
    given.iter().zip(&entry.spans).flat_map(of_answer).collect()
}

/// The joints of a pose that the robot has not, or not in that unit.
fn wrong_joints(
    answer: &WrittenAnswer,
    spans: &AnswerSpans,
    kind: &StepQuestion<'_>,
    robots: &[RobotSetting],
) -> Vec<Mistake> {
    let StepQuestion::Prompt(PromptQuestion::JogTo { robot, .. }) = kind else { return Vec::new() };
    let (Some(robot), WrittenAnswer::Pose(joints)) =
        (robots.iter().find(|known| known.device == *robot), answer)
    else {
        return Vec::new();
    };
    let wrong = |(joint, span): (&NamedValue, &Span)| match robot.unit(&joint.name) {
        None => {
            let help = did_you_mean(&joint.name, robot.joints.iter().map(|(name, _)| name.as_str()));
            Some((*span, format!("robot `{}` has no joint `{}`", robot.device, joint.name), help))
        }
        Some(unit) if unit.symbol() != joint.unit => {
            let message = format!("joint `{}` goes by {}", joint.name, unit.symbol());
            Some((*span, message, format!("write it under `pose_{}`", unit.symbol())))
        }
        Some(_) => None,
    };
    joints.iter().zip(&spans.joints).filter_map(wrong).collect()
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
            (PromptQuestion::Number { unit, minimum, maximum, .. }, WrittenAnswer::Number(value)) => {
                check_number(*value, unit, written_bound(minimum.as_ref()), written_bound(maximum.as_ref()))
            }
            (PromptQuestion::Number { .. }, WrittenAnswer::Word(word)) if word == "offered" => Ok(()),
            (PromptQuestion::Number { .. }, _) => {
                Err("write a number, or `offered` for the one the prompt offers".to_owned())
            }
            (PromptQuestion::Text { longest }, WrittenAnswer::Word(text)) => check_text(text, *longest),
            (PromptQuestion::Text { .. }, WrittenAnswer::Number(_)) => Ok(()),
            (PromptQuestion::Text { .. }, _) => Err("write a line of text".to_owned()),
            (PromptQuestion::Level { most }, WrittenAnswer::Word(readings)) => {
                level_readings(readings).and_then(|(x, y)| check_level(x, y, *most))
            }
            (PromptQuestion::Level { .. }, _) => level_readings("").map(drop),
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

/// A bound that is written as a number; others are known in the run.
fn written_bound(bound: Option<&Expression>) -> Option<f64> {
    bound?.text().trim().parse().ok()
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
