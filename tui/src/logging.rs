//! Where the events of `tracing` go: to standard error where `RUST_LOG` is set, to the file of `--log`, and, while a run goes on, to a file of
//! its own beside the record. Those of hosts and plugins arrive here as events of the orchestrator.

use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use plumb_record::create_owner_only_directory;
use tracing_subscriber::EnvFilter;

/// What is logged where `RUST_LOG` is not set: everything of plumb's own, and warnings of the libraries below it.
const USUAL: &str = "warn,plumb=debug";

/// Bytes that are kept until the run has its number: some hundred lines.
const MOST_KEPT: usize = 64 * 1024;

/// Why nothing can be logged.
#[derive(Debug, thiserror::Error)]
pub(crate) enum LogError {
    /// `RUST_LOG` makes no sense.
    #[error(
        "RUST_LOG is `{text}`: {reason}; write a level, as in RUST_LOG=debug, or RUST_LOG=plumb_host=trace,warn"
    )]
    Filter {
        /// What it says.
        text: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The file cannot be written.
    #[error("the log {} cannot be written: {source}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// Where lines go.
struct Sinks {
    /// Somebody has asked for them on standard error.
    on_stderr: bool,
    /// The screens are open: a line would spoil them.
    behind_screens: bool,
    file: Option<File>,
    run: Option<File>,
    /// Lines from before the run had its number.
    kept: Vec<u8>,
}

static SINKS: Mutex<Sinks> =
    Mutex::new(Sinks { on_stderr: false, behind_screens: false, file: None, run: None, kept: Vec::new() });

fn sinks() -> MutexGuard<'static, Sinks> {
    SINKS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A line of the log, handed to every place that takes lines.
struct Line;

impl Write for Line {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut guard = sinks();
        let sinks = &mut *guard;
        if sinks.on_stderr && !sinks.behind_screens {
            // Nobody may read it; the files count.
            let _reader_gone = io::stderr().write_all(bytes);
        }
        if let Some(file) = &mut sinks.file {
            file.write_all(bytes)?;
        }
        match &mut sinks.run {
            Some(run) => run.write_all(bytes)?,
            None if sinks.kept.len() + bytes.len() <= MOST_KEPT => sinks.kept.extend_from_slice(bytes),
            None => {}
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Starts to log: to `file` where one is named, to standard error where `RUST_LOG` is set.
///
/// # Errors
/// [`LogError`].
pub(crate) fn start(file: Option<&Path>) -> Result<(), LogError> {
    let requested = std::env::var("RUST_LOG").ok().filter(|text| !text.trim().is_empty());
    let text = requested.as_deref().unwrap_or(USUAL);
    let filter = EnvFilter::builder()
        .parse(text)
        .map_err(|error| LogError::Filter { text: text.to_owned(), reason: error.to_string() })?;
    {
        let mut sinks = sinks();
        sinks.on_stderr = requested.is_some();
        sinks.file = file.map(open).transpose()?;
    }
    let lines =
        tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(|| Line).finish();
    // Only a second call could fail.
    let _set_before = tracing::subscriber::set_global_default(lines);
    Ok(())
}

/// Opens a log to write at its end; nobody but its owner may read it.
fn open(path: &Path) -> Result<File, LogError> {
    let opened = OpenOptions::new().create(true).append(true).mode(0o600).open(path);
    opened.map_err(|source| LogError::File { path: path.to_owned(), source })
}

/// Logs into the file of a run from here on, and what came before with it. A run that is resumed goes on in its file.
///
/// # Errors
/// [`LogError::File`].
pub(crate) fn begin_run(record: &Path, run: i64) -> Result<(), LogError> {
    let folder = record.join("logs");
    create_owner_only_directory(&folder).map_err(|error| LogError::File {
        path: folder.clone(),
        source: io::Error::other(error.to_string()),
    })?;
    let path = folder.join(format!("run-{run}.log"));
    let mut file = open(&path)?;
    let mut sinks = sinks();
    let kept = std::mem::take(&mut sinks.kept);
    file.write_all(&kept).map_err(|source| LogError::File { path, source })?;
    sinks.run = Some(file);
    Ok(())
}

/// Says whether the screens are open, where lines on standard error would spoil them.
pub(crate) fn behind_screens(open: bool) {
    sinks().behind_screens = open;
}
