//! `plumb world`: the simulated world as a process of its own. Cells start it for themselves; it is not in the help.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use plumb_simulated::protocol;
use plumb_simulated::serve::{ServeOptions, serve};
use plumb_simulated::world_file;

use crate::failure::CommandResult;

/// Serve a simulated world until it is asked to end or nobody has been there for long.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The world file, sealed or open.
    #[arg(long)]
    file: PathBuf,
    #[command(flatten)]
    purpose: Purpose,
    /// Draw what is left to chance from this seed instead of the file's.
    #[arg(long)]
    seed: Option<u64>,
    /// How time runs: as the wall's, or as fast as it can.
    #[arg(long, value_enum, default_value = "real")]
    pace: Pace,
    /// The world ends when nobody has been there for so long.
    #[arg(long, value_name = "MINUTES", default_value_t = 15.0, value_parser = minutes)]
    idle_minutes: f64,
    /// The socket's directory is this world's alone, and goes with it.
    #[arg(long, requires = "socket")]
    owns_directory: bool,
}

/// What is wanted of the world file.
#[derive(clap::Args)]
#[group(required = true, multiple = false)]
struct Purpose {
    /// Serve the world, listening here.
    #[arg(long)]
    socket: Option<PathBuf>,
    /// Write the file under a seal, so that its faults cannot be read from it, and end.
    #[arg(long, value_name = "SEALED")]
    seal: Option<PathBuf>,
    /// Print what is under the file's seal, and end.
    #[arg(long)]
    reveal: bool,
}

/// How the world's time runs.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Pace {
    /// As the wall's.
    Real,
    /// As fast as it can.
    Fast,
}

/// Serves the world, or seals or reveals its file.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    if let Some(sealed) = &arguments.purpose.seal {
        world_file::write_sealed(&arguments.file, sealed)?;
    }
    if arguments.purpose.reveal {
        let described = world_file::read(&arguments.file)?;
        let text = described.sealed_text().ok_or("the file is not sealed: read it as it is")?;
        std::io::stdout().write_all(text.as_bytes())?;
    }
    if let Some(socket) = &arguments.purpose.socket {
        // The world outlives anyone who started it: what a terminal sends to a cell's processes must not end it. Started from a shell
        // by hand it leads a group already, is refused this, and obeys the keyboard.
        let _leads_already = nix::unistd::setsid();
        let served = serve(&ServeOptions {
            file: arguments.file.clone(),
            socket: socket.clone(),
            seed: arguments.seed,
            pace: match arguments.pace {
                Pace::Real => protocol::Pace::Real,
                Pace::Fast => protocol::Pace::Fast,
            },
            idle: Duration::from_secs_f64(arguments.idle_minutes * 60.0),
        });
        if let (Ok(()), true, Some(directory)) = (&served, arguments.owns_directory, socket.parent()) {
            // Anyone who ended this world may be removing it as well.
            let _removed = std::fs::remove_dir_all(directory);
        }
        served?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Minutes, above 0 and at most a year of them.
fn minutes(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(minutes) if minutes > 0.0 && minutes <= 525_600.0 => Ok(minutes),
        _ => Err("give minutes, above 0 and at most 525600".to_owned()),
    }
}
