//! Cells: which run, and what those that were killed left behind.

use std::path::{Path, PathBuf};
use std::time::Instant;

use plumb_cell::device::{CellResources, Occupancy, Remains};
use plumb_document::counted;
use plumb_simulated::client::WorldClient;

use super::finding::Finding;
use super::processes::{LOOK, PUTTING_AWAY};
use crate::commands::run::simulated_world::SimulatedWorld;

const TOPIC: &str = "cells";

/// A cell file that is not there.
#[derive(Debug, thiserror::Error)]
#[error("there is no cell file {0}")]
struct NoCellFile(String);

/// Every cell of this machine of which something is there, or those given.
pub(super) fn look(cells: &[PathBuf]) -> Result<Vec<Finding>, Box<dyn std::error::Error>> {
    let findings: Vec<Finding> = resources(cells)?.iter().filter_map(|cell| finding(&cell.state())).collect();
    Ok(if findings.is_empty() {
        vec![Finding::good(TOPIC, "none runs, and none has left anything behind")]
    } else {
        findings
    })
}

fn finding(state: &Occupancy) -> Option<Finding> {
    match state {
        Occupancy::Empty => None,
        Occupancy::InUse(holder) => Some(Finding::good(
            TOPIC,
            format!("{} is run by process {}", cell_name(&holder.runs), holder.process),
        )),
        Occupancy::LeftBehind(remains) => Some(left_behind(remains)),
    }
}

fn left_behind(remains: &Remains) -> Finding {
    let name = name_of(remains);
    let world = remains.world.as_ref().and_then(|socket| WorldClient::connect(socket, "doctor").ok());
    if let (Some(world), None, true) =
        (&world, &remains.holder, remains.users.is_empty() && remains.files == 0)
    {
        // The program ended in good order and left the world for a resume; it goes by itself.
        let text = format!(
            "{name}: its simulated world (process {}) waits for a run to be resumed",
            world.welcome().pid
        );
        return Finding::note(TOPIC, text).mend(
            "plumb run --resume goes on there; it ends by itself after a while; plumb doctor --clean ends it",
        );
    }
    if let (None, Some(holder), true, 1) =
        (&remains.world, &remains.holder, remains.users.is_empty(), remains.files)
    {
        let text = format!(
            "{name}: the lock of process {}, which has gone; the next run takes it over",
            holder.process
        );
        return Finding::note(TOPIC, text).mend("plumb doctor --clean removes it");
    }
    let mut what = vec![format!("{} in shared memory", counted(remains.files, "file", "files"))];
    what.extend(world.map(|world| format!("a simulated world (process {})", world.welcome().pid)));
    what.extend(remains.users.iter().map(|user| format!("the {user}")));
    let by =
        remains.holder.as_ref().map(|holder| format!(" by process {}, which was killed", holder.process));
    let text = format!("{name}: left behind{}: {}", by.unwrap_or_default(), what.join(", "));
    Finding::wrong(
        TOPIC,
        text,
        "plumb run --resume goes on with the run; if that is not wanted, plumb doctor --clean removes it",
    )
}

/// Removes what cells that nobody runs have left.
pub(super) fn clean(cells: &[PathBuf]) -> Result<Vec<Finding>, Box<dyn std::error::Error>> {
    let mut findings = Vec::new();
    for cell in resources(cells)? {
        let Occupancy::LeftBehind(remains) = cell.state() else { continue };
        let name = name_of(&remains);
        // Held meanwhile, so that no run begins in what is being removed.
        let Ok(lock) = cell.lock("this", "plumb doctor --clean") else { continue };
        if let Some(socket) = &remains.world {
            SimulatedWorld::end_at(socket);
        }
        findings.push(match removed(&cell) {
            Ok(()) => Finding::good(TOPIC, format!("{name}: what it left behind is removed")),
            Err(error) => {
                let mend = "end these processes, or wait for them, and clean again";
                Finding::wrong(TOPIC, format!("{name}: cannot be cleaned up: {error}"), mend)
            }
        });
        drop(lock);
    }
    Ok(findings)
}

/// Removes everything once the last host has finished.
fn removed(resources: &CellResources) -> Result<(), plumb_bus::DomainError> {
    let begin = Instant::now();
    loop {
        match resources.remove() {
            Err(plumb_bus::DomainError::InUse(_)) if begin.elapsed() < PUTTING_AWAY => {
                std::thread::sleep(LOOK);
            }
            other => return other,
        }
    }
}

fn resources(cells: &[PathBuf]) -> Result<Vec<CellResources>, Box<dyn std::error::Error>> {
    if cells.is_empty() {
        return Ok(CellResources::all());
    }
    let mut resources = Vec::new();
    for cell in cells {
        if !cell.is_file() {
            return Err(NoCellFile(cell.display().to_string()).into());
        }
        resources.push(CellResources::of_cell(cell)?);
    }
    Ok(resources)
}

fn name_of(remains: &Remains) -> String {
    remains.holder.as_ref().map_or_else(|| "a cell".to_owned(), |holder| cell_name(&holder.runs))
}

fn cell_name(runs: &str) -> String {
    if Path::new(runs).is_absolute() { runs.to_owned() } else { "a cell".to_owned() }
}
