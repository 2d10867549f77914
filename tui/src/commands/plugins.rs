//! `plumb plugins`: the plugins that can be found, and whether they can be used.

mod check;
mod directories;
mod new;
mod template;

use std::io::{self, Write};
use std::process::ExitCode;

use clap::{Args, Subcommand};
use plumb_host::{Catalogue, CatalogueRow, Plugin, verify};

use crate::failure::CommandResult;
use directories::PluginDirectories;

/// What to do with plugins.
#[derive(Subcommand)]
pub(crate) enum PluginsCommand {
    /// Lists the plugins that can be found, from their manifests alone; nothing is loaded.
    List(PluginDirectories),
    /// Loads each plugin's library, checks it against its manifest and asks for the functions of its kind; no device is touched.
    Verify(VerifyArguments),
    Check(check::CheckArguments),
    New(new::NewArguments),
}

/// Which plugins to verify.
#[derive(Args)]
pub(crate) struct VerifyArguments {
    #[command(flatten)]
    searched: PluginDirectories,
    /// Names of plugins, or manifest files; all that can be found when none is given.
    plugins: Vec<String>,
}

/// Exit code when a plugin cannot be used.
const UNUSABLE: u8 = 1;

/// Does it.
pub(crate) fn run(command: &PluginsCommand) -> CommandResult {
    let mut output = io::stdout().lock();
    let all_good = match command {
        PluginsCommand::List(searched) => list(&mut output, &Catalogue::search(&searched.directories))?,
        PluginsCommand::Verify(arguments) => verify_all(&mut output, arguments)?,
        PluginsCommand::Check(arguments) => return check::run(arguments, &mut output),
        PluginsCommand::New(arguments) => return new::run(arguments, &mut output),
    };
    Ok(if all_good { ExitCode::SUCCESS } else { ExitCode::from(UNUSABLE) })
}

/// One line for each plugin; whether all are good.
fn list(output: &mut impl Write, catalogue: &Catalogue) -> io::Result<bool> {
    for row in catalogue.rows() {
        match &row.plugin {
            Ok(plugin) => {
                let manifest = &plugin.manifest;
                let (id, version, kind) = (&manifest.id, &manifest.version, manifest.kind);
                let (contract, title) = (manifest.contract, &manifest.title);
                let limit = manifest.read_time_limit_s;
                let limit =
                    limit.map(|seconds| format!(" (a reading within {seconds} s)")).unwrap_or_default();
                writeln!(output, "{id:<20} {version:<8} {kind:<7} contract {contract:<5} {title}{limit}")?;
            }
            Err(error) => writeln!(output, "unusable: {error}")?,
        }
    }
    if catalogue.rows().is_empty() {
        let shown: Vec<String> =
            catalogue.directories().iter().map(|path| path.display().to_string()).collect();
        writeln!(output, "no plugins; looked in {}", shown.join(", "))?;
    }
    Ok(catalogue.rows().iter().all(|row| row.plugin.is_ok()))
}

fn verify_all(
    output: &mut impl Write,
    arguments: &VerifyArguments,
) -> Result<bool, Box<dyn std::error::Error>> {
    let catalogue = Catalogue::search(&arguments.searched.directories);
    let mut all_good = true;
    let mut show = |name: &str, result: Result<Vec<String>, String>| {
        all_good &= result.is_ok();
        match result {
            Ok(notes) if notes.is_empty() => writeln!(output, "{name}: good"),
            Ok(notes) => writeln!(output, "{name}: good, but {}", notes.join("; ")),
            // What is wrong with a file begins with its name.
            Err(text) if text.starts_with(name) => writeln!(output, "{text}"),
            Err(text) => writeln!(output, "{name}: {text}"),
        }
    };
    if arguments.plugins.is_empty() {
        for row in catalogue.rows() {
            let (name, result) = verified(row);
            show(&name, result)?;
        }
    }
    for name in &arguments.plugins {
        let plugin = if name.ends_with(".yaml") {
            Plugin::at(name.as_ref()).map_err(|error| error.to_string())
        } else {
            catalogue.find(name).cloned().map_err(|error| error.to_string())
        };
        show(name, plugin.and_then(|plugin| verify(&plugin).map_err(|error| error.to_string())))?;
    }
    Ok(all_good)
}

fn verified(row: &CatalogueRow) -> (String, Result<Vec<String>, String>) {
    match &row.plugin {
        Ok(plugin) => (plugin.manifest.id.clone(), verify(plugin).map_err(|error| error.to_string())),
        Err(error) => (row.manifest_path.display().to_string(), Err(error.to_string())),
    }
}
