//! `plumb watch`: the screens of a run that goes on somewhere else, or went, read from the record or from its events as JSON lines.

mod from_record;

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::thread;

use plumb_cell::event::{Event, LogLevel, StampedEvent};
use plumb_document::{FileKind, ReadError, lines, open};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use crate::failure::CommandResult;
use crate::record_directory::record_directory;
use crate::screens;

/// Show the screens of a run that goes on in another terminal, or went. Only watches; `plumb answer` answers its prompts.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The number of a run, as `plumb history` gives it; or a file of events, as `plumb run --json` writes them (`-` reads standard input).
    #[arg(value_name = "RUN|EVENTS")]
    events: PathBuf,
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

/// Why a run cannot be watched.
#[derive(Debug, thiserror::Error)]
enum WatchError {
    /// The file cannot be opened.
    #[error("cannot open {}", path.display())]
    Open {
        /// Which.
        path: PathBuf,
        /// Why.
        source: ReadError,
    },
    /// The file broke off or holds something else.
    #[error("{}, line {line}: {reason}; expected events as `plumb run --json` writes them", path.display())]
    Read {
        /// Which.
        path: PathBuf,
        /// Counted from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
}

/// Shows the screens until the operator leaves.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let number = arguments.events.to_str().and_then(|text| text.parse::<i64>().ok());
    if let Some(run) = number.filter(|_| !arguments.events.exists()) {
        let events = from_record::follow(&record_directory(arguments.record.as_ref())?, run)?;
        screens::watch(events)?;
        return Ok(ExitCode::SUCCESS);
    }
    let source: Box<dyn Read + Send> = if arguments.events == Path::new("-") {
        Box::new(io::stdin())
    } else {
        let opened = open(&arguments.events, FileKind::EVENTS);
        Box::new(opened.map_err(|source| WatchError::Open { path: arguments.events.clone(), source })?)
    };
    let (events, broken) = follow(source, arguments.events.clone());
    screens::watch(events)?;
    // The error of the reader, if it had one, is the more useful thing to say once the terminal is given back.
    broken.try_recv().map_or(Ok(ExitCode::SUCCESS), |error| Err(error.into()))
}

/// Reads events on a thread of its own, so that a slow pipe does not hold up the keys.
fn follow(
    source: Box<dyn Read + Send>,
    path: PathBuf,
) -> (UnboundedReceiver<StampedEvent>, std::sync::mpsc::Receiver<WatchError>) {
    let (to_screens, events) = unbounded_channel();
    let (to_command, broken) = std::sync::mpsc::channel();
    thread::spawn(move || {
        for (index, line) in lines(source).enumerate() {
            let read = line.map_err(|error| error.to_string());
            let event = read.and_then(|line| serde_json::from_str(&line).map_err(|error| error.to_string()));
            let event: StampedEvent = match event {
                Ok(event) => event,
                Err(reason) => {
                    let error = WatchError::Read { path, line: index + 1, reason };
                    let _left = to_screens.send(reported(&error));
                    let _left = to_command.send(error);
                    return;
                }
            };
            if to_screens.send(event).is_err() {
                return;
            }
        }
    });
    (events, broken)
}

/// The error as a line of the log, so that it is seen while the screens are open.
fn reported(error: &WatchError) -> StampedEvent {
    let event = Event::Log {
        level: LogLevel::Error,
        source: "watch".to_owned(),
        step: None,
        message: error.to_string(),
    };
    StampedEvent { sequence: 0, time: String::new(), event }
}
