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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_call_that_waits_is_the_one_under_way() {
        let spans = Spans::default();
        assert_eq!(spans.under_way(), 0, "none is");
        let (first, second, third) = (spans.enter_current(), spans.enter_current(), spans.enter_current());
        assert_eq!([first.number(), second.number(), third.number()], [1, 2, 3]);
        assert_eq!(spans.under_way(), 1);
        drop(second);
        assert_eq!(spans.under_way(), 1, "the answer of another call changes nothing");
        drop(first);
        assert_eq!(spans.under_way(), 3);
        drop(third);
        assert_eq!(spans.under_way(), 0);
    }

    #[test]
    fn each_of_the_last_calls_has_its_span_and_any_other_that_of_the_start() {
        tracing::subscriber::with_default(tracing_subscriber::registry(), || {
            let start = tracing::info_span!("start");
            let spans = start.in_scope(Spans::default);
            let called: Vec<Span> = (0..REMEMBERED + 2).map(|_| tracing::info_span!("call")).collect();
            for span in &called {
                drop(span.in_scope(|| spans.enter_current()));
            }
            let of_number = |number: usize| spans.get(number as u64).id();
            assert_eq!(of_number(0), start.id());
            assert_eq!((of_number(1), of_number(2)), (start.id(), start.id()), "the oldest are forgotten");
            for (index, span) in called.iter().enumerate().skip(2) {
                assert_eq!(of_number(index + 1), span.id());
            }
            assert_eq!(of_number(called.len() + 1), start.id(), "there was no such call yet");
        });
    }
}
