//! A run that the queue begins, or goes on with.

use plumb_cell::engine::dry_run;
use plumb_cell::event::RunOutcome;

use super::arguments::Arguments;
use super::dry::beyond_limits;
use super::headless;
use super::prepare::{Refused, Requested, absolute, prepare, requested};
use crate::signals::SignalsInTurn;

/// A run that could begin now: what an entry of the queue says of it.
pub(crate) struct Checked {
    /// Name of the cell.
    pub(crate) cell: String,
    /// Path of its file, absolute.
    pub(crate) cell_file: String,
    /// Name of the procedure.
    pub(crate) procedure: String,
    /// About how long it takes, s, prompts left out.
    pub(crate) estimate_s: f64,
}

/// A move that the cell does not allow.
#[derive(Debug, thiserror::Error)]
#[error("{}", .0.join("; "))]
struct BeyondLimits(Vec<String>);

/// Reads everything a run needs, and plans it; nothing is started.
pub(crate) fn check(arguments: &Arguments) -> Result<Checked, Refused> {
    let Requested { request, .. } = requested(arguments)?;
    let plan = dry_run(&request)?;
    if let Some(reason) = plan.needs_operator {
        return Err(Refused::NeedsOperator(reason));
    }
    let beyond = beyond_limits(&plan);
    if !beyond.is_empty() {
        return Err(BeyondLimits(beyond).into());
    }
    Ok(Checked {
        cell: request.cell.name.clone(),
        cell_file: absolute(&request.cell.file),
        procedure: request.procedure.name.clone(),
        estimate_s: plan.estimate_s,
    })
}

/// Carries it out to its end.
pub(crate) fn carry_out(arguments: &Arguments, signals: &SignalsInTurn) -> Result<RunOutcome, Refused> {
    let prepared = prepare(arguments)?;
    signals.forward_to(&prepared.running.handle);
    Ok(headless::watch(prepared.running, arguments.json_events(), false)?)
}
