//! What travels: `AA AA`, the count of the payload, the payload (a command's number, a control byte, parameters), and a checksum.

/// What begins every frame.
const HEADER: [u8; 2] = [0xaa, 0xaa];
/// The payload holds at least the command's number and the control byte; beyond the most that any answer here has, a count is damage.
const COUNTS: std::ops::RangeInclusive<u8> = 2..=80;

/// How a command is meant: the bits of the control byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Asks for something.
    Read = 0,
    /// Takes effect at once.
    Write = 1,
    /// Takes its turn in the queue.
    Queue = 3,
}

/// A frame that came whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    /// The command's number.
    pub id: u8,
    /// The control byte.
    pub control: u8,
    /// What was asked for.
    pub parameters: Vec<u8>,
}

/// A command as it goes over the line.
pub fn command(id: u8, control: Control, parameters: &[u8]) -> Vec<u8> {
    let mut payload = vec![id, control as u8];
    payload.extend_from_slice(parameters);
    let mut bytes = HEADER.to_vec();
    bytes.push(u8::try_from(payload.len()).unwrap_or(u8::MAX));
    let sum = checksum(&payload);
    bytes.append(&mut payload);
    bytes.push(sum);
    bytes
}

/// Takes the first whole frame out of what was heard. Bytes that can begin none are dropped; each frame whose checksum is wrong is counted.
pub fn take(heard: &mut Vec<u8>, damaged: &mut u32) -> Option<Frame> {
    loop {
        match heard.windows(2).position(|pair| pair == HEADER) {
            Some(start) => drop(heard.drain(..start)),
            None => {
                // The last byte may be the first of a header.
                let keep = usize::from(heard.last() == Some(&HEADER[0]));
                heard.drain(..heard.len() - keep);
                return None;
            }
        }
        let count = *heard.get(2)?;
        if !COUNTS.contains(&count) {
            heard.drain(..1);
            continue;
        }
        let length = 3 + usize::from(count) + 1;
        let payload = heard.get(3..length - 1).zip(heard.get(length - 1));
        let (payload, sum) = payload?;
        if let ([id, control, parameters @ ..], true) = (payload, *sum == checksum(payload)) {
            let frame = Frame { id: *id, control: *control, parameters: parameters.to_vec() };
            heard.drain(..length);
            return Some(frame);
        }
        *damaged += 1;
        heard.drain(..1);
    }
}

/// What brings the sum of payload and checksum to 0 in eight bits.
fn checksum(payload: &[u8]) -> u8 {
    payload.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte)).wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The examples that the maker's support gives (forum.dobot.cc, topic 200): GetPose, and SetPTPCmd to x = 250 along a line, in the queue.
    #[test]
    fn commands_look_as_the_maker_writes_them() {
        assert_eq!(command(10, Control::Read, &[]), [0xaa, 0xaa, 0x02, 0x0a, 0x00, 0xf6]);
        let mut parameters = vec![1, 0x00, 0x00, 0x7a, 0x43];
        parameters.resize(17, 0);
        let bytes = command(84, Control::Queue, &parameters);
        assert_eq!((&bytes[..5], bytes[22]), (&[0xaa, 0xaa, 0x13, 0x54, 0x03][..], 0xeb));
    }

    #[test]
    fn a_frame_is_found_among_noise_and_damage() {
        let good = [0xaa, 0xaa, 0x03, 0xf6, 0x00, 0x07, 0x03];
        let mut heard = vec![0x12, 0xaa, 0x00, 0xaa];
        heard.extend([0xaa, 0xaa, 0x03, 0xf6, 0x00, 0x17, 0x03]);
        heard.extend(good);
        heard.extend([0xaa, 0xaa, 0x05]);
        let mut damaged = 0;
        let frame = take(&mut heard, &mut damaged);
        assert_eq!(frame, Some(Frame { id: 246, control: 0, parameters: vec![7] }));
        assert!(damaged > 0);
        assert_eq!(take(&mut heard, &mut damaged), None);
        assert_eq!(heard, [0xaa, 0xaa, 0x05], "what may become a frame is kept");
    }

    #[test]
    fn a_frame_that_was_cut_does_not_swallow_the_next() {
        let mut heard = vec![0xaa, 0xaa, 0x03, 0xf6];
        heard.extend([0xaa, 0xaa, 0x02, 0xf5, 0x01, 0x0a]);
        let mut damaged = 0;
        let frame = take(&mut heard, &mut damaged);
        assert_eq!(frame, Some(Frame { id: 245, control: 1, parameters: vec![] }));
    }

    /// A count that is damaged into a large one would have the driver wait for bytes that never come.
    #[test]
    fn counts_that_no_answer_has_are_damage() {
        let mut heard = vec![0xaa, 0xaa, 0xf0];
        heard.extend([0xaa, 0xaa, 0x02, 0xf5, 0x01, 0x0a]);
        assert_eq!(take(&mut heard, &mut 0).map(|frame| frame.id), Some(245));
    }
}
