//! Requests as they come in, byte by byte, and status packets as they go out.

/// A host that pauses for longer inside a request has given it up, ns.
const GIVEN_UP_NS: u64 = 50_000_000;
/// The longest request that fits: its count is one byte.
const ROOM: usize = 4 + 255;

/// A request that came whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Request {
    pub(super) id: u8,
    pub(super) instruction: u8,
    pub(super) parameters: Vec<u8>,
}

/// What has come of a request.
#[derive(Debug, Default)]
pub(super) struct Incoming {
    bytes: Vec<u8>,
    latest_ns: u64,
}

impl Incoming {
    /// One more byte; the request that it completes, if its sum is right. All servos drop one whose sum is wrong.
    pub(super) fn push(&mut self, byte: u8, now_ns: u64) -> Option<Request> {
        if now_ns > self.latest_ns.saturating_add(GIVEN_UP_NS) {
            self.bytes.clear();
        }
        self.latest_ns = now_ns;
        self.bytes.push(byte);
        self.align();
        let count = usize::from(*self.bytes.get(3)?);
        if self.bytes.len() < 4 + count {
            return None;
        }
        let request = std::mem::take(&mut self.bytes);
        let (sum, body) = request.get(2..)?.split_last()?;
        if *sum != inverted_sum(body) {
            return None;
        }
        let [id, _, instruction, parameters @ ..] = body else { return None };
        Some(Request { id: *id, instruction: *instruction, parameters: parameters.to_vec() })
    }

    /// Drops bytes from the front until what is left can be the beginning of a request.
    fn align(&mut self) {
        while !self.can_begin() {
            self.bytes.remove(0);
        }
    }

    fn can_begin(&self) -> bool {
        match self.bytes.as_slice() {
            [] | [0xff] => true,
            [0xff, 0xff, rest @ ..] => {
                rest.first() != Some(&0xff)
                    && rest.get(1).is_none_or(|count| *count >= 2)
                    && self.bytes.len() <= ROOM
            }
            _ => false,
        }
    }
}

/// A servo's answer.
pub(super) fn status_packet(id: u8, error: u8, data: &[u8]) -> Vec<u8> {
    let mut body = vec![id, u8::try_from(data.len() + 2).unwrap_or(0), error];
    body.extend_from_slice(data);
    let sum = inverted_sum(&body);
    let mut packet = vec![0xff, 0xff];
    packet.append(&mut body);
    packet.push(sum);
    packet
}

fn inverted_sum(body: &[u8]) -> u8 {
    let sum: u32 = body.iter().map(|byte| u32::from(*byte)).sum();
    !(sum as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<Request> {
        let mut incoming = Incoming::default();
        bytes.iter().filter_map(|byte| incoming.push(*byte, 0)).collect()
    }

    #[test]
    fn a_request_is_taken_when_it_is_whole_and_its_sum_is_right() {
        let read = [0xff, 0xff, 1, 4, 2, 0x38, 2, 0xbe];
        let taken = Request { id: 1, instruction: 2, parameters: vec![0x38, 2] };
        assert_eq!(all(&read), vec![taken.clone()]);
        assert_eq!(all(&[&[7, 0xff][..], &read].concat()), vec![taken.clone()], "noise before it");
        assert_eq!(all(&[0xff, 0xff, 1, 4, 2, 0x38, 2, 0xbf]), vec![]);
        assert_eq!(all(&[0xff, 0xff, 1, 4, 2]), vec![]);
    }

    #[test]
    fn a_request_that_was_broken_off_is_forgotten_after_a_pause() {
        let mut incoming = Incoming::default();
        assert!([0xff, 0xff, 1, 4, 2].iter().all(|byte| incoming.push(*byte, 0).is_none()));
        let later = GIVEN_UP_NS + 1;
        let ping = [0xff, 0xff, 2, 2, 1, 0xfa];
        let taken: Vec<Request> = ping.iter().filter_map(|byte| incoming.push(*byte, later)).collect();
        assert_eq!(taken, vec![Request { id: 2, instruction: 1, parameters: vec![] }]);
    }

    #[test]
    fn an_answer_is_summed_as_a_request_is() {
        assert_eq!(status_packet(1, 0, &[0x18, 0x05]), [0xff, 0xff, 1, 4, 0, 0x18, 5, 0xdd]);
    }
}
