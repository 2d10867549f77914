//! The key table: every key of the screens, where it works, what it does. The footer, the help overlay and the table in
//! the manual are all read from here, and so is the dispatch; a key that is not here does nothing.

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::state::Screen;

/// Where a key works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// Everywhere: in prompts, in overlays, while typing.
    Everywhere,
    /// Everywhere but where a name is being written.
    NotWriting,
    /// Everywhere but where a number or a name is being typed.
    NotTyping,
    /// While something is open over the screen: help, or a question.
    Overlay,
    /// While the program asks whether to leave.
    Leaving,
    /// While the program asks whether to abort the run.
    Aborting,
    /// On the Cell screen.
    Cell,
    /// On the Run screen.
    Run,
    /// On the Run screen while a prompt waits for an answer.
    Prompt,
    /// On the Run screen while a prompt asks for a pose that can be jogged to.
    Jog,
    /// On the Run screen while a step that went wrong waits for a decision.
    Decision,
    /// On the Model screen.
    Model,
    /// On the Model screen while the name of an effect is being written.
    Naming,
    /// On the Log screen.
    Log,
}

impl Place {
    /// How the manual and the help name the place.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Everywhere => "everywhere",
            Self::NotWriting => "not while writing a name",
            Self::NotTyping => "not while typing",
            Self::Overlay => "help",
            Self::Leaving => "leaving",
            Self::Aborting => "aborting",
            Self::Cell => "Cell",
            Self::Run => "Run",
            Self::Prompt => "Run, prompt",
            Self::Jog => "Run, jogging",
            Self::Decision => "Run, failed step",
            Self::Model => "Model",
            Self::Naming => "Model, naming an effect",
            Self::Log => "Log",
        }
    }
}

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Command {
    /// Stop every robot now.
    Stop,
    /// Stop every robot now and ask whether to leave.
    StopAndLeave,
    /// Open or close the help.
    Help,
    /// Close what is open over the screen.
    Close,
    /// Ask whether to leave.
    Leave,
    /// Leave; an unfinished run can be taken up again.
    LeaveNow,
    /// Abort the run and leave.
    AbortAndLeave,
    /// Show a screen.
    Show(Screen),
    /// Show the next screen.
    NextScreen,
    /// Show the screen before.
    PreviousScreen,
    /// One up: the choice above, the line above.
    Up,
    /// One down.
    Down,
    /// A page up.
    PageUp,
    /// A page down.
    PageDown,
    /// Give the answer that stands in the prompt.
    Answer,
    /// Pause after the motion under way.
    Pause,
    /// Go on with a paused run.
    Resume,
    /// Ask whether to abort the run.
    Abort,
    /// Abort the run.
    AbortNow,
    /// Do the failed step again.
    Retry,
    /// Go on without the failed step.
    Skip,
    /// End the run early in good order.
    Finish,
    /// Jog the chosen joint by one step, forwards.
    JogForwards,
    /// Jog the chosen joint by one step, backwards.
    JogBackwards,
    /// Make the step of the jog greater.
    JogMore,
    /// Make the step of the jog smaller.
    JogLess,
    /// Hand the arm to its pendant.
    HandOver,
    /// Show the prompt in letters to be read from the arm.
    Large,
    /// Look at errors in the next plane.
    NextPlane,
    /// Look at errors in the plane before.
    PreviousPlane,
    /// Show what adding the chosen candidate would leave.
    Preview,
    /// Add the chosen candidate to the model.
    Add,
    /// Take the effect added last away again.
    Undo,
    /// Write the name of an effect to be added.
    NameEffect,
    /// Add the effect whose name was written.
    AddNamed,
    /// Step the scale of the plots.
    Scale,
}

/// One row of the key table.
#[derive(Debug)]
pub(crate) struct Binding {
    /// The keys that do it.
    pub keys: &'static [(KeyModifiers, KeyCode)],
    /// How the keys are written.
    pub shown: &'static str,
    /// Where they work.
    pub place: Place,
    /// What they ask for.
    pub command: Command,
    /// Two words for the footer; empty keeps the key out of it.
    pub footer: &'static str,
    /// One sentence for the help and the manual.
    pub help: &'static str,
}

