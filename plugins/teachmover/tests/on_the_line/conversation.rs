//! Conversations as data: what a controller hears and says, what an operator does meanwhile, and what comes of it.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{DigitalInputs, JointVector, Motion, PluginError, Robot, Value};
use plumb_teachmover::TeachMover;
use plumb_teachmover::drive::{HalfSteps, Joint, RegisterZero};
use serde::Deserialize;

use crate::pseudo_terminal::PseudoTerminal;

/// How long a party waits for the other before the conversation has failed; generous, because the machine may be busy.
const PATIENCE: Duration = Duration::from_secs(20);

/// How long the line must stay quiet at the end.
const QUIET: Duration = Duration::from_millis(60);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Conversation {
    /// What is so: the name of the test.
    title: String,
    /// The configuration beside the port.
    #[serde(default)]
    config: serde_json::Map<String, Value>,
    controller: Vec<Line>,
    operator: Vec<Step>,
    /// The levels and changes emitted on `inputs`, in order.
    inputs: Option<Vec<[u64; 2]>>,
    /// What the log must contain.
    #[serde(default)]
    log: Vec<String>,
}

/// What the controller does.
#[derive(Clone, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Line {
    /// Waits for this line, which ends with a carriage return.
    Hear(String),
    /// Sends these bytes.
    Say(String),
    /// Waits for `@READ` and answers it with this line of registers.
    Read(String),
    /// Sends these bytes again and again, whatever it hears, until the operator has finished.
    Babble(String),
    /// Waits.
    PauseMs(u64),
    /// The host asks for a stop.
    StopAsked,
    /// The plug is pulled.
    Unplug,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    #[serde(rename = "do")]
    act: Act,
    /// The text of the error it ends in; `PORT` means the path of the port, `...` any text.
    error: Option<String>,
    /// The kind of that error.
    kind: Option<String>,
    /// The registers of the state it ends in.
    registers: Option<[i32; 6]>,
    /// The levels it returns.
    levels: Option<u64>,
    /// Whether the hand control has ended.
    finished: Option<bool>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Act {
    Create,
    Activate,
    ReadJoints,
    ReadInputs,
    Stop,
    JogOn,
    JogOff,
    Outputs(u64),
    /// Moves motors by half-steps, at a fraction of full speed: joints that move are those whose motors do.
    Move {
        by: [i32; 6],
        speed: f64,
    },
    /// The joints are at these values: degrees, and mm.
    SetZero([f64; 6]),
    /// Asks again and again until the hand control has ended.
    AwaitJogEnd,
}

/// What an act returned.
#[derive(Default)]
struct Outcome {
    joints: Option<JointVector>,
    levels: Option<u64>,
    finished: Option<bool>,
}

/// Plays a conversation from its file.
///
/// # Panics
/// When a party does not say or get what the file has.
pub(crate) fn play(file: &Path) {
    let text = std::fs::read_to_string(file).unwrap();
    let conversation: Conversation =
        serde_yaml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let recording = RecordingHost::new();
    let terminal = PseudoTerminal::open();
    let port = terminal.path.display().to_string();
    let mut config = conversation.config.clone();
    config.insert("port".to_owned(), port.clone().into());
    let peer = Peer::start(terminal, conversation.controller.clone(), recording.clone());
    let mut cell = Cell { arm: None, config: config.into(), recording: recording.clone() };
    for (index, step) in conversation.operator.iter().enumerate() {
        let context = format!("{}, step {} ({})", file.display(), index + 1, conversation.title);
        let outcome = cell.act(&step.act);
        step.check(outcome, &context, &port);
    }
    if let Err(error) = peer.finish() {
        panic!("{} ({}): {error}", file.display(), conversation.title);
    }
    if let Some(expected) = &conversation.inputs {
        let emitted = recording.emitted::<DigitalInputs>("inputs");
        let emitted: Vec<[u64; 2]> = emitted.iter().map(|inputs| [inputs.levels, inputs.changed]).collect();
        assert_eq!(&emitted, expected, "{}: inputs", file.display());
    }
    let lines = recording.lines();
    for expected in &conversation.log {
        let found = lines.iter().any(|(_, line)| line.contains(expected));
        assert!(found, "{}: the log does not contain '{expected}': {lines:?}", file.display());
    }
}

struct Cell {
    arm: Option<TeachMover>,
    config: Value,
    recording: RecordingHost,
}

