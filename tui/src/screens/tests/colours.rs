//! The pages at three sizes, with colours and without: the same text, and which style each cell has.

use std::fmt::Write as _;

use plumb_cell::event::StepOutcome;
use ratatui::buffer::{Buffer, Cell};
use ratatui::crossterm::event::KeyCode;
use ratatui::style::Color;

use super::fixtures::{
    begun, decision_asked, deliver, drawn, examined, finished, jog_asked, passed, press, recorded, searching,
    started,
};
use super::scanning::scanned;
use crate::screens::screen::Screen;
use crate::screens::state::State;
use crate::screens::theme::Theme;

const SIZES: [(u16, u16); 3] = [(80, 24), (120, 40), (200, 60)];

/// A cell with one of its screens open.
fn on(screen: Screen, mut state: State) -> State {
    state.screen = screen;
    state
}

fn pages() -> Vec<(&'static str, State)> {
    let mut jogging = begun();
    deliver(&mut jogging, started("upright"));
    deliver(&mut jogging, jog_asked());
    let mut large = jogging.clone();
    press(&mut large, KeyCode::Char('z'));
    let mut failed = searching();
    deliver(&mut failed, finished("cycle[2].lower", StepOutcome::Failed, "eye stayed OFF"));
    deliver(&mut failed, decision_asked());
    let mut details = examined();
    press(&mut details, KeyCode::Enter);
    vec![
        ("model", examined()),
        ("model-details", details),
        ("cell", on(Screen::Cell, searching())),
        ("run-jog", jogging),
        ("run-large", large),
        ("run-search", searching()),
        ("run-failed", failed),
        ("run-passed", passed()),
        ("scan", scanned()),
        ("history", recorded()),
        ("log", on(Screen::Log, searching())),
    ]
}

/// The styles of a page: a letter for each, and the rows in which each cell has the letter of its style.
fn styles(page: &Buffer) -> String {
    let letters: Vec<char> = ('a'..='z').chain('A'..='Z').collect();
    let mut known: Vec<String> = Vec::new();
    let mut rows = String::new();
    for row in page.content().chunks(usize::from(page.area.width)) {
        let mut line = String::new();
        for cell in row {
            let style = in_words(cell);
            if style.is_empty() {
                line.push('.');
                continue;
            }
            let index = known.iter().position(|one| *one == style).unwrap_or_else(|| {
                known.push(style);
                known.len() - 1
            });
            line.push(letters.get(index).copied().unwrap_or('?'));
        }
        writeln!(rows, "{}", line.trim_end_matches('.')).unwrap();
    }
    let legend: Vec<String> =
        letters.iter().zip(&known).map(|(letter, style)| format!("{letter}: {style}")).collect();
    format!("{}\n{rows}", legend.join("\n"))
}

/// A style; nothing for the terminal's own. What a blank is written in does not show.
fn in_words(cell: &Cell) -> String {
    let is_blank = cell.symbol().trim().is_empty();
    let mut words = Vec::new();
    if cell.fg != Color::Reset && !is_blank {
        words.push(format!("{}", cell.fg));
    }
    if cell.bg != Color::Reset {
        words.push(format!("on {}", cell.bg));
    }
    if !cell.modifier.is_empty()
        && (!is_blank || cell.bg != Color::Reset || format!("{:?}", cell.modifier).contains("REVERSED"))
    {
        words.push(format!("{:?}", cell.modifier));
    }
    words.join(" ")
}

#[test]
fn every_page_has_its_colours_and_without_them_the_same_text_in_none() {
    for (name, state) in pages() {
        let plain = State { theme: Theme::plain(), ..state.clone() };
        for (width, height) in SIZES {
            let (coloured, plain) = (drawn(&state, width, height), drawn(&plain, width, height));
            assert_eq!(coloured.to_string(), plain.to_string(), "{name} at {width}x{height}");
            for cell in plain.buffer().content() {
                assert_eq!((cell.fg, cell.bg), (Color::Reset, Color::Reset), "{name}: {cell:?}");
            }
            let (with, without) = (styles(coloured.buffer()), styles(plain.buffer()));
            let page = format!("{coloured}\nwith colours\n{with}\nwithout\n{without}");
            insta::assert_snapshot!(format!("{name}-{width}x{height}"), page);
        }
    }
}
