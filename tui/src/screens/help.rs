//! The help overlay: the keys that hold on this page first, then all others, read from the key table.

use ratatui::Frame;
use ratatui::layout::{Constraint, Rect};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Clear, Paragraph};

use super::keys::{BINDINGS, Binding, Command, Context};
use super::pane::{self, wrapped};
use super::screen::Screen;
use super::state::State;
use super::theme::Theme;

/// What the help says of the stop key, before anything else.
const STOP: &str = "Esc stops every robot at once, wherever you are in the program. It is software and no emergency \
                    stop: stand where you reach the real one, and keep people out of the arm's reach.";

/// What it says to who only watches, or looks at a model alone.
const WATCHING: &str = "Nothing can be stopped from here: this program moves no robot.";

/// How far the help can be scrolled; no less than its lines in a terminal forty columns wide.
pub(crate) fn lines() -> u16 {
    u16::try_from(4 * BINDINGS.len()).unwrap_or(u16::MAX)
}

/// Draws the help over the page.
pub(crate) fn view(state: &State, frame: &mut Frame, area: Rect, scrolled: u16) {
    let area = area.centered(Constraint::Max(84), Constraint::Percentage(100));
    frame.render_widget(Clear, area);
    let inner = pane::open(frame, area, &state.theme, "Help \u{b7} Enter closes, Up and Down scroll", true);
    let here = state.contexts_of_page();
    let screens = state.screens();
    let (mut first, mut then): (Vec<&Binding>, Vec<&Binding>) = BINDINGS
        .iter()
        .filter(|binding| page_of(binding).is_none_or(|page| screens.contains(&page)))
        .partition(|binding| here.contains(&binding.context) && binding.context != Context::Everywhere);
    first.sort_by_key(|binding| here.iter().position(|context| *context == binding.context));
    then.sort_by_key(|binding| !is_everywhere(binding.context));
    let width = usize::from(inner.width);
    let stop = if state.only_watches() { WATCHING } else { STOP };
    let mut text: Vec<Line> =
        wrapped(stop, width).into_iter().map(|line| Line::styled(line, state.theme.bad)).collect();
    rows(&mut text, "On this page", first, width, &state.theme);
    let mut left = then;
    while let Some(context) = left.first().map(|binding| binding.context) {
        let (here, others): (Vec<&Binding>, Vec<&Binding>) =
            left.into_iter().partition(|binding| binding.context == context);
        rows(&mut text, context.name(), here, width, &state.theme);
        left = others;
    }
    let scrolled = scrolled.min(u16::try_from(text.len()).unwrap_or(u16::MAX).saturating_sub(inner.height));
    frame.render_widget(Paragraph::new(text).scroll((scrolled, 0)), inner);
}

/// The page whose key it is, or that it shows; none for keys that belong to no page.
fn page_of(binding: &Binding) -> Option<Screen> {
    match (binding.context, binding.command) {
        (_, Command::Show(screen)) => Some(screen),
        (Context::Cell, _) => Some(Screen::Cell),
        (
            Context::Run
            | Context::RunPage
            | Context::Prompt
            | Context::Jog
            | Context::Decision
            | Context::Simulated
            | Context::Aborting,
            _,
        ) => Some(Screen::Run),
        (Context::Model | Context::Naming | Context::AddingRejected, _) => Some(Screen::Model),
        (Context::History | Context::Filtering | Context::OpenedRun | Context::BringingBack, _) => {
            Some(Screen::History)
        }
        (Context::Log, _) => Some(Screen::Log),
        (Context::Scan, _) => Some(Screen::Scan),
        (
            Context::Everywhere
            | Context::NotWriting
            | Context::NotTyping
            | Context::Overlay
            | Context::Leaving,
            _,
        ) => None,
    }
}

/// Whether keys of this context hold on about every page.
fn is_everywhere(context: Context) -> bool {
    matches!(context, Context::Everywhere | Context::NotWriting | Context::NotTyping)
}

/// Adds the rows of one context under its heading; the sentences are broken within their own column.
fn rows(
    text: &mut Vec<Line<'static>>,
    heading: &'static str,
    bindings: Vec<&Binding>,
    width: usize,
    theme: &Theme,
) {
    if bindings.is_empty() {
        return;
    }
    text.extend([Line::default(), Line::styled(heading, theme.heading)]);
    for binding in bindings {
        for (index, sentence) in wrapped(binding.help, width.saturating_sub(12)).into_iter().enumerate() {
            let keys = if index == 0 { binding.shown } else { "" };
            text.push(Line::from(vec![
                Span::styled(format!("{keys:>10}  "), theme.key),
                Span::styled(sentence, theme.text),
            ]));
        }
    }
}
