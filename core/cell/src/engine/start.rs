//! Starting a run, or going on with one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread::JoinHandle;

use plumb_record::{
    CellLock, ChangedLibrary, Interruption, LoadedFile, NewRun, Record, RecordError, RunId, RunState,
    record_option, sha256_hex, today,
};
use serde_json::{Map, Value};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

use super::event_sender::EventSender;
use super::inbox::{Inbox, Interrupt};
use super::journal::Journal;
use super::plan::{Plan, PlanError, make_plan, number_value};
use super::pose_cache::PoseCache;
use super::run_loop::{RunEnd, describe};
use super::scope::result_name;
use super::step_error::StepError;
use super::{Engine, RobotFacts, prompting};
use crate::answers::{Answers, missing_answers};
use crate::device::DeviceLinks;
use crate::event::{Event, LogLevel, RunOutcome, StampedEvent, StepPath};
use crate::expression::Calculator;
use crate::procedure::{Procedure, check_procedure};
use crate::run_handle::{RunHandle, StopActions};
use crate::step::{Inside, OnError, Step};
use crate::workcell::{Workcell, cell_names};
use plumb_document::did_you_mean;

/// What is to be run.
pub struct RunRequest {
    /// In which cell.
    pub cell: Arc<Workcell>,
    /// What.
    pub procedure: Arc<Procedure>,
    /// Parameters other than their defaults.
    pub parameters: BTreeMap<String, f64>,
    /// Answers for an unattended run.
    pub answers: Option<Answers>,
    /// Nobody is there to be asked.
    pub unattended: bool,
    /// Who runs it.
    pub operator: String,
    /// Where the record lies.
    pub record_directory: PathBuf,
    /// The run to go on with, instead of a new one.
    pub resume: Option<RunId>,
    /// What else the program needs to know when the run is resumed; kept in the record.
    pub settings: Value,
    /// What the operator wants remembered with the run.
    pub notes: Vec<String>,
    /// Other files that were loaded, such as plugins and the world's, for the record.
    pub other_files: Vec<LoadedFile>,
    /// Plugins that have changed since the cell ran with them last are run without asking.
    pub accepts_changed_plugins: bool,
    /// What is known of the robots without asking them: how fast they are, for the time a plan takes.
    pub robots: Vec<RobotFacts>,
    /// The entry of the record's queue that a new run carries out.
    pub queue_entry: Option<i64>,
}

/// A run that goes on in a thread of its own.
pub struct RunningRun {
    /// Its number.
    pub run: RunId,
    /// What happens.
    pub events: UnboundedReceiver<StampedEvent>,
    /// To command it.
    pub handle: RunHandle,
    /// Ends with the run.
    pub thread: JoinHandle<RunOutcome>,
}

/// Why a run does not start. Nothing has moved.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// A parameter the procedure does not have.
    #[error("procedure `{procedure}` has no parameter `{name}`: {help}")]
    UnknownParameter {
        /// The procedure.
        procedure: String,
        /// The parameter.
        name: String,
        /// What it has.
        help: String,
    },
    /// A parameter out of its range.
    #[error("{0}")]
    Parameter(String),
    /// The procedure cannot be unrolled.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// An unattended run would have to ask.
    #[error("this needs an operator: {0}")]
    NeedsOperator(String),
    /// The run cannot be resumed.
    #[error("run {run} cannot be resumed: {reason}")]
    NotResumable {
        /// The run.
        run: i64,
        /// Why.
        reason: String,
    },
    /// The devices' surroundings cannot be had.
    #[error(transparent)]
    Devices(Box<dyn std::error::Error + Send + Sync>),
    /// The record.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// What a run's devices are made of, or why they cannot be.
pub type Connected = Result<Box<dyn DeviceLinks>, Box<dyn std::error::Error + Send + Sync>>;

/// What the robots' model files give to expressions: `{"arm": {"model": {"shoulder": {"a_mm": ...}}}}`.
pub(crate) fn model_values(cell: &Workcell) -> Map<String, Value> {
    let models = cell.robots.iter().filter_map(|robot| {
        let model = Value::Object(robot.model.as_ref()?.quantities.clone());
        Some((robot.device.clone(), Value::Object(Map::from_iter([("model".to_owned(), model)]))))
    });
    models.collect()
}

