//! `plumb answer`: answers the prompt of a run that goes on in another terminal.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use plumb_cell::answers::level_readings;
use plumb_cell::device::{CellResources, Occupancy};
use plumb_cell::event::NamedValue;
use plumb_cell::prompt::{Answer, Decision, Prompt, PromptKind, SIMULATED_OPERATOR};
use plumb_record::{Record, RunFilter, RunId, RunState, RunSummary, record_option};

use crate::commands::run::prepare::operator;
use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;

/// Answer the prompt of a run that goes on in another terminal, or show it when no answer is given. The first valid answer counts.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The run, where more than one goes on, and the answer: `done`, the key of a choice, a number, joints as in `shoulder=45,elbow=-70`,
    /// `confirm`; or, of a step that failed, `retry`, `move`, `back`, `skip`, `abort`. In a simulated cell `simulate` leaves this and everything like it to the program.
    #[arg(value_name = "[RUN] ANSWER", num_args = 0..=2, allow_negative_numbers = true)]
    words: Vec<String>,
    /// Which prompt is meant, by its number or its step: when another one is open by now, the answer is refused. `plumb answer` alone shows both.
    #[arg(long, value_name = "NUMBER|STEP")]
    prompt: Option<String>,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Who answers, for the record; your login name if left out.
    #[arg(long, value_name = "NAME")]
    operator: Option<String>,
}

/// How long a run may take to say what becomes of an answer. One that moves the arm first takes its time.
const HEARD_WITHIN: Duration = Duration::from_secs(60);

/// How often the record is looked at meanwhile.
const LOOK: Duration = Duration::from_millis(30);

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum AnswerError {
    #[error("no run goes on in {0}: `plumb run CELL` in another terminal starts one")]
    NothingRuns(String),
    #[error("several runs go on ({0}): say which, as in `plumb answer {1} done{2}`")]
    Several(String, i64, String),
    #[error("`{0}` is no number of a run; write `plumb answer RUN ANSWER`")]
    NoRun(String),
    #[error("run {0} has ended; nothing waits for an answer")]
    Ended(i64),
    #[error("the program that ran run {0} has gone: `plumb run --resume {0}{1}` goes on with it")]
    Killed(i64, String),
    #[error("run {0} asks nothing now")]
    NothingAsked(i64),
    #[error(
        "prompt `{meant}` is not open: run {run} asks at {step} now (prompt {open}), and was given no answer"
    )]
    AnotherPrompt { meant: String, run: i64, step: String, open: i64 },
    #[error("`{given}` is no answer to `{title}`: {right}")]
    WrongKind { given: String, title: String, right: String },
    #[error("the answer was not taken: {0}")]
    Refused(String),
    #[error("somebody else has answered already: {0}")]
    Late(String),
    #[error("the question was withdrawn meanwhile; `plumb answer{0}` shows what is asked now")]
    Withdrawn(String),
    #[error("run {0} took no notice within {1} s: its program may have been killed; `plumb doctor` says")]
    Unheard(i64, u64),
}

/// Answers, and waits until the run has taken it.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let directory = record_directory(arguments.record.as_ref())?;
    let mut record = Record::open(&directory)?;
    let (run, answer) = match arguments.words.as_slice() {
        [] => (None, None),
        [answer] => (None, Some(answer)),
        [run, answer, ..] => {
            (Some(run.parse::<i64>().map_err(|_| AnswerError::NoRun(run.clone()))?), Some(answer))
        }
    };
    let run = match run {
        Some(run) => record.run(RunId(run))?,
        None => the_one_that_goes_on(&record)?
            .ok_or_else(|| AnswerError::NothingRuns(directory.display().to_string()))?,
    };
    if run.state != RunState::Running {
        return Err(AnswerError::Ended(run.run.0).into());
    }
    if !is_alive(&run) {
        return Err(AnswerError::Killed(run.run.0, record_option(&directory)).into());
    }
    let stored = record.open_prompt(run.run)?.ok_or(AnswerError::NothingAsked(run.run.0))?;
    let prompt: Prompt = serde_json::from_value(stored.description)?;
    if let Some(meant) = &arguments.prompt
        && !is_meant(meant, &prompt)
    {
        let step = prompt.step.to_string();
        let (meant, run) = (meant.clone(), run.run.0);
        return Err(AnswerError::AnotherPrompt { meant, run, step, open: prompt.id.0 }.into());
    }
    let Some(answer) = answer else {
        print_line!(
            "run {} asks at {} (prompt {}): {}\n{}",
            run.run,
            prompt.step,
            prompt.id.0,
            prompt.title,
            prompt.text
        )?;
        print_line!("answer with: plumb answer --prompt {} {}", prompt.id.0, ways_to_answer(&prompt.kind))?;
        if prompt.simulated {
            print_line!("         or: plumb answer --prompt {} {SIMULATE}   ({SIMULATES})", prompt.id.0)?;
        }
        return Ok(ExitCode::SUCCESS);
    };
    let meant = read(answer, &prompt).map_err(|right| AnswerError::WrongKind {
        given: answer.clone(),
        title: prompt.title.clone(),
        right,
    })?;
    let by = operator(arguments.operator.as_ref());
    let offer = record.offer_answer(prompt.id.0, &serde_json::to_value(&meant)?, &by)?;
    await_taken(&record, run.run, &prompt, offer, &meant)?;
    print_line!("run {}: {} is answered", run.run, prompt.step)?;
    Ok(ExitCode::SUCCESS)
}

