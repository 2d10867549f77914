//! `plumb fleet`: many cells on one page, from the central database.

mod chart;
mod page;
mod print;
mod screen;
mod screen_view;
mod series;
mod serve;
mod words;

use std::net::SocketAddr;
use std::process::ExitCode;

use plumb_central::Central;

use crate::failure::CommandResult;
use crate::unchecked_server::warn_unchecked;
use series::Asked;

/// Many cells at a glance, from the central database that `plumb ship` fills: what each does, which one waits for an answer and for how long, and how a
/// correction or an effect went over months and machines. Printed, on a terminal screen that renews itself, or as a page for browsers.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The database: postgres://USER@HOST/DATABASE.
    #[arg(long, value_name = "ADDRESS")]
    from: String,
    /// One correction over time, over all cells: DEVICE.JOINT, as in `arm.waist`.
    #[arg(long, value_name = "DEVICE.JOINT", conflicts_with = "effect")]
    trend: Option<String>,
    /// One effect of the arms' models over time, over all cells: `joint_compliance(shoulder)`.
    #[arg(long, value_name = "EFFECT")]
    effect: Option<String>,
    /// Only cells with this arm, as their model files name it.
    #[arg(long, value_name = "NAME")]
    arm: Option<String>,
    /// Show the cells on a terminal screen that renews itself, who waits first.
    #[arg(long, conflicts_with_all = ["trend", "effect", "json", "serve"])]
    screen: bool,
    /// A line of JSON for each cell or value.
    #[arg(long)]
    json: bool,
    /// Serve a page instead. Only on this machine's own addresses; from another room come by a tunnel (`ssh -L 8718:localhost:8718 MACHINE`) or through a proxy with TLS.
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        num_args = 0..=1,
        default_missing_value = "127.0.0.1:8718",
        conflicts_with_all = ["trend", "effect", "arm", "json"]
    )]
    serve: Option<SocketAddr>,
    /// With --serve: a name under which a proxy is reached, beside localhost. May be given more than once.
    #[arg(long, value_name = "NAME", requires = "serve")]
    name: Vec<String>,
}

/// Prints or serves it.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    // What cannot be asked is reported before anything is connected.
    let asked = match (&arguments.trend, &arguments.effect) {
        (Some(correction), _) => Some(Asked::correction(correction)?),
        (_, Some(effect)) => Some(Asked::effect(effect)?),
        _ => None,
    };
    warn_unchecked("fleet", &arguments.from)?;
    if let Some(listen) = arguments.serve {
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
        runtime.block_on(serve::serve(&arguments.from, listen, arguments.name.clone()))?;
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.screen {
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
        runtime.block_on(screen::show(&arguments.from, arguments.arm.clone()))?;
        return Ok(ExitCode::SUCCESS);
    }
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let mut central = Central::connect(&arguments.from).await?;
        let arm = arguments.arm.as_deref();
        match asked {
            None => {
                let mut cells = central.cells().await?;
                cells.retain(|cell| arm.is_none_or(|arm| cell.arm.as_deref() == Some(arm)));
                print::cells(&cells, arguments.json)
            }
            Some(asked) => print::series(&series::points(&mut central, &asked, arm).await?, arguments.json),
        }
    })?;
    Ok(ExitCode::SUCCESS)
}
