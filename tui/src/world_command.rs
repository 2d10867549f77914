//! `plumb world`: the simulated world as a process of its own. Cells start it for themselves; it is not in the help.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use plumb_simulated::protocol;
use plumb_simulated::serve::{ServeOptions, serve};

use crate::failure::CommandResult;

/// Serve a simulated world until it is told to end or nobody has been there for long.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Where the world listens.
    #[arg(long)]
    socket: PathBuf,
    /// The world file.
    #[arg(long)]
    file: PathBuf,
    /// How time runs: as the wall's, or as fast as it can.
    #[arg(long, value_enum, default_value = "real")]
    pace: Pace,
    /// The world ends when nobody has been there for so long.
    #[arg(long, value_name = "MINUTES", default_value_t = 15.0, value_parser = minutes)]
    idle_minutes: f64,
}

/// How the world's time runs.
#[derive(Clone, Copy, clap::ValueEnum)]
enum Pace {
    /// As the wall's.
    Real,
    /// As fast as it can.
    Fast,
}

/// Serves the world.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    serve(&ServeOptions {
        file: arguments.file.clone(),
        socket: arguments.socket.clone(),
        pace: match arguments.pace {
            Pace::Real => protocol::Pace::Real,
            Pace::Fast => protocol::Pace::Fast,
        },
        idle: Duration::from_secs_f64(arguments.idle_minutes * 60.0),
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Minutes, above 0 and at most a year of them.
fn minutes(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(minutes) if minutes > 0.0 && minutes <= 525_600.0 => Ok(minutes),
        _ => Err("give minutes, above 0 and at most 525600".to_owned()),
    }
}
