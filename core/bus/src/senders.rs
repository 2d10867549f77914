//! Which messages of a stream a receiver has missed, by the senders it has heard.

use std::collections::VecDeque;

/// How many senders are remembered: a device's own, and those it has replaced whose last messages may still come.
const REMEMBERED: usize = 4;

/// The senders heard so far with the number of the last message of each, the newest last: more than one when a device was started again.
pub(crate) struct Senders<Id> {
    heard: VecDeque<(Id, u64)>,
}

impl<Id> Default for Senders<Id> {
    fn default() -> Self {
        Self { heard: VecDeque::with_capacity(REMEMBERED) }
    }
}

impl<Id: PartialEq> Senders<Id> {
    /// How many messages of a sender are missing before one of a number. The first sender ever heard may have begun earlier; one that takes
    /// over begins at 0.
    pub(crate) fn missing_before(&mut self, sender: Id, sequence: u64) -> u64 {
        if let Some((_, last)) = self.heard.iter_mut().find(|(known, _)| *known == sender) {
            let before = std::mem::replace(last, sequence);
            return sequence.wrapping_sub(before).wrapping_sub(1);
        }
        let takes_over = !self.heard.is_empty();
        if self.heard.len() == REMEMBERED {
            self.heard.pop_front();
        }
        self.heard.push_back((sender, sequence));
        if takes_over { sequence } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_one_sender_are_missing_where_its_numbers_jump() {
        let mut senders = Senders::default();
        assert_eq!(senders.missing_before('a', 7), 0, "the first one heard may have begun earlier");
        assert_eq!(senders.missing_before('a', 8), 0);
        assert_eq!(senders.missing_before('a', 12), 3);
        assert_eq!(senders.missing_before('a', 13), 0, "counted once");
    }

    #[test]
    fn a_sender_that_takes_over_begins_at_0() {
        let mut senders = Senders::default();
        senders.missing_before('a', 7);
        assert_eq!(senders.missing_before('b', 0), 0);
        assert_eq!(senders.missing_before('c', 2), 2, "its messages 0 and 1 were lost");
        assert_eq!(senders.missing_before('a', 8), 0, "the last messages of the old one may still come");
    }

    #[test]
    fn the_last_four_senders_are_remembered() {
        let mut senders = Senders::default();
        for sender in ['a', 'b', 'c', 'd'] {
            senders.missing_before(sender, 0);
        }
        assert_eq!(senders.missing_before('a', 1), 0);
        assert_eq!(senders.missing_before('e', 0), 0);
        assert_eq!(senders.missing_before('b', 1), 0, "the oldest went, and no other");
        assert_eq!(senders.missing_before('a', 5), 5, "which is taken for a new one");
    }
}
