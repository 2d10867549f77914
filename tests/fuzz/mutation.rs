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

/// One change. Positions are shares of the file's length.
#[derive(Debug, Clone, TypeGenerator)]
enum Change {
    Set { share: u16, byte: u8 },
    Flip { share: u16, bit: u8 },
    Insert { share: u16, bytes: Vec<u8> },
    Word { share: u16, word: u8 },
    Remove { share: u16, length: u8 },
    Double { share: u16, length: u8, times: u8 },
    RemoveLine { share: u16 },
    DoubleLine { share: u16 },
    Cut { share: u16 },
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
        let at = |share: u16, bytes: &[u8]| usize::from(share) * bytes.len() / (usize::from(u16::MAX) + 1);
        let line = |offset: usize, bytes: &[u8]| {
            let begin = bytes[..offset].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
            let length = bytes[offset..].iter().position(|byte| *byte == b'\n');
            begin..length.map_or(bytes.len(), |length| offset + length + 1)
        };
        match self {
            Self::Set { share, byte } => {
                let offset = at(*share, bytes);
                bytes.iter_mut().skip(offset).take(1).for_each(|known| *known = *byte);
            }
            Self::Flip { share, bit } => {
                let offset = at(*share, bytes);
                bytes.iter_mut().skip(offset).take(1).for_each(|known| *known ^= 1 << (bit % 8));
            }
            Self::Insert { share, bytes: more } => {
                let offset = at(*share, bytes);
                bytes.splice(offset..offset, more.iter().copied());
            }
            Self::Word { share, word } => {
                let offset = at(*share, bytes);
                bytes.splice(offset..offset, WORDS[usize::from(*word) % WORDS.len()].iter().copied());
            }
            Self::Remove { share, length } => {
                let offset = at(*share, bytes);
                let end = (offset + usize::from(*length)).min(bytes.len());
                bytes.drain(offset..end);
            }
            Self::Double { share, length, times } => {
                let offset = at(*share, bytes);
                let end = (offset + usize::from(*length)).min(bytes.len());
                let more = bytes[offset..end].repeat(usize::from(*times));
                bytes.splice(offset..offset, more);
            }
            Self::RemoveLine { share } => {
                let range = line(at(*share, bytes), bytes);
                bytes.drain(range);
            }
            Self::DoubleLine { share } => {
                let range = line(at(*share, bytes), bytes);
                let more = bytes[range.clone()].to_vec();
                bytes.splice(range.start..range.start, more);
            }
            Self::Cut { share } => bytes.truncate(at(*share, bytes)),
            Self::Only { bytes: other } => bytes.clone_from(other),
        }
    }
}