/// Starts a run in a thread of its own. `connect` makes the devices' links, given the socket of the world a resumed run left.
///
/// # Errors
/// [`StartError`]; then nothing was started.
pub fn start_run(
    request: RunRequest,
    connect: impl FnOnce(Option<String>) -> Connected,
) -> Result<RunningRun, StartError> {
    let calculator = Arc::new(Calculator::new());
    let parameters = parameters_of(&request)?;
    let plan = make_plan(&request.procedure, parameters.clone(), &model_values(&request.cell), &calculator)?;
    if request.unattended {
        check_unattended(&request)?;
    }
    let mut record = Record::open(&request.record_directory)?;
    let changed_plugins = changed_plugins(&record, &request)?;
    let lock = CellLock::take(&request.record_directory, &request.cell.name)?;
    let (run, world) = match request.resume {
        Some(run) => (run, resume_in_record(&mut record, run, &request)?),
        None => (start_in_record(&mut record, &request, parameters)?, None),
    };
    let (event_sender, events) = unbounded_channel();
    let (command_sender, commands) = channel();
    let stops = StopActions::default();
    let handle = RunHandle::new(command_sender, stops.clone());
    let links = match connect(world) {
        Ok(links) => links,
        Err(error) => {
            record.end_run(run, plumb_record::RunEnd::Error, &error.to_string())?;
            return Err(StartError::Devices(error));
        }
    };
    let journal = Journal::new(record, run, EventSender::new(event_sender));
    let engine = Engine::new(&request, calculator, plan, journal, links, (Inbox::new(commands), stops));
    let thread = std::thread::Builder::new().name("engine".to_owned()).spawn(move || {
        let _lock = lock;
        let procedure = &request.procedure.name;
        let _run = tracing::info_span!("run", run = run.0, cell = request.cell.name, procedure).entered();
        engine.sitting(&request, &changed_plugins)
    });
    let thread =
        thread.map_err(|cause| RecordError::Lock { path: PathBuf::from("the engine's thread"), cause })?;
    Ok(RunningRun { run, events, handle, thread })
}

impl Engine {
    /// The engine of a run whose devices are not connected yet. `control` is what commands the run and what stops its robots.
    fn new(
        request: &RunRequest,
        calculator: Arc<Calculator>,
        plan: Plan,
        journal: Journal,
        links: Box<dyn DeviceLinks>,
        control: (Inbox, StopActions),
    ) -> Self {
        let (inbox, stops) = control;
        let outputs = request.record_directory.join(format!("run-{}", journal.run.0));
        Self {
            cell: Arc::clone(&request.cell),
            calculator,
            journal,
            inbox,
            links,
            stops,
            arms: Vec::new(),
            sensors: Vec::new(),
            settings: BTreeMap::new(),
            lost: Vec::new(),
            finds_zeros: request.procedure.finds_zeros_of(),
            moved: BTreeMap::new(),
            pose_cache: PoseCache::default(),
            rest_ns: 0,
            clock: Arc::default(),
            answers: request.answers.clone(),
            unattended: request.unattended,
            left_to_world_by: None,
            plan,
            offered: None,
            outputs,
            paused_scan: None,
            failed_check: None,
            facts: request.robots.clone(),
            with_results: std::collections::BTreeSet::new(),
        }
    }
}

/// The plugins that have changed since the cell ran with them last, unless that was accepted beforehand.
///
/// # Errors
/// [`StartError::NeedsOperator`] where nobody is there to look at them.
fn changed_plugins(record: &Record, request: &RunRequest) -> Result<Vec<ChangedLibrary>, StartError> {
    if request.accepts_changed_plugins {
        return Ok(Vec::new());
    }
    let changed = record.changed_libraries(&request.cell.name, &request.other_files)?;
    if changed.is_empty() || !request.unattended {
        return Ok(changed);
    }
    Err(StartError::NeedsOperator(format!(
        "{}. Run it with somebody there, or with --accept-plugins when you know why",
        describe_changed(&changed)
    )))
}

