//! Changes to a whole file: a few bytes, lines or words at a time, so that what comes out is still nearly a file of its kind.

use bolero::TypeGenerator;

/// Words that have been trouble: numbers beyond every range, aliases, brackets, ends.
const WORDS: [&[u8]; 16] = [
    b"1e308",
    b"-.inf",
    b".nan",
    b"-1",
    b"0",
    b"18446744073709551616",
    b"4294967295",
    b"&a [*a, *a]",
    b"*a",
    b"{",
    b"[[[[[[[[[[[[[[[[",
    b"\n",
    b"\x00\xff",
    b"\xef\xbb\xbf",
    b": ",
    b"!!binary x",
];

/// What is done to a file.
#[derive(Debug, Clone, TypeGenerator)]
pub(crate) struct Changes {
    file: u16,
    changes: Vec<Change>,
}

/// One change. Places are shares of the file's length.
#[derive(Debug, Clone, TypeGenerator)]
enum Change {
    Set { place: u16, byte: u8 },
    Flip { place: u16, bit: u8 },
    Insert { place: u16, bytes: Vec<u8> },
    Word { place: u16, word: u8 },
    Remove { place: u16, length: u8 },
    Double { place: u16, length: u8, times: u8 },
    RemoveLine { place: u16 },
    DoubleLine { place: u16 },
    Cut { place: u16 },
    Only { bytes: Vec<u8> },
}

impl Changes {
    /// One of the whole files, changed.
    pub(crate) fn of(&self, whole: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = whole[usize::from(self.file) % whole.len()].clone();
        // The first changes alone, half of the time: a file with one mistake gets furthest.
        let count = if self.file.is_multiple_of(2) { 1 } else { self.changes.len() };
        self.changes.iter().take(count).for_each(|change| change.make(&mut bytes));
        bytes
    }
}

impl Change {
    fn make(&self, bytes: &mut Vec<u8>) {
        let at = |place: u16, bytes: &[u8]| usize::from(place) * bytes.len() / (usize::from(u16::MAX) + 1);
        let line = |place: usize, bytes: &[u8]| {
            let begin = bytes[..place].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
            let length = bytes[place..].iter().position(|byte| *byte == b'\n');
            begin..length.map_or(bytes.len(), |length| place + length + 1)
        };
        match self {
            Self::Set { place, byte } => {
                let place = at(*place, bytes);
                bytes.iter_mut().skip(place).take(1).for_each(|known| *known = *byte);
            }
            Self::Flip { place, bit } => {
                let place = at(*place, bytes);
                bytes.iter_mut().skip(place).take(1).for_each(|known| *known ^= 1 << (bit % 8));
            }
            Self::Insert { place, bytes: more } => {
                let place = at(*place, bytes);
                bytes.splice(place..place, more.iter().copied());
            }
            Self::Word { place, word } => {
                let place = at(*place, bytes);
                bytes.splice(place..place, WORDS[usize::from(*word) % WORDS.len()].iter().copied());
            }
            Self::Remove { place, length } => {
                let place = at(*place, bytes);
                let end = (place + usize::from(*length)).min(bytes.len());
                bytes.drain(place..end);
            }
            Self::Double { place, length, times } => {
                let place = at(*place, bytes);
                let end = (place + usize::from(*length)).min(bytes.len());
                let more = bytes[place..end].repeat(usize::from(*times));
                bytes.splice(place..place, more);
            }
            Self::RemoveLine { place } => {
                let range = line(at(*place, bytes), bytes);
                bytes.drain(range);
            }
            Self::DoubleLine { place } => {
                let range = line(at(*place, bytes), bytes);
                let more = bytes[range.clone()].to_vec();
                bytes.splice(range.start..range.start, more);
            }
            Self::Cut { place } => bytes.truncate(at(*place, bytes)),
            Self::Only { bytes: other } => bytes.clone_from(other),
        }
    }
}
