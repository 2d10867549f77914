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
