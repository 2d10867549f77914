//! Which call a host's lines served.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use tracing::Span;

/// How many calls are remembered: a line may arrive a little after its call has ended.
const REMEMBERED: usize = 64;

/// The spans of the last calls, by number.
pub(super) struct Spans {
    calls: Mutex<Calls>,
    /// What the host was started in: lines that serve no call belong there.
    home: Span,
}

impl Default for Spans {
    fn default() -> Self {
        Self { calls: Mutex::default(), home: Span::current() }
    }
}

#[derive(Default)]
struct Calls {
    last: u64,
    recent: VecDeque<(u64, Span)>,
    /// The calls that have not been answered, oldest first.
    under_way: Vec<u64>,
}

/// A call under way.
pub(super) struct CallSpan<'a> {
    spans: &'a Spans,
    number: u64,
}

impl Spans {
    /// Remembers the span that is current now. Its number is what the host attaches to what it says meanwhile.
    pub(super) fn enter_current(&self) -> CallSpan<'_> {
        let mut calls = self.calls();
        calls.last += 1;
        let number = calls.last;
        if calls.recent.len() == REMEMBERED {
            calls.recent.pop_front();
        }
        calls.recent.push_back((number, Span::current()));
        calls.under_way.push(number);
        CallSpan { spans: self, number }
    }

    /// The span of a number, or that in which the host was started when it is unknown or 0.
    pub(super) fn get(&self, number: u64) -> Span {
        let calls = self.calls();
        let found = calls.recent.iter().find(|(known, _)| *known == number);
        found.map_or_else(|| self.home.clone(), |(_, span)| span.clone())
    }

    /// The number of the call a host is at, as far as the orchestrator knows: the oldest that waits; 0 when none does.
    pub(super) fn under_way(&self) -> u64 {
        self.calls().under_way.first().copied().unwrap_or(0)
    }

    fn calls(&self) -> MutexGuard<'_, Calls> {
        self.calls.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl CallSpan<'_> {
    pub(super) fn number(&self) -> u64 {
        self.number
    }
}

impl Drop for CallSpan<'_> {
    fn drop(&mut self) {
        self.spans.calls().under_way.retain(|number| *number != self.number);
    }
}
