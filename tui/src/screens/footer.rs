//! The foot of every page: the keys that hold here, read from the key table, and the bar with the stop key.

use ratatui::Frame;
use ratatui::layout::{Position, Rect};
use ratatui::text::{Line, Span};

use super::hits::Hit;
use super::keys::{Binding, Command, Context, bindings_for};
use super::run::Phase;
use super::state::State;

/// What the stop bar says, the longest that fits.
const STOP_TEXTS: [&str; 3] = [
    " Esc or Ctrl+C STOPS every robot. It is software, not an emergency stop.",
    " Esc, Ctrl+C STOP \u{b7} not an emergency stop",
    " Esc STOP",
];

/// What is there for who only watches.
const WATCHING: &str = " Watching only: nothing can be stopped from here.";

/// Draws the key hints into the one row of `area`.
pub(crate) fn hints(state: &State, frame: &mut Frame, area: Rect) {
    for hint in placed(state, area) {
        let line = Line::from(vec![
            Span::styled(first_key(hint.binding), state.theme.key),
            Span::raw(" "),
            Span::styled(hint.binding.footer, state.theme.text),
        ]);
        frame.render_widget(line, hint.area);
    }
}

/// Draws the stop bar into the one row of `area`.
pub(crate) fn stop_bar(state: &State, frame: &mut Frame, area: Rect) {
    let fits = |text: &&&str| Span::raw(**text).width() < usize::from(area.width);
    let text = if state.only_watches() {
        WATCHING
    } else {
        STOP_TEXTS.iter().find(fits).copied().unwrap_or("Esc STOP")
    };
    let line = Line::styled(format!("{text:<width$}", width = usize::from(area.width)), state.theme.stop);
    frame.render_widget(line, area);
}

/// The command of the hint at a position of the screen, for the mouse.
pub(crate) fn command_at(state: &State, area: Rect, position: Position) -> Option<Command> {
    placed(state, area).into_iter().find(|hint| hint.area.contains(position)).map(|hint| hint.binding.command)
}

/// A hint and where it is.
struct Hint {
    binding: &'static Binding,
    area: Rect,
}

/// The hints that fit: those of the page from the left, those that hold everywhere at the right.
fn placed(state: &State, area: Rect) -> Vec<Hint> {
    if area.is_empty() {
        return Vec::new();
    }
    let shown: Vec<&'static Binding> = bindings_for(&state.contexts())
        .into_iter()
        .filter(|binding| !binding.footer.is_empty() && applies(state, binding.command))
        .collect();
    let (everywhere, here): (Vec<_>, Vec<_>) = shown
        .into_iter()
        .partition(|binding| matches!(binding.context, Context::Everywhere | Context::NotWriting));
    // Help is never pushed out, nor is what makes a prompt readable from the arm, nor what the lab just now waits for or can be stopped with; then the page's
    // own keys have their turn, then the others.
    let (help, others): (Vec<_>, Vec<_>) =
        everywhere.into_iter().partition(|binding| binding.command == Command::Help);
    let (large, here): (Vec<_>, Vec<_>) = here
        .into_iter()
        .partition(|binding| matches!(binding.command, Command::Large | Command::Cancel | Command::Judge));
    let help: Vec<_> = large.into_iter().chain(help).collect();
    let mut hints = Vec::new();
    let (mut left, mut right) = (area.left().saturating_add(1), area.right().saturating_sub(1));
    for (binding, at_right) in
        from_right(help).chain(here.into_iter().map(|binding| (binding, false))).chain(from_right(others))
    {
        let width = width_of(binding);
        if left.saturating_add(width) > right {
            continue;
        }
        let x = if at_right { right.saturating_sub(width) } else { left };
        hints.push(Hint { binding, area: Rect::new(x, area.y, width, 1) });
        if at_right {
            right = x.saturating_sub(2);
        } else {
            left = left.saturating_add(width).saturating_add(2);
        }
    }
    hints
}

/// Hints that are at the right, the last of the table first.
fn from_right(bindings: Vec<&'static Binding>) -> impl Iterator<Item = (&'static Binding, bool)> {
    bindings.into_iter().rev().map(|binding| (binding, true))
}

fn width_of(binding: &Binding) -> u16 {
    let width = Span::raw(first_key(binding)).width() + 1 + Span::raw(binding.footer).width();
    u16::try_from(width).unwrap_or(u16::MAX)
}

/// The first of the keys a binding names.
fn first_key(binding: &Binding) -> &'static str {
    binding.shown.split_once(", ").map_or(binding.shown, |(first, _)| first)
}

/// Whether a command would do something now; the others are kept out of the footer.
fn applies(state: &State, command: Command) -> bool {
    let phase = state.run.as_ref().map(|run| &run.phase).filter(|_| !state.only_watches());
    match command {
        Command::Answer
        | Command::LeaveToWorld
        | Command::Retry
        | Command::MoveArm
        | Command::GoBack
        | Command::Skip
        | Command::JogForwards
        | Command::JogLess => phase.is_some(),
        Command::Pause => matches!(phase, Some(Phase::Running)),
        Command::Resume => matches!(phase, Some(Phase::Paused { .. })),
        Command::Abort => matches!(phase, Some(Phase::Running | Phase::Paused { .. })),
        Command::Large => state.run.as_ref().is_some_and(|run| run.prompt.is_some()),
        Command::SwapViews => state.hits.area_of(Hit::Views).is_some(),
        Command::NextScreen => state.screens().len() > 1,
        Command::Cancel => state.model.as_ref().is_some_and(|model| model.busy.is_some()),
        Command::Judge => state.model.as_ref().is_some_and(|model| model.can_judge()),
        Command::BringBack => state.history.as_ref().is_some_and(|history| history.way_back().is_ok()),
        Command::OpenRun => state.history.as_ref().is_some_and(|history| history.run().is_some()),
        Command::NextTrend => state.history.as_ref().is_some_and(|history| history.trends.len() > 1),
        Command::Undo => state.model.as_ref().is_some_and(|model| model.can_undo()),
        _ => true,
    }
}
