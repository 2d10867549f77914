//! A cell in which one run follows the other: its world, its hosts and its bus are started once, and the world begins again before each run.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use plumb_cell::answers::{Answers, load_answers};
use plumb_cell::check_cell;
use plumb_cell::device::{CellResources, DeviceLinks as _, HostedDevices, KeptDevices};
use plumb_cell::engine::{RunRequest, start_run};
use plumb_cell::event::{Event, RunOutcome, StepOutcome};
use plumb_cell::expression::Calculator;
use plumb_cell::procedure::Procedure;
use plumb_cell::workcell::{Pace, Workcell, WorldSetting, load_workcell};
use plumb_document::did_you_mean;
use plumb_host::Catalogue;
use plumb_record::{CellLock, Record};
use plumb_simulated::client::{ClientError, WorldClient};
use plumb_simulated::protocol::WorldCommand;
use serde_json::Value;

use super::StudyError;
use super::truth::{self, Missed};
use plumb::commands::run::simulated_world::SimulatedWorld;
use plumb::commands::study::study_file::{Common, lay_over};

/// How far from where the world file says an operator leaves the arm, where it does not say: what an eye judges.
const TOLERANCE: &str = "{waist_deg: 3, shoulder_deg: 3, elbow_deg: 5, wrist_pitch_deg: 1}";

/// A directory that goes with what made it; in memory where there is such a folder, as nothing in it is kept.
pub(super) struct StudyFolder(PathBuf);

impl StudyFolder {
    pub(super) fn new() -> Result<Self, StudyError> {
        let memory = Path::new("/dev/shm");
        let parent = if memory.is_dir() { memory.to_owned() } else { std::env::temp_dir() };
        let path = parent.join(format!("plumb-study-{}", std::process::id()));
        fs::create_dir_all(&path)?;
        Ok(Self(path))
    }
}

impl Drop for StudyFolder {
    fn drop(&mut self) {
        if let Err(error) = fs::remove_dir_all(&self.0) {
            tracing::debug!("{} is left behind: {error}", self.0.display());
        }
    }
}

/// What one run came to.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub(super) seed: u64,
    pub(super) outcome: RunOutcome,
    /// Its last word.
    pub(super) message: String,
    /// None after a run that did not pass.
    pub(super) missed: Option<Missed>,
    /// What the arm needed, by the world's clock, s.
    pub(super) seconds: f64,
    /// Steps that were done.
    pub(super) steps: usize,
}

/// The cell.
pub(super) struct Bench<'a> {
    folder: &'a StudyFolder,
    cell: Arc<Workcell>,
    procedure: Arc<Procedure>,
    answers: Option<Answers>,
    with: Common,
    devices: Arc<Mutex<HostedDevices>>,
    world: WorldClient,
    /// Held as long as anything runs there.
    _lock: CellLock,
}

impl<'a> Bench<'a> {
    /// Starts the cell's world as the study changes it.
    pub(super) fn new(
        with: Common,
        folder: &'a StudyFolder,
        plugins: &[PathBuf],
    ) -> Result<Self, StudyError> {
        let file = with.cell.clone().unwrap_or_default();
        let in_words = |problems: Vec<plumb_document::FileProblems>| {
            StudyError::Cell(problems.iter().map(ToString::to_string).collect())
        };
        let mut cell = load_workcell(&file, &Calculator::new()).map_err(in_words)?;
        let catalogue = Catalogue::search(plugins);
        check_cell(&cell, &catalogue, &[], &[]).map_err(in_words)?;
        let procedure = procedure_of(&cell, with.procedure.as_deref())?;
        let answers = answers_of(&cell).map_err(|problems| in_words(vec![problems]))?;
        let world_file = folder.0.join("world.yaml");
        fs::write(&world_file, world_text(&cell, &with.world)?)?;
        let setting = WorldSetting { file: world_file.clone(), pace: Pace::Fast };
        cell.world = Some(setting.clone());
        let here = CellResources::of_cell(&world_file)?;
        let lock = here.lock(&cell.name, &world_file.display().to_string())?;
        let socket = here.world_socket();
        let started = SimulatedWorld::start(&setting, Pace::Fast, &socket)?;
        let cell = Arc::new(cell);
        let domain = here.domain().clone();
        let devices = HostedDevices::new(Arc::clone(&cell), catalogue, domain, Some(Box::new(started)));
        let devices = Arc::new(Mutex::new(devices));
        let world = WorldClient::connect(&socket, "study")?;
        Ok(Self { folder, cell, procedure, answers, with, devices, world, _lock: lock })
    }

