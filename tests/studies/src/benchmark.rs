//! `plumb-studies benchmark`: hide something, diagnose, compare; many times, with every analyst on the same cases.

mod cards;
mod cells;
mod correlation;
mod error;
mod evidence;
mod formulas;
mod forward_bic;
pub(crate) mod halves;
mod lab;
mod lasso;
pub(crate) mod probabilities;
mod report;
mod ties;
mod trials;

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use serde::Serialize;

use crate::reliability::{Forecast, Reliability};
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
    /// Fraction of the full number of trials.
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Only these cells; all when not given.
    #[arg(long = "cell", value_name = "NAME", conflicts_with = "each")]
    cells: Vec<String>,
    /// Every effect of the library alone, 50 trials each, instead of the cells.
    #[arg(long)]
    each: bool,
    /// Where the lab cannot distinguish candidates: do eight further poses settle it, those it asks for and, beside them, eight
    /// at random? The cells with one effect when none is given.
    #[arg(long, conflicts_with_all = ["each", "analysts"])]
    ties: bool,
    /// Which formulas are offered where nothing is named. The cells with nothing hidden, and with what the library does not list, when none is given.
    #[arg(long, conflicts_with_all = ["each", "analysts", "ties"])]
    formulas: bool,
    /// Whether probabilities mean what they say: a reliability diagram and the Brier score, beside a constant guess.
    #[arg(long, conflicts_with_all = ["each", "analysts", "ties", "formulas"])]
    probabilities: bool,
    /// Whether cards keep their promise: what each says adding it leaves, against what adding it leaves on the rows that were locked away.
    #[arg(long, conflicts_with_all = ["each", "analysts", "ties", "formulas", "probabilities"])]
    cards: bool,
    /// Whether two halves of one table say the same.
    #[arg(long, conflicts_with_all = ["each", "analysts", "ties", "formulas", "probabilities", "cards"])]
    halves: bool,
    /// With --halves: also these tables of real machines, as MODEL:TABLE; may be repeated.
    #[arg(long = "set", value_name = "MODEL:TABLE", requires = "halves")]
    sets: Vec<String>,
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

/// Runs the benchmark; each cell is reported as soon as it is done.
pub(crate) fn run(arguments: &Arguments, folder: Option<&Path>) -> Result<ExitCode, BenchmarkError> {
    let work = work(arguments)?;
    if arguments.probabilities {
        return probabilities(arguments, &work, folder);
    }
    if arguments.cards || arguments.halves {
        return kept_or_replicated(arguments, &work);
    }
    judged(arguments, work)
}

/// What is asked.
fn work(arguments: &Arguments) -> Result<Vec<Work>, BenchmarkError> {
    let tables_alone = !arguments.sets.is_empty() && arguments.cells.is_empty() && arguments.own.is_none();
    Ok(match arguments.own {
        Some(trials) => vec![Work::own(&arguments.campaign, trials, arguments.seed)?],
        None if tables_alone => Vec::new(),
        None if arguments.each => cells::each_effect().into_iter().map(Work::cell).collect(),
        None if arguments.ties && arguments.cells.is_empty() => cells::one_effect().map(Work::cell).collect(),
        None if arguments.formulas && arguments.cells.is_empty() => {
            cells::unlisted_or_nothing().map(Work::cell).collect()
        }
        None => chosen(&arguments.cells)?.into_iter().map(Work::cell).collect(),
    })
}

/// Trials of some work.
fn count(work: &Work, arguments: &Arguments) -> usize {
    ((work.trials() as f64 * arguments.scale).round() as usize).max(1)
}