const PLAIN: KeyModifiers = KeyModifiers::NONE;

const fn letter(letter: char) -> (KeyModifiers, KeyCode) {
    (PLAIN, KeyCode::Char(letter))
}

const fn code(code: KeyCode) -> (KeyModifiers, KeyCode) {
    (PLAIN, code)
}

/// The table. Where two rows share a key, the row of the narrower place wins (see [`command_for`]).
pub(crate) const BINDINGS: &[Binding] = &[
    Binding {
        keys: &[code(KeyCode::Esc)],
        shown: "Esc",
        place: Place::Everywhere,
        command: Command::Stop,
        footer: "",
        help: "Stop every robot now, in prompts and overlays too. It is software, not an emergency stop.",
    },
    Binding {
        keys: &[(KeyModifiers::CONTROL, KeyCode::Char('c'))],
        shown: "Ctrl+C",
        place: Place::Everywhere,
        command: Command::StopAndLeave,
        footer: "",
        help: "Stop every robot now, then ask whether to leave. Inside tmux or screen it arrives at once, while Esc waits for their escape-time.",
    },
    Binding {
        keys: &[code(KeyCode::Tab)],
        shown: "Tab",
        place: Place::Everywhere,
        command: Command::NextScreen,
        footer: "screen",
        help: "Show the next screen.",
    },
    Binding {
        keys: &[code(KeyCode::BackTab)],
        shown: "Shift+Tab",
        place: Place::Everywhere,
        command: Command::PreviousScreen,
        footer: "",
        help: "Show the screen before.",
    },
    Binding {
        keys: &[code(KeyCode::F(1))],
        shown: "F1",
        place: Place::Everywhere,
        command: Command::Help,
        footer: "",
        help: "Open or close this help.",
    },
    Binding {
        keys: &[letter('?')],
        shown: "?",
        place: Place::NotWriting,
        command: Command::Help,
        footer: "help",
        help: "Open or close this help.",
    },
    Binding {
        keys: &[letter('q')],
        shown: "q",
        place: Place::NotWriting,
        command: Command::Leave,
        footer: "leave",
        help: "Leave; asks first while a run is open.",
    },
    Binding {
        keys: &[letter('1')],
        shown: "1",
        place: Place::NotTyping,
        command: Command::Show(Screen::Cell),
        footer: "",
        help: "Show the Cell screen: devices, joints, streams and the arm.",
    },
    Binding {
        keys: &[letter('2')],
        shown: "2",
        place: Place::NotTyping,
        command: Command::Show(Screen::Run),
        footer: "",
        help: "Show the Run screen: steps, prompt, live values and corrections.",
    },
    Binding {
        keys: &[letter('3')],
        shown: "3",
        place: Place::NotTyping,
        command: Command::Show(Screen::Model),
        footer: "",
        help: "Show the Model screen: candidates, residuals and the fall of the error.",
    },
    Binding {
        keys: &[letter('4')],
        shown: "4",
        place: Place::NotTyping,
        command: Command::Show(Screen::Log),
        footer: "",
        help: "Show the Log screen: what happened, newest last.",
    },
    Binding {
        keys: &[code(KeyCode::Enter), letter('q')],
        shown: "Enter, q",
        place: Place::Overlay,
        command: Command::Close,
        footer: "close",
        help: "Close the help.",
    },
    Binding {
        keys: &[letter('k')],
        shown: "k",
        place: Place::Leaving,
        command: Command::LeaveNow,
        footer: "keep and leave",
        help: "Leave; the run is kept and can be resumed.",
    },
    Binding {
        keys: &[letter('a')],
        shown: "a",
        place: Place::Leaving,
        command: Command::AbortAndLeave,
        footer: "abort and leave",
        help: "Abort the run, then leave.",
    },
    Binding {
        keys: &[letter('s'), code(KeyCode::Enter)],
        shown: "s, Enter",
        place: Place::Leaving,
        command: Command::Close,
        footer: "stay",
        help: "Stay.",
    },
    Binding {
        keys: &[letter('y')],
        shown: "y",
        place: Place::Aborting,
        command: Command::AbortNow,
        footer: "abort the run",
        help: "Abort the run: it ends here, what was found so far stays in the record.",
    },
    Binding {
        keys: &[letter('n'), code(KeyCode::Enter)],
        shown: "n, Enter",
        place: Place::Aborting,
        command: Command::Close,
        footer: "go back",
        help: "Go back; nothing moves by going back.",
    },
    Binding {
        keys: &[code(KeyCode::Up)],
        shown: "Up",
        place: Place::Everywhere,
        command: Command::Up,
        footer: "",
        help: "The choice or line above.",
    },
    Binding {
        keys: &[code(KeyCode::Down)],
        shown: "Down",
        place: Place::Everywhere,
        command: Command::Down,
        footer: "",
        help: "The choice or line below.",
    },
    Binding {
        keys: &[code(KeyCode::PageUp)],
        shown: "PgUp",
        place: Place::Everywhere,
        command: Command::PageUp,
        footer: "",
        help: "A page up.",
    },
    Binding {
        keys: &[code(KeyCode::PageDown)],
        shown: "PgDn",
        place: Place::Everywhere,
        command: Command::PageDown,
        footer: "",
        help: "A page down.",
    },
    Binding {
        keys: &[code(KeyCode::Enter)],
        shown: "Enter",
        place: Place::Prompt,
        command: Command::Answer,
        footer: "answer",
        help: "Give the answer that stands in the prompt.",
    },
    Binding {
        keys: &[letter('p')],
        shown: "p",
        place: Place::Run,
        command: Command::Pause,
        footer: "pause",
        help: "Pause at the next point where the run can be taken up again.",
    },
    Binding {
        keys: &[letter('r')],
        shown: "r",
        place: Place::Run,
        command: Command::Resume,
        footer: "resume",
        help: "Go on after a pause or a stop. Nothing moves again without it.",
    },
    Binding {
        keys: &[letter('a')],
        shown: "a",
        place: Place::Run,
        command: Command::Abort,
        footer: "abort",
        help: "Abort the run; asks first.",
    },
    Binding {
        keys: &[letter('t')],
        shown: "t",
        place: Place::Decision,
        command: Command::Retry,
        footer: "try again",
        help: "Do the failed step again.",
    },
    Binding {
        keys: &[letter('k')],
        shown: "k",
        place: Place::Decision,
        command: Command::Skip,
        footer: "skip",
        help: "Go on without the failed step.",
    },
    Binding {
        keys: &[code(KeyCode::Right), letter('+')],
        shown: "Right, +",
        place: Place::Jog,
        command: Command::JogForwards,
        footer: "jog",
        help: "Jog the chosen joint one step forwards.",
    },
    Binding {
        keys: &[code(KeyCode::Left), letter('-')],
        shown: "Left, -",
        place: Place::Jog,
        command: Command::JogBackwards,
        footer: "",
        help: "Jog the chosen joint one step backwards.",
    },
    Binding {
        keys: &[letter(']')],
        shown: "]",
        place: Place::Jog,
        command: Command::JogMore,
        footer: "",
        help: "Greater jog steps.",
    },
    Binding {
        keys: &[letter('[')],
        shown: "[",
        place: Place::Jog,
        command: Command::JogLess,
        footer: "step",
        help: "Smaller jog steps.",
    },
    Binding {
        keys: &[letter('h')],
        shown: "h",
        place: Place::Jog,
        command: Command::HandOver,
        footer: "",
        help: "Hand the arm to its pendant, where only that can end it; asks first.",
    },
    Binding {
        keys: &[letter('f')],
        shown: "f",
        place: Place::Run,
        command: Command::Finish,
        footer: "",
        help: "End the run early, in good order, with what it has found.",
    },
    Binding {
        keys: &[letter('z')],
        shown: "z",
        place: Place::Run,
        command: Command::Large,
        footer: "large text",
        help: "Show the prompt in letters that can be read from the arm.",
    },
    Binding {
        keys: &[letter(' ')],
        shown: "Space",
        place: Place::Model,
        command: Command::Preview,
        footer: "preview",
        help: "Show what adding the chosen candidate would leave, without adding it.",
    },
    Binding {
        keys: &[letter('a'), code(KeyCode::Enter)],
        shown: "a, Enter",
        place: Place::Model,
        command: Command::Add,
        footer: "add",
        help: "Add the chosen candidate: fit everything again and write the model's next revision.",
    },
    Binding {
        keys: &[letter('u')],
        shown: "u",
        place: Place::Model,
        command: Command::Undo,
        footer: "undo",
        help: "Take the effect added last away again.",
    },
    Binding {
        keys: &[letter('n')],
        shown: "n",
        place: Place::Model,
        command: Command::NameEffect,
        footer: "add by name",
        help: "Write the name of an effect to add, as joint_zero(*).",
    },
    Binding {
        keys: &[code(KeyCode::Enter)],
        shown: "Enter",
        place: Place::Naming,
        command: Command::AddNamed,
        footer: "add it",
        help: "Add the effect whose name was written; an empty name adds none.",
    },
    Binding {
        keys: &[code(KeyCode::Right)],
        shown: "Right",
        place: Place::Model,
        command: Command::NextPlane,
        footer: "plane",
        help: "Bull's eye and whiskers in the next plane.",
    },
    Binding {
        keys: &[code(KeyCode::Left)],
        shown: "Left",
        place: Place::Model,
        command: Command::PreviousPlane,
        footer: "",
        help: "Bull's eye and whiskers in the plane before.",
    },
    Binding {
        keys: &[letter('f')],
        shown: "f",
        place: Place::Model,
        command: Command::Scale,
        footer: "scale",
        help: "Step the scale of the plots through multiples of the noise floor.",
    },
];

