//! The looks of the screens: one style for each meaning, so that a screen never picks a colour by itself.
//!
//! Colour only repeats what a sign and a word already say. Without colour (`NO_COLOR`) the same meanings are distinguished
//! by weight and reversal. Only the terminal's own sixteen colours are used, so its light or dark scheme holds.

use ratatui::style::{Color, Modifier, Style};

/// A style for every meaning the screens know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Theme {
    /// Ordinary text.
    pub text: Style,
    /// What helps but need not be read: units, borders, hints.
    pub faint: Style,
    /// Headings of panes and of the page.
    pub heading: Style,
    /// The border and heading of the pane that waits for the operator.
    pub focus: Style,
    /// What went well or is ready.
    pub good: Style,
    /// What wants attention but is no fault.
    pub warning: Style,
    /// A fault.
    pub bad: Style,
    /// The row or tab that is chosen.
    pub chosen: Style,
    /// Names of keys.
    pub key: Style,
    /// The bar with the stop key.
    pub stop: Style,
    /// Measured points and lines of a drawing.
    pub measured: Style,
    /// The machine in a drawing.
    pub machine: Style,
    /// The surroundings in a drawing: table, target, axes.
    pub ground: Style,
    /// What would be if a candidate were added.
    pub preview: Style,
    /// Values from low to high.
    pub ramp: [Style; 5],
}

impl Theme {
    /// The theme for a terminal with colours.
    pub(crate) fn coloured() -> Self {
        let plain = Style::new();
        Self {
            text: plain,
            faint: plain.fg(Color::DarkGray),
            heading: plain.fg(Color::Reset).add_modifier(Modifier::BOLD),
            focus: plain.fg(Color::Cyan).add_modifier(Modifier::BOLD),
            good: plain.fg(Color::Green),
            warning: plain.fg(Color::Yellow),
            bad: plain.fg(Color::Red).add_modifier(Modifier::BOLD),
            chosen: plain.add_modifier(Modifier::REVERSED | Modifier::BOLD),
            key: plain.fg(Color::Cyan).add_modifier(Modifier::BOLD),
            stop: plain.fg(Color::White).bg(Color::Red).add_modifier(Modifier::BOLD),
            measured: plain.fg(Color::Cyan),
            machine: plain.fg(Color::Yellow),
            ground: plain.fg(Color::DarkGray),
            preview: plain.fg(Color::Magenta),
            ramp: [Color::Blue, Color::Cyan, Color::Green, Color::Yellow, Color::Red]
                .map(|colour| plain.fg(colour)),
        }
    }

    /// The theme for a terminal without colours: weight and reversal only.
    pub(crate) fn plain() -> Self {
        let plain = Style::new();
        let bold = plain.add_modifier(Modifier::BOLD);
        let reversed = plain.add_modifier(Modifier::REVERSED);
        Self {
            text: plain,
            faint: plain,
            heading: bold,
            focus: bold,
            good: plain,
            warning: bold,
            bad: bold.add_modifier(Modifier::REVERSED),
            chosen: reversed,
            key: bold,
            stop: bold.add_modifier(Modifier::REVERSED),
            measured: plain,
            machine: bold,
            ground: plain,
            preview: bold,
            ramp: [plain; 5],
        }
    }

    /// The theme the environment asks for: plain when `NO_COLOR` is set to anything but nothing (<https://no-color.org>).
    pub(crate) fn from_environment() -> Self {
        match std::env::var_os("NO_COLOR") {
            Some(value) if !value.is_empty() => Self::plain(),
            _ => Self::coloured(),
        }
    }
}
