//! `plumb wire record`.

use std::fs::File;
use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use plumb_simulated::emulate::transcript::{Entry, LineOptions, Recorder, SerialDevice};

use crate::commands::emulate::typed::Typing;
use crate::failure::CommandResult;

/// Write down what goes over a serial line: sits between a device and whatever drives it, plumb or another program.
///
/// Prints the path of a port; the program opens that (or the link) in place of the device's. Every byte is passed on both ways and written down, until the
/// command is asked to end (Ctrl+C, or `quit` on standard input). What was written is a text that `plumb wire replay` plays.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The device's port.
    port: String,
    /// Its rate.
    #[arg(long, default_value_t = 9600)]
    baud: u32,
    /// The file that is written; one that is there is not overwritten.
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    /// Make a link to the port here, and take it away at the end.
    #[arg(long, value_name = "PATH")]
    link: Option<PathBuf>,
}

/// Why nothing is recorded.
#[derive(Debug, thiserror::Error)]
enum RecordError {
    #[error("{port}: {why}")]
    Port { port: String, why: String },
    #[error("{} cannot be written: {error}", file.display())]
    Output { file: PathBuf, error: io::Error },
}

/// Records until it is asked to end.
pub(super) fn run(arguments: &Arguments) -> CommandResult {
    // Before any thread is there, so that the signals come to this one and nowhere else.
    let mut typing = Typing::listen(false)?;
    let device = SerialDevice::open(&arguments.port, arguments.baud)
        .map_err(|failure| RecordError::Port { port: arguments.port.clone(), why: failure.to_string() })?;
    let failed = |error| RecordError::Output { file: arguments.output.clone(), error };
    let mut file = File::create_new(&arguments.output).map_err(failed)?;
    writeln!(
        file,
        "# plumb wire 1: {}, {} baud. `>` is the program, `<` the device; s at the beginning of a line.",
        arguments.port, arguments.baud
    )
    .map_err(failed)?;
    let note = move |turn: &Entry| write!(file, "{turn}");
    let line = LineOptions { link: arguments.link.clone(), ..LineOptions::default() };
    let recorder = Recorder::start(Box::new(device), Box::new(note), line)?;
    let port = recorder.status().port.unwrap_or_default();
    let mut output = io::stdout();
    writeln!(output, "{}", port.display())?;
    output.flush()?;
    eprintln!(
        "recording {} on {} into {}; Ctrl+C ends it",
        arguments.port,
        port.display(),
        arguments.output.display()
    );
    while recorder.is_working() {
        let Some(lines) = typing.next()? else { break };
        if lines.iter().any(|line| line.trim() == "quit") {
            break;
        }
    }
    let [sent, received] = recorder.status().bytes;
    recorder.stop()?;
    eprintln!(
        "{sent} bytes of the program and {received} of the device are in {}",
        arguments.output.display()
    );
    Ok(ExitCode::SUCCESS)
}
