//! The key table: every key of the screens, where it works, what it does. The footer, the help overlay and the table in
//! the manual are all read from here, and so is the dispatch; a key that is not here does nothing.

mod table;

use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::scan::ScanCommand;
use super::screen::Screen;
pub(crate) use table::BINDINGS;

/// Where a key works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Context {
    /// Everywhere: in prompts, in overlays, while typing.
    Everywhere,
    /// Everywhere but where a name or a filter is being written.
    NotWriting,
    /// Everywhere but where a number or a name is being typed.
    NotTyping,
    /// While something is open over the screen: help, or a question.
    Overlay,
    /// While the program asks whether to leave.
    Leaving,
    /// While the program asks whether to abort the run.
    Aborting,
    /// While the program asks whether to add a candidate that the lab rejects.
    AddingRejected,
    /// While the program asks whether to bring earlier corrections back.
    BringingBack,
    /// On the Cell screen.
    Cell,
    /// On every page while a run is open.
    Run,
    /// On the Run screen.
    RunPage,
    /// On the Run screen while a prompt waits for an answer.
    Prompt,
    /// On the Run screen while a prompt asks for a pose that can be jogged to.
    Jog,
    /// On the Run screen while a step that went wrong waits for a decision.
    Decision,
    /// On the Run screen while a prompt asks for what the simulated world does or reads.
    Simulated,
    /// On the Model screen.
    Model,
    /// On the Model screen while the name of an effect is being written.
    Naming,
    /// On the History screen.
    History,
    /// On the History screen while the filter is being written.
    Filtering,
    /// On the History screen while a run is open.
    OpenedRun,
    /// On the Log screen.
    Log,
    /// On the Scan screen.
    Scan,
}

impl Context {
    /// How the manual and the help name the context.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Everywhere => "everywhere",
            Self::NotWriting => "not while writing",
            Self::NotTyping => "not while typing",
            Self::Overlay => "help, details",
            Self::Leaving => "leaving",
            Self::Aborting => "aborting",
            Self::AddingRejected => "Model, adding what was not named",
            Self::BringingBack => "History, bringing back",
            Self::Cell => "Cell",
            Self::Run => "while a run is open",
            Self::RunPage => "Run",
            Self::Prompt => "Run, prompt",
            Self::Jog => "Run, jogging",
            Self::Decision => "Run, failed step",
            Self::Simulated => "Run, simulated cell",
            Self::Model => "Model",
            Self::Naming => "Model, naming an effect",
            Self::History => "History",
            Self::Filtering => "History, filter",
            Self::OpenedRun => "History, one run",
            Self::Log => "Log",
            Self::Scan => "Scan",
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
    /// Give the answer that is in the prompt.
    Answer,
    /// Leave this prompt and all like it to the simulated world.
    LeaveToWorld,
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
    /// Move the arm by hand, then do the failed step again.
    MoveArm,
    /// Go back to the step that placed the arm.
    GoBack,
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
    /// Show the arm in the place of the steps, or the steps again.
    SwapViews,
    /// Look at errors in the next plane.
    NextPlane,
    /// Look at errors in the plane before.
    PreviousPlane,
    /// Show what adding the chosen candidate would leave.
    Preview,
    /// Add the chosen candidate to the model.
    Add,
    /// Add it although the lab rejects it.
    AddNow,
    /// Show the chosen candidate in full.
    Details,
    /// Point out the next row, from the worst on.
    NextWorst,
    /// Point out the row before.
    PreviousWorst,
    /// Complete the name that is being written.
    CompleteName,
    /// Take the effect added last away again.
    Undo,
    /// Write the name of an effect to be added.
    NameEffect,
    /// Add the effect whose name was written.
    AddNamed,
    /// Step the scale of the plots.
    Scale,
    /// Give up what the lab is doing.
    Cancel,
    /// Judge what could explain the rest, where that was given up.
    Judge,
    /// Open the chosen run.
    OpenRun,
    /// Close the run that is open.
    CloseRun,
    /// Write the words runs are filtered by.
    Filter,
    /// Leave the filter as it is.
    FilterDone,
    /// Draw the next corrected quantity over time.
    NextTrend,
    /// Draw the one before.
    PreviousTrend,
    /// Ask whether to bring back what the chosen run put in force.
    BringBack,
    /// Bring it back.
    BringBackNow,
    /// Something on the Scan screen.
    Scan(ScanCommand),
}

/// One row of the key table.
#[derive(Debug)]
pub(crate) struct Binding {
    /// The keys that do it.
    pub keys: &'static [(KeyModifiers, KeyCode)],
    /// How the keys are written.
    pub shown: &'static str,
    /// Where they work.
    pub context: Context,
    /// What they ask for.
    pub command: Command,
    /// Two words for the footer; empty keeps the key out of it.
    pub footer: &'static str,
    /// One sentence for the help and the manual.
    pub help: &'static str,
}

/// What `event` asks for in the given contexts, the narrowest context first.
pub(crate) fn command_for(contexts: &[Context], event: &KeyEvent) -> Option<Command> {
    contexts.iter().find_map(|context| {
        BINDINGS
            .iter()
            .filter(|binding| binding.context == *context)
            .find(|binding| binding.keys.iter().any(|key| is_key(*key, event)))
            .map(|binding| binding.command)
    })
}

/// The rows that hold in the given contexts, the narrowest context first, without those whose keys a narrower context took.
pub(crate) fn bindings_for(contexts: &[Context]) -> Vec<&'static Binding> {
    let mut rows: Vec<&'static Binding> = Vec::new();
    for context in contexts {
        for binding in BINDINGS.iter().filter(|binding| binding.context == *context) {
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
        table.push_str(&format!("| `{}` | {} | {} |\n", binding.shown, binding.context.name(), binding.help));
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
