//! The Log screen: what happened, newest last.

mod state;
mod view;

pub(crate) use state::LogState;
pub(crate) use view::view;
