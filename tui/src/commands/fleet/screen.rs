//! The fleet as a terminal screen: the cells, read anew while it is open.

use std::time::{Duration, Instant};

use futures_util::StreamExt as _;
use plumb_central::{CellState, CentralError, Reader};
use plumb_record::today;
use ratatui::crossterm::event::{
    Event, EventStream, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, MouseEventKind,
};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio::time::sleep;

use super::screen_view::{Shown, view};
use super::words::in_order;
use crate::failure::with_causes;
use crate::screens::terminal::OpenTerminal;
use crate::screens::theme::Theme;
use crate::signals::LeavingSignals;

/// How often the cells are read: as often as the page does it.
const RENEW: Duration = Duration::from_secs(2);

/// How long the database may take for one answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(20);

/// Rows that a page key goes on by.
const PAGE: isize = 10;

/// What the database last said.
type Answer = Result<Vec<CellState>, String>;

/// Shows the screen until somebody leaves it; only cells with this arm, where one is named.
///
/// # Errors
/// The database cannot be read at the start; the terminal cannot be used, or was lost.
pub(super) async fn show(from: &str, arm: Option<String>) -> Result<(), Box<dyn std::error::Error>> {
    let mut reader = Reader::new(from, ANSWER_WITHIN);
    // What is wrong with the address is said before the terminal is taken over.
    let first = read(&mut reader, arm.as_deref()).await?;
    let (to_here, mut answers) = unbounded_channel();
    tokio::spawn(read_on(reader, arm, to_here));
    let mut screen = Screen::new(first);
    let theme = Theme::from_environment();
    let mut terminal = OpenTerminal::open("plumb fleet")?;
    let mut keys = EventStream::new();
    let mut ends = LeavingSignals::watch()?;
    loop {
        let shown = screen.shown();
        terminal.draw(|frame| view(frame, &shown, &theme))?;
        let stays = tokio::select! {
            biased;
            () = ends.any() => false,
            event = keys.next() => match event {
                Some(Ok(event)) => screen.take(&event),
                // Nobody can press a key any more: the terminal is gone.
                Some(Err(_)) | None => false,
            },
            Some(answer) = answers.recv() => {
                screen.renew(answer);
                true
            }
        };
        if !stays {
            return Ok(());
        }
    }
}

async fn read(reader: &mut Reader, arm: Option<&str>) -> Result<Vec<CellState>, CentralError> {
    let mut cells = reader.ask(async |central| central.cells().await).await?;
    cells.retain(|cell| arm.is_none_or(|arm| cell.arm.as_deref() == Some(arm)));
    Ok(cells)
}

/// Reads the cells until the screen is closed.
async fn read_on(mut reader: Reader, arm: Option<String>, to_screen: UnboundedSender<Answer>) {
    loop {
        sleep(RENEW).await;
        let answer = read(&mut reader, arm.as_deref()).await.map_err(|error| with_causes(&error));
        if to_screen.send(answer).is_err() {
            return;
        }
    }
}

/// What is on the screen.
struct Screen {
    /// Who waits first.
    cells: Vec<CellState>,
    /// When they were read.
    read: Instant,
    /// Why they were not read since.
    trouble: Option<String>,
    /// Record and name of the chosen cell: it stays chosen when the order changes.
    chosen: Option<(String, String)>,
}

impl Screen {
    fn new(cells: Vec<CellState>) -> Self {
        let mut screen = Self { cells: Vec::new(), read: Instant::now(), trouble: None, chosen: None };
        screen.renew(Ok(cells));
        screen
    }

    fn renew(&mut self, answer: Answer) {
        match answer {
            Ok(cells) => {
                self.cells = in_order(&cells).into_iter().cloned().collect();
                (self.read, self.trouble) = (Instant::now(), None);
            }
            Err(trouble) => self.trouble = Some(trouble),
        }
    }

    fn shown(&self) -> Shown<'_> {
        Shown {
            cells: &self.cells,
            chosen: self.row(),
            trouble: self.trouble.as_deref(),
            old: self.read.elapsed(),
            today: today(),
        }
    }

    /// The row of the chosen cell; the first where none is chosen, or it is gone.
    fn row(&self) -> usize {
        let is_chosen = |cell: &CellState| {
            self.chosen.as_ref().is_some_and(|(record, name)| *record == cell.record && *name == cell.cell)
        };
        self.cells.iter().position(is_chosen).unwrap_or(0)
    }

    fn go(&mut self, rows: isize) {
        let last = self.cells.len().saturating_sub(1);
        let row = self.row().saturating_add_signed(rows).min(last);
        self.chosen = self.cells.get(row).map(|cell| (cell.record.clone(), cell.cell.clone()));
    }

    /// Does what a key asks for; whether the screen stays open.
    fn take(&mut self, event: &Event) -> bool {
        match event {
            Event::Key(key) if key.kind != KeyEventKind::Release => self.press(key),
            Event::Mouse(mouse) => {
                match mouse.kind {
                    MouseEventKind::ScrollDown => self.go(1),
                    MouseEventKind::ScrollUp => self.go(-1),
                    _ => {}
                }
                true
            }
            _ => true,
        }
    }

    fn press(&mut self, key: &KeyEvent) -> bool {
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('q') | KeyCode::Esc => return false,
            KeyCode::Char('c') if control => return false,
            KeyCode::Char('j') | KeyCode::Down => self.go(1),
            KeyCode::Char('k') | KeyCode::Up => self.go(-1),
            KeyCode::PageDown => self.go(PAGE),
            KeyCode::PageUp => self.go(-PAGE),
            KeyCode::Char('g') | KeyCode::Home => self.go(isize::MIN),
            KeyCode::Char('G') | KeyCode::End => self.go(isize::MAX),
            _ => {}
        }
        true
    }
}
