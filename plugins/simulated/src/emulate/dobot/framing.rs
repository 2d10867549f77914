//! Frames as they come in, byte by byte, and answers as they go out.

/// What the controller takes at most between header and checksum.
const LONGEST: u8 = 250;

/// A command whose frame came whole.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Command {
    pub(super) id: u8,
    /// Bit 0: it sets something; bit 1: it takes its turn.
    pub(super) control: u8,
    pub(super) body: Vec<u8>,
}

impl Command {
    pub(super) fn sets(&self) -> bool {
        self.control & 1 != 0
    }

    pub(super) fn waits(&self) -> bool {
        self.control & 2 != 0
    }
}

/// Where in a frame the controller is.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
enum FrameState {
    #[default]
    Outside,
    Header,
    Length,
    Inside(u8),
}

/// What has come of a frame. The controller does not look back: a byte that does not fit ends the frame.
#[derive(Debug, Default)]
pub(super) struct Incoming {
    state: FrameState,
    bytes: Vec<u8>,
}

impl Incoming {
    /// One more byte; the command that it completes. A frame whose bytes and checksum do not add up to 0 is dropped without a word.
    pub(super) fn push(&mut self, byte: u8) -> Option<Command> {
        self.state = match (self.state, byte) {
            (FrameState::Outside, 0xaa) => FrameState::Header,
            (FrameState::Header, 0xaa) => FrameState::Length,
            (FrameState::Length, length @ 2..=LONGEST) => {
                self.bytes.clear();
                FrameState::Inside(length)
            }
            (FrameState::Inside(length), _) => {
                self.bytes.push(byte);
                if self.bytes.len() <= usize::from(length) {
                    return None;
                }
                self.state = FrameState::Outside;
                return self.whole();
            }
            _ => FrameState::Outside,
        };
        None
    }

    fn whole(&self) -> Option<Command> {
        let total = self.bytes.iter().fold(0_u8, |total, byte| total.wrapping_add(*byte));
        match (total, self.bytes.as_slice()) {
            (0, [id, control, body @ .., _]) => {
                Some(Command { id: *id, control: *control, body: body.to_vec() })
            }
            _ => None,
        }
    }
}

/// The answer to a command: its number and control byte come back.
pub(super) fn answer(to: &Command, body: &[u8]) -> Vec<u8> {
    let mut frame = vec![0xaa, 0xaa, u8::try_from(body.len() + 2).unwrap_or(0), to.id, to.control];
    frame.extend_from_slice(body);
    let total: u32 = frame.iter().skip(3).map(|byte| u32::from(*byte)).sum();
    frame.push(0_u8.wrapping_sub(total as u8));
    frame
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<Command> {
        let mut incoming = Incoming::default();
        bytes.iter().filter_map(|byte| incoming.push(*byte)).collect()
    }

    #[test]
    fn a_command_is_taken_when_it_is_whole_and_adds_up() {
        let pose = [0xaa, 0xaa, 2, 10, 0, 0xf6];
        let taken = Command { id: 10, control: 0, body: vec![] };
        assert_eq!(all(&pose), vec![taken.clone()]);
        assert_eq!(all(&[&[7, 0xaa, 3][..], &pose].concat()), vec![taken], "noise before it");
        assert_eq!(all(&[0xaa, 0xaa, 2, 10, 0, 0xf7]), vec![]);
        assert_eq!(all(&[0xaa, 0xaa, 1, 10]), vec![]);
    }

    #[test]
    fn an_answer_bears_the_number_of_its_command_and_adds_up() {
        let command = Command { id: 246, control: 0, body: vec![] };
        assert_eq!(answer(&command, &[7]), [0xaa, 0xaa, 3, 246, 0, 7, 3]);
    }
}
