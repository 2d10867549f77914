//! What a shell completes. The shell asks this program with a variable of the environment set: commands and options come from the command line,
//! names of effects and cells from what lies here.

use std::io::{self, Write};

use clap_complete::CompletionCandidate;
use clap_complete::env::{CompleteEnv, Shells};
use plumb_calibration::effect;
use plumb_record::{Record, default_directory};

/// With this set to a shell's name the program completes and ends.
const VARIABLE: &str = "PLUMB_COMPLETE";

/// The shells that can be served.
pub(crate) fn shells() -> Vec<&'static str> {
    Shells::builtins().names().collect()
}

/// Where a shell asks for completions, they are printed and the program ends.
pub(crate) fn serve(command: fn() -> clap::Command) {
    CompleteEnv::with_factory(command).var(VARIABLE).complete();
}

/// Writes what a shell reads once to ask for completions from then on.
///
/// # Errors
/// It cannot be written, or there is no such shell.
pub(crate) fn write_script(shell: &str, out: &mut dyn Write) -> io::Result<()> {
    let shells = Shells::builtins();
    let Some(completer) = shells.completer(shell) else {
        return Err(io::Error::other(format!(
            "no completions for `{shell}`; there are {}",
            self::shells().join(", ")
        )));
    };
    completer.write_registration(VARIABLE, "plumb", "plumb", "plumb", out)
}

/// Effects of the library, each with what it is.
pub(crate) fn effects() -> Vec<CompletionCandidate> {
    let kinds = effect::kinds().iter();
    kinds.map(|kind| CompletionCandidate::new(kind.name).help(Some(kind.sentence.into()))).collect()
}

/// Cells of which the record where it usually is holds runs.
pub(crate) fn recorded_cells() -> Vec<CompletionCandidate> {
    /// As many runs are looked at.
    const RUNS: u32 = 1000;
    // A completion makes no record where there is none, and has nobody to inform of one that cannot be read.
    let Some(directory) = default_directory().ok().filter(|directory| directory.is_dir()) else {
        return Vec::new();
    };
    let runs = Record::open(&directory).and_then(|record| record.history(RUNS)).unwrap_or_default();
    let mut names: Vec<String> = runs.into_iter().map(|run| run.cell).collect();
    names.sort();
    names.dedup();
    names.into_iter().map(CompletionCandidate::new).collect()
}
