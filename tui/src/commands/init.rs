//! `plumb init`: an example cell to begin with, put where the user is.

mod error;
mod shipped;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap_complete::{ArgValueCandidates, CompletionCandidate};
use plumb_document::did_you_mean;

use crate::failure::CommandResult;
use crate::print_line::print_line;
use error::InitError;
use shipped::{Shipped, shipped_cells};

/// Put an example cell where you are, ready to run. Each has a simulated cell that needs no hardware. Nothing is overwritten.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The folder to put it in; it gets a folder of the cell's name there.
    #[arg(value_name = "DIR", default_value = ".")]
    directory: PathBuf,
    /// Which example; can be given several times.
    #[arg(long, value_name = "NAME", default_value = "teachmover", add = ArgValueCandidates::new(candidates))]
    cell: Vec<String>,
    /// List the examples there are; nothing is written.
    #[arg(long, conflicts_with = "cell")]
    list: bool,
    /// Take the examples from this folder instead of the installed one.
    #[arg(long, value_name = "DIR")]
    from: Option<PathBuf>,
}

/// Lists the examples, or copies those that were asked for with what they need.
pub(crate) fn run(arguments: &Arguments) -> CommandResult {
    let examples = shipped_cells(arguments.from.as_deref())?;
    if arguments.list {
        for example in &examples {
            print_line!("{:<14}{}", example.name, example.title)?;
        }
        return Ok(ExitCode::SUCCESS);
    }
    let requested = arguments.cell.iter().map(|name| find(&examples, name)).collect::<Result<Vec<_>, _>>()?;
    // All is looked at before anything is written. What others use and is there whole, from an earlier time, stays as it is.
    let mut copied = Vec::new();
    for example in with_needs(&examples, &requested) {
        let destination = arguments.directory.join(&example.name);
        let is_requested = requested.iter().any(|requested| requested.name == example.name);
        if destination.symlink_metadata().is_err() {
            copied.push(example);
        } else if is_requested || !holds_all(&destination, &example.folder)? {
            return Err(InitError::Exists { path: destination }.into());
        }
    }
    for example in &copied {
        copy(&example.folder, &arguments.directory.join(&example.name))?;
    }
    for example in &requested {
        print_next(example, &arguments.directory)?;
    }
    for example in copied.iter().filter(|one| requested.iter().all(|requested| requested.name != one.name)) {
        let destination = arguments.directory.join(&example.name);
        print_line!("{}: {}, whose files are used too", destination.display(), example.title)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Whether a folder has every file that another one has, by their names.
fn holds_all(folder: &Path, other: &Path) -> Result<bool, InitError> {
    for entry in fs::read_dir(other).map_err(InitError::io(other))? {
        let path = entry.map_err(InitError::io(other))?.path();
        let here = folder.join(path.file_name().unwrap_or_default());
        let is_there = if path.is_dir() { here.is_dir() && holds_all(&here, &path)? } else { here.is_file() };
        if !is_there {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The examples that are installed, each with its title, for a shell; none where they are not found.
fn candidates() -> Vec<CompletionCandidate> {
    let examples = shipped_cells(None).unwrap_or_default().into_iter();
    examples.map(|one| CompletionCandidate::new(one.name).help(Some(one.title.into()))).collect()
}

fn find<'a>(examples: &'a [Shipped], name: &str) -> Result<&'a Shipped, InitError> {
    examples.iter().find(|example| example.name == name).ok_or_else(|| InitError::Unknown {
        name: name.to_owned(),
        help: did_you_mean(name, examples.iter().map(|example| example.name.as_str())),
    })
}

/// The wanted examples, and those whose files they use, each once.
fn with_needs<'a>(examples: &'a [Shipped], requested: &[&'a Shipped]) -> Vec<&'a Shipped> {
    let mut all: Vec<&Shipped> = Vec::new();
    let mut open: Vec<&Shipped> = requested.iter().rev().copied().collect();
    while let Some(next) = open.pop() {
        if all.iter().any(|known| known.name == next.name) {
            continue;
        }
        all.push(next);
        open.extend(examples.iter().filter(|example| next.needs.contains(&example.name)));
    }
    all
}

/// Copies a folder with all in it. The copy can be written to, whatever the rights of an installed original.
fn copy(from: &Path, to: &Path) -> Result<(), InitError> {
    fs::create_dir_all(to).map_err(InitError::io(to))?;
    for entry in fs::read_dir(from).map_err(InitError::io(from))? {
        let entry = entry.map_err(InitError::io(from))?;
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if source.is_dir() {
            copy(&source, &target)?;
        } else {
            let bytes = fs::read(&source).map_err(InitError::io(&source))?;
            fs::write(&target, bytes).map_err(InitError::io(&target))?;
        }
    }
    Ok(())
}

/// What was written, and what to type next.
fn print_next(example: &Shipped, directory: &Path) -> io::Result<()> {
    let folder = directory.join(&example.name);
    print_line!("{}: {}", folder.display(), example.title)?;
    let cell = folder.join("cell.yaml");
    if cell.is_file() {
        let cell = quoted(&cell);
        print_line!("  plumb check {cell}            # its files are in order")?;
        print_line!("  plumb run {cell} --dry-run    # what it would do")?;
        print_line!("  plumb run {cell}              # do it, on the screens")?;
    }
    if folder.join("README.md").is_file() {
        print_line!("  Read on in {}", folder.join("README.md").display())?;
    }
    Ok(())
}

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = text.chars().all(|c| c.is_ascii_alphanumeric() || "/._-+~".contains(c));
    if is_plain { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_with_a_blank_is_quoted() {
        assert_eq!(quoted(Path::new("lab/cell.yaml")), "lab/cell.yaml");
        assert_eq!(quoted(Path::new("my lab/it's")), r"'my lab/it'\''s'");
    }

    #[test]
    fn what_an_example_needs_comes_with_it_once() {
        let shipped = |name: &str, needs: &[&str]| Shipped {
            name: name.to_owned(),
            title: String::new(),
            folder: PathBuf::new(),
            needs: needs.iter().map(|one| (*one).to_owned()).collect(),
        };
        let examples = [shipped("a", &["b"]), shipped("b", &["a"]), shipped("c", &[])];
        let copied = with_needs(&examples, &[&examples[0], &examples[1]]);
        assert_eq!(copied.iter().map(|one| one.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
    }
}
