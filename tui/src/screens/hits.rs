//! What can be clicked, and where it was drawn. The view notes it while it draws, so that a click means what was seen.

use std::cell::RefCell;

use ratatui::layout::{Position, Rect};

/// Something that can be clicked, other than the keys of the footer and the tabs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Hit {
    /// The option or joint at this index of the prompt.
    Option(usize),
    /// The prompt's button.
    Answer,
    /// The text of a prompt that has not room enough.
    Text {
        /// Lines out of sight.
        hidden: usize,
    },
    /// The candidate at this index.
    Card(usize),
    /// A point of a plot: the row of the table it is of.
    Row(usize),
    /// The run at this index of those shown.
    Run(usize),
    /// The view of a cloud.
    Cloud,
    /// Where steps and arm can take one another's place.
    Views,
}

/// Everything that can be clicked in the frame drawn last. Drawing only looks at the state, and notes its areas through
/// this one cell.
#[derive(Clone, Debug, Default)]
pub(crate) struct Hits(RefCell<Vec<(Rect, Hit)>>);

impl Hits {
    /// Forgets the frame before.
    pub(crate) fn clear(&self) {
        self.0.borrow_mut().clear();
    }

    /// Notes that `hit` was drawn in `area`.
    pub(crate) fn note(&self, area: Rect, hit: Hit) {
        self.0.borrow_mut().push((area, hit));
    }

    /// Where something was drawn last.
    pub(crate) fn area_of(&self, hit: Hit) -> Option<Rect> {
        self.0.borrow().iter().find(|(_, other)| *other == hit).map(|(area, _)| *area)
    }

    /// The text of a prompt that was drawn last without room enough: its rows but the mark's, and how many lines are out of sight.
    pub(crate) fn cut_text(&self) -> Option<(usize, usize)> {
        self.0.borrow().iter().find_map(|(area, hit)| match hit {
            Hit::Text { hidden } => Some((usize::from(area.height.saturating_sub(1)).max(1), *hidden)),
            _ => None,
        })
    }

    /// What was drawn last at a position.
    pub(crate) fn at(&self, position: Position) -> Option<Hit> {
        self.0.borrow().iter().rev().find(|(area, _)| area.contains(position)).map(|(_, hit)| *hit)
    }
}