/// What `event` asks for in the given places, the narrowest place first.
pub(crate) fn command_for(places: &[Place], event: &KeyEvent) -> Option<Command> {
    places.iter().find_map(|place| {
        BINDINGS
            .iter()
            .filter(|binding| binding.place == *place)
            .find(|binding| binding.keys.iter().any(|key| is_key(*key, event)))
            .map(|binding| binding.command)
    })
}

/// The rows that hold in the given places, the narrowest place first, without those whose keys a narrower place took.
pub(crate) fn bindings_for(places: &[Place]) -> Vec<&'static Binding> {
    let mut rows: Vec<&'static Binding> = Vec::new();
    for place in places {
        for binding in BINDINGS.iter().filter(|binding| binding.place == *place) {
            let taken = |key: &(KeyModifiers, KeyCode)| rows.iter().any(|row| row.keys.contains(key));
            if !binding.keys.iter().all(taken) {
                rows.push(binding);
            }
        }
    }
    rows
}

/// The key table as the manual prints it: a Markdown table, one row a binding.
#[cfg(test)]
pub(crate) fn manual_table() -> String {
    let mut table = String::from("| Key | Where | What it does |\n|---|---|---|\n");
    for binding in BINDINGS {
        table.push_str(&format!("| `{}` | {} | {} |\n", binding.shown, binding.place.name(), binding.help));
    }
    table
}

/// Whether `event` is `key`. Shift is not compared for characters: `?` arrives with it from some terminals, without it
/// from others.
fn is_key(key: (KeyModifiers, KeyCode), event: &KeyEvent) -> bool {
    let ignored = match event.code {
        KeyCode::Char(_) | KeyCode::BackTab => KeyModifiers::SHIFT,
        _ => KeyModifiers::NONE,
    };
    key.1 == event.code && key.0 == event.modifiers - ignored
}
