//! The camera's own clock: pictures it takes by itself while the arm moves.

use std::collections::VecDeque;

use crate::served_world::Exposure;

/// More pictures do not fit in the camera; later ones are not taken.
const MOST_WAITING: usize = 4096;

/// When the camera takes pictures by itself, and those that wait to be fetched.
#[derive(Default)]
pub(super) struct Shutter {
    /// From picture to picture, ns; none when it takes them only when asked.
    pub(super) every_ns: Option<u64>,
    /// When the next is due, world time, ns.
    pub(super) next_ns: u64,
    /// In the order they were taken.
    pub(super) waiting: VecDeque<Exposure>,
}

impl Shutter {
    /// The arm sets out: from now on pictures are due, the first after half a period.
    pub(super) fn set_out(&mut self, now_ns: u64) {
        self.next_ns = now_ns + self.every_ns.unwrap_or(0) / 2;
    }

    /// When the next picture is due, if that is before a moment.
    pub(super) fn due_before(&self, until_ns: u64) -> Option<u64> {
        let due = self.every_ns.is_some() && self.next_ns < until_ns && self.waiting.len() < MOST_WAITING;
        due.then_some(self.next_ns)
    }

    /// It was taken.
    pub(super) fn took(&mut self, exposure: Exposure) {
        self.next_ns = self.next_ns.saturating_add(self.every_ns.unwrap_or(u64::MAX));
        self.waiting.push_back(exposure);
    }
}
