//! The command line as a whole: the commands, grouped by what a person wants to do, each with examples. Help, manual pages and completions are
//! made from this.

mod cells_examples;
mod example;
mod examples;
mod groups;
mod help_examples;
mod result_examples;

use std::path::PathBuf;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};

use crate::commands::{
    alert, answer, certificate, check, completions, doctor, emulate, fleet, history, host, init, man, model,
    note, plugins, queue, record, report, run, schema, serve, ship, show, streams, stripe, study, target,
    trial, watch, wire, world,
};

/// Calibrates lab robots: runs the procedures of workcells, and shows where the model of a machine fails and what it lacks.
#[derive(Parser)]
#[command(name = "plumb", version)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    /// Write what happens inside into this file, at its end. RUST_LOG says how much, as in RUST_LOG=debug, and puts it on standard error too. A
    /// run has a log of its own: `logs/run-NUMBER.log` beside the record.
    #[arg(long, value_name = "FILE", global = true)]
    pub(crate) log: Option<PathBuf>,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    Init(init::Arguments),
    Run(run::Arguments),
    Watch(watch::Arguments),
    Answer(answer::Arguments),
    Target(target::Arguments),
    Check(check::Arguments),
    Doctor(doctor::Arguments),
    History(history::Arguments),
    Show(show::Arguments),
    Certificate(certificate::Arguments),
    Note(note::Arguments),
    /// Runs that wait for their cell: add, reorder and remove them while one goes on, and carry them out unattended.
    #[command(subcommand)]
    Queue(queue::QueueCommand),
    /// Look after the record: copy it, check it, list corrections and bring earlier ones back.
    #[command(subcommand)]
    Record(record::RecordCommand),
    Serve(serve::Arguments),
    Ship(ship::Arguments),
    Fleet(fleet::Arguments),
    Alert(alert::Arguments),
    /// Compare a model with measurements, see what it lacks, add it, watch the error fall.
    #[command(subcommand)]
    Model(model::ModelCommand),
    /// Reports after standards, from measurement tables: ISO 230-2 of an axis, ISO 9283 of a robot, with an uncertainty budget by effect.
    #[command(subcommand)]
    Report(report::ReportCommand),
    /// What the stripes of a light stripe sensor say of the arm that carries it.
    #[command(subcommand)]
    Stripe(stripe::StripeCommand),
    /// Blind trials: measurements of an arm that hides something, and the answer under seal.
    #[command(subcommand)]
    Trial(trial::TrialCommand),
    /// The controller of an arm on a pseudo-terminal, to try its driver without the arm.
    #[command(subcommand)]
    Emulate(emulate::EmulateCommand),
    /// What goes over a device's line: record it, and hold what plumb sends against a record.
    #[command(subcommand)]
    Wire(wire::WireCommand),
    Study(study::StudyArguments),
    Streams(streams::Arguments),
    /// The plugins that can be found, and whether they can be used.
    #[command(subcommand)]
    Plugins(plugins::PluginsCommand),
    Schema(schema::Arguments),
    Completions(completions::Arguments),
    Man(man::Arguments),
    #[command(hide = true)]
    Host(host::Arguments),
    #[command(hide = true)]
    World(world::Arguments),
}

/// The command line, with its overview and its examples.
pub fn command() -> clap::Command {
    let with_examples = help_examples::add(Arguments::command(), "");
    let overview = groups::overview(&with_examples);
    with_examples.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{overview}Options:\n{{options}}"
    ))
}

/// Reads the arguments of this process; prints help and mistakes and ends the program, as clap does.
pub(crate) fn parse() -> Arguments {
    let mut command = command();
    let matches = command.get_matches_mut();
    Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.format(&mut command).exit())
}
