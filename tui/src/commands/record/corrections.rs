//! `plumb record zeros` and `plumb record rollback`: what was corrected, and the way back.

use std::io;
use std::process::ExitCode;

use plumb_cell::give_or_take;
use plumb_document::{did_you_mean, one_of};
use plumb_record::{
    AppliedCorrection, CellLock, CorrectionKey, Record, RecordError, Revision, RolledBack, StoredCorrection,
    StoredZeroLoss, record_option,
};

use super::{Rollback, Zeros};
use crate::failure::CommandResult;
use crate::print_line::print_line;

/// What cannot be listed or brought back.
#[derive(Debug, thiserror::Error)]
enum CorrectionsError {
    #[error("nothing was ever corrected in a cell `{cell}`: {help}")]
    NoSuchCell { cell: String, help: String },
    #[error("cell {cell} has no revision {revision}: {help}")]
    NoSuchRevision { cell: String, revision: i64, help: String },
    #[error("cell {cell} has corrections of several devices: say which with --device; {help}")]
    WhichDevice { cell: String, help: String },
    #[error("revision {revision} is of {device}, not of {asked}")]
    OtherDevice { revision: i64, device: String, asked: String },
}

/// Lists the revisions of a cell's corrections.
pub(super) fn list(record: &Record, arguments: &Zeros) -> CommandResult {
    let revisions = revisions_of(record, &arguments.cell)?;
    if arguments.json {
        for revision in &revisions {
            print_line!("{}", serde_json::to_string(revision)?)?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    for device in devices(&revisions) {
        let in_force = record.corrections_in_force(&arguments.cell, device)?;
        print_line!("{device} of cell {}: in force now", arguments.cell)?;
        let loss = record.zero_loss(&arguments.cell, device)?;
        for one in &in_force {
            let lost = is_lost(record, &arguments.cell, one, loss.as_ref())?;
            print_line!("  {}{}", in_force_in_words(one), if lost { "   LOST" } else { "" })?;
        }
        if let Some(loss) = &loss {
            print_line!("zeros last lost in run {}: {}", loss.run, loss.reason)?;
        }
        print_line!("revisions, the oldest first")?;
        for revision in revisions.iter().filter(|revision| revision.device == *device) {
            print(revision, &in_force)?;
        }
    }
    print_line!(
        "`plumb record rollback {} REVISION{}` brings a revision back; 0 is what was before the first",
        arguments.cell,
        record_option(record.directory())
    )?;
    Ok(ExitCode::SUCCESS)
}

/// Whether a zero no longer holds, because the drive has begun to count anew since it was found.
fn is_lost(
    record: &Record,
    cell: &str,
    one: &AppliedCorrection,
    loss: Option<&StoredZeroLoss>,
) -> Result<bool, RecordError> {
    match loss {
        Some(loss) if one.key.quantity == "joint_zero" => Ok(!record.was_found_since(cell, one, loss)?),
        _ => Ok(false),
    }
}

fn print(revision: &Revision, in_force: &[AppliedCorrection]) -> io::Result<()> {
    let made = revision.made.get(..16).unwrap_or(&revision.made).replace('T', " ");
    print_line!("  {:>4}  {made}  {}", revision.revision, revision.reason)?;
    for one in &revision.corrections {
        let now = in_force.iter().any(|known| known.key == one.key && known.revision == revision.revision);
        print_line!("          {}{}", stored_in_words(one), if now { "   in force" } else { "" })?;
    }
    Ok(())
}

fn name(key: &CorrectionKey) -> String {
    // A parameter's name says what it is.
    if key.quantity == "sensor_parameter" {
        return key.site.replace('_', " ");
    }
    format!("{} of {}", key.quantity.replace('_', " "), key.site)
}

fn in_force_in_words(one: &AppliedCorrection) -> String {
    let around = give_or_take(one.uncertainty, &one.unit);
    format!("{:<28} {:>10.4} {} ({around}), revision {}", name(&one.key), one.value, one.unit, one.revision)
}

fn stored_in_words(one: &StoredCorrection) -> String {
    let around = give_or_take(one.uncertainty, &one.unit);
    format!("{:<28} {:>10.4} -> {:>10.4} {} ({around})", name(&one.key), one.old, one.new, one.unit)
}

/// Brings a revision back and prints what changed.
pub(super) fn bring_back(record: &mut Record, arguments: &Rollback) -> CommandResult {
    let revisions = revisions_of(record, &arguments.cell)?;
    let device = device_of(&revisions, arguments)?;
    let done = roll_back(record, &arguments.cell, &device, arguments.revision)?;
    print_line!(
        "revision {} is in force: {device} of cell {} as at revision {}",
        done.revision,
        arguments.cell,
        arguments.revision
    )?;
    for one in &done.changed {
        let around = give_or_take(one.uncertainty, &one.unit);
        print_line!(
            "  {:<28} {:>10.4} -> {:>10.4} {} ({around})",
            name(&one.key),
            one.old,
            one.new,
            one.unit
        )?;
    }
    for key in &done.left {
        print_line!(
            "  {:<28} is kept by the controller and stays: bring the arm to the pose and declare it anew",
            name(key)
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Brings a revision back while nobody runs the cell: a run that goes on keeps the zeros it began with.
///
/// # Errors
/// As [`Record::roll_back`]; [`RecordError::CellLocked`] while a run goes on.
pub(crate) fn roll_back(
    record: &mut Record,
    cell: &str,
    device: &str,
    revision: i64,
) -> Result<RolledBack, RecordError> {
    let _lock = CellLock::take(record.directory(), cell)?;
    record.roll_back(cell, device, revision, &format!("rolled back to revision {revision}"))
}

fn revisions_of(record: &Record, cell: &str) -> Result<Vec<Revision>, Box<dyn std::error::Error>> {
    let revisions = record.revisions(cell)?;
    if revisions.is_empty() {
        let known = record.corrected_cells()?;
        let help = did_you_mean(cell, known.iter().map(String::as_str));
        return Err(CorrectionsError::NoSuchCell { cell: cell.to_owned(), help }.into());
    }
    Ok(revisions)
}

/// The devices with corrections, each once.
fn devices(revisions: &[Revision]) -> Vec<&String> {
    let mut devices: Vec<&String> = revisions.iter().map(|revision| &revision.device).collect();
    devices.sort();
    devices.dedup();
    devices
}

/// The device a revision is of; the one that is named, or the only one, for revision 0.
fn device_of(revisions: &[Revision], arguments: &Rollback) -> Result<String, CorrectionsError> {
    let devices = devices(revisions);
    let help = || one_of(devices.iter().map(|device| device.as_str()));
    let found = revisions.iter().find(|revision| revision.revision == arguments.revision);
    match (found, arguments.revision, &arguments.device, devices.as_slice()) {
        (Some(found), _, Some(asked), _) if found.device != *asked => Err(CorrectionsError::OtherDevice {
            revision: arguments.revision,
            device: found.device.clone(),
            asked: asked.clone(),
        }),
        (Some(found), ..) => Ok(found.device.clone()),
        (None, 0, Some(asked), _) => Ok(asked.clone()),
        (None, 0, None, [only]) => Ok((*only).clone()),
        (None, 0, None, _) => {
            Err(CorrectionsError::WhichDevice { cell: arguments.cell.clone(), help: help() })
        }
        _ => Err(CorrectionsError::NoSuchRevision {
            cell: arguments.cell.clone(),
            revision: arguments.revision,
            help: one_of(
                revisions
                    .iter()
                    .map(|known| known.revision.to_string())
                    .collect::<Vec<_>>()
                    .iter()
                    .map(String::as_str),
            ),
        }),
    }
}
