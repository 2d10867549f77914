//! Examples under the help of commands.

use std::fmt::Write as _;

use super::cells_examples::CELLS_EXAMPLES;
use super::example::Example;
use super::examples::EXAMPLES;
use super::result_examples::RESULT_EXAMPLES;

/// The examples of a command.
fn of(path: &str) -> &'static [Example] {
    let mut all = EXAMPLES.iter().chain(CELLS_EXAMPLES).chain(RESULT_EXAMPLES);
    all.find(|(known, _)| *known == path).map_or(&[], |(_, examples)| *examples)
}

/// The command with examples under its help, and so all below it.
pub(super) fn add(command: clap::Command, path: &str) -> clap::Command {
    let mut shown: Vec<&Example> = of(path).iter().collect();
    if shown.is_empty() {
        shown = of_group(&command, path);
    }
    let command = if shown.is_empty() { command } else { command.after_help(text(&shown)) };
    command.mut_subcommands(|one| {
        let path = format!("{path} {}", one.get_name());
        add(one, path.trim())
    })
}

/// Examples shown under the help of a command that others are under.
const OF_A_GROUP: usize = 3;

/// The first example of each of the first commands under another, all of an only one; none of the program itself, whose help is an overview.
fn of_group(command: &clap::Command, path: &str) -> Vec<&'static Example> {
    let below = command.get_subcommands().filter(|one| !path.is_empty() && !one.is_hide_set());
    match below.map(|one| of(&format!("{path} {}", one.get_name()))).collect::<Vec<_>>().as_slice() {
        [only] => only.iter().collect(),
        all => all.iter().filter_map(|examples| examples.first()).take(OF_A_GROUP).collect(),
    }
}

fn text(examples: &[&Example]) -> String {
    let mut text = String::from("Examples:");
    for Example { line, what } in examples {
        let _ = write!(text, "\n  {line}\n      {what}");
    }
    text
}
