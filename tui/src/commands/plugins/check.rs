//! `plumb plugins check`: the conformance suite on any plugin, in processes of its own.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use plumb_bus::{Bus, Domain};
use plumb_cell::device::config_mistakes;
use plumb_document::{FileKind, did_you_mean, read_document};
use plumb_host::{Catalogue, CatalogueError, HostArguments, HostCommand, Plugin, WiredInput, check_plugin};
use plumb_plugin::conformance::{CheckOutcome, CheckReport, row_in_words};
use plumb_plugin::message::known_length;
use plumb_plugin::{DeviceKind, InputDescription, Manifest, StreamDescription, Value};

use super::directories::PluginDirectories;
use crate::failure::CommandResult;

/// Exit code when a check failed.
const FAILED: u8 = 1;

/// The device at whose streams the inputs of a checked sensor end. Nothing comes from it.
const NOBODY: &str = "nobody";

/// The longest message of an input whose layout has no fixed length, bytes.
const LONG_MESSAGE: usize = 1 << 20;

/// Hold a plugin of any language against the contract: the conformance suite, each check in a process of its own, with what the contract says and what
/// to change wherever it fails. The device is connected. Checks that move a robot run with --move alone.
#[derive(Args)]
pub(crate) struct CheckArguments {
    /// A manifest, a library, the folder they lie in, or the name of a plugin that can be found.
    plugin: String,
    /// The device's configuration as under `config:` of a cell file, or a file that holds it.
    #[arg(long, value_name = "YAML|FILE")]
    config: Option<String>,
    /// Wire this optional input too; those that must be wired are. Nothing comes on them.
    #[arg(long = "input", value_name = "NAME")]
    inputs: Vec<String>,
    /// Run the checks that move a robot as well: by small amounts, and once for two seconds. Keep clear of a real one.
    #[arg(long = "move")]
    may_move: bool,
    #[command(flatten)]
    searched: PluginDirectories,
}

/// Why nothing could be checked.
#[derive(Debug, thiserror::Error)]
enum CheckError {
    #[error("--config is no YAML: {0}")]
    Config(String),
    #[error("{plugin} cannot be configured like that: {mistakes}")]
    Configuration { plugin: String, mistakes: String },
    #[error("{plugin} has no input '{input}': {help}")]
    Input { plugin: String, input: String, help: String },
}

