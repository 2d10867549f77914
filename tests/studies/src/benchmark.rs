//! `plumb-studies benchmark`: hide something, diagnose, compare; many times, with every analyst on the same cases.

mod cells;
mod correlation;
mod error;
mod evidence;
mod formulas;
mod forward_bic;
mod interval;
mod lab;
mod lasso;
mod report;
mod ties;
mod trials;

use std::fs;
use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use cells::{CELLS, Cell, Work};
use error::BenchmarkError;
use plumb::commands::trial::arguments::CampaignArguments;
use trials::{Analyst, all_trials};

/// Options of `plumb-studies benchmark`.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Seed of the first trial of every cell.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Share of the full number of trials.
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Only these cells; all when not given.
    #[arg(long = "cell", value_name = "NAME", conflicts_with = "each")]
    cells: Vec<String>,
    /// Every effect of the library alone, 50 trials each, instead of the cells.
    #[arg(long)]
    each: bool,
    /// Where the lab cannot tell candidates apart: do eight further poses settle it, those it asks for and, beside them, eight
    /// by lot? The cells with one effect when none is given.
    #[arg(long, conflicts_with_all = ["each", "analysts"])]
    ties: bool,
    /// Which formulas are offered where nothing is named. The cells with nothing hidden, and with what the library does not list, when none is given.
    #[arg(long, conflicts_with_all = ["each", "analysts", "ties"])]
    formulas: bool,
    /// Instead of the cells, so many trials of the campaign that the options of `plumb trial new` describe.
    #[arg(long, value_name = "TRIALS", conflicts_with_all = ["cells", "each"])]
    own: Option<usize>,
    #[command(flatten)]
    campaign: CampaignArguments,
    /// Only these analysts; all when not given.
    #[arg(long = "analyst", value_enum)]
    analysts: Vec<Analyst>,
    /// Write every figure and the seeds of the trials that went wrong as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Runs the benchmark; each cell is told as soon as it is done.
pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode, BenchmarkError> {
    let work: Vec<Work> = match arguments.own {
        Some(trials) => vec![Work::own(&arguments.campaign, trials, arguments.seed)?],
        None if arguments.each => cells::each_effect().into_iter().map(Work::cell).collect(),
        None if arguments.ties && arguments.cells.is_empty() => cells::one_effect().map(Work::cell).collect(),
        None if arguments.formulas && arguments.cells.is_empty() => {
            cells::unlisted_or_nothing().map(Work::cell).collect()
        }
        None => chosen(&arguments.cells)?.into_iter().map(Work::cell).collect(),
    };
    let analysts =
        if arguments.analysts.is_empty() { Analyst::ALL.to_vec() } else { arguments.analysts.clone() };
    let count = |work: &Work| ((work.trials() as f64 * arguments.scale).round() as usize).max(1);
    if arguments.ties {
        let mut rows = Vec::new();
        say(&ties::heading())?;
        for work in work {
            let row = ties::settle(&work, arguments.seed, count(&work))?;
            say(&ties::lines(&row))?;
            rows.push(row);
        }
        return keep(arguments, &rows);
    }
    if arguments.formulas {
        let mut rows = Vec::new();
        say(&formulas::heading())?;
        for work in work {
            let row = formulas::offered(&work, arguments.seed, count(&work))?;
            say(&formulas::line(&row))?;
            rows.push(row);
        }
        return keep(arguments, &rows);
    }
    let mut rows = Vec::new();
    say(&report::heading())?;
    for work in work {
        let count = count(&work);
        say(&format!("{} ({count} trials)\n", work.title()))?;
        let trials = all_trials(&work, &analysts, arguments.seed, count)?;
        for (analyst, trials) in analysts.iter().zip(trials) {
            let row = report::summary(work.name(), *analyst, trials);
            say(&report::line(&row))?;
            rows.push(row);
        }
    }
    keep(arguments, &rows)
}

/// Writes the figures where they are asked for.
fn keep(arguments: &Arguments, rows: &impl Serialize) -> Result<ExitCode, BenchmarkError> {
    if let Some(path) = &arguments.json {
        let text = serde_json::json!({"seed": arguments.seed, "scale": arguments.scale, "rows": rows});
        fs::write(path, format!("{text:#}\n"))
            .map_err(|source| BenchmarkError::Write { path: path.clone(), source })?;
    }
    Ok(ExitCode::SUCCESS)
}

fn say(text: &str) -> Result<(), BenchmarkError> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(BenchmarkError::Output)
}

fn chosen(names: &[String]) -> Result<Vec<Cell>, BenchmarkError> {
    if names.is_empty() {
        return Ok(CELLS.to_vec());
    }
    let find = |name: &String| {
        CELLS.iter().find(|cell| cell.name == name).copied().ok_or_else(|| BenchmarkError::UnknownCell {
            name: name.clone(),
            known: CELLS.map(|cell| cell.name).join(", "),
        })
    };
    names.iter().map(find).collect()
}
