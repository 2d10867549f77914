//! The terminal while the screens are open: raw, on its alternate page, with mouse. It is given back as it was on every
//! way out: return, error, panic; signals end the event loop, which returns.

use std::io::{self, IsTerminal as _, Stdout, Write as _, stdout};
use std::sync::Once;

use ratatui::crossterm::cursor::Show;
use ratatui::crossterm::event::{DisableMouseCapture, EnableMouseCapture};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{
    BeginSynchronizedUpdate, EndSynchronizedUpdate, EnterAlternateScreen, LeaveAlternateScreen, SetTitle,
    disable_raw_mode, enable_raw_mode,
};
use ratatui::prelude::CrosstermBackend;
use ratatui::{Frame, Terminal};

use crate::logging;

/// The open terminal; dropping it gives it back.
pub(crate) struct OpenTerminal(Terminal<CrosstermBackend<Stdout>>);

impl OpenTerminal {
    /// Takes the terminal over.
    ///
    /// # Errors
    /// Standard output is no terminal, or does not take the settings.
    pub(crate) fn open(title: &str) -> io::Result<Self> {
        // Nothing is written to what is no terminal, not even what a terminal would take for settings.
        if !stdout().is_terminal() {
            return Err(io::Error::other("the screens need a terminal, and standard output is none"));
        }
        restore_on_panic();
        logging::behind_screens(true);
        // From here on a failure has something to undo, which dropping does.
        let terminal = Self(Terminal::new(CrosstermBackend::new(stdout()))?);
        enable_raw_mode()?;
        execute!(stdout(), EnterAlternateScreen, EnableMouseCapture, SetTitle(title))?;
        Ok(terminal)
    }

    /// Draws one frame; terminals that can show it whole, not line by line as it comes.
    ///
    /// # Errors
    /// The terminal is gone.
    pub(crate) fn draw(&mut self, view: impl FnOnce(&mut Frame)) -> io::Result<()> {
        execute!(stdout(), BeginSynchronizedUpdate)?;
        let drawn = self.0.draw(view).map(drop);
        execute!(stdout(), EndSynchronizedUpdate)?;
        drawn
    }

    /// Size in columns and rows.
    ///
    /// # Errors
    /// The terminal is gone.
    pub(crate) fn size(&self) -> io::Result<(u16, u16)> {
        self.0.size().map(|size| (size.width, size.height))
    }

    /// Rings the bell.
    ///
    /// # Errors
    /// The terminal is gone.
    pub(crate) fn ring(&mut self) -> io::Result<()> {
        stdout().write_all(b"\x07")?;
        stdout().flush()
    }
}

impl Drop for OpenTerminal {
    fn drop(&mut self) {
        restore();
    }
}

/// Gives the terminal back. Each step is tried whatever became of the others; a terminal that is gone needs none.
fn restore() {
    let _gone = execute!(stdout(), EndSynchronizedUpdate, DisableMouseCapture, LeaveAlternateScreen, Show);
    let _gone = disable_raw_mode();
    logging::behind_screens(false);
}

/// Gives the terminal back before a panic prints its message, once for all later panics.
fn restore_on_panic() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            restore();
            before(panic);
        }));
    });
}