/// Checks it, and prints each check as it is done.
pub(super) fn run(arguments: &CheckArguments, output: &mut impl Write) -> CommandResult {
    let plugin = match found(arguments) {
        Ok(plugin) => plugin,
        Err(error @ CatalogueError::Manifest(_)) => {
            let outcome = CheckOutcome::Failed(error.to_string().trim_end().to_owned());
            writeln!(output, "{}", row_in_words("its manifest is good", &outcome))?;
            return Ok(ExitCode::from(FAILED));
        }
        Err(error) => return Err(error.into()),
    };
    let manifest = &plugin.manifest;
    let config = config_of(arguments, manifest)?;
    let inputs = inputs_of(arguments, manifest)?;
    let (id, version, kind) = (&manifest.id, &manifest.version, manifest.kind);
    writeln!(
        output,
        "{id} {version}, a {kind} by contract {}: {}",
        manifest.contract,
        plugin.library_path.display()
    )?;
    writeln!(output, "time limits: {}\n", time_limits(manifest))?;
    let report = checked(&plugin, config, inputs, arguments.may_move, output)?;
    print_sum(&report, arguments.may_move, output)?;
    Ok(if report.is_good() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
}

/// The plugin that was named.
fn found(arguments: &CheckArguments) -> Result<Plugin, CatalogueError> {
    let path = Path::new(&arguments.plugin);
    if path.is_dir() {
        return Plugin::at(&path.join(Manifest::FILE_NAME));
    }
    if path.is_file() {
        let is_manifest = path.extension().is_some_and(|extension| extension == "yaml");
        let folder = path.parent().unwrap_or(Path::new(""));
        return match is_manifest {
            true => Plugin::at(path),
            false => Ok(Plugin::at_library(&folder.join(Manifest::FILE_NAME), path)?),
        };
    }
    Catalogue::search(&arguments.searched.directories).find(&arguments.plugin).cloned()
}

/// What the device is given, held against the schema in the manifest.
fn config_of(arguments: &CheckArguments, manifest: &Manifest) -> Result<Value, Box<dyn std::error::Error>> {
    let Some(given) = &arguments.config else { return Ok(Value::Null) };
    let path = PathBuf::from(given);
    let text = if path.is_file() { read_document(&path, FileKind::CELL)? } else { given.clone() };
    let config: Value = serde_yaml::from_str(&text).map_err(|error| CheckError::Config(error.to_string()))?;
    let mistakes = config_mistakes(&config, &manifest.config);
    if mistakes.is_empty() {
        return Ok(config);
    }
    Err(CheckError::Configuration { plugin: manifest.id.clone(), mistakes: mistakes.join("; ") }.into())
}

/// The inputs that have to be wired, and those that were asked for.
fn inputs_of(arguments: &CheckArguments, manifest: &Manifest) -> Result<Vec<WiredInput>, CheckError> {
    let names = || manifest.inputs.iter().map(|input| input.name.as_str());
    if let Some(unknown) =
        arguments.inputs.iter().find(|requested| !names().any(|name| name == requested.as_str()))
    {
        let help = did_you_mean(unknown, names());
        return Err(CheckError::Input { plugin: manifest.id.clone(), input: unknown.clone(), help });
    }
    let is_wired = |input: &&InputDescription| !input.optional || arguments.inputs.contains(&input.name);
    Ok(manifest.inputs.iter().filter(is_wired).map(wired_to_nobody).collect())
}

fn wired_to_nobody(input: &InputDescription) -> WiredInput {
    let stream = StreamDescription {
        name: input.name.clone(),
        message: input.message.clone(),
        max_bytes: known_length(&input.message).is_none().then_some(LONG_MESSAGE),
        depth: None,
        fields: Vec::new(),
    };
    WiredInput { input: input.name.clone(), device: NOBODY.to_owned(), stream }
}

/// How long the calls of a plugin may take.
fn time_limits(manifest: &Manifest) -> String {
    let reading = manifest.read_time_limit().as_secs_f64();
    match manifest.kind {
        DeviceKind::Robot => {
            "until it is ready 15 s, activate 60 s, set_zero 900 s, any other call but a move 5 s".to_owned()
        }
        DeviceKind::Sensor => {
            let source = if manifest.read_time_limit_s.is_some() {
                "as its manifest says"
            } else {
                "unless its manifest has read_time_limit_s"
            };
            format!("until it is ready 15 s, a reading {reading} s ({source}), any other call 5 s")
        }
    }
}

/// Runs the suite over shared memory of its own, which is gone afterwards.
fn checked(
    plugin: &Plugin,
    config: Value,
    inputs: Vec<WiredInput>,
    may_move: bool,
    output: &mut impl Write,
) -> Result<CheckReport, Box<dyn std::error::Error>> {
    // Of this process alone: two checks of one plugin do not meet, nor a check and a cell.
    let name = format!("{}#{}", plugin.manifest_path.display(), std::process::id());
    let domain = Domain::of_cell(Path::new(&name))?;
    let bus = Bus::open(&domain, "plumb plugins check")?;
    let arguments = HostArguments { config, inputs, ..HostArguments::new("device", &domain, plugin) };
    let program = std::env::current_exe()?;
    let command = || HostCommand::new(program.clone(), ["host"]).of_cell("plumb plugins check");
    let mut written = Ok(());
    let mut causes = BTreeMap::new();
    let report = check_plugin(&bus, plugin, &arguments, may_move, command, &mut |name, outcome| {
        if written.is_ok() {
            written =
                writeln!(output, "{}", shown_once(name, outcome, &mut causes)).and_then(|()| output.flush());
        }
    });
    drop(bus);
    domain.remove()?;
    written?;
    Ok(report)
}

/// A check in words. One fault shows in many checks: its cause, which may differ in its numbers, is reported with the first.
fn shown_once(
    name: &'static str,
    outcome: &CheckOutcome,
    causes: &mut BTreeMap<String, &'static str>,
) -> String {
    let CheckOutcome::Failed(how) = outcome else { return row_in_words(name, outcome) };
    let cause: String = how.chars().filter(|letter| !letter.is_ascii_digit()).collect();
    match causes.get(&cause) {
        Some(first) => format!("FAILED   {name}: for the same reason as '{first}'"),
        None => {
            causes.insert(cause, name);
            row_in_words(name, outcome)
        }
    }
}

fn print_sum(report: &CheckReport, may_move: bool, output: &mut impl Write) -> io::Result<()> {
    let count =
        |fits: fn(&CheckOutcome) -> bool| report.rows.iter().filter(|(_, outcome)| fits(outcome)).count();
    let failed = count(|outcome| matches!(outcome, CheckOutcome::Failed(_)));
    let skipped = count(|outcome| matches!(outcome, CheckOutcome::Skipped(_)));
    let passed = count(|outcome| *outcome == CheckOutcome::Passed);
    writeln!(output, "\n{} checks: {passed} passed, {failed} failed, {skipped} skipped", report.rows.len())?;
    let would_move =
        |outcome: &CheckOutcome| matches!(outcome, CheckOutcome::Skipped(why) if why.contains("would move"));
    if !may_move && report.rows.iter().any(|(_, outcome)| would_move(outcome)) {
        writeln!(output, "to check how it moves, keep clear of it and add --move")?;
    }
    Ok(())
}
