//! `plumb run`: a procedure in a cell, on the screens or without anybody.

mod arguments;
mod dry;
mod emulated_controller;
mod event_log;
mod headless;
mod json_events;
pub(crate) mod prepare;
pub(crate) mod queued;
mod robot_facts;
mod simulated_operator;
pub mod simulated_world;

use std::process::ExitCode;

use plumb_cell::command::Command;
use plumb_cell::event::RunOutcome;
use plumb_record::{Record, record_option};

use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::screens::{self, Left};
use crate::signals::EndingSignals;
pub use arguments::parameter;
pub(crate) use arguments::{Arguments, OfQueue, PaceArgument};
use prepare::Prepared;

/// Runs it; the exit code says how it ended.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    if arguments.dry_run {
        return match dry::plan(arguments) {
            Ok(code) => Ok(code),
            Err(refused) => refused.report(),
        };
    }
    plumb_bus::check_limits()?;
    let signals = EndingSignals::take_over()?;
    let prepared = match prepare::prepare(arguments) {
        Ok(prepared) => prepared,
        Err(refused) => return refused.report(),
    };
    if arguments.is_headless() {
        // The run hears of them itself; nobody else has to.
        drop(signals.watch(prepared.running.handle.clone(), false));
        let outcome = headless::watch(prepared.running, arguments.json_events(), arguments.attended)?;
        return Ok(ExitCode::from(outcome.exit_code()));
    }
    run_on_screens(prepared, signals)
}

/// Runs it on the screens until the operator leaves or it has ended.
fn run_on_screens(prepared: Prepared, signals: EndingSignals) -> CommandResult {
    let running = prepared.running;
    let record = record_option(&prepared.record);
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
        // Anyone who read along may have gone: the state of the run counts.
        let run = running.run.0;
        drop(print_line!("Run {run} is kept; go on with: plumb run --resume {run}{record}"));
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
    let (run, reason) = (running.run.0, reason.unwrap_or_default());
    drop(print_line!("Run {run} {how}{reason}\nThe record keeps it: plumb show {run}{record}"));
    Ok(ExitCode::from(outcome.exit_code()))
}