/// Changed plugins, as a sentence.
pub(crate) fn describe_changed(changed: &[ChangedLibrary]) -> String {
    let one = |library: &ChangedLibrary| {
        let short = |hash: &str| hash.get(..12).unwrap_or(hash).to_owned();
        let (path, run) = (&library.path, library.run);
        format!("{path} (SHA-256 {} in run {run}, {} now)", short(&library.before), short(&library.sha256))
    };
    let list: Vec<String> = changed.iter().map(one).collect();
    let (what, them) = if changed.len() == 1 { ("a plugin has", "it") } else { ("plugins have", "them") };
    format!("{what} changed since this cell ran with {them} last: {}", list.join(", "))
}

pub(crate) fn parameters_of(request: &RunRequest) -> Result<Map<String, Value>, StartError> {
    let procedure = &request.procedure;
    for name in request.parameters.keys() {
        if !procedure.parameters.iter().any(|parameter| parameter.name == *name) {
            let help =
                did_you_mean(name, procedure.parameters.iter().map(|parameter| parameter.name.as_str()));
            return Err(StartError::UnknownParameter {
                procedure: procedure.name.clone(),
                name: name.clone(),
                help,
            });
        }
    }
    let mut values = Map::new();
    for parameter in &procedure.parameters {
        let value = request.parameters.get(&parameter.name).copied().unwrap_or(parameter.default);
        parameter.accept(value).map_err(StartError::Parameter)?;
        values.insert(parameter.name.clone(), number_value(value));
    }
    Ok(values)
}

/// An unattended run knows beforehand that it will not have to ask.
pub(crate) fn check_unattended(request: &RunRequest) -> Result<(), StartError> {
    let missing = missing_answers(request.answers.as_ref(), &request.procedure);
    if !missing.is_empty() {
        let names: Vec<String> = missing.iter().map(|name| format!("`{name}`")).collect();
        return Err(StartError::NeedsOperator(format!("no answers are given for {}", names.join(", "))));
    }
    let decided =
        |name: &str| request.answers.as_ref().is_some_and(|answers| answers.decision(name).is_some());
    let mut asking = Vec::new();
    steps_that_ask(&request.procedure, &request.procedure.steps, "", &mut asking);
    match asking.into_iter().find(|name| !decided(name)) {
        Some(name) => Err(StartError::NeedsOperator(format!(
            "step `{name}` says `on_error: ask`; decide beforehand under `on_error:` in the answers"
        ))),
        None => Ok(()),
    }
}

fn steps_that_ask(procedure: &Procedure, steps: &[Step], prefix: &str, asking: &mut Vec<String>) {
    for step in steps {
        let name = format!("{prefix}{}", step.id);
        if step.on_error == Some(OnError::Ask) {
            asking.push(name.clone());
        }
        match step.action.inside() {
            Inside::Repeated { steps, .. } => steps_that_ask(procedure, steps, prefix, asking),
            Inside::Called { file, .. } => {
                if let Some(called) = procedure.called(file) {
                    steps_that_ask(called, &called.steps, &format!("{name}."), asking);
                }
            }
            Inside::Nothing => {}
        }
    }
}

fn start_in_record(
    record: &mut Record,
    request: &RunRequest,
    parameters: Map<String, Value>,
) -> Result<RunId, StartError> {
    let absolute =
        |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned()).display().to_string();
    let run = record.start_run(&NewRun {
        cell: request.cell.name.clone(),
        cell_file: absolute(&request.cell.file),
        procedure: request.procedure.name.clone(),
        procedure_file: absolute(&request.procedure.file),
        title: request.procedure.title.clone(),
        operator: request.operator.clone(),
        unattended: request.unattended,
        parameters: Value::Object(parameters),
        settings: request.settings.clone(),
        program: env!("CARGO_PKG_VERSION").to_owned(),
        loaded: loaded_files(request),
        instruments: request.cell.instruments.clone(),
        notes: request.notes.clone(),
        queue_entry: request.queue_entry,
    })?;
    for robot in &request.cell.robots {
        if let Some(model) = &robot.model {
            record.note_model(&request.cell.name, &robot.device, Some(run), &model.text, "loaded")?;
        }
    }
    Ok(run)
}

