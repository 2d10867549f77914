//! `plumb stripe`: what the stripes of a light stripe sensor say of the arm that carries it and of its rig.

mod adjust;
mod cell_text;
mod correct;
mod diagnose;
mod export;
mod lab;
mod lab_error;
mod next;
mod rig_in_force;
mod screen;
mod show;
pub mod study_world;

use clap::Subcommand;

use crate::failure::CommandResult;

pub(crate) use lab::Lab as Stripes;

/// What to do with stripes.
#[derive(Debug, Subcommand)]
pub(crate) enum StripeCommand {
    /// Say what zeros and rig cannot explain of scans, if anything: the diagnosis of `plumb model diagnose`, of stripes.
    Diagnose(diagnose::Arguments),
    /// Pictures to take next: poses at which what is open would show, beside those that were taken.
    Next(next::Arguments),
    /// The same on the Model screen, with what adding an effect would leave.
    Screen(screen::Arguments),
    /// Adjust zeros, rig and what is added to scans, and write a cell that uses what was found.
    Adjust(adjust::Arguments),
    /// Write the rig in force, the rig file with the corrections of the record, as a rig file of its own, and a cell that uses it.
    Correct(correct::Arguments),
    Show(show::Arguments),
    Export(export::Arguments),
}

/// Runs one of the commands.
pub(crate) fn run(command: &StripeCommand) -> CommandResult {
    match command {
        StripeCommand::Diagnose(arguments) => diagnose::run(arguments),
        StripeCommand::Next(arguments) => next::run(arguments),
        StripeCommand::Screen(arguments) => screen::run(arguments),
        StripeCommand::Adjust(arguments) => adjust::run(arguments),
        StripeCommand::Correct(arguments) => correct::run(arguments),
        StripeCommand::Show(arguments) => show::run(arguments),
        StripeCommand::Export(arguments) => export::run(arguments),
    }
}
