//! Pictures of what is left: one panel a quantity, all on one scale that the noise floor sets; an effect's own plot; the error in space.

mod drawing;
mod panels;
mod space;
mod svg;
mod terminal;

pub(crate) use drawing::{Links, escaped};
pub use panels::{Dot, Panel, effect_panel, panels, reach_of};
pub(crate) use space::space;
pub(crate) use svg::grid;
pub use svg::svg;
pub use terminal::terminal;

#[cfg(test)]
mod tests;
