//! Pictures of what is left: one panel a quantity, all on one scale that the noise floor sets.

mod panels;
mod svg;
mod terminal;

pub use panels::{Panel, panels};
pub(crate) use svg::escaped;
pub use svg::svg;
pub use terminal::terminal;
