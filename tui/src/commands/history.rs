//! `plumb history`: the runs in the record, and how corrections went over time.

mod trend;

use std::path::PathBuf;
use std::process::ExitCode;

use plumb_record::{Record, RunEnd, RunFilter, RunSummary, is_day};
use plumb_report::csv::csv_field;
use plumb_report::run_words::{ended_in_words, state_in_words};

use crate::failure::CommandResult;
use crate::print_line::print_line;
use crate::record_directory::record_directory;
use crate::screens;

/// List the runs in the record, the newest first; or, with --trend, what runs found for one joint over time.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Where the record lies [default: `plumb` in $XDG_STATE_HOME, which is ~/.local/state where that is not set].
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// At most so many.
    #[arg(short = 'n', long, default_value_t = 20)]
    number: u32,
    /// Only runs of this cell.
    #[arg(long, value_name = "NAME")]
    cell: Option<String>,
    /// Only runs of this procedure.
    #[arg(long, value_name = "NAME", conflicts_with = "trend")]
    procedure: Option<String>,
    /// Only runs by this operator.
    #[arg(long, value_name = "NAME", conflicts_with = "trend")]
    operator: Option<String>,
    /// Only runs that ended so; `open` for those that have not.
    #[arg(long, value_enum, conflicts_with = "trend")]
    ended: Option<Ended>,
    /// Only runs of this day or later, as 2026-11-21 (UTC).
    #[arg(long, value_name = "DAY", value_parser = day)]
    since: Option<String>,
    /// Only runs of this day or earlier.
    #[arg(long, value_name = "DAY", value_parser = day)]
    until: Option<String>,
    /// What runs found for one joint over time, as in arm.waist.
    #[arg(long, value_name = "DEVICE.JOINT")]
    trend: Option<String>,
    /// As JSON, one run (or one finding) a line.
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// As CSV.
    #[arg(long)]
    csv: bool,
    /// On a screen: runs with a filter, one in full, corrections over time.
    #[arg(long, conflicts_with_all = ["json", "csv", "trend"])]
    screen: bool,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
enum Ended {
    Passed,
    Failed,
    Error,
    Aborted,
    NeedsOperator,
    Open,
}

impl Ended {
    /// As the record writes it.
    fn state(self) -> &'static str {
        match self {
            Ended::Passed => RunEnd::Passed.name(),
            Ended::Failed => RunEnd::Failed.name(),
            Ended::Error => RunEnd::Error.name(),
            Ended::Aborted => RunEnd::Aborted.name(),
            Ended::NeedsOperator => RunEnd::NeedsOperator.name(),
            Ended::Open => "running",
        }
    }
}

fn day(text: &str) -> Result<String, String> {
    match is_day(text) {
        true => Ok(text.to_owned()),
        false => Err("write year, month and day, as in 2026-11-21".to_owned()),
    }
}

/// Prints the list.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let directory = record_directory(arguments.record.as_ref())?;
    if arguments.screen {
        screens::browse(directory)?;
        return Ok(ExitCode::SUCCESS);
    }
    let record = Record::open(&directory)?;
    if let Some(site) = &arguments.trend {
        return trend::print(&record, site, arguments);
    }
    let filter = RunFilter {
        cell: arguments.cell.clone(),
        procedure: arguments.procedure.clone(),
        operator: arguments.operator.clone(),
        state: arguments.ended.map(|ended| ended.state().to_owned()),
        since: arguments.since.clone(),
        until: arguments.until.clone(),
        limit: arguments.number,
    };
    let runs = record.find_runs(&filter)?;
    if arguments.json {
        for run in &runs {
            print_line!("{}", serde_json::to_string(run)?)?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    if arguments.csv {
        print_line!("run,started,ended,outcome,cell,procedure,operator,message")?;
        for run in &runs {
            print_line!("{}", csv_row(run))?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    if runs.is_empty() {
        let such =
            if filter == (RunFilter { limit: filter.limit, ..RunFilter::default() }) { "" } else { "such " };
        print_line!("no {such}runs in {}", directory.display())?;
        return Ok(ExitCode::SUCCESS);
    }
    for line in table(&runs) {
        print_line!("{line}")?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The runs as a table whose columns are as wide as what is in them.
fn table(runs: &[RunSummary]) -> Vec<String> {
    let head = ["run", "started (UTC)", "ended", "cell", "procedure", "by"].map(str::to_owned);
    let row = |run: &RunSummary| {
        [
            run.run.0.to_string(),
            run.started.get(..19).unwrap_or(&run.started).replace('T', " "),
            ended_in_words(run),
            run.cell.clone(),
            run.procedure.clone(),
            run.operator.clone(),
        ]
    };
    let rows: Vec<[String; 6]> = std::iter::once(head).chain(runs.iter().map(row)).collect();
    let width =
        |column: usize| rows.iter().map(|row| row.get(column).map_or(0, |cell| cell.chars().count())).max();
    let widths: [usize; 6] = std::array::from_fn(|column| width(column).unwrap_or(0));
    let line = |[run, started, ended, cell, procedure, by]: &[String; 6]| {
        let [wide_run, wide_started, wide_ended, wide_cell, wide_procedure, _] = widths;
        format!(
            "{run:>wide_run$}  {started:<wide_started$}  {ended:<wide_ended$}  {cell:<wide_cell$}  {procedure:<wide_procedure$}  {by}"
        )
    };
    rows.iter().map(line).collect()
}

fn csv_row(run: &RunSummary) -> String {
    let fields = [
        run.run.to_string(),
        run.started.clone(),
        run.ended.clone().unwrap_or_default(),
        state_in_words(run).to_owned(),
        run.cell.clone(),
        run.procedure.clone(),
        run.operator.clone(),
        run.message.clone().unwrap_or_default(),
    ];
    fields.map(|field| csv_field(&field)).join(",")
}