    /// Makes one run from a start drawn from `seed`, and takes its error.
    pub(super) fn run(&mut self, seed: u64) -> Result<Run, StudyError> {
        let begin = self.world.read(WorldCommand::Again { seed })?;
        let record_directory = self.folder.0.join("record");
        let request = RunRequest {
            notes: Vec::new(),
            cell: Arc::clone(&self.cell),
            procedure: Arc::clone(&self.procedure),
            parameters: self.parameters(),
            answers: self.answers.clone(),
            unattended: true,
            operator: "study".to_owned(),
            record_directory: record_directory.clone(),
            resume: None,
            settings: Value::Null,
            other_files: Vec::new(),
            robots: Vec::new(),
            accepts_changed_plugins: true,
            queue_entry: None,
        };
        let mut running = start_run(request, |_| Ok(Box::new(KeptDevices::new(&self.devices))))?;
        let (mut steps, mut message) = (0, String::new());
        while let Some(stamped) = running.events.blocking_recv() {
            match stamped.event {
                Event::StepFinished { outcome: StepOutcome::Passed, .. } => steps += 1,
                Event::RunEnded { message: last, .. } => message = last,
                _ => {}
            }
        }
        let outcome = running.thread.join().unwrap_or(RunOutcome::Error);
        let end = self.world.read(WorldCommand::Read {})?;
        let seconds = end.time_ns.saturating_sub(begin.time_ns) as f64 / 1e9;
        let missed = match outcome {
            RunOutcome::Passed => Some(self.take_error(&record_directory)?),
            _ => None,
        };
        fs::remove_dir_all(&record_directory)?;
        Ok(Run { seed, outcome, message, missed, seconds, steps })
    }

    /// The procedure's parameters as far as this one has them: a study of several procedures sets those of all.
    fn parameters(&self) -> BTreeMap<String, f64> {
        let known = |name: &String| self.procedure.parameters.iter().any(|parameter| parameter.name == *name);
        self.with.set.clone().into_iter().filter(|(name, _)| known(name)).collect()
    }

    fn take_error(&mut self, record: &Path) -> Result<Missed, StudyError> {
        let record = Record::open(record)?;
        let robot = self.cell.robots.first().map_or("", |robot| robot.device.as_str());
        let corrections = record.corrections_in_force(&self.cell.name, robot)?;
        truth::take(&mut self.world, &self.cell, &corrections, &self.with.check_pose)
    }
}

impl Drop for Bench<'_> {
    fn drop(&mut self) {
        self.devices.lock().unwrap_or_else(PoisonError::into_inner).shut_down(false);
    }
}

fn procedure_of(cell: &Workcell, expected: Option<&str>) -> Result<Arc<Procedure>, StudyError> {
    let found = match expected {
        Some(expected) => cell.procedure(expected),
        None => cell.procedures.first(),
    };
    found.cloned().ok_or_else(|| {
        let expected = expected.unwrap_or_default();
        let help = did_you_mean(expected, cell.procedures.iter().map(|procedure| procedure.name.as_str()));
        StudyError::Cell(format!("cell `{}` has no procedure `{expected}`: {help}", cell.name))
    })
}

fn answers_of(cell: &Workcell) -> Result<Option<Answers>, plumb_document::FileProblems> {
    let procedures: Vec<&Procedure> = cell.procedures.iter().map(AsRef::as_ref).collect();
    cell.answers.as_ref().map(|file| load_answers(file, &procedures, &cell.robots)).transpose()
}

/// The text of the cell's world with a patch laid over it and, where it has none, an operator's tolerance.
fn world_text(cell: &Workcell, patch: &Value) -> Result<String, StudyError> {
    let wrong = |cause: String| StudyError::Cell(format!("cell `{}`: {cause}", cell.name));
    let setting = cell.world.as_ref().ok_or_else(|| {
        wrong(
            "it has no `world`; only a simulated cell can be studied, as only there the truth is known"
                .to_owned(),
        )
    })?;
    let text = plumb_document::read_text(&setting.file, plumb_document::FileKind::WORLD)
        .map_err(std::io::Error::from)?;
    let mut world: Value = serde_yaml::from_str(&text).map_err(|error| wrong(error.to_string()))?;
    if world.get("sealed").is_some() {
        return Err(StudyError::Truth(ClientError::Refused(
            "it is sealed, so that nobody can tell how far a run missed; reveal it first".to_owned(),
        )));
    }
    lay_over(&mut world, patch);
    if let Some(arm) = world.get_mut("arm").and_then(|arm| arm.get_mut("teachmover"))
        && let Some(arm) = arm.as_object_mut()
        && !arm.contains_key("start_within")
    {
        let tolerance = serde_yaml::from_str(TOLERANCE).map_err(|error| wrong(error.to_string()))?;
        arm.insert("start_within".to_owned(), tolerance);
    }
    Ok(world.to_string())
}
