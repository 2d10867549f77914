//! Running a procedure in the cell in memory and watching it.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use plumb_cell::RunHandle;
use plumb_cell::answers::load_answers;
use plumb_cell::command::Command;
use plumb_cell::engine::{RunRequest, RunningRun, start_run};
use plumb_cell::event::{Event, RunOutcome};
use plumb_cell::expression::Calculator;
use plumb_cell::prompt::{Answer, Decision, PromptKind};
use plumb_cell::workcell::{Workcell, load_workcell};
use tempfile::TempDir;
use tokio::sync::mpsc::error::TryRecvError;

use super::{Devices, OnMove, World};

pub const ZERO_ERROR_DEG: [f64; 3] = [1.7, -2.4, 1.3];

pub fn workcell(file: &str) -> Arc<Workcell> {
    load(&workcells().join(file))
}

fn workcells() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workcells/teachmover")
}

fn load(path: &Path) -> Arc<Workcell> {
    match load_workcell(path, &Calculator::new()) {
        Ok(cell) => Arc::new(cell),
        Err(problems) => panic!("{}", problems.iter().map(ToString::to_string).collect::<String>()),
    }
}

pub fn request(cell: &Arc<Workcell>, record: &TempDir) -> RunRequest {
    let procedure = cell.procedures.first().cloned().expect("a procedure");
    let procedures: Vec<_> = cell.procedures.iter().map(AsRef::as_ref).collect();
    let answers = cell
        .answers
        .as_ref()
        .map(|file| load_answers(file, &procedures, &cell.robots).expect("good answers"));
    RunRequest {
        notes: Vec::new(),
        cell: Arc::clone(cell),
        procedure,
        parameters: BTreeMap::new(),
        answers,
        unattended: true,
        operator: "test".to_owned(),
        record_directory: record.path().to_owned(),
        resume: None,
        settings: serde_json::Value::Null,
        other_files: Vec::new(),
        robots: Vec::new(),
        accepts_changed_plugins: false,
        queue_entry: None,
    }
}

pub fn start(request: RunRequest, world: &Arc<World>) -> RunningRun {
    let devices = Devices(Arc::clone(world));
    start_run(request, |_| Ok(Box::new(devices))).unwrap_or_else(|error| panic!("{error}"))
}

/// Starts a run that is commanded at the beginning of its moves, from the first one on.
pub fn start_commanded(
    request: RunRequest,
    world: &Arc<World>,
    at_move: impl Fn(usize, &RunHandle) + Send + 'static,
) -> RunningRun {
    let handle = Arc::new(OnceLock::new());
    let known = Arc::clone(&handle);
    let hook: OnMove = Box::new(move |number| at_move(number, known.wait()));
    *world.on_move.lock().expect("the hook") = Some(hook);
    let running = start(request, world);
    handle.get_or_init(|| running.handle.clone());
    running
}

/// How long a run in memory may say nothing: hundreds of times what any of them takes.
const SILENCE: Duration = Duration::from_secs(30);

/// Lets a run go on to its end; `watch` may answer it. A run that waits for what nobody will say fails the test, in place of hanging it.
pub fn watch(mut running: RunningRun, mut watch: impl FnMut(&Event, &RunHandle)) -> (RunOutcome, Vec<Event>) {
    let mut events = Vec::new();
    let mut heard = Instant::now();
    loop {
        match running.events.try_recv() {
            Ok(stamped) => {
                watch(&stamped.event, &running.handle);
                // The position of the arm is shown again and again while a prompt waits.
                if !matches!(stamped.event, Event::Joints { .. } | Event::Clearance { .. }) {
                    heard = Instant::now();
                }
                events.push(stamped.event);
            }
            Err(TryRecvError::Empty) => std::thread::sleep(Duration::from_millis(1)),
            Err(TryRecvError::Disconnected) => break,
        }
        if heard.elapsed() > SILENCE {
            running.handle.send(Command::Abort);
            let last: Vec<_> =
                events.iter().rev().filter(|e| !matches!(e, Event::Joints { .. })).take(3).collect();
            panic!("nothing has happened for {} s, after {last:?}", SILENCE.as_secs());
        }
    }
    (running.thread.join().expect("the engine"), events)
}

