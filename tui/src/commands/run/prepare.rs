//! From the command line to a run that goes on.

use std::collections::BTreeMap;
use std::error::Error;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use plumb_cell::answers::{Answers, load_answers};
use plumb_cell::device::{CellResources, HostedDevices, World, hashed, plugin_files};
use plumb_cell::engine::{RunRequest, RunningRun, StartError, start_run};
use plumb_cell::event::RunOutcome;
use plumb_cell::expression::Calculator;
use plumb_cell::procedure::Procedure;
use plumb_cell::workcell::{Pace, Workcell, load_workcell};
use plumb_document::{FileProblems, did_you_mean};
use plumb_host::Catalogue;
use plumb_record::{CellLock, Record, RunEnd, RunId, RunState, RunSummary};
use serde_json::json;

use super::arguments::{Arguments, PaceArgument};
use super::event_log::logged;
use super::robot_facts::robot_facts;
use super::simulated_world::SimulatedWorld;
use crate::commands::cell_check::check_with_world;
use crate::failure::CommandResult;
use crate::logging;
use crate::record_directory::record_directory;

/// A run that goes on.
pub(super) struct Prepared {
    pub(super) running: RunningRun,
    pub(super) operator: String,
    pub(super) cell: Arc<Workcell>,
    /// Where the record lies.
    pub(super) record: PathBuf,
    /// Held while the cell is run.
    _lock: CellLock,
}

/// Why a run does not start.
pub(crate) enum Refused {
    /// Mistakes in files.
    Files(Vec<FileProblems>),
    /// It would have to ask.
    NeedsOperator(String),
    /// Anything else.
    Other(Box<dyn Error>),
}

impl Refused {
    /// Says it; the exit code of a command that ends with it.
    pub(crate) fn report(self) -> CommandResult {
        match self {
            Refused::Files(problems) => {
                problems.iter().for_each(|problems| eprintln!("{problems}"));
                Ok(ExitCode::from(RunOutcome::Error.exit_code()))
            }
            Refused::NeedsOperator(reason) => {
                eprintln!("plumb: {reason}");
                Ok(ExitCode::from(RunOutcome::NeedsOperator.exit_code()))
            }
            Refused::Other(error) => Err(error),
        }
    }
}

impl<E: Error + 'static> From<E> for Refused {
    fn from(error: E) -> Self {
        Refused::Other(Box::new(error))
    }
}

/// What cannot be run as it was asked.
#[derive(Debug, thiserror::Error)]
enum RunError {
    #[error("cell `{cell}` has no procedure `{requested}`: {help}")]
    NoProcedure { cell: String, requested: String, help: String },
    #[error("cell `{cell}` names no procedures: add one under `procedures:`")]
    NothingToRun { cell: String },
    #[error("cell `{cell}` has no device `{device}` with a port of its own: {help}")]
    NoPort { cell: String, device: String, help: String },
    #[error("there is no interrupted run to resume in {record}")]
    NothingToResume { record: String },
}

/// What was asked for on the command line, with every file it names read.
pub(super) struct Requested {
    pub(super) request: RunRequest,
    catalogue: Catalogue,
    pace: Pace,
}

/// Reads the files.
pub(super) fn requested(arguments: &Arguments) -> Result<Requested, Refused> {
    let record_directory = record_directory(arguments.record.as_ref())?;
    let resumed = resumed_run(arguments, &record_directory)?;
    let calculator = Calculator::new();
    let cell_file = cell_file(arguments, resumed.as_ref());
    let mut cell = load_workcell(&cell_file, &calculator).map_err(Refused::Files)?;
    let ports = ports_of(arguments, resumed.as_ref());
    exchange_ports(&mut cell, &ports)?;
    let cell = Arc::new(cell);
    let catalogue = plugins_of(&cell, &arguments.plugins);
    check_with_world(&cell, &catalogue).map_err(Refused::Files)?;
    let procedure = procedure_of(&cell, arguments, resumed.as_ref())?;
    let unattended = arguments.is_unattended();
    let answers = answers_of(&cell, arguments, unattended, resumed.as_ref())?;
    let operator = operator(arguments.operator.as_ref());
    let pace = pace_of(&cell, arguments);
    let mut other_files = plugin_files(&cell, &catalogue);
    other_files.extend(cell.world.as_ref().and_then(|world| hashed("world", &world.file)));
    let request = RunRequest {
        robots: robot_facts(&cell, &catalogue),
        cell,
        procedure,
        parameters: parameters_of(arguments, resumed.as_ref()),
        settings: json!({"answers": answers.as_ref().map(|answers| absolute(&answers.file)), "ports": ports}),
        answers,
        unattended,
        operator,
        notes: arguments.note.clone(),
        record_directory,
        resume: resumed.as_ref().map(|run| run.run),
        other_files,
        accepts_changed_plugins: arguments.accept_plugins,
        queue_entry: arguments.queue_entry,
    };
    Ok(Requested { request, catalogue, pace })
}

