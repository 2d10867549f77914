//! One trial's directory, and the commands that are given in it.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

use super::arguments::RehearsalArguments;
use crate::commands::trial::cell;
use crate::commands::trial::error::TrialError;
use crate::commands::trial::score::{Diagnosis, Score};
use crate::commands::trial::shown::shown_size;

/// One trial's directory, and the record of its runs.
pub(super) struct Bench {
    pub(super) directory: PathBuf,
    pub(super) fault: String,
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
    pub(super) fn new(
        arguments: &RehearsalArguments,
        called: &str,
        fault: &str,
        seed: u64,
    ) -> Result<Self, TrialError> {
        let name = format!("{}-{seed}", called.replace('(', "-").replace([')', ' '], ""));
        let (directory, passing) = match &arguments.output {
            Some(folder) => (folder.join(name), None),
            None => {
                let folder =
                    std::env::temp_dir().join(format!("plumb-rehearsal-{}-{name}", std::process::id()));
                (folder.clone(), Some(Passing(folder)))
            }
        };
        let failed = |source: io::Error| TrialError::Write { path: directory.clone(), source };
        fs::create_dir_all(&directory).map_err(failed)?;
        let directory = fs::canonicalize(&directory).map_err(failed)?;
        let bench = Self { directory, fault: fault.to_owned(), _passing: passing };
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
        Ok(bench)
    }

    /// Gives a command, in the trial's directory and with a record of its own.
    pub(super) fn plumb(&self, arguments: &[&str]) -> Result<String, TrialError> {
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
            let message =
                [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
            let mut last =
                message.iter().flat_map(|text| text.lines()).filter(|line| !line.trim().is_empty());
            return Err(failed(last.next_back().unwrap_or("it does not say why").to_owned()));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    }

    pub(super) fn run(&self, procedure: &str, settings: &[&str]) -> Result<String, TrialError> {
        let mut arguments = vec!["run", "cell/cell.yaml", procedure, "--headless"];
        arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
        self.plumb(&arguments)
    }

    pub(super) fn json(&self, arguments: &[&str]) -> Result<Value, TrialError> {
        let message = self.plumb(arguments)?;
        let command = arguments.join(" ");
        serde_json::from_str(&message)
            .map_err(|error| TrialError::Rehearsal { command, cause: format!("it prints no JSON: {error}") })
    }

    pub(super) fn write(&self, name: &str, text: &str) -> Result<(), TrialError> {
        let path = self.directory.join(name);
        fs::write(&path, text).map_err(|source| TrialError::Write { path, source })
    }

    pub(super) fn last_run(&self) -> Result<String, TrialError> {
        let shown = self.json(&["show", "--json"])?;
        let number = shown.pointer("/run/run").and_then(Value::as_i64);
        number.map(|number| number.to_string()).ok_or_else(|| TrialError::Rehearsal {
            command: "show --json".to_owned(),
            cause: "the run has no number".to_owned(),
        })
    }

    /// The true error over fresh points as a procedure reports it in its step `error`, mm RMS.
    pub(super) fn true_error(&self, procedure: &str, settings: &[&str]) -> Result<f64, TrialError> {
        self.run(procedure, settings)?;
        let shown = self.json(&["show", "--json"])?;
        let steps = shown.get("steps").and_then(Value::as_array).map_or(&[] as &[Value], Vec::as_slice);
        let error = steps.iter().find(|step| step.get("step").and_then(Value::as_str) == Some("error"));
        let rms = error.and_then(|step| step.pointer("/result/rms_mm")).and_then(Value::as_f64);
        rms.ok_or_else(|| TrialError::Rehearsal {
            command: "show --json".to_owned(),
            cause: "the run tells no error".to_owned(),
        })
    }

    /// What is hidden, in words: effect, site, size.
    pub(super) fn hidden(&self) -> Result<String, TrialError> {
        let truth = cell::open(&self.directory.join("cell"))?;
        Ok(truth.hidden.first().map_or_else(
            || "nothing".to_owned(),
            |hidden| match hidden.size != 0.0 {
                true => {
                    format!("{}({}) {}", hidden.effect, hidden.site, shown_size(hidden.size, &hidden.unit))
                }
                false => format!("{}({})", hidden.effect, hidden.site),
            },
        ))
    }

    /// Opens the seal: how right the diagnosis is.
    pub(super) fn score(&self, diagnosis: &Value) -> Result<Score, TrialError> {
        let read: Diagnosis = serde_json::from_value(diagnosis.clone()).map_err(|source| {
            TrialError::Diagnosis { path: Path::new("plumb model diagnose").to_owned(), source }
        })?;
        Ok(Score::of(&read, &cell::open(&self.directory.join("cell"))?))
    }
}