pub fn message_of(events: &[Event]) -> &str {
    match events.last() {
        Some(Event::RunEnded { message, .. }) => message,
        other => panic!("the last event ends the run, not {other:?}"),
    }
}

/// Answers every prompt of the initialization as an operator would, and decisions by `decide`.
pub fn operator(decide: Decision) -> impl FnMut(&Event, &RunHandle) {
    move |event, handle| {
        let Event::PromptAsked { prompt } = event else { return };
        let answer = match &prompt.kind {
            PromptKind::Acknowledge { .. } | PromptKind::JogTo { .. } => Answer::Done,
            PromptKind::Choice { .. } => Answer::Choice { key: "accept".to_owned() },
            PromptKind::ConfirmPose { .. } => Answer::Confirmed,
            PromptKind::Decision { .. } => Answer::Decision { decision: decide },
            PromptKind::Number { .. } => Answer::Number { value: 0.0 },
            PromptKind::Level { .. } => Answer::Level { x: 0.1, y: -0.2 },
            PromptKind::Photo => Answer::Photo { file: "picture.png".to_owned() },
            PromptKind::Text { .. } => Answer::Text { text: "a line".to_owned() },
        };
        handle.send(Command::Answer { prompt: prompt.id, answer, by: "ada".to_owned() });
    }
}

/// A copy of the cell in which `steps` are the only procedure, called `extra`.
pub fn cell_with_steps(folder: &TempDir, steps: &str) -> Arc<Workcell> {
    let source = workcells();
    let text = std::fs::read_to_string(source.join("cell.yaml")).expect("the cell file");
    let head = text.split("procedures:").next().expect("its beginning");
    let head = head.replace("world: {file: world-ideal.yaml, pace: real}\n", "");
    std::fs::copy(source.join("teachmover.model.yaml"), folder.path().join("teachmover.model.yaml"))
        .expect("copied");
    std::fs::write(folder.path().join("cell.yaml"), format!("{head}procedures: [extra.yaml]\n"))
        .expect("written");
    std::fs::write(folder.path().join("extra.yaml"), format!("procedure: extra\n{steps}")).expect("written");
    load(&folder.path().join("cell.yaml"))
}

/// An operator who jogs one step after the other, each once the one before is over, and then answers.
#[derive(Default)]
pub struct Patient {
    waiting: VecDeque<Command>,
    /// Where the joints were last shown.
    shown: Vec<f64>,
    /// Where they were when the jog under way was sent; nothing while none is.
    sent_from: Option<Vec<f64>>,
}

impl Patient {
    /// Sends these, the first at once.
    pub fn send(&mut self, commands: impl IntoIterator<Item = Command>, handle: &RunHandle) {
        self.waiting.extend(commands);
        self.go_on(handle);
    }

    /// Takes in where the joints are: a jog is over when they have changed and are then shown once more.
    pub fn take(&mut self, event: &Event, handle: &RunHandle) {
        let Event::Joints { joints, .. } = event else { return };
        let now: Vec<f64> = joints.iter().map(|joint| joint.value).collect();
        let over = self.sent_from.as_ref().is_some_and(|from| *from != now && self.shown == now);
        self.shown = now;
        if over {
            self.sent_from = None;
            self.go_on(handle);
        }
    }

    fn go_on(&mut self, handle: &RunHandle) {
        while self.sent_from.is_none()
            && let Some(command) = self.waiting.pop_front()
        {
            self.sent_from = matches!(command, Command::Jog { .. }).then(|| self.shown.clone());
            handle.send(command);
        }
    }
}
