//! `plumb trial rehearse`: trials in a cell from the first run to the last, unattended: built, measured by the cell's own sensors, diagnosed, measured
//! further where the lab asks for poses that would show what is tied or not shown, mended by what it ranks first, and held against the truth and against the same
//! arm with nothing hidden. Every step is the command a person would give.

mod arguments;
mod bench;
mod light_stripe;
mod puma;
mod report;
mod teachmover;

use std::collections::BTreeMap;
use std::io::{self, IsTerminal as _, Write as _};

use serde::Serialize;
use serde_json::Value;

use crate::commands::trial::cell;
use crate::commands::trial::error::TrialError;
use crate::commands::trial::outcome::Outcome;
pub(crate) use arguments::RehearsalArguments;
use bench::Bench;

/// What became of one trial.
#[derive(Debug, Clone, Serialize)]
struct Trial {
    fault: String,
    seed: u64,
    /// What was hidden: effect, site, size with its unit; empty where nobody opened the seal.
    hidden: String,
    #[serde(flatten)]
    end: End,
}

/// How a trial ended.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "snake_case")]
enum End {
    /// What was hidden never happened in the runs: there was nothing to be found.
    NotScored(String),
    /// A command failed, and what it said.
    Failed(String),
    /// It was scored.
    #[serde(untagged)]
    Scored(Rehearsal),
}

/// How one trial went.
#[derive(Debug, Clone, Serialize)]
struct Rehearsal {
    /// The verdict on the first measurement, where poses were taken that the lab asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    at_first: Option<String>,
    verdict: String,
    /// What was ranked first and added; empty where nothing was.
    added: String,
    right: bool,
    /// Nothing was found, and what is hidden is among what the lab says these rows could not show.
    #[serde(rename = "told_not_shown")]
    reported_not_shown: bool,
    sentence: String,
    /// True error of the hand over fresh points, mm RMS: before anything was known, after what was added, and of the same arm with nothing hidden.
    before_mm: f64,
    after_mm: f64,
    floor_mm: f64,
    /// Of lost steps: after they were lost again, and after the zeros were found anew.
    #[serde(skip_serializing_if = "Option::is_none")]
    lost_again_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    anew_mm: Option<f64>,
}

impl Rehearsal {
    /// What is left over the floor once everything was done that the lab asked for.
    fn over_floor(&self) -> f64 {
        self.anew_mm.unwrap_or(self.after_mm) / self.floor_mm
    }

    /// The verdict; before it, the one that led to further poses.
    fn verdicts(&self) -> String {
        match &self.at_first {
            Some(first) => format!("{first}, {}", self.verdict),
            None => self.verdict.clone(),
        }
    }
}

/// Rehearses, prints. A trial that fails is reported with its seed and its reason, and the others go on.
pub(super) fn run(arguments: &RehearsalArguments) -> Result<Outcome, TrialError> {
    let known = cell::find(&arguments.cell)?;
    let all: Vec<String> = known.faults.iter().map(|fault| (*fault).to_owned()).collect();
    let faults: &[String] = if arguments.fault.is_empty() { &all } else { &arguments.fault };
    for fault in faults {
        cell::check(known, fault)?;
    }
    let mut floors: BTreeMap<u64, Result<f64, String>> = BTreeMap::new();
    let mut done = Vec::new();
    for fault in faults {
        for seed in (0..arguments.seeds).map(|number| arguments.seed.wrapping_add(number)) {
            let floor = floors.entry(seed).or_insert_with(|| {
                show_progress(&format!("seed {seed}, nothing hidden"));
                let bench = Bench::new(arguments, "floor", "none", seed);
                bench.and_then(|bench| floor(arguments, &bench)).map_err(|error| error.to_string())
            });
            show_progress(&format!("seed {seed}, {fault}"));
            done.push(trial(arguments, fault, seed, floor));
        }
    }
    show_progress("");
    let message = match arguments.json {
        true => format!("{:#}\n", serde_json::to_value(&done).unwrap_or_default()),
        false => report::table(&done),
    };
    let failed = done.iter().any(|one| matches!(one.end, End::Failed(_)));
    let right = done.iter().all(|one| !matches!(&one.end, End::Scored(scored) if !scored.right));
    Ok(Outcome { message, right, failed })
}

/// One trial, whatever becomes of it.
fn trial(arguments: &RehearsalArguments, fault: &str, seed: u64, floor: &Result<f64, String>) -> Trial {
    let ended = |end: End, hidden: String| Trial { fault: fault.to_owned(), seed, hidden, end };
    let floor_mm = match floor {
        Ok(floor_mm) => *floor_mm,
        Err(reason) => {
            return ended(End::Failed(format!("the same arm with nothing hidden: {reason}")), String::new());
        }
    };
    let bench = match Bench::new(arguments, fault, fault, seed) {
        Ok(bench) => bench,
        Err(error) => return ended(End::Failed(error.to_string()), String::new()),
    };
    let hidden = bench.hidden().unwrap_or_default();
    let gone_through = match arguments.cell.as_str() {
        LIGHT_STRIPE => light_stripe::rehearse(&bench, floor_mm),
        PUMA => puma::rehearse(&bench, floor_mm),
        _ => teachmover::rehearse(&bench, floor_mm),
    };
    match gone_through {
        Ok(end) => ended(end, hidden),
        Err(error) => ended(End::Failed(error.to_string()), hidden),
    }
}

const LIGHT_STRIPE: &str = "light-stripe";
const PUMA: &str = "puma";

/// The true error of the same arm with nothing hidden, treated alike.
fn floor(arguments: &RehearsalArguments, bench: &Bench) -> Result<f64, TrialError> {
    match arguments.cell.as_str() {
        LIGHT_STRIPE => light_stripe::floor(bench),
        PUMA => puma::floor(bench),
        _ => teachmover::floor(bench),
    }
}

/// What is being done, on a terminal's last line.
fn show_progress(what: &str) {
    let mut errors = io::stderr();
    if errors.is_terminal() {
        let _ = write!(errors, "\r\x1b[K{what}");
    }
}

fn word(diagnosis: &Value, key: &str) -> String {
    diagnosis.get(key).and_then(Value::as_str).unwrap_or_default().to_owned()
}