/// Reads the files, starts the world where there is one, and starts the run.
pub(super) fn prepare(arguments: &Arguments) -> Result<Prepared, Refused> {
    let Requested { request, catalogue, pace } = requested(arguments)?;
    let cell = Arc::clone(&request.cell);
    let operator = request.operator.clone();
    let resources = CellResources::of_cell(&cell.file)?;
    let lock = resources.lock(&cell.name, &absolute(&cell.file))?;
    let (shown, record) = (Arc::clone(&cell), request.record_directory.clone());
    let socket = resources.world_socket();
    let domain = resources.domain().clone();
    let under_debugger = arguments.debugger;
    let running = start_run(request, |left_world| {
        let world: Option<Box<dyn World>> = match &cell.world {
            None => None,
            Some(setting) => {
                let found = left_world.and_then(|socket| SimulatedWorld::found(&socket, pace));
                let world = match found {
                    Some(world) => world,
                    None => SimulatedWorld::start(setting, pace, &socket)?,
                };
                Some(Box::new(world))
            }
        };
        let devices = HostedDevices::new(Arc::clone(&cell), catalogue, domain, world);
        Ok(Box::new(devices.under_debugger(under_debugger)))
    });
    match running {
        Ok(mut running) => {
            running.events = logged(running.events);
            // A run goes on where its log cannot be written; the record counts.
            if let Err(error) = logging::begin_run(&record, running.run.0) {
                eprintln!("plumb: {error}; the run goes on without it");
            }
            Ok(Prepared { running, operator, cell: shown, record, _lock: lock })
        }
        Err(StartError::NeedsOperator(reason)) => {
            Err(Refused::NeedsOperator(StartError::NeedsOperator(reason).to_string()))
        }
        Err(error) => Err(error.into()),
    }
}

/// The plugins that a cell may use: those named on the command line, those of its own folders, those of the program, and those beside its file.
pub(crate) fn plugins_of(cell: &Workcell, named: &[PathBuf]) -> Catalogue {
    let directories: Vec<PathBuf> = named.iter().chain(&cell.plugins).cloned().collect();
    Catalogue::search_for_cell(&directories, Some(&cell.file))
}

/// The run to go on with, if that is asked for.
fn resumed_run(arguments: &Arguments, directory: &Path) -> Result<Option<RunSummary>, Refused> {
    let Some(requested) = arguments.resume else { return Ok(None) };
    let record = Record::open(directory)?;
    if let Some(number) = requested {
        return Ok(Some(record.run(RunId(number))?));
    }
    let cell = arguments.cell.as_ref().map(|cell| absolute(cell));
    let resumable = |run: &RunSummary| {
        let open =
            matches!(run.state, RunState::Running | RunState::Ended(RunEnd::Error | RunEnd::NeedsOperator));
        open && cell.as_ref().is_none_or(|cell| *cell == run.cell_file)
    };
    let found = record.history(1000)?.into_iter().find(resumable);
    match found {
        Some(run) => Ok(Some(run)),
        None => Err(RunError::NothingToResume { record: directory.display().to_string() }.into()),
    }
}

fn cell_file(arguments: &Arguments, resumed: Option<&RunSummary>) -> PathBuf {
    match (&arguments.cell, resumed) {
        (Some(cell), _) => cell.clone(),
        (None, Some(run)) => PathBuf::from(&run.cell_file),
        (None, None) => PathBuf::new(),
    }
}

