//! The Model screen: what could explain the error, ranked; the residuals, on a scale tied to the noise floor; the fall of
//! the error; one plain sentence.

mod arm_view;
mod cards;
mod chart;
mod details;
mod lab;
mod lab_thread;
mod names;
mod plane;
mod plots;
mod request;
mod residuals;
mod state;
mod strip;
mod stripes;
mod summary;
mod update;
mod view;
mod waterfall;

pub(crate) use details::view as details;
pub(crate) use lab::{Desk, Lab};
pub(crate) use request::{LabAnswer, LabRequest};
pub(crate) use state::{Doubtful, ModelState};
pub(crate) use stripes::open as open_stripes;
pub(crate) use update::{choose, choose_at, give_up, note_progress, obey, point_at, take, write};
pub(crate) use view::view;

/// What tests need to make a model's summary by hand.
#[cfg(test)]
pub(crate) mod testing {
    pub(crate) use super::residuals::Residuals;
    pub(crate) use super::state::{Card, CardStatus, ErrorStep, ModelSummary, StripLine};
}