/// Whether this prompt goes by that number or step.
fn is_meant(meant: &str, prompt: &Prompt) -> bool {
    meant == prompt.id.0.to_string() || meant == prompt.step.to_string()
}

/// The run that goes on, when it is the only one.
fn the_one_that_goes_on(record: &Record) -> Result<Option<RunSummary>, Box<dyn std::error::Error>> {
    let filter = RunFilter { state: Some("running".to_owned()), limit: 1000, ..RunFilter::default() };
    let mut going_on: Vec<RunSummary> = Vec::new();
    for run in record.find_runs(&filter)? {
        // Of one cell only the newest can go on: those before it were killed.
        if is_alive(&run) && going_on.iter().all(|newer| newer.cell_file != run.cell_file) {
            going_on.push(run);
        }
    }
    match going_on.as_slice() {
        [] => Ok(None),
        [run] => Ok(Some(run.clone())),
        [first, ..] => {
            let numbers: Vec<String> = going_on.iter().map(|run| run.run.to_string()).collect();
            Err(AnswerError::Several(numbers.join(", "), first.run.0, record_option(record.directory()))
                .into())
        }
    }
}

/// Whether a program runs the cell of a run now.
pub(crate) fn is_alive(run: &RunSummary) -> bool {
    let resources = CellResources::of_cell(Path::new(&run.cell_file));
    resources.is_ok_and(|resources| matches!(resources.state(), Occupancy::InUse(_)))
}

pub(crate) fn await_taken(
    record: &Record,
    run: RunId,
    prompt: &Prompt,
    offer: i64,
    meant: &Answer,
) -> Result<(), Box<dyn std::error::Error>> {
    let begin = Instant::now();
    while begin.elapsed() < HEARD_WITHIN {
        if let Some(reason) = record.why_refused(offer)? {
            return Err(AnswerError::Refused(reason).into());
        }
        let stored = record.prompts(run)?.into_iter().find(|stored| stored.id == prompt.id.0);
        if let Some(stored) = stored {
            if let Some(taken) = stored.answer {
                let is_simulated = *meant == Answer::Simulated && taken.by.starts_with(SIMULATED_OPERATOR);
                return match serde_json::from_value::<Answer>(taken.answer.clone()) {
                    _ if is_simulated => Ok(()),
                    Ok(answer) if answer == *meant => Ok(()),
                    _ => Err(AnswerError::Late(format!("{}, {}", taken.by, taken.answer)).into()),
                };
            }
            if stored.withdrawn.is_some() {
                return Err(AnswerError::Withdrawn(record_option(record.directory())).into());
            }
        }
        std::thread::sleep(LOOK);
    }
    Err(AnswerError::Unheard(run.0, HEARD_WITHIN.as_secs()).into())
}

/// What answers a prompt, as it is typed.
pub(crate) fn ways_to_answer(kind: &PromptKind) -> String {
    match kind {
        PromptKind::Acknowledge { .. } => "done".to_owned(),
        PromptKind::Choice { options, .. } => {
            let keys: Vec<&str> = options.iter().map(|option| option.key.as_str()).collect();
            keys.join(" | ")
        }
        PromptKind::Number { unit, minimum, maximum, .. } => {
            let range = match (minimum, maximum) {
                (Some(least), Some(most)) => format!(", {least} to {most}"),
                (Some(least), None) => format!(", at least {least}"),
                (None, Some(most)) => format!(", at most {most}"),
                (None, None) => String::new(),
            };
            format!("NUMBER   (in {}{range})", if unit.is_empty() { "no unit" } else { unit })
        }
        PromptKind::Text { longest } => format!("'A LINE OF TEXT'   (up to {longest} characters)"),
        PromptKind::Level { most } => {
            format!("'X Y'   (two readings of the level, deg, up to {most} to either side)")
        }
        PromptKind::Photo => "FILE   (the picture you took, PNG or JPEG)".to_owned(),
        PromptKind::JogTo { .. } => "done   (or where it is to go, as in shoulder=45,elbow=-70)".to_owned(),
        PromptKind::ConfirmPose { .. } => "confirm".to_owned(),
        PromptKind::Decision { options, labels, .. } => {
            let words: Vec<&str> = options.iter().map(|decision| decision.name()).collect();
            let meanings = words.iter().zip(labels).map(|(word, label)| format!("\n  {word:<6} {label}"));
            format!("{}{}", words.join(" | "), meanings.collect::<String>())
        }
    }
}