/// The reliability diagrams, of each cell and of all together.
fn probabilities(
    arguments: &Arguments,
    work: &[Work],
    folder: Option<&Path>,
) -> Result<ExitCode, BenchmarkError> {
    let mut all = probabilities::Forecasts::default();
    let table = |title: String, forecasts: &[Forecast]| {
        Reliability::of(forecasts)
            .map_or_else(|| format!("{title}: no probability was given\n"), |one| one.table(&title))
    };
    for work in work {
        let count = count(work, arguments);
        let diagnosed = probabilities::forecasts(work, arguments.seed, count)?;
        print_line(&table(
            format!("{} ({count} trials): what was named, located or tied", work.title()),
            &diagnosed.verdicts,
        ))?;
        all.take(diagnosed);
    }
    for (name, title, forecasts) in [
        ("verdicts", "what was named, located or tied", &all.verdicts),
        ("candidates", "candidates", &all.candidates),
    ] {
        print_line(&table(format!("\nall: {title}"), forecasts))?;
        if let (Some(folder), Some(reliability)) = (folder, Reliability::of(forecasts)) {
            let picture = reliability.svg(title).map_err(BenchmarkError::Picture)?;
            write(&folder.join(format!("reliability-{name}.svg")), &picture)?;
        }
    }
    keep(arguments, &all)
}

/// Whether cards keep their promise, or halves of a table say the same.
fn kept_or_replicated(arguments: &Arguments, work: &[Work]) -> Result<ExitCode, BenchmarkError> {
    if arguments.cards {
        let mut rows = Vec::new();
        print_line(&cards::heading())?;
        for work in work {
            let row = cards::delivered(work, arguments.seed, count(work, arguments))?;
            print_line(&cards::line(&row))?;
            rows.push(row);
        }
        return keep(arguments, &rows);
    }
    let mut all = Vec::new();
    print_line(&halves::heading())?;
    for work in work {
        let rows = halves::replicated(work, arguments.seed, count(work, arguments))?;
        print_line(&halves::lines(work.title(), &rows))?;
        all.extend(rows);
    }
    for set in &arguments.sets {
        let (model, table) = set.split_once(':').ok_or_else(|| BenchmarkError::Set(set.clone()))?;
        let rows = halves::of_files(Path::new(model), Path::new(table), arguments.seed)?;
        print_line(&halves::lines(table, &rows))?;
        all.extend(rows);
    }
    keep(arguments, &all)
}

/// How right every analyst is, what settles ties, or which formulas are offered.
fn judged(arguments: &Arguments, work: Vec<Work>) -> Result<ExitCode, BenchmarkError> {
    let analysts =
        if arguments.analysts.is_empty() { Analyst::ALL.to_vec() } else { arguments.analysts.clone() };
    let count = |work: &Work| count(work, arguments);
    if arguments.ties {
        let mut rows = Vec::new();
        print_line(&ties::heading())?;
        for work in work {
            let row = ties::settle(&work, arguments.seed, count(&work))?;
            print_line(&ties::lines(&row))?;
            rows.push(row);
        }
        return keep(arguments, &rows);
    }
    if arguments.formulas {
        let mut rows = Vec::new();
        print_line(&formulas::heading())?;
        for work in work {
            let row = formulas::offered(&work, arguments.seed, count(&work))?;
            print_line(&formulas::line(&row))?;
            rows.push(row);
        }
        return keep(arguments, &rows);
    }
    let mut rows = Vec::new();
    print_line(&report::heading())?;
    for work in work {
        let count = count(&work);
        print_line(&format!("{} ({count} trials)\n", work.title()))?;
        let trials = all_trials(&work, &analysts, arguments.seed, count)?;
        for (analyst, trials) in analysts.iter().zip(trials) {
            let row = report::summary(work.name(), *analyst, trials);
            print_line(&report::line(&row))?;
            rows.push(row);
        }
    }
    keep(arguments, &rows)
}

/// Writes the figures where they are asked for.
fn keep(arguments: &Arguments, rows: &impl Serialize) -> Result<ExitCode, BenchmarkError> {
    if let Some(path) = &arguments.json {
        let text = serde_json::json!({"seed": arguments.seed, "scale": arguments.scale, "rows": rows});
        write(path, &format!("{text:#}\n"))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write(path: &Path, text: &str) -> Result<(), BenchmarkError> {
    let failed = |source| BenchmarkError::Write { path: path.to_owned(), source };
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).map_err(failed)?;
    }
    fs::write(path, text).map_err(failed)
}

fn print_line(text: &str) -> Result<(), BenchmarkError> {
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