impl Cell {
    fn act(&mut self, act: &Act) -> Result<Outcome, PluginError> {
        if let Act::Create = act {
            self.arm = Some(TeachMover::create(&self.config, self.recording.host())?);
            return Ok(Outcome::default());
        }
        let arm = self.arm.as_mut().expect("`create` comes first");
        let none = |()| Outcome::default();
        match act {
            Act::Create => Ok(Outcome::default()),
            Act::AwaitJogEnd => {
                let deadline = std::time::Instant::now() + PATIENCE;
                while arm.jog(true)?.finished == 0 && std::time::Instant::now() < deadline {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Ok(Outcome::default())
            }
            Act::Activate => {
                self.recording.set_stop(false);
                arm.activate().map(none)
            }
            Act::ReadJoints => {
                arm.read_joints().map(|state| Outcome { joints: Some(state.joints), ..Outcome::default() })
            }
            Act::ReadInputs => {
                arm.read_inputs().map(|inputs| Outcome { levels: Some(inputs.levels), ..Outcome::default() })
            }
            Act::Stop => arm.stop().map(none),
            Act::JogOn | Act::JogOff => arm.jog(matches!(act, Act::JogOn)).map(|jog| Outcome {
                joints: Some(jog.state.joints),
                finished: Some(jog.finished != 0),
                ..Outcome::default()
            }),
            Act::Outputs(levels) => arm.write_outputs(*levels).map(none),
            Act::Move { by, speed } => {
                let motion = motion(*by, *speed);
                arm.move_joints(&motion)
                    .map(|state| Outcome { joints: Some(state.joints), ..Outcome::default() })
            }
            Act::SetZero(values) => arm.set_zero(&pose(*values)).map(none),
        }
    }
}

/// The relative motion that makes these half-steps.
fn motion(by: [i32; 6], speed: f64) -> Motion {
    let straight = RegisterZero::at([0.0; 6]);
    let change = straight.joints(HalfSteps(by));
    let mask = Joint::ALL.into_iter().filter(|joint| change[joint.index()].abs() > 1e-12);
    let mask = mask.fold(0, |mask, joint| mask | 1 << joint.index());
    Motion::relative(JointVector::from_slice(&change).unwrap(), speed).only(mask)
}

fn pose(values: [f64; 6]) -> JointVector {
    let [.., opening] = values;
    let mut joints = values.map(f64::to_radians);
    joints[5] = opening;
    JointVector::from_slice(&joints).unwrap()
}

impl Step {
    fn check(&self, outcome: Result<Outcome, PluginError>, context: &str, port: &str) {
        let outcome = match (outcome, &self.error) {
            (Ok(outcome), None) => outcome,
            (Ok(_), Some(error)) => panic!("{context}: should have failed with: {error}"),
            (Err(error), None) => panic!("{context}: {error}"),
            (Err(error), Some(expected)) => {
                let expected = expected.replace("PORT", port);
                let message = error.to_string();
                assert!(
                    alike(&message, &expected),
                    "{context}:\n  it said:     {message}\n  it should:   {expected}"
                );
                if let Some(kind) = &self.kind {
                    assert!(
                        format!("{error:?}").starts_with(kind.as_str()),
                        "{context}: {error:?} is no {kind}"
                    );
                }
                return;
            }
        };
        if let Some(registers) = self.registers {
            let expected = RegisterZero::at([0.0; 6]).joints(HalfSteps(registers));
            let joints = outcome.joints.unwrap_or_else(|| panic!("{context}: tells no joints"));
            for (joint, (expected, found)) in
                Joint::ALL.into_iter().zip(expected.iter().zip(joints.as_slice()))
            {
                assert!(
                    (expected - found).abs() < 1e-9,
                    "{context}: {}: {found}, not {expected}",
                    joint.name()
                );
            }
        }
        if self.levels.is_some() {
            assert_eq!(outcome.levels, self.levels, "{context}");
        }
        if self.finished.is_some() {
            assert_eq!(outcome.finished, self.finished, "{context}");
        }
    }
}

/// Whether a text is another in which `...` means any text.
fn alike(message: &str, expected: &str) -> bool {
    match expected.split_once("...") {
        None => message == expected,
        Some((beginning, rest)) => message
            .strip_prefix(beginning)
            .is_some_and(|message| message.char_indices().any(|(offset, _)| alike(&message[offset..], rest))),
    }
}

/// The controller's side, in a thread of its own.
struct Peer {
    thread: JoinHandle<Result<(), String>>,
    /// Set when the operator has finished: whatever the peer still hears is too much.
    over: Arc<AtomicBool>,
}

impl Peer {
    fn start(mut terminal: PseudoTerminal, lines: Vec<Line>, recording: RecordingHost) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let is_over = over.clone();
        let thread = std::thread::spawn(move || {
            lines.iter().try_for_each(|line| line.play(&mut terminal, &recording, &is_over))?;
            while !is_over.load(Ordering::Acquire) {
                let heard = terminal.receive(Duration::from_millis(5));
                nothing(&heard)?;
            }
            nothing(&terminal.receive(QUIET))
        });
        Self { thread, over }
    }

    fn finish(self) -> Result<(), String> {
        self.over.store(true, Ordering::Release);
        self.thread.join().unwrap_or_else(|_| Err("the controller's side panicked".to_owned()))
    }
}

fn nothing(heard: &[u8]) -> Result<(), String> {
    if heard.is_empty() {
        Ok(())
    } else {
        Err(format!("the controller heard '{}' too", heard.escape_ascii()))
    }
}

impl Line {
    fn play(
        &self,
        terminal: &mut PseudoTerminal,
        recording: &RecordingHost,
        over: &AtomicBool,
    ) -> Result<(), String> {
        match self {
            Self::Hear(expected) => hear(terminal, expected)?,
            Self::Say(text) => terminal.send(text.as_bytes()),
            Self::Read(registers) => {
                hear(terminal, "@READ")?;
                terminal.send(format!("1\r{registers}\r").as_bytes());
            }
            Self::Babble(text) => {
                while !over.load(Ordering::Acquire) {
                    terminal.send_if_taken(text.as_bytes());
                    terminal.receive(Duration::ZERO);
                }
            }
            Self::PauseMs(pause) => std::thread::sleep(Duration::from_millis(*pause)),
            Self::StopAsked => recording.set_stop(true),
            Self::Unplug => terminal.unplug(),
        }
        Ok(())
    }
}

fn hear(terminal: &mut PseudoTerminal, expected: &str) -> Result<(), String> {
    let mut heard = Vec::new();
    let expected = format!("{expected}\r");
    while heard.len() < expected.len() {
        let bytes = terminal.receive(PATIENCE);
        if bytes.is_empty() {
            break;
        }
        heard.extend(bytes);
    }
    if heard == expected.as_bytes() {
        return Ok(());
    }
    Err(format!("the controller heard '{}', not '{}'", heard.escape_ascii(), expected.escape_debug()))
}
