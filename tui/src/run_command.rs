//! `plumb run`: a procedure in a cell, on the screens or without anybody.

mod dry;
mod emulated_controller;
mod headless;
pub(crate) mod prepare;
mod simulated_operator;
pub(crate) mod simulated_world;

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::process::ExitCode;

use plumb_cell::command::Command;
use plumb_cell::event::RunOutcome;
use plumb_record::{Record, record_option};

use crate::failure::CommandResult;
use crate::say::say;
use crate::screens::{self, Left};
use crate::signals::EndingSignals;
use prepare::Refused;

/// Run a procedure of a cell. In a terminal the screens open; without one, or with --headless, it runs by itself with answers from a file.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The cell file. With --resume it may be left out.
    #[arg(required_unless_present = "resume")]
    cell: Option<PathBuf>,
    /// Which of the cell's procedures, by name or file; the first if left out.
    procedure: Option<String>,
    /// Without screens; prompts are answered from a file.
    #[arg(long)]
    headless: bool,
    /// The file of answers; the cell's own if left out.
    #[arg(long, value_name = "FILE")]
    answers: Option<PathBuf>,
    /// Set a parameter of the procedure; can be given several times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = parameter)]
    set: Vec<(String, f64)>,
    /// Print every event as a line of JSON; implies --headless.
    #[arg(long)]
    json: bool,
    /// Go on with a run that was interrupted: the newest of the cell, or the one of this number.
    #[arg(long, value_name = "RUN", num_args = 0..=1)]
    #[expect(clippy::option_option, reason = "given, given with a number, or not given")]
    resume: Option<Option<i64>>,
    /// Where the record lies.
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// How the time of a simulated cell goes; without screens it is fast if left out.
    #[arg(long, value_enum)]
    pace: Option<PaceArgument>,
    /// Who runs it, for the record; your login name if left out.
    #[arg(long, value_name = "NAME")]
    operator: Option<String>,
    /// Without screens, but with somebody there: prompts wait for `plumb answer` from another terminal. Implies --headless.
    #[arg(long, conflicts_with = "answers")]
    attended: bool,
    /// Print what the run would do, about how long it would take and what it would move within what limits. Nothing is started.
    #[arg(long, conflicts_with = "resume")]
    dry_run: bool,
    /// Something to be remembered with the run; can be given several times.
    #[arg(long, value_name = "TEXT")]
    note: Vec<String>,
    /// Look for plugins here too.
    #[arg(long, value_name = "DIR")]
    plugins: Vec<PathBuf>,
    /// Run plugins whose files have changed since this cell ran with them last; asked at the start when somebody is there, refused when nobody is.
    #[arg(long)]
    accept_plugins: bool,
    /// Let a debugger hold this program or a device's process: robots are not stopped because this program is silent, and nothing that a device is
    /// asked is too late.
    #[arg(long)]
    debugger: bool,
}

/// How the time of a simulated world goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum PaceArgument {
    /// As on the wall.
    Real,
    /// As fast as can be.
    Fast,
}

impl Arguments {
    /// There are no screens.
    fn is_headless(&self) -> bool {
        self.headless || self.json || self.attended || !std::io::stdout().is_terminal()
    }

    /// Nobody is there to answer.
    fn is_unattended(&self) -> bool {
        self.is_headless() && !self.attended
    }
}

/// Reads `NAME=VALUE`.
pub(crate) fn parameter(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("write NAME=VALUE, as in Br_deg=5")?;
    let value = value.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    let value = value.ok_or("the value is a number; its unit is the end of the parameter's name")?;
    Ok((name.trim().to_owned(), value))
}

/// Says why a run does not start.
fn told(refused: Refused) -> CommandResult {
    match refused {
        Refused::Files(problems) => {
            problems.iter().for_each(|problems| eprintln!("{problems}"));
            Ok(ExitCode::from(RunOutcome::Error.exit_code()))
        }
        Refused::NeedsOperator(reason) => {
            eprintln!("plumb: {reason}");
            Ok(ExitCode::from(RunOutcome::NeedsOperator.exit_code()))
        }
        Refused::Other(error) => Err(error),
    }
}

/// Runs it; the exit code says how it ended.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    if arguments.dry_run {
        return match dry::plan(arguments) {
            Ok(code) => Ok(code),
            Err(refused) => told(refused),
        };
    }
    plumb_bus::check_limits()?;
    let signals = EndingSignals::take_over()?;
    let prepared = match prepare::prepare(arguments) {
        Ok(prepared) => prepared,
        Err(refused) => return told(refused),
    };
    let running = prepared.running;
    let record = record_option(&prepared.record);
    let outcome = if arguments.is_headless() {
        headless::watch(running, signals, arguments.json, arguments.attended)?
    } else {
        let handle = running.handle.clone();
        let shown = screens::operate(
            running.events,
            handle.clone(),
            signals.watch(handle.clone(), true),
            &prepared.operator,
            &prepared.cell,
            &prepared.record,
        );
        if let Ok(Left::Kept) = shown {
            handle.send(Command::Keep);
            // The robots come to rest and the devices' processes end; a simulated world waits for the resume.
            let _left_by_the_operator = running.thread.join();
            // Whoever read along may have gone: how the run stands counts.
            drop(say!(
                "Run {} is kept; go on with: plumb run --resume {}{record}",
                running.run.0,
                running.run.0
            ));
            return Ok(ExitCode::from(RunOutcome::NeedsOperator.exit_code()));
        }
        // A run that has ended takes no notice; one whose terminal was lost must not go on unseen.
        handle.send(Command::Abort);
        let outcome = running.thread.join().unwrap_or(RunOutcome::Error);
        shown?;
        // The screens are gone, and with them the reason.
        let reason = Record::open(&prepared.record).and_then(|record| record.run(running.run));
        let reason = reason.ok().and_then(|run| run.message).map(|message| format!(": {message}"));
        // A signal may end the run before the screens have noticed.
        let how = match outcome {
            RunOutcome::NeedsOperator => "is kept",
            other => headless::in_words(other),
        };
        drop(say!(
            "Run {} {how}{}\nThe record keeps it: plumb show {}{record}",
            running.run.0,
            reason.unwrap_or_default(),
            running.run.0
        ));
        outcome
    };
    Ok(ExitCode::from(outcome.exit_code()))
}