/// Leaves a prompt of a simulated cell, and every later one like it, to the program.
pub(crate) const SIMULATE: &str = "simulate";

/// What that does, in words.
pub(crate) const SIMULATES: &str =
    "leaves this and everything like it to the program, for the rest of the run";

/// What was typed, as an answer to this prompt.
pub(crate) fn read(text: &str, prompt: &Prompt) -> Result<Answer, String> {
    match text.trim() {
        SIMULATE if prompt.simulated => Ok(Answer::Simulated),
        text => read_for(text, &prompt.kind),
    }
}

fn read_for(text: &str, kind: &PromptKind) -> Result<Answer, String> {
    let right = || format!("write {}", ways_to_answer(kind));
    match kind {
        PromptKind::Acknowledge { .. } if text == "done" => Ok(Answer::Done),
        PromptKind::Choice { .. } => Ok(Answer::Choice { key: text.to_owned() }),
        PromptKind::Number { unit, .. } => {
            let number = text.strip_suffix(unit.as_str()).unwrap_or(text).trim();
            let value = number.parse::<f64>().ok().filter(|value| value.is_finite());
            value.map(|value| Answer::Number { value }).ok_or_else(right)
        }
        PromptKind::Text { .. } if text.is_empty() => Err(right()),
        PromptKind::Text { .. } => Ok(Answer::Text { text: text.to_owned() }),
        PromptKind::Level { .. } => {
            level_readings(text).map(|(x, y)| Answer::Level { x, y }).map_err(|_| right())
        }
        PromptKind::Photo if text.is_empty() => Err(right()),
        PromptKind::Photo => {
            // Anyone who runs the procedure may be in another directory.
            let file = std::path::absolute(text).map_err(|error| error.to_string())?;
            Ok(Answer::Photo { file: file.display().to_string() })
        }
        PromptKind::JogTo { .. } if text == "done" => Ok(Answer::Done),
        PromptKind::JogTo { joints, .. } => {
            let mut pose = Vec::new();
            for part in text.split(',') {
                let (name, value) = part.split_once('=').ok_or_else(right)?;
                let value =
                    value.trim().parse::<f64>().ok().filter(|value| value.is_finite()).ok_or_else(right)?;
                let known = joints.iter().find(|joint| joint.name == name.trim());
                let unit = known.map_or_else(|| "deg".to_owned(), |joint| joint.unit.clone());
                pose.push(NamedValue { name: name.trim().to_owned(), value, unit, uncertainty: None });
            }
            Ok(Answer::Pose { joints: pose })
        }
        PromptKind::ConfirmPose { .. } if text == "confirm" => Ok(Answer::Confirmed),
        PromptKind::Decision { .. } => match text {
            "retry" => Ok(Answer::Decision { decision: Decision::Retry }),
            "move" => Ok(Answer::Decision { decision: Decision::Move }),
            "back" => Ok(Answer::Decision { decision: Decision::Back }),
            "skip" => Ok(Answer::Decision { decision: Decision::Skip }),
            "abort" => Ok(Answer::Decision { decision: Decision::Abort }),
            _ => Err(right()),
        },
        PromptKind::Acknowledge { .. } | PromptKind::ConfirmPose { .. } => Err(right()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number() -> PromptKind {
        PromptKind::Number {
            unit: "mm".to_owned(),
            minimum: Some(2.0),
            maximum: None,
            default: None,
            decimals: None,
        }
    }

    #[test]
    fn a_number_may_carry_the_prompts_unit() {
        assert_eq!(read_for("8.02", &number()), Ok(Answer::Number { value: 8.02 }));
        assert_eq!(read_for("8.02 mm", &number()), Ok(Answer::Number { value: 8.02 }));
        assert_eq!(read_for("8.02 in", &number()), Err("write NUMBER   (in mm, at least 2)".to_owned()));
    }

    #[test]
    fn a_pose_is_read_joint_by_joint() {
        let joint = |name: &str, unit: &str| NamedValue {
            name: name.into(),
            value: 0.0,
            unit: unit.into(),
            uncertainty: None,
        };
        let kind = PromptKind::JogTo {
            device: "arm".into(),
            goals: Vec::new(),
            hand_over: false,
            joint: None,
            sensor: None,
            joints: vec![joint("shoulder", "deg"), joint("gripper", "mm")],
        };
        let Ok(Answer::Pose { joints }) = read_for("shoulder=45, gripper=-1.5", &kind) else {
            panic!("a pose")
        };
        assert_eq!(
            (joints[1].name.as_str(), joints[1].value, joints[1].unit.as_str()),
            ("gripper", -1.5, "mm")
        );
        assert!(read_for("shoulder 45", &kind).is_err());
    }
}
