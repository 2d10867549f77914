//! One way of the line: bytes at the line's own rate, and what may happen to them.

use std::collections::VecDeque;

use super::fault::FaultKind;
use crate::physics::random::Random;

/// One way of the line. Times are ns of the controller's clock.
#[derive(Debug)]
pub(in crate::emulate) struct Wire {
    /// The time of one byte, 0 for a line that takes none.
    byte_ns: u64,
    /// When the last byte put on it has gone through.
    busy_until: u64,
    /// Bytes on their way, with when they arrive.
    under_way: VecDeque<(u64, u8)>,
    /// Bytes put on it so far.
    count: u64,
    /// The bytes that will be damaged, by their numbers from 1.
    planned: Vec<(u64, FaultKind)>,
    /// The probability that any other byte is damaged.
    probability: f64,
    random: Random,
}

impl Wire {
    /// A wire whose bytes take `byte_ns` each. `random` decides what happens by chance.
    pub(in crate::emulate) fn new(byte_ns: u64, random: Random) -> Wire {
        Wire {
            byte_ns,
            busy_until: 0,
            under_way: VecDeque::new(),
            count: 0,
            planned: Vec::new(),
            probability: 0.0,
            random,
        }
    }

    /// Damages one of the bytes to come, 1 being the next.
    pub(in crate::emulate) fn damage(&mut self, byte: u64, kind: FaultKind) {
        self.planned.push((self.count + byte, kind));
    }

    /// Damages every byte from now on with this probability.
    pub(in crate::emulate) fn damage_at_random(&mut self, probability: f64) {
        self.probability = probability;
    }

    /// Puts a byte on the wire; `pause` ns pass before it.
    pub(in crate::emulate) fn put(&mut self, byte: u8, pause: u64, now: u64) {
        self.count += 1;
        match self.fate() {
            None => self.send(byte, pause, now),
            Some(FaultKind::Drop) => self.busy_until = self.busy_until.max(now) + pause + self.byte_ns,
            Some(FaultKind::Double) => {
                self.send(byte, pause, now);
                self.send(byte, 0, now);
            }
            Some(FaultKind::Garble) => {
                let turned = 1_u8 << self.random.below(7);
                self.send(byte ^ turned, pause, now);
            }
            Some(FaultKind::Late(delay)) => {
                let delay = u64::try_from(delay.as_nanos()).unwrap_or(u64::MAX);
                self.send(byte, pause.saturating_add(delay), now);
            }
        }
    }

    /// The next byte that has arrived.
    pub(in crate::emulate) fn take(&mut self, now: u64) -> Option<(u64, u8)> {
        let (arrives, _) = self.under_way.front()?;
        if *arrives <= now { self.under_way.pop_front() } else { None }
    }

    /// When the next byte arrives.
    pub(in crate::emulate) fn next(&self) -> Option<u64> {
        self.under_way.front().map(|(arrives, _)| *arrives)
    }

    /// Loses all that is under way.
    pub(in crate::emulate) fn cut(&mut self) {
        self.under_way.clear();
    }

    fn send(&mut self, byte: u8, pause: u64, now: u64) {
        self.busy_until = self.busy_until.max(now).saturating_add(pause).saturating_add(self.byte_ns);
        self.under_way.push_back((self.busy_until, byte));
    }

    fn fate(&mut self) -> Option<FaultKind> {
        let count = self.count;
        if let Some(index) = self.planned.iter().position(|(byte, _)| *byte == count) {
            return Some(self.planned.swap_remove(index).1);
        }
        if self.probability <= 0.0 || !self.random.chance(self.probability) {
            return None;
        }
        let late = FaultKind::Late(std::time::Duration::from_millis(200));
        self.random.pick(&[FaultKind::Drop, FaultKind::Double, FaultKind::Garble, late]).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    const AT_9600: u64 = 1_041_667;

    fn wire() -> Wire {
        Wire::new(AT_9600, Random::new(1, "wire"))
    }

    fn arrived(wire: &mut Wire) -> Vec<u8> {
        std::iter::from_fn(|| wire.take(u64::MAX)).map(|(_, byte)| byte).collect()
    }

    #[test]
    fn bytes_come_one_after_the_other_at_the_lines_rate() {
        let mut wire = wire();
        for byte in *b"abc" {
            wire.put(byte, 0, 0);
        }
        assert_eq!(wire.next(), Some(AT_9600));
        assert_eq!(wire.take(AT_9600 - 1), None);
        assert_eq!(wire.take(AT_9600), Some((AT_9600, b'a')));
        assert_eq!(wire.take(10 * AT_9600), Some((2 * AT_9600, b'b')));
        assert_eq!(wire.take(10 * AT_9600), Some((3 * AT_9600, b'c')));
    }

    #[test]
    fn each_fault_does_what_it_is_called() {
        for (kind, bytes) in [
            (FaultKind::Drop, &b"ac"[..]),
            (FaultKind::Double, b"abbc"),
            (FaultKind::Late(Duration::from_secs(1)), b"abc"),
        ] {
            let mut wire = wire();
            wire.damage(2, kind);
            b"abc".iter().for_each(|byte| wire.put(*byte, 0, 0));
            assert_eq!(arrived(&mut wire), bytes, "{kind:?}");
        }
        let mut garbled = wire();
        garbled.damage(1, FaultKind::Garble);
        garbled.put(b'a', 0, 0);
        assert_eq!((arrived(&mut garbled)[0] ^ b'a').count_ones(), 1);
        let mut late = wire();
        late.damage(1, FaultKind::Late(Duration::from_secs(1)));
        late.put(b'a', 0, 0);
        assert_eq!(late.next(), Some(1_000_000_000 + AT_9600));
    }

    #[test]
    fn faults_by_chance_are_those_of_the_seed() {
        let bytes_of = |seed| {
            let mut wire = Wire::new(0, Random::new(seed, "wire"));
            wire.damage_at_random(0.2);
            (0..200).for_each(|byte| wire.put(byte, 0, 0));
            arrived(&mut wire)
        };
        assert_eq!(bytes_of(7), bytes_of(7));
        assert_ne!(bytes_of(7), bytes_of(8));
        assert_ne!(bytes_of(7), (0..200).collect::<Vec<u8>>());
    }
}
