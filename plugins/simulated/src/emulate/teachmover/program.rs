//! A taught program, as the controller keeps it: eight sixteen-bit words a line.

use std::collections::BTreeMap;

/// The kind of a line that is a point to go to, in the low half of its second word.
const GO_TO: u16 = 1;

/// A point of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Target {
    /// The speed of the way there.
    pub(super) speed: u8,
    /// The registers there.
    pub(super) registers: [i32; 6],
}

/// The lines of a program by their numbers.
#[derive(Debug, Clone, Default)]
pub(super) struct Program {
    lines: BTreeMap<u8, [u16; 8]>,
}

impl Program {
    /// Keeps a line in the entry its first word names.
    pub(super) fn keep(&mut self, words: [u16; 8]) {
        let [number, ..] = words;
        self.lines.insert((number & 0xff) as u8, words);
    }

    /// The lines in the order of their numbers.
    pub(super) fn lines(&self) -> impl Iterator<Item = &[u16; 8]> {
        self.lines.values()
    }

    /// The points to go to, in order. What other kinds of lines do is not known: they are passed over.
    pub(super) fn targets(&self) -> Vec<Target> {
        self.lines.values().filter_map(target).collect()
    }
}

/// Speed and kind share the second word; the positions' low bytes are two to a word in the third to fifth, their high bytes likewise in the
/// last three.
fn target(words: &[u16; 8]) -> Option<Target> {
    let [_, speed_and_kind, low @ .., _, _, _] = words;
    let [.., high_1, high_2, high_3] = words;
    if speed_and_kind & 0xff != GO_TO {
        return None;
    }
    let bytes = |word: &u16| word.to_le_bytes();
    let low: Vec<u8> = low.iter().flat_map(bytes).collect();
    let high: Vec<u8> = [high_1, high_2, high_3].into_iter().flat_map(bytes).collect();
    let mut registers = [0; 6];
    for (register, (low, high)) in registers.iter_mut().zip(low.iter().zip(&high)) {
        *register = i32::from(i16::from_le_bytes([*low, *high]));
    }
    Some(Target { speed: 255 - (speed_and_kind >> 8) as u8, registers })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_published_layout_is_a_target() {
        // Speed 200, registers 1, -2, 300, 0, 0, -300.
        let words = [3, 55 * 256 + 1, 0xFE01, 0x002C, 0xD400, 0xFF00, 0x0001, 0xFE00];
        assert_eq!(target(&words), Some(Target { speed: 200, registers: [1, -2, 300, 0, 0, -300] }));
    }

    #[test]
    fn a_line_written_again_replaces_the_first() {
        let mut program = Program::default();
        program.keep([2, 1, 0, 0, 0, 0, 0, 0]);
        program.keep([1, 9, 0, 0, 0, 0, 0, 0]);
        program.keep([2, 257, 5, 0, 0, 0, 0, 0]);
        assert_eq!(program.lines().count(), 2);
        assert_eq!(program.targets(), [Target { speed: 254, registers: [5, 0, 0, 0, 0, 0] }]);
    }
}
