//! The terminal program. A state, a pure [`update::update`] that takes messages and gives actions, a pure [`view::view`]
//! that draws the state, and one loop ([`event_loop`]) that joins them to keys, engine and terminal.
//!
//! Nothing is decided about robots here: the screens show what the engine says and pass on what the operator asks for.

mod cell;
mod event_loop;
mod footer;
mod help;
mod history;
mod hits;
pub(crate) mod keys;
mod log;
mod message;
mod model;
pub(crate) mod pane;
mod run;
pub(crate) mod scan;
mod screen;
mod state;
pub(crate) mod terminal;
pub(crate) mod theme;
mod update;
mod view;

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

use plumb_cell::RunHandle;
use plumb_cell::event::StampedEvent;
use plumb_cell::workcell::Workcell;
use tokio::runtime::Runtime;
use tokio::sync::mpsc::UnboundedReceiver;

use cell::ArmShape;
use event_loop::Sources;
use history::{Archive, ArchiveRequest};
use model::Lab;
use state::State;
use theme::Theme;

use crate::commands::model::arguments::Opened;
use crate::commands::stripe::Stripes;

/// Shows a model and the table called `data` on the Model screen until the operator leaves.
///
/// # Errors
/// An earlier revision of the model cannot be read; the terminal cannot be used, or was lost.
pub(crate) fn explore(opened: Opened, data: String) -> Result<(), Box<dyn Error>> {
    let (lab, model) = Lab::open(opened, data)?;
    let sources = Sources { lab: Some(lab), ..Sources::default() };
    let state = State::of_model(model, Theme::from_environment());
    Runtime::new()?.block_on(event_loop::show(state, sources))?;
    Ok(())
}

/// Shows scans of a cell's light stripe on the Model screen until the operator leaves; `files` says which.
///
/// # Errors
/// The terminal cannot be used, or was lost.
pub(crate) fn explore_stripes(stripes: Stripes, files: &str) -> io::Result<()> {
    let (lab, model) = model::open_stripes(stripes, files);
    let sources = Sources { lab: Some(lab), ..Sources::default() };
    let state = State::of_model(model, Theme::from_environment());
    Runtime::new()?.block_on(event_loop::show(state, sources)).map(drop)
}

/// Shows the runs of the record in `directory` until the operator leaves.
///
/// # Errors
/// The terminal cannot be used, or was lost.
pub(crate) fn browse(directory: PathBuf) -> io::Result<()> {
    let record_option = plumb_record::record_option(&directory);
    let archive = Archive::open(directory);
    let _ended = archive.desk().send(ArchiveRequest::List);
    let sources = Sources { archive: Some(archive), ..Sources::default() };
    let state = State { record_option, ..State::of_record(Theme::from_environment()) };
    Runtime::new()?.block_on(event_loop::show(state, sources)).map(drop)
}

/// Shows the screens of a run that somebody else controls, until the operator leaves.
///
/// # Errors
/// The terminal cannot be used, or was lost.
pub(crate) fn watch(events: UnboundedReceiver<StampedEvent>) -> io::Result<()> {
    let sources = Sources { events: Some(events), ..Sources::default() };
    Runtime::new()?
        .block_on(event_loop::show(State::of_watcher(Theme::from_environment()), sources))
        .map(drop)
}

/// Shows a cloud until the operator leaves.
///
/// # Errors
/// The terminal cannot be used, or was lost.
pub(crate) fn look(scan: scan::ScanState) -> io::Result<()> {
    let state = State::of_cloud(scan, Theme::from_environment());
    Runtime::new()?.block_on(event_loop::show(state, Sources::default())).map(drop)
}

/// How the operator left a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Left {
    /// It had ended, or was aborted.
    Ended,
    /// It is kept, to be resumed.
    Kept,
}

/// Shows the screens of a run in `cell` that the operator controls, until they leave or `ended_by_signal` says that a signal asks the program to
/// end.
///
/// # Errors
/// The terminal cannot be used, or was lost; robots were commanded to stop.
pub(crate) fn operate(
    events: UnboundedReceiver<StampedEvent>,
    handle: RunHandle,
    ended_by_signal: UnboundedReceiver<()>,
    operator: &str,
    cell: &Workcell,
    record: &Path,
) -> io::Result<Left> {
    let archive = Some(Archive::open(record.to_owned()));
    let sources = Sources {
        events: Some(events),
        handle: Some(handle),
        archive,
        ended_by_signal: Some(ended_by_signal),
        ..Sources::default()
    };
    let mut state = State {
        record_option: plumb_record::record_option(record),
        ..State::of_cell(operator, ArmShape::of_cell(cell), Theme::from_environment())
    };
    state.cell.target = cell.target;
    let state = Runtime::new()?.block_on(event_loop::show(state, sources))?;
    let aborts = state.leaving.is_some_and(|leaving| leaving.aborts);
    Ok(if state.has_open_run() && !aborts { Left::Kept } else { Left::Ended })
}

#[cfg(test)]
mod tests;
