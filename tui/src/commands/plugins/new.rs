//! `plumb plugins new`: the project of a plugin, which builds, passes the conformance suite and runs in the cell beside it as it is.

use std::env;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, ValueEnum};

use super::template::{Language, Project, files};
use crate::failure::CommandResult;

/// Make the project of a plugin of your own: it builds, passes `plumb plugins check` and runs in the cell beside it as it is. Nothing is overwritten.
#[derive(Args)]
pub(crate) struct NewArguments {
    /// What it drives.
    kind: KindArgument,
    /// Its name in cell files: lower-case letters, digits and hyphens. It gets a folder of that name.
    name: String,
    /// What it is written in. A driver in Python needs no compiler.
    #[arg(long, value_enum, default_value = "rust")]
    lang: LanguageArgument,
    /// Where to make its folder.
    #[arg(long = "in", value_name = "DIR", default_value = ".")]
    directory: PathBuf,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum KindArgument {
    /// Something that moves.
    Robot,
    /// Something that measures.
    Sensor,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LanguageArgument {
    Rust,
    C,
    Python,
}

/// Why there is no project.
#[derive(Debug, thiserror::Error)]
enum NewError {
    #[error("'{0}' cannot be a plugin's name: use lower-case letters, digits and hyphens, a letter first")]
    Name(String),
    #[error("{} is already there; nothing was written", .0.display())]
    Exists(PathBuf),
    #[error("{} cannot be written: {cause}", path.display())]
    Write { path: PathBuf, cause: io::Error },
}

/// Where an installed program has the crate that a plugin in Rust is written against, from the folder it lies in.
const INSTALLED: &str = "../share/plumb/source/core/plugin";

/// That crate in the source this program was built from.
const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../core/plugin");

/// The crate that a plugin in Rust is written against: that of the installed program, else of the source it was built from.
fn crate_of_plugins() -> Option<PathBuf> {
    let program = env::current_exe().ok();
    let beside = program.as_deref().and_then(Path::parent).map(|folder| folder.join(INSTALLED));
    let mut candidates = beside.into_iter().chain([PathBuf::from(SOURCE)]);
    candidates.find_map(|folder| fs::canonicalize(folder).ok())
}

/// Writes the project, and says what to type next.
pub(super) fn run(arguments: &NewArguments, output: &mut impl Write) -> CommandResult {
    let name = &arguments.name;
    let is_word = |letter: char| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-';
    if !name.starts_with(|first: char| first.is_ascii_lowercase())
        || !name.chars().all(is_word)
        || name.ends_with('-')
    {
        return Err(NewError::Name(name.clone()).into());
    }
    let folder = arguments.directory.join(name);
    if folder.symlink_metadata().is_ok() {
        return Err(NewError::Exists(folder).into());
    }
    let source = crate_of_plugins();
    let project = Project {
        name,
        is_robot: arguments.kind == KindArgument::Robot,
        language: match arguments.lang {
            LanguageArgument::Rust => Language::Rust,
            LanguageArgument::C => Language::C,
            LanguageArgument::Python => Language::Python,
        },
        source: source.as_deref(),
    };
    for (path, text) in files(&project) {
        write(&folder.join(path), text.as_bytes())?;
    }
    // The versions that plumb itself was built with: what is on this machine already is taken, without a network.
    if let (Language::Rust, Some(source)) = (project.language, &source)
        && let Ok(locked) = fs::read(source.join("../../Cargo.lock"))
    {
        write(&folder.join("Cargo.lock"), &locked)?;
    }
    writeln!(
        output,
        "{}: a {} of your own. Next:",
        folder.display(),
        if project.is_robot { "robot" } else { "sensor" }
    )?;
    writeln!(output, "  cd {}", folder.display())?;
    for line in project.commands() {
        writeln!(output, "  {line}")?;
    }
    if project.language == Language::Rust && source.is_none() {
        let line = "Cargo.toml takes plumb-plugin from the registry; with plumb's source, give its path: plumb-plugin = { path = \".../core/plugin\" }";
        writeln!(output, "  ({line})")?;
    }
    Ok(ExitCode::SUCCESS)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), NewError> {
    let failed = |cause| NewError::Write { path: path.to_owned(), cause };
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(failed)?;
    }
    fs::write(path, bytes).map_err(failed)
}
