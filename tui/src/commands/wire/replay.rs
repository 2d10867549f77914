//! `plumb wire replay`.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use plumb_cell::expression::Calculator;
use plumb_cell::workcell::{Workcell, load_workcell};
use plumb_document::{FileKind, ReadError, read_text};
use plumb_simulated::emulate::transcript::{LineOptions, Progress, Replay, Transcript, TranscriptError};

use crate::commands::emulate::typed::Typing;
use crate::commands::run::prepare::Refused;
use crate::failure::CommandResult;

/// Play a recorded line in place of the device, and hold what is sent now against what was sent then.
///
/// With a cell, one of its procedures runs against the transcript, unattended and with a record of its own that is thrown away. Without one, the path of a port is printed, and whatever
/// opens it is played to until the command is ended. A question that is asked again and again may come more or less often than then; everything else has to be as it was, byte by
/// byte. The first difference is shown with its line in the transcript; after it nothing is answered. Exit code 0: all was as then, and the run passed.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The transcript, as `plumb wire record` writes it.
    transcript: PathBuf,
    /// The cell that is run against it.
    cell: Option<PathBuf>,
    /// Which of its procedures; the first if left out.
    #[arg(requires = "cell")]
    procedure: Option<String>,
    /// The device that has the transcript for its port; may be left out where one device alone has a port.
    #[arg(long, value_name = "NAME", requires = "cell")]
    device: Option<String>,
    /// Make a link to the port here, and take it away at the end.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
    /// Further options of `plumb run`, such as --answers FILE.
    #[arg(last = true, requires = "cell")]
    run: Vec<String>,
}

/// An hour of a line of a megabaud, as digits.
const TRANSCRIPT: FileKind = FileKind { name: "a transcript", most_bytes: 1 << 30 };

/// Why nothing is played.
#[derive(Debug, thiserror::Error)]
enum ReplayError {
    #[error("the transcript {} cannot be read: {error}", file.display())]
    Read { file: PathBuf, error: ReadError },
    #[error("{}, {error}", file.display())]
    Transcript { file: PathBuf, error: TranscriptError },
    #[error("cell `{cell}` has no device with a port that a transcript could stand in for")]
    NoDevice { cell: String },
    #[error("several devices of cell `{cell}` have a port; name one of them: --device {}", devices.join(", --device "))]
    SeveralDevices { cell: String, devices: Vec<String> },
}

/// Plays it.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    let file = &arguments.transcript;
    let text =
        read_text(file, TRANSCRIPT).map_err(|error| ReplayError::Read { file: file.clone(), error })?;
    let transcript =
        Transcript::parse(&text).map_err(|error| ReplayError::Transcript { file: file.clone(), error })?;
    let line = LineOptions { link: arguments.link.clone(), ..LineOptions::default() };
    match &arguments.cell {
        None => play_to_anybody(transcript, line),
        Some(cell) => play_to_cell(arguments, cell, transcript, line),
    }
}

fn play_to_anybody(transcript: Transcript, line: LineOptions) -> CommandResult {
    let mut typing = Typing::listen(false)?;
    let replay = Replay::start(transcript, line)?;
    let mut output = io::stdout();
    writeln!(output, "{}", replay.status().port.unwrap_or_default().display())?;
    output.flush()?;
    while replay.is_working() {
        let Some(lines) = typing.next()? else { break };
        if lines.iter().any(|line| line.trim() == "quit") {
            break;
        }
    }
    let progress = replay.status().progress;
    replay.stop()?;
    verdict(&progress, true)
}

fn play_to_cell(
    arguments: &Arguments,
    cell: &Path,
    transcript: Transcript,
    line: LineOptions,
) -> CommandResult {
    let loaded = match load_workcell(cell, &Calculator::new()) {
        Ok(loaded) => loaded,
        Err(problems) => return Refused::Files(problems).report(),
    };
    let device = match &arguments.device {
        Some(device) => device.clone(),
        None => device_with_port(&loaded)?,
    };
    let replay = Replay::start(transcript, line)?;
    let port = replay.status().port.unwrap_or_default();
    let record = tempfile_directory()?;
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("run").arg(cell).args(&arguments.procedure).arg("--headless");
    command.arg("--record").arg(&record).arg("--port").arg(format!("{device}={}", port.display()));
    let ended = command.args(&arguments.run).status();
    // A record that cannot be thrown away is in nobody's way.
    let _ = std::fs::remove_dir_all(&record);
    let passed = ended?.success();
    let progress = replay.status().progress;
    replay.stop()?;
    verdict(&progress, passed)
}

/// The one device of a cell whose configuration names a port.
fn device_with_port(cell: &Workcell) -> Result<String, ReplayError> {
    let with_port = cell.devices.iter().filter(|device| device.config.get("port").is_some());
    let mut devices: Vec<String> = with_port.map(|device| device.name.clone()).collect();
    match (devices.pop(), devices.is_empty()) {
        (Some(device), true) => Ok(device),
        (None, _) => Err(ReplayError::NoDevice { cell: cell.name.clone() }),
        (Some(last), false) => {
            devices.push(last);
            Err(ReplayError::SeveralDevices { cell: cell.name.clone(), devices })
        }
    }
}

/// A folder for a record that nobody keeps.
fn tempfile_directory() -> io::Result<PathBuf> {
    let folder = std::env::temp_dir().join(format!("plumb-replay-{}", std::process::id()));
    std::fs::create_dir(&folder)?;
    Ok(folder)
}

/// Says how it went; 1 where it was not as then.
fn verdict(progress: &Progress, passed: bool) -> CommandResult {
    let mut output = io::stdout();
    let Progress { turns, of, repeated, left_out, .. } = progress;
    writeln!(
        output,
        "played {} of {of} turns; {repeated} questions came once more than then, {left_out} were left out",
        turns + left_out
    )?;
    let is_whole = turns + left_out == *of;
    match &progress.difference {
        Some(difference) => writeln!(output, "DIFFERS: {difference}")?,
        None if *turns == 0 && !passed => {
            writeln!(output, "NOTHING SENT: the run ended before it sent anything; why, it says above")?
        }
        None if !is_whole => {
            writeln!(output, "SHORTER: what was sent is as then, and ends before the transcript does")?
        }
        None => writeln!(output, "AS THEN")?,
    }
    Ok(ExitCode::from(u8::from(progress.difference.is_some() || !is_whole || !passed)))
}
