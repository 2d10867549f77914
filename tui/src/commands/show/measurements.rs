//! `plumb show --table`: what a run measured, for the model lab.

use std::io::{self, Write as _};
use std::path::Path;
use std::process::ExitCode;

use plumb_cell::expression::Calculator;
use plumb_cell::measurement_table::{Recorded, Zeros, measurement_table, provenance};
use plumb_cell::workcell::load_workcell;
use plumb_document::did_you_mean;
use plumb_record::{Record, RecordError, RunId, RunSummary, StoredCorrection, StoredStep, StoredTrigger};

use super::Arguments;
use crate::failure::CommandResult;

/// Which robot is meant.
#[derive(Debug, thiserror::Error)]
enum RobotError {
    #[error("the cell has no robot `{requested}`: {help}")]
    Unknown { requested: String, help: String },
    #[error("the cell has several robots: say which with --robot; there are {0}")]
    Several(String),
    #[error("the cell names no robots, so nothing has a pose")]
    None,
    #[error("run {run} is of another cell, {cell}: rows of different cells do not go into one table")]
    OtherCell { run: i64, cell: String },
}

/// Prints the table. The cell file is read as it is now; a run is based on the model it was made with, so a changed one is reported.
pub(super) fn print(record: &Record, run: &RunSummary, arguments: &Arguments) -> CommandResult {
    let cell = match load_workcell(Path::new(&run.cell_file), &Calculator::new()) {
        Ok(cell) => cell,
        Err(problems) => {
            problems.iter().for_each(|problems| eprintln!("{problems}"));
            return Ok(ExitCode::from(2));
        }
    };
    let robot = match (&arguments.robot, cell.robots.as_slice()) {
        (Some(requested), robots) => cell.robot(requested).ok_or_else(|| RobotError::Unknown {
            requested: requested.clone(),
            help: did_you_mean(requested, robots.iter().map(|robot| robot.device.as_str())),
        })?,
        (None, [robot]) => robot,
        (None, []) => return Err(RobotError::None.into()),
        (None, several) => {
            let names: Vec<&str> = several.iter().map(|robot| robot.device.as_str()).collect();
            return Err(RobotError::Several(names.join(", ")).into());
        }
    };
    if let Some(model) = &robot.model {
        let now = plumb_record::sha256_hex(model.text.as_bytes());
        if !record.loaded(run.run)?.iter().any(|file| file.sha256 == now) {
            eprintln!("plumb: {} was changed since run {}", model.file.display(), run.run);
        }
    }
    let zeros = if arguments.as_left { Zeros::AsLeft } else { Zeros::AsFound };
    let also = arguments.run.iter().skip(1).map(|run| record.run(RunId(*run)));
    let runs: Vec<RunSummary> = std::iter::once(Ok(run.clone())).chain(also).collect::<Result<_, _>>()?;
    if let Some(other) = runs.iter().find(|other| other.cell_file != run.cell_file) {
        return Err(RobotError::OtherCell { run: other.run.0, cell: other.cell_file.clone() }.into());
    }
    let held = runs.iter().map(|run| Held::of(record, run.run)).collect::<Result<Vec<_>, _>>()?;
    let recorded: Vec<Recorded<'_>> = held.iter().map(Held::recorded).collect();
    let table = measurement_table(robot, &recorded, zeros)?;
    let numbers: Vec<i64> = runs.iter().map(|run| run.run.0).collect();
    let head = robot.model.as_ref().map(|model| provenance(&cell.name, &numbers, model)).unwrap_or_default();
    io::stdout().write_all(format!("{head}{table}").as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

/// What the record holds of one run.
struct Held {
    run: RunId,
    steps: Vec<StoredStep>,
    triggers: Vec<StoredTrigger>,
    corrections: Vec<StoredCorrection>,
}

impl Held {
    fn of(record: &Record, run: RunId) -> Result<Self, RecordError> {
        let (steps, triggers) = (record.steps(run)?, record.triggers(run)?);
        Ok(Self { run, steps, triggers, corrections: record.corrections_of_run(run)? })
    }

    fn recorded(&self) -> Recorded<'_> {
        Recorded {
            run: self.run.0,
            steps: &self.steps,
            triggers: &self.triggers,
            corrections: &self.corrections,
        }
    }
}