/// Every file the run was made of.
fn loaded_files(request: &RunRequest) -> Vec<LoadedFile> {
    let text_file = |role: &str, path: &Path, text: &str| LoadedFile {
        role: role.to_owned(),
        path: path.display().to_string(),
        sha256: sha256_hex(text.as_bytes()),
        content: Some(text.as_bytes().to_vec()),
    };
    let mut files = vec![text_file("cell", &request.cell.file, &request.cell.text)];
    files.extend(
        request.procedure.all_files().into_iter().map(|(path, text)| text_file("procedure", path, text)),
    );
    let models = request.cell.robots.iter().filter_map(|robot| robot.model.as_ref());
    files.extend(models.map(|model| text_file("model", &model.file, &model.text)));
    files.extend(request.answers.iter().map(|answers| text_file("answers", &answers.file, &answers.text)));
    files.extend(request.other_files.iter().cloned());
    files
}

/// Opens a run again; gives the socket of the world it left.
fn resume_in_record(
    record: &mut Record,
    run: RunId,
    request: &RunRequest,
) -> Result<Option<String>, StartError> {
    let stored = record.run(run)?;
    let refuse = |reason: &str| StartError::NotResumable { run: run.0, reason: reason.to_owned() };
    match stored.state {
        RunState::Ended(plumb_record::RunEnd::Error | plumb_record::RunEnd::NeedsOperator)
        | RunState::Running => {}
        RunState::Ended(end) => return Err(refuse(&format!("it has ended: {}", end.name()))),
    }
    let before = record.loaded(run)?;
    for file in loaded_files(request)
        .iter()
        .filter(|file| matches!(file.role.as_str(), "cell" | "procedure" | "model"))
    {
        let unchanged = before.iter().any(|known| known.role == file.role && known.sha256 == file.sha256);
        if !unchanged {
            return Err(refuse(&format!("{} was changed since it began; begin a new run", file.path)));
        }
    }
    record.reopen_run(run)?;
    Ok(stored.world)
}

impl Engine {
    /// The whole sitting, from the first event to the last.
    fn sitting(mut self, request: &RunRequest, changed_plugins: &[ChangedLibrary]) -> RunOutcome {
        let (events, run) = (self.journal.events.clone(), self.journal.run);
        let go_on = format!("plumb run --resume {run}{}", record_option(self.journal.record.directory()));
        let result = self.begin(request, changed_plugins).and_then(|end| Ok(self.finish(end)?));
        match result {
            Ok(outcome) => outcome,
            Err(error) => {
                tracing::error!(error = describe(&error), "the run cannot be written down");
                // The one event that nothing in the record is behind: without it nobody would learn why the run ended.
                let message = format!("{} (then go on with: {go_on})", describe(&error));
                events.send(Event::RunEnded { run: run.0, outcome: RunOutcome::Error, message });
                RunOutcome::Error
            }
        }
    }

    fn begin(
        &mut self,
        request: &RunRequest,
        changed_plugins: &[ChangedLibrary],
    ) -> Result<RunEnd, StepError> {
        let first_time = request.resume.is_none();
        self.journal.interruption(Interruption::SittingBegan, None, &request.operator)?;
        let stored = if first_time { Vec::new() } else { self.journal.record.steps(self.journal.run)? };
        let resumed_at = if first_time { None } else { self.first_open_step(&stored) };
        self.journal.show(Event::RunStarted {
            run: self.journal.run.0,
            cell: self.cell.name.clone(),
            procedure: request.procedure.name.clone(),
            title: request.procedure.title.clone(),
            unattended: self.unattended,
            resumed_at,
        });
        self.warn_of_overdue_instruments()?;
        let accepted = self.confirm_plugins(changed_plugins);
        match accepted.and_then(|()| self.prepare(request, &stored)) {
            Ok((position, open)) => Ok(self.run_from(position, open)?),
            Err(StepError::Record(error)) => Err(StepError::Record(error)),
            Err(error) => Ok(end_of_preparation(error)),
        }
    }

    /// A calibration that was due is no reason not to run, but one to know of.
    fn warn_of_overdue_instruments(&mut self) -> Result<(), StepError> {
        let cell = Arc::clone(&self.cell);
        let today = today();
        for one in cell.instruments.iter().filter(|one| one.is_overdue(&today)) {
            let due = one.calibration_due.as_deref().unwrap_or_default();
            let message = format!(
                "the calibration of {} ({}) was due on {due}: have it calibrated",
                one.name, one.what
            );
            self.journal.log(LogLevel::Warning, "instruments", None, &message)?;
        }
        Ok(())
    }

