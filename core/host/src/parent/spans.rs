//! Which call a host's log line served.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use tracing::Span;

/// How many calls are remembered: a line may arrive a little after its call has ended.
const REMEMBERED: usize = 64;

/// The spans of the last calls, by number.
#[derive(Default)]
pub(super) struct Spans {
    last: AtomicU64,
    recent: Mutex<VecDeque<(u64, Span)>>,
}

impl Spans {
    /// Remembers the span that is current now; its number, which the host attaches to what it says meanwhile.
    pub(super) fn enter_current(&self) -> u64 {
        let number = self.last.fetch_add(1, Ordering::Relaxed) + 1;
        let mut recent = self.recent.lock().unwrap_or_else(PoisonError::into_inner);
        if recent.len() == REMEMBERED {
            recent.pop_front();
        }
        recent.push_back((number, Span::current()));
        number
    }

    /// The span of a number, or none when it is unknown or 0.
    pub(super) fn get(&self, number: u64) -> Span {
        let recent = self.recent.lock().unwrap_or_else(PoisonError::into_inner);
        recent.iter().find(|(known, _)| *known == number).map_or_else(Span::none, |(_, span)| span.clone())
    }
}
