//! `plumb trial rehearse`: trials in a cell from the first run to the last, unattended: built, measured by the cell's own sensor, diagnosed, measured
//! further where the lab asks for poses that would tell what is tied, mended by what it ranks first, and held against the truth and against the same arm with nothing hidden. Every step is the command a person would give.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, IsTerminal as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::Serialize;
use serde_json::Value;

use super::{Outcome, TrialError, cell};

/// Options of `plumb trial rehearse`.
#[derive(Debug, clap::Args)]
pub(crate) struct RehearsalArguments {
    /// Which cell: `teachmover`.
    #[arg(long, value_name = "CELL")]
    cell: String,
    /// What to hide: none, spot, backlash, coupling, droop or lost_steps; one after the other when not given.
    #[arg(long, value_name = "FAULT")]
    fault: Vec<String>,
    /// The first trial's seed.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,
    /// How many seeds of each.
    #[arg(short = 'n', long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Print JSON, an object a trial.
    #[arg(long)]
    json: bool,
    /// Keep the trials' directories there.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

/// How one trial went.
#[derive(Debug, Clone, Serialize)]
struct Rehearsal {
    fault: String,
    seed: u64,
    /// What was hidden: effect, place, size with its unit.
    hidden: String,
    /// The verdict on the first measurement, where poses were taken that the lab asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    at_first: Option<String>,
    verdict: String,
    /// What was ranked first and added; empty where nothing was.
    added: String,
    right: bool,
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

/// Rehearses, prints.
pub(super) fn run(arguments: &RehearsalArguments) -> Result<Outcome, TrialError> {
    let all = cell::FAULTS.map(str::to_owned);
    let faults: &[String] = if arguments.fault.is_empty() { &all } else { &arguments.fault };
    let mut floors = BTreeMap::new();
    let mut done = Vec::new();
    for fault in faults {
        for seed in (0..arguments.seeds).map(|number| arguments.seed.wrapping_add(number)) {
            let floor_mm = match floors.get(&seed) {
                Some(floor_mm) => *floor_mm,
                None => {
                    tell(&format!("seed {seed}, nothing hidden"));
                    let floor_mm = Bench::new(arguments, "floor", "none", seed)?.floor()?;
                    floors.insert(seed, floor_mm);
                    floor_mm
                }
            };
            tell(&format!("seed {seed}, {fault}"));
            done.push(Bench::new(arguments, fault, fault, seed)?.rehearse(floor_mm)?);
        }
    }
    tell("");
    let said = match arguments.json {
        true => format!("{:#}\n", serde_json::to_value(&done).unwrap_or_default()),
        false => table(&done),
    };
    Ok(Outcome { said, right: done.iter().all(|one| one.right) })
}

/// What is being done, on a terminal's last line.
fn tell(what: &str) {
    let mut errors = io::stderr();
    if errors.is_terminal() {
        let _ = write!(errors, "\r\x1b[K{what}");
    }
}

fn table(done: &[Rehearsal]) -> String {
    let mut text = format!(
        "{:<10} {:>4}  {:<44} {:<14} {:<34} {:>6} {:>6} {:>6} {:>7}\n",
        "fault", "seed", "hidden", "verdict", "added", "before", "after", "floor", "ratio"
    );
    for one in done {
        let wrong = if one.right { "" } else { "  WRONG" };
        text.push_str(&format!(
            "{:<10} {:>4}  {:<44} {:<14} {:<34} {:>6.2} {:>6.2} {:>6.2} {:>7.2}{wrong}\n",
            one.fault,
            one.seed,
            one.hidden,
            one.verdicts(),
            one.added,
            one.lost_again_mm.unwrap_or(one.before_mm),
            one.anew_mm.unwrap_or(one.after_mm),
            one.floor_mm,
            one.over_floor(),
        ));
    }
    let right = done.iter().filter(|one| one.right).count();
    let near = done.iter().filter(|one| one.over_floor() <= NEAR).count();
    text.push_str(&format!(
        "{right} of {0} verdicts right; the true error at most {NEAR} times the floor in {near} of {0}\n",
        done.len()
    ));
    text.push_str(
        "mm RMS over 50 fresh points; of lost steps, before: lost again at full speed, after: zeros found anew after that\n",
    );
    text
}

fn word(diagnosis: &Value, key: &str) -> String {
    diagnosis.get(key).and_then(Value::as_str).unwrap_or_default().to_owned()
}

/// Whether the lab says that other poses would tell more.
fn is_undecided(verdict: &str) -> bool {
    ["tied", "located"].contains(&verdict)
}

/// What has been measured, in a trial's directory.
const TABLE: &str = "table.csv";

/// How many poses the lab is asked for, beside the two it returns to.
const POSES_ASKED: &str = "12";

/// What the hand can be given to carry, kg: two thirds of what this arm lifts.
const LOAD_KG: f64 = 0.3;

/// Times the floor within which an error counts as gone.
const NEAR: f64 = 1.3;

/// One trial's directory, and the record of its runs.
struct Bench {
    directory: PathBuf,
    fault: String,
    seed: u64,
    /// Where nobody keeps it, it goes when this does.
    _passing: Option<Passing>,
}

/// A directory that is removed in the end.
struct Passing(PathBuf);

impl Drop for Passing {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

impl Bench {
    /// `called` begins the directory's name: nothing hidden may be a trial of its own and the floor of the others.
    fn new(arguments: &RehearsalArguments, called: &str, fault: &str, seed: u64) -> Result<Self, TrialError> {
        let name = format!("{called}-{seed}");
        let (directory, passing) = match &arguments.output {
            Some(folder) => (folder.join(name), None),
            None => {
                let place =
                    std::env::temp_dir().join(format!("plumb-rehearsal-{}-{name}", std::process::id()));
                (place.clone(), Some(Passing(place)))
            }
        };
        let failed = |source: io::Error| TrialError::Write { path: directory.clone(), source };
        fs::create_dir_all(&directory).map_err(failed)?;
        let directory = fs::canonicalize(&directory).map_err(failed)?;
        let bench = Self { directory, fault: fault.to_owned(), seed, _passing: passing };
        let seed = seed.to_string();
        bench.plumb(&[
            "trial",
            "new",
            "--cell",
            &arguments.cell,
            "--fault",
            fault,
            "--seed",
            &seed,
            "-o",
            "cell",
        ])?;
        bench.run("find-zeros", &[])?;
        Ok(bench)
    }