fn procedure_of(
    cell: &Workcell,
    arguments: &Arguments,
    resumed: Option<&RunSummary>,
) -> Result<Arc<Procedure>, Refused> {
    let requested = match resumed {
        Some(run) => Some(run.procedure.as_str()),
        None => arguments.procedure.as_deref(),
    };
    let Some(requested) = requested else {
        let first = cell.procedures.first().cloned();
        return first.ok_or_else(|| RunError::NothingToRun { cell: cell.name.clone() }.into());
    };
    cell.procedure(requested).cloned().ok_or_else(|| {
        let help = did_you_mean(requested, cell.procedures.iter().map(|procedure| procedure.name.as_str()));
        RunError::NoProcedure { cell: cell.name.clone(), requested: requested.to_owned(), help }.into()
    })
}

fn parameters_of(arguments: &Arguments, resumed: Option<&RunSummary>) -> BTreeMap<String, f64> {
    let stored = resumed.and_then(|run| run.parameters.as_object());
    let stored =
        stored.into_iter().flatten().filter_map(|(name, value)| Some((name.clone(), value.as_f64()?)));
    stored.chain(arguments.set.iter().cloned()).collect()
}

/// The ports that were named for devices, by the command line or by the run that is resumed.
fn ports_of(arguments: &Arguments, resumed: Option<&RunSummary>) -> BTreeMap<String, String> {
    let kept = resumed.and_then(|run| run.settings.get("ports")?.as_object().cloned()).unwrap_or_default();
    let kept = kept.into_iter().filter_map(|(device, port)| Some((device, port.as_str()?.to_owned())));
    kept.chain(arguments.port.iter().cloned()).collect()
}

/// Gives devices other ports than the cell file does.
fn exchange_ports(cell: &mut Workcell, ports: &BTreeMap<String, String>) -> Result<(), RunError> {
    for (device, port) in ports {
        let config = cell.devices.iter_mut().find(|one| one.name == *device).map(|one| &mut one.config);
        let Some(entry) = config.and_then(|config| config.get_mut("port")) else {
            let with_ports = cell.devices.iter().filter(|one| one.config.get("port").is_some());
            let help = did_you_mean(device, with_ports.map(|one| one.name.as_str()));
            return Err(RunError::NoPort { cell: cell.name.clone(), device: device.clone(), help });
        };
        *entry = port.clone().into();
    }
    Ok(())
}

/// The answers of an unattended run: those given, those the resumed run had, or the cell's own.
fn answers_of(
    cell: &Workcell,
    arguments: &Arguments,
    unattended: bool,
    resumed: Option<&RunSummary>,
) -> Result<Option<Answers>, Refused> {
    if !unattended {
        return Ok(None);
    }
    let of_run = resumed.and_then(|run| run.settings.get("answers")?.as_str().map(PathBuf::from));
    let Some(file) = arguments.answers.clone().or(of_run).or_else(|| cell.answers.clone()) else {
        return Ok(None);
    };
    let procedures: Vec<&Procedure> = cell.procedures.iter().map(AsRef::as_ref).collect();
    load_answers(&file, &procedures, &cell.robots)
        .map(Some)
        .map_err(|problems| Refused::Files(vec![problems]))
}

/// Who sits there: as given, or the login name; in a service or a container, where no variable gives it, the name of the user in the password file.
pub(crate) fn operator(given: Option<&String>) -> String {
    let login = || std::env::var("USER").ok().or_else(|| std::env::var("LOGNAME").ok());
    given.cloned().or_else(login).or_else(name_of_user).unwrap_or_else(|| "unknown".to_owned())
}

/// The name of the user this program runs as.
fn name_of_user() -> Option<String> {
    let user = std::fs::metadata("/proc/self").ok()?.uid().to_string();
    let known = std::fs::read_to_string("/etc/passwd").ok()?;
    let line = known.lines().find(|line| line.split(':').nth(2) == Some(&user))?;
    line.split(':').next().map(str::to_owned).filter(|name| !name.is_empty())
}

fn pace_of(cell: &Workcell, arguments: &Arguments) -> Pace {
    match (arguments.pace, &cell.world) {
        (Some(PaceArgument::Real), _) => Pace::Real,
        (Some(PaceArgument::Fast), _) => Pace::Fast,
        (None, _) if arguments.is_headless() => Pace::Fast,
        (None, Some(world)) => world.pace,
        (None, None) => Pace::Real,
    }
}

pub(crate) fn absolute(path: &Path) -> String {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string()
}
