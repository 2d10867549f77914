//! The History screen: the runs in the record, one of them in full, and how what was corrected has moved over time.

mod archive;
mod state;
mod trend;
mod update;
mod view;

pub(crate) use archive::{Archive, ArchiveAnswer, ArchiveRequest};
pub(crate) use state::{BringBack, HistoryState};
pub(crate) use update::{asked, bring_back, choose, give_up, obey, scroll, take, write};
pub(crate) use view::view;

/// What tests need to fill the screen by hand.
#[cfg(test)]
pub(crate) mod testing {
    pub(crate) use super::trend::{Trend, TrendPoint};
}