    /// Gives a command, in the trial's directory and with a record of its own.
    fn plumb(&self, arguments: &[&str]) -> Result<String, TrialError> {
        let failed = |cause: String| TrialError::Rehearsal { command: arguments.join(" "), cause };
        let program = std::env::current_exe().map_err(|error| failed(error.to_string()))?;
        let output = Command::new(program)
            .args(arguments)
            .current_dir(&self.directory)
            .env("XDG_STATE_HOME", self.directory.join("record"))
            .stdin(Stdio::null())
            .output()
            .map_err(|error| failed(error.to_string()))?;
        if !output.status.success() {
            let said = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
            let mut last = said.iter().flat_map(|text| text.lines()).filter(|line| !line.trim().is_empty());
            return Err(failed(last.next_back().unwrap_or("it does not say why").to_owned()));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }

    fn run(&self, procedure: &str, settings: &[&str]) -> Result<String, TrialError> {
        let mut arguments = vec!["run", "cell/cell.yaml", procedure, "--headless"];
        arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
        self.plumb(&arguments)
    }

    fn json(&self, arguments: &[&str]) -> Result<Value, TrialError> {
        let said = self.plumb(arguments)?;
        let command = arguments.join(" ");
        serde_json::from_str(&said)
            .map_err(|error| TrialError::Rehearsal { command, cause: format!("it prints no JSON: {error}") })
    }

    fn lab(&self, command: &str, more: &[&str]) -> Result<Value, TrialError> {
        let mut arguments = vec!["model", command, "cell/trial.model.yaml"];
        arguments.extend(more);
        arguments.extend(["--data", TABLE, "--json"]);
        self.json(&arguments)
    }

    /// Measures by the sensor in the hand: the number of the run.
    fn measure(&self) -> Result<String, TrialError> {
        self.run("measure-by-triggers", &[])?;
        let run = self.last_run()?;
        self.tabulate(&[&run])?;
        Ok(run)
    }

    /// Takes the poses that the lab says would tell apart what is tied, some under load, beside what a run has measured.
    fn measure_further(&self, measured: &str) -> Result<(), TrialError> {
        let loads = format!("0,{LOAD_KG}");
        let model = "cell/trial.model.yaml";
        let asked =
            ["model", "next", model, "--data", TABLE, "-n", POSES_ASKED, "--payload", &loads, "--csv"];
        self.write(&format!("cell/{}", cell::POSES), &self.plumb(&asked)?)?;
        self.run("measure-poses", &[])?;
        self.tabulate(&[measured, &self.last_run()?])
    }

    /// Makes a measurement table of what runs have measured.
    fn tabulate(&self, runs: &[&str]) -> Result<(), TrialError> {
        self.write(TABLE, &self.plumb(&[&["show"], runs, &["--table"]].concat())?)
    }

    fn write(&self, name: &str, text: &str) -> Result<(), TrialError> {
        let path = self.directory.join(name);
        fs::write(&path, text).map_err(|source| TrialError::Write { path, source })
    }

    fn last_run(&self) -> Result<String, TrialError> {
        let shown = self.json(&["show", "--json"])?;
        let number = shown.pointer("/run/run").and_then(Value::as_i64);
        number.map(|number| number.to_string()).ok_or_else(|| TrialError::Rehearsal {
            command: "show --json".to_owned(),
            cause: "the run has no number".to_owned(),
        })
    }

    /// The true error of the hand over fresh points, mm RMS.
    fn true_error(&self, settings: &[&str]) -> Result<f64, TrialError> {
        self.run("verify-by-points", settings)?;
        let shown = self.json(&["show", "--json"])?;
        let steps = shown.get("steps").and_then(Value::as_array).map_or(&[] as &[Value], Vec::as_slice);
        let error = steps.iter().find(|step| step.get("step").and_then(Value::as_str) == Some("error"));
        let rms = error.and_then(|step| step.pointer("/result/rms_mm")).and_then(Value::as_f64);
        rms.ok_or_else(|| TrialError::Rehearsal {
            command: "show --json".to_owned(),
            cause: "the run tells no error".to_owned(),
        })
    }

    /// Its own error once the zeros were fitted: the floor, if nothing is hidden.
    fn floor(&self) -> Result<f64, TrialError> {
        self.measure()?;
        self.lab("accept", &[])?;
        self.true_error(&[])
    }

    fn rehearse(&self, floor_mm: f64) -> Result<Rehearsal, TrialError> {
        let before_mm = self.true_error(&[])?;
        let run = self.measure()?;
        let mut diagnosis = self.lab("diagnose", &[])?;
        let at_first = Some(word(&diagnosis, "verdict")).filter(|verdict| is_undecided(verdict));
        if at_first.is_some() {
            self.measure_further(&run)?;
            diagnosis = self.lab("diagnose", &[])?;
        }
        let (verdict, sentence) = (word(&diagnosis, "verdict"), word(&diagnosis, "sentence"));
        let first = diagnosis.pointer("/candidates/0/label").and_then(Value::as_str).unwrap_or_default();
        let found = ["named", "located", "tied"].contains(&verdict.as_str()) && !first.is_empty();
        let added = if found { first.to_owned() } else { String::new() };
        match found {
            true => self.lab("add", &[&added])?,
            false => self.lab("accept", &[])?,
        };
        let after_mm = self.true_error(&[])?;
        let lost = added.starts_with("joint_step");
        let lost_again_mm = if lost { Some(self.true_error(&["hurry=1"])?) } else { None };
        let anew_mm = if lost { Some(self.true_error(&["hurry=1", "anew=1"])?) } else { None };
        let (hidden, right) = self.score(&diagnosis)?;
        let (fault, seed) = (self.fault.clone(), self.seed);
        Ok(Rehearsal {
            fault,
            seed,
            hidden,
            at_first,
            verdict,
            added,
            right,
            sentence,
            before_mm,
            after_mm,
            floor_mm,
            lost_again_mm,
            anew_mm,
        })
    }

    /// Opens the seal: what was hidden, and whether the diagnosis is right.
    fn score(&self, diagnosis: &Value) -> Result<(String, bool), TrialError> {
        let read = serde_json::from_value(diagnosis.clone()).map_err(|source| TrialError::Diagnosis {
            path: Path::new("plumb model diagnose").to_owned(),
            source,
        })?;
        let truth = cell::open(&self.directory.join("cell"))?;
        let hidden = truth.hidden.first().map_or_else(
            || "nothing".to_owned(),
            |hidden| match hidden.size != 0.0 {
                true => format!("{}({}) {:.3e} {}", hidden.effect, hidden.place, hidden.size, hidden.unit),
                false => format!("{}({})", hidden.effect, hidden.place),
            },
        );
        Ok((hidden, super::score::Score::of(&read, &truth).right))
    }
}
