//! The rows of the key table. Where two rows share a key, the row of the narrower context wins.

use ratatui::crossterm::event::{KeyCode, KeyModifiers};

use super::{Binding, Command, Context};
use crate::screens::scan::ScanCommand;
use crate::screens::screen::Screen;

const PLAIN: KeyModifiers = KeyModifiers::NONE;

const fn letter(letter: char) -> (KeyModifiers, KeyCode) {
    (PLAIN, KeyCode::Char(letter))
}

const fn code(code: KeyCode) -> (KeyModifiers, KeyCode) {
    (PLAIN, code)
}

/// A letter with Ctrl held.
const fn control(letter: char) -> (KeyModifiers, KeyCode) {
    (KeyModifiers::CONTROL, KeyCode::Char(letter))
}

/// A row: the keys and how they are written, where they work, what they ask for, the words of the footer and the sentence of the help.
const fn bind(
    keys: &'static [(KeyModifiers, KeyCode)],
    shown: &'static str,
    context: Context,
    command: Command,
    footer: &'static str,
    help: &'static str,
) -> Binding {
    Binding { keys, shown, context, command, footer, help }
}

/// The table, a line a row.
#[rustfmt::skip]
pub(crate) const BINDINGS: &[Binding] = &[
    bind(&[code(KeyCode::Esc)], "Esc", Context::Everywhere, Command::Stop, "", "Stop every robot now, in prompts and overlays too. It is software, not an emergency stop."),
    bind(&[control('c')], "Ctrl+C", Context::Everywhere, Command::StopAndLeave, "", "Stop every robot now, then ask whether to leave. Inside tmux or screen it arrives at once, while Esc waits for their escape-time."),
    bind(&[code(KeyCode::Tab)], "Tab", Context::Everywhere, Command::NextScreen, "screen", "Show the next screen."),
    bind(&[code(KeyCode::BackTab)], "Shift+Tab", Context::Everywhere, Command::PreviousScreen, "", "Show the screen before."),
    bind(&[code(KeyCode::F(1))], "F1", Context::Everywhere, Command::Help, "", "Open or close this help."),
    bind(&[letter('?')], "?", Context::NotWriting, Command::Help, "help", "Open or close this help."),
    bind(&[letter('q')], "q", Context::NotWriting, Command::Leave, "leave", "Leave; asks first while a run is open."),
    bind(&[letter('1')], "1", Context::NotTyping, Command::Show(Screen::Cell), "", "Show the Cell screen: devices, joints, streams and the arm."),
    bind(&[letter('2')], "2", Context::NotTyping, Command::Show(Screen::Run), "", "Show the Run screen: steps, prompt, live values and corrections."),
    bind(&[letter('3')], "3", Context::NotTyping, Command::Show(Screen::Model), "", "Show the Model screen: candidates, residuals and the fall of the error."),
    bind(&[letter('4')], "4", Context::NotTyping, Command::Show(Screen::History), "", "Show the History screen: the runs in the record, and corrections over time."),
    bind(&[letter('5')], "5", Context::NotTyping, Command::Show(Screen::Log), "", "Show the Log screen: what happened, newest last."),
    bind(&[letter('6')], "6", Context::NotTyping, Command::Show(Screen::Scan), "", "Show the Scan screen: the cloud of the scan under way."),
    bind(&[code(KeyCode::Enter), letter('q')], "Enter, q", Context::Overlay, Command::Close, "close", "Close the help, or the details of a candidate."),
    bind(&[letter('k')], "k", Context::Leaving, Command::LeaveNow, "keep and leave", "Leave; the run is kept and can be resumed."),
    bind(&[letter('a')], "a", Context::Leaving, Command::AbortAndLeave, "abort and leave", "Abort the run, then leave."),
    bind(&[letter('s'), code(KeyCode::Enter)], "s, Enter", Context::Leaving, Command::Close, "stay", "Stay."),
    bind(&[letter('y')], "y", Context::Aborting, Command::AbortNow, "abort the run", "Abort the run: it ends here, what was found so far stays in the record."),
    bind(&[letter('n'), code(KeyCode::Enter)], "n, Enter", Context::Aborting, Command::Close, "go back", "Go back; nothing moves by going back."),
    bind(&[code(KeyCode::Up)], "Up", Context::Everywhere, Command::Up, "", "The choice or line above."),
    bind(&[code(KeyCode::Down)], "Down", Context::Everywhere, Command::Down, "", "The choice or line below."),
    bind(&[code(KeyCode::PageUp)], "PgUp", Context::Everywhere, Command::PageUp, "", "A page up."),
    bind(&[code(KeyCode::PageDown)], "PgDn", Context::Everywhere, Command::PageDown, "", "A page down."),
    bind(&[code(KeyCode::Enter)], "Enter", Context::Prompt, Command::Answer, "answer", "Give the answer shown in the prompt."),
    bind(&[letter('s')], "s", Context::Simulated, Command::LeaveToWorld, "simulate the rest", "Leave this and everything like it for the rest of the run to the simulated operator: what hands do, where an arm is driven by hand, what instruments read. Other questions are still asked."),
    bind(&[letter('p')], "p", Context::Run, Command::Pause, "pause", "Pause at the next point where the run can be taken up again."),
    bind(&[letter('r')], "r", Context::Run, Command::Resume, "resume", "Go on after a pause or a stop. Nothing moves again without it."),
    bind(&[letter('a')], "a", Context::Run, Command::Abort, "abort", "Abort the run; asks first."),
    bind(&[letter('t')], "t", Context::Decision, Command::Retry, "try again", "Do the failed step again."),
    bind(&[letter('m')], "m", Context::Decision, Command::MoveArm, "move the arm", "Move the arm yourself, then do the failed step again from there."),
    bind(&[letter('b')], "b", Context::Decision, Command::GoBack, "go back", "Go back to the step that placed the arm, or that asked something."),
    bind(&[letter('k')], "k", Context::Decision, Command::Skip, "skip", "Go on without the failed step."),
    bind(&[code(KeyCode::Right), letter('+')], "Right, +", Context::Jog, Command::JogForwards, "jog", "Jog the chosen joint one step forwards."),
    bind(&[code(KeyCode::Left), letter('-')], "Left, -", Context::Jog, Command::JogBackwards, "", "Jog the chosen joint one step backwards."),
    bind(&[letter(']')], "]", Context::Jog, Command::JogMore, "", "Greater jog steps."),
    bind(&[letter('[')], "[", Context::Jog, Command::JogLess, "step", "Smaller jog steps."),
    bind(&[letter('h')], "h", Context::Jog, Command::HandOver, "", "Hand the arm to its pendant, where only that can end it; asks first."),
    bind(&[letter('f')], "f", Context::Run, Command::Finish, "", "End the run early, in good order, with what it has found."),
    bind(&[letter('z')], "z", Context::Run, Command::Large, "large", "Show the prompt in letters that can be read from the arm; again goes back."),
    bind(&[letter('v')], "v", Context::RunPage, Command::SwapViews, "views", "Show the arm from above and from the side in the place of the steps, or the steps again, where there is no room for both."),
    bind(&[letter(' ')], "Space", Context::Model, Command::Preview, "preview", "Show what adding the chosen candidate would leave, without adding it."),
    bind(&[letter('a')], "a", Context::Model, Command::Add, "add", "Add the chosen candidate: fit everything again and write the model's next revision; asks first where it was not named."),
    bind(&[code(KeyCode::Enter)], "Enter", Context::Model, Command::Details, "details", "Show the chosen candidate in full: its own plot, what it is, how sure it is, what to measure to see it."),
    bind(&[letter('w')], "w", Context::Model, Command::NextWorst, "worst row", "Point out the worst row in every plot, with its line of the table and its pose; again the next. A click on a point does it for that row."),
    bind(&[letter('W')], "W", Context::Model, Command::PreviousWorst, "", "Point out the row before."),
    bind(&[letter('u')], "u", Context::Model, Command::Undo, "undo", "Take the effect added last away again."),
    bind(&[letter('n')], "n", Context::Model, Command::NameEffect, "add by name", "Write the name of an effect to add, as joint_zero(*)."),
    bind(&[code(KeyCode::Enter)], "Enter", Context::Naming, Command::AddNamed, "add it", "Add the effect whose name was written; an empty name adds none."),
    bind(&[code(KeyCode::Tab)], "Tab", Context::Naming, Command::CompleteName, "complete", "Complete the name as far as it is certain."),
    bind(&[letter('y')], "y", Context::AddingRejected, Command::AddNow, "add it", "Add the candidate although the lab did not name it."),
    bind(&[letter('n'), code(KeyCode::Enter)], "n, Enter", Context::AddingRejected, Command::Close, "leave it", "Leave the model as it is."),
    bind(&[code(KeyCode::Right)], "Right", Context::Model, Command::NextPlane, "plane", "Bull's eye and whiskers in the next plane."),
    bind(&[code(KeyCode::Left)], "Left", Context::Model, Command::PreviousPlane, "", "Bull's eye and whiskers in the plane before."),
    bind(&[letter('f')], "f", Context::Model, Command::Scale, "scale", "Step the scale of the plots through multiples of the noise floor."),
    bind(&[letter('c')], "c", Context::Model, Command::Cancel, "cancel", "Give up what the lab is doing; the model stays as it is."),
    bind(&[letter('j')], "j", Context::Model, Command::Judge, "judge", "Judge what could explain the rest, where that was given up."),
    bind(&[code(KeyCode::Enter)], "Enter", Context::History, Command::OpenRun, "open", "Open the chosen run: its steps, answers, trigger poses, values, corrections and files."),
    bind(&[letter('/')], "/", Context::History, Command::Filter, "filter", "Write words; only runs that hold all of them are shown (cell, procedure, operator, date, how it ended)."),
    bind(&[code(KeyCode::Right)], "Right", Context::History, Command::NextTrend, "next correction", "Draw the next corrected quantity over time."),
    bind(&[code(KeyCode::Left)], "Left", Context::History, Command::PreviousTrend, "", "Draw the corrected quantity before."),
    bind(&[letter('b')], "b", Context::History, Command::BringBack, "bring back", "Bring back the corrections as the chosen run applied them; asks first, and makes a new revision."),
    bind(&[letter('y')], "y", Context::BringingBack, Command::BringBackNow, "bring them back", "Bring the corrections back: a new revision puts them in force, nothing is overwritten."),
    bind(&[letter('n'), code(KeyCode::Enter)], "n, Enter", Context::BringingBack, Command::Close, "leave them", "Leave the corrections as they are."),
    bind(&[code(KeyCode::Enter)], "Enter", Context::Filtering, Command::FilterDone, "done", "Leave the filter as it is; an empty one shows all runs."),
    bind(&[code(KeyCode::Enter), code(KeyCode::Backspace)], "Enter, Backspace", Context::OpenedRun, Command::CloseRun, "close", "Back to the list of runs."),
    bind(&[code(KeyCode::Left)], "Left", Context::Scan, Command::Scan(ScanCommand::TurnLeft), "turn", "Go around the cloud to the left; the mouse does it by dragging."),
    bind(&[code(KeyCode::Right)], "Right", Context::Scan, Command::Scan(ScanCommand::TurnRight), "", "Go around the cloud to the right."),
    bind(&[code(KeyCode::Up)], "Up", Context::Scan, Command::Scan(ScanCommand::TurnUp), "", "Look from higher up; edge-on, draw the thickness larger."),
    bind(&[code(KeyCode::Down)], "Down", Context::Scan, Command::Scan(ScanCommand::TurnDown), "", "Look from lower down; edge-on, draw the thickness smaller."),
    bind(&[letter('+'), letter('=')], "+, =", Context::Scan, Command::Scan(ScanCommand::Nearer), "zoom", "Show less, larger; so does the wheel."),
    bind(&[letter('-')], "-", Context::Scan, Command::Scan(ScanCommand::Farther), "", "Show more, smaller."),
    bind(&[letter('A')], "A", Context::Scan, Command::Scan(ScanCommand::MoveLeft), "move", "Move the view to the left; the mouse moves it with the right button, or with Ctrl held."),
    bind(&[letter('D')], "D", Context::Scan, Command::Scan(ScanCommand::MoveRight), "", "Move the view to the right."),
    bind(&[letter('W')], "W", Context::Scan, Command::Scan(ScanCommand::MoveUp), "", "Move the view up."),
    bind(&[letter('S')], "S", Context::Scan, Command::Scan(ScanCommand::MoveDown), "", "Move the view down."),
    bind(&[letter('v')], "v", Context::Scan, Command::Scan(ScanCommand::NextSide), "sides", "Look from the next of the usual sides."),
    bind(&[letter('g'), code(KeyCode::Home)], "g, Home", Context::Scan, Command::Scan(ScanCommand::Whole), "all", "Show the whole cloud."),
    bind(&[letter('o')], "o", Context::Scan, Command::Scan(ScanCommand::Strokes), "points", "Points, or the stripes as a wire-frame."),
    bind(&[letter('c')], "c", Context::Scan, Command::Scan(ScanCommand::Colour), "colour", "Colour by height, by the distance from the plane most points lie in, or by brightness."),
    bind(&[letter('e')], "e", Context::Scan, Command::Scan(ScanCommand::EdgeOn), "edge-on", "Look along the plane most points lie in, and measure how thick their band is; again goes back."),
    bind(&[letter('h')], "h", Context::Scan, Command::Scan(ScanCommand::AimLeft), "", "Move the cross to the left; the point nearest to it is measured. A click sets it."),
    bind(&[letter('l')], "l", Context::Scan, Command::Scan(ScanCommand::AimRight), "", "Move the cross to the right."),
    bind(&[letter('k')], "k", Context::Scan, Command::Scan(ScanCommand::AimUp), "", "Move the cross up."),
    bind(&[letter('j')], "j", Context::Scan, Command::Scan(ScanCommand::AimDown), "", "Move the cross down."),
    bind(&[letter('m'), code(KeyCode::Enter)], "m, Enter", Context::Scan, Command::Scan(ScanCommand::Mark), "mark", "Measure distances from the point under the cross; again ends it."),
    bind(&[letter('x')], "x", Context::Scan, Command::Scan(ScanCommand::Picture), "picture", "Save the view as a picture (PNG) where the program was started."),
    bind(&[letter('X')], "X", Context::Scan, Command::Scan(ScanCommand::Stereo), "", "Save two pictures side by side, one for each eye."),
    bind(&[letter('[')], "[", Context::Scan, Command::Scan(ScanCommand::Narrower), "", "Open the virtual camera less wide, down to parallel rays."),
    bind(&[letter(']')], "]", Context::Scan, Command::Scan(ScanCommand::Wider), "", "Open the virtual camera wider."),
    bind(&[letter('<'), letter(',')], "<", Context::Scan, Command::Scan(ScanCommand::RollLeft), "", "Roll the view to the left."),
    bind(&[letter('>'), letter('.')], ">", Context::Scan, Command::Scan(ScanCommand::RollRight), "", "Roll the view to the right."),
];