    /// The first step that is not done.
    fn first_open_step(&self, stored: &[plumb_record::StoredStep]) -> Option<StepPath> {
        let done = |path: &StepPath| {
            let last = stored.iter().rev().find(|attempt| attempt.step == path.0);
            let outcome = last.and_then(|attempt| attempt.outcome.as_deref());
            matches!(outcome, Some("passed" | "skipped" | "not_needed"))
        };
        let leaves = self.plan.entries.iter().filter(|entry| matches!(entry.work, super::plan::Work::Leaf));
        leaves.map(|entry| &entry.path).find(|path| !done(path)).cloned()
    }

    /// What a procedure names of readings, held against what the sensors measure. Known only now that they are there, and before anything moves.
    fn check_names_of_readings(&self, procedure: &Procedure) -> Result<(), StepError> {
        let mut names = cell_names(&self.cell.devices, &self.cell.robots);
        for sensor in &self.sensors {
            let quantities = &sensor.link.description().quantities;
            let known = quantities.iter().map(|known| result_name(&known.name, &known.unit));
            names.quantities.push((sensor.name.clone(), known.collect()));
        }
        check_procedure(procedure, &names).map_err(|problems| {
            let messages: Vec<String> = problems.iter().map(ToString::to_string).collect();
            StepError::error(messages.join("\n"))
        })
    }

    /// Connects the devices, shows the plan, and finds where to begin.
    fn prepare(
        &mut self,
        request: &RunRequest,
        stored: &[plumb_record::StoredStep],
    ) -> Result<(usize, Vec<(usize, super::journal::Attempt)>), StepError> {
        let first_time = request.resume.is_none();
        self.connect_all()?;
        self.check_names_of_readings(&request.procedure)?;
        self.check_zeros(first_time)?;
        let socket = self.links.world_socket();
        self.journal.record.set_world(self.journal.run, socket.as_deref())?;
        let (steps, estimate_s) = self.planned_steps();
        // A program that was killed before it wrote the plan down left none.
        let is_new = first_time || self.journal.record.plan(self.journal.run)?.is_empty();
        self.journal.planned(steps, estimate_s, is_new)?;
        let point = self.replay(stored)?;
        for sensor in self.settings.keys().cloned().collect::<Vec<_>>() {
            self.give_settings(&sensor)?;
        }
        let something_left = point.position < self.plan.entries.len();
        if !first_time && something_left {
            self.confirm_poses(point.position)?;
        }
        self.activate_robots()?;
        self.read_and_note_poses()?;
        let open = self.reopen(&point.open)?;
        Ok((point.position, open))
    }
}

fn end_of_preparation(error: StepError) -> RunEnd {
    let outcome = match &error {
        StepError::NeedsOperator(_)
        | StepError::Interrupted {
            interrupt: Interrupt::Keep | Interrupt::FromOutside { keep: true, .. },
            ..
        } => RunOutcome::NeedsOperator,
        StepError::Interrupted { interrupt, .. } if !prompting::is_pause(*interrupt) => RunOutcome::Aborted,
        _ => RunOutcome::Error,
    };
    RunEnd { outcome, message: describe(&error) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_preparation_that_is_ended_says_whether_somebody_ended_it_or_something_went_wrong() {
        let outcome = |interrupt: Interrupt| {
            let reason = "asked for".to_owned();
            end_of_preparation(StepError::Interrupted { interrupt, reason }).outcome
        };
        assert_eq!(outcome(Interrupt::Abort), RunOutcome::Aborted);
        assert_eq!(outcome(Interrupt::FromOutside { by: "SIGTERM", keep: false }), RunOutcome::Aborted);
        assert_eq!(outcome(Interrupt::Keep), RunOutcome::NeedsOperator);
        assert_eq!(outcome(Interrupt::FromOutside { by: "SIGTERM", keep: true }), RunOutcome::NeedsOperator);
        // Nothing is there yet that could be paused.
        assert_eq!(outcome(Interrupt::Pause), RunOutcome::Error);
        assert_eq!(outcome(Interrupt::Stop), RunOutcome::Error);
        let end = end_of_preparation(StepError::NeedsOperator("nobody is there".to_owned()));
        assert_eq!(end.outcome, RunOutcome::NeedsOperator);
        assert_eq!(end_of_preparation(StepError::error("no power")).outcome, RunOutcome::Error);
    }
}
