//! The last lines of a host's output, for the reason of its end.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

/// How many lines of output are kept for the reason of an end.
const TAIL: usize = 60;

/// The last lines of a host's output.
#[derive(Default)]
pub(super) struct Tail(Mutex<VecDeque<String>>);

impl Tail {
    pub(super) fn push(&self, line: String) {
        let mut lines = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if lines.len() == TAIL {
            lines.pop_front();
        }
        lines.push_back(line);
    }

    pub(super) fn lines(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).iter().cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_lines_are_kept_in_their_order_and_no_more() {
        let tail = Tail::default();
        let line = |number: usize| format!("line {number}");
        (0..3).for_each(|number| tail.push(line(number)));
        assert_eq!(tail.lines(), [line(0), line(1), line(2)]);
        (3..TAIL + 5).for_each(|number| tail.push(line(number)));
        assert_eq!(tail.lines(), (5..TAIL + 5).map(line).collect::<Vec<_>>());
    }
}
