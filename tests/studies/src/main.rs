//! `plumb-studies`: the research behind the tables of the manual. A development program: the product holds none of it.
//!
//! Simulated cells need a process for their world, for each device and for an emulated controller; a run as a user makes it is a process as well. All of these
//! are the program itself, started again with a command of `plumb`.

#![warn(clippy::print_stdout, reason = "`print_line!` gives an error where `println!` panics")]

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod benchmark;
mod inject;
mod interval;
mod method;
mod reliability;
mod stripes;

/// Studies of plumb: how often the diagnosis is right beside its peers, how well the initialization does, what stripes give away.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    study: Study,
    /// Write each figure there as SVG and CSV.
    #[arg(short, long, value_name = "DIR", global = true)]
    output: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Study {
    /// Hide effects in simulated arms, diagnose, compare, many times: how often is the truth found, and by whom.
    Benchmark(benchmark::Arguments),
    /// Table 2-1, figures and single numbers of Yang & Siegel 1987, computed anew.
    Paper,
    Repeatability(method::repeatability::Arguments),
    /// What each imperfection of arm and sensor costs, alone: 100 random starts each.
    Imperfections(method::Chosen),
    /// The paper's method and its rivals, with the arm's lengths known rightly and wrongly: error, time, steps.
    Methods(method::Chosen),
    /// The reviewer's doubts, a figure each.
    Doubts(method::Chosen),
    /// Hide effects in measurements of real machines: how often are they named, in the set, or something else named.
    Inject(inject::Arguments),
    /// Hide an effect in sealed worlds, find it from stripes, and measure the direction-dependent error before and after.
    Stripes(stripes::Arguments),
}

/// Commands of `plumb` that a study, or what tidies up after it, starts as processes of their own.
const PROCESSES: [&str; 6] = ["host", "world", "emulate", "run", "stripe", "doctor"];

fn main() -> ExitCode {
    if std::env::args().nth(1).is_some_and(|command| PROCESSES.contains(&command.as_str())) {
        return plumb::program();
    }
    plumb::signals::let_through();
    let Arguments { study, output } = Arguments::parse();
    let folder = output.as_deref();
    let result = match &study {
        Study::Benchmark(arguments) => benchmark::run(arguments, folder).map_err(Into::into),
        Study::Inject(arguments) => inject::run(arguments).map_err(Into::into),
        Study::Paper => method::ended(method::paper::run(folder)),
        Study::Repeatability(arguments) => method::ended(method::repeatability::run(arguments, folder)),
        Study::Imperfections(chosen) => {
            method::ended(method::imperfect::run("imperfections", chosen, folder))
        }
        Study::Methods(chosen) => method::ended(method::imperfect::run("methods", chosen, folder)),
        Study::Doubts(chosen) => method::ended(method::imperfect::run("doubts", chosen, folder)),
        Study::Stripes(arguments) => stripes::run(arguments, folder),
    };
    plumb::failure::exit_code(result)
}
