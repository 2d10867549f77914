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
    Set { fraction: u16, byte: u8 },
    Flip { fraction: u16, bit: u8 },
    Insert { fraction: u16, bytes: Vec<u8> },
    Word { fraction: u16, word: u8 },
    Remove { fraction: u16, length: u8 },
    Double { fraction: u16, length: u8, times: u8 },
    RemoveLine { fraction: u16 },
    DoubleLine { fraction: u16 },
    Cut { fraction: u16 },
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
        let at =
            |fraction: u16, bytes: &[u8]| usize::from(fraction) * bytes.len() / (usize::from(u16::MAX) + 1);
        let line = |offset: usize, bytes: &[u8]| {
            let begin = bytes[..offset].iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
            let length = bytes[offset..].iter().position(|byte| *byte == b'\n');
            begin..length.map_or(bytes.len(), |length| offset + length + 1)
        };
        match self {
            Self::Set { fraction, byte } => {
                let offset = at(*fraction, bytes);
                bytes.iter_mut().skip(offset).take(1).for_each(|known| *known = *byte);
            }
            Self::Flip { fraction, bit } => {
                let offset = at(*fraction, bytes);
                bytes.iter_mut().skip(offset).take(1).for_each(|known| *known ^= 1 << (bit % 8));
            }
            Self::Insert { fraction, bytes: more } => {
                let offset = at(*fraction, bytes);
                bytes.splice(offset..offset, more.iter().copied());
            }
            Self::Word { fraction, word } => {
                let offset = at(*fraction, bytes);
                bytes.splice(offset..offset, WORDS[usize::from(*word) % WORDS.len()].iter().copied());
            }
            Self::Remove { fraction, length } => {
                let offset = at(*fraction, bytes);
                let end = (offset + usize::from(*length)).min(bytes.len());
                bytes.drain(offset..end);
            }
            Self::Double { fraction, length, times } => {
                let offset = at(*fraction, bytes);
                let end = (offset + usize::from(*length)).min(bytes.len());
                let more = bytes[offset..end].repeat(usize::from(*times));
                bytes.splice(offset..offset, more);
            }
            Self::RemoveLine { fraction } => {
                let range = line(at(*fraction, bytes), bytes);
                bytes.drain(range);
            }
            Self::DoubleLine { fraction } => {
                let range = line(at(*fraction, bytes), bytes);
                let more = bytes[range.clone()].to_vec();
                bytes.splice(range.start..range.start, more);
            }
            Self::Cut { fraction } => bytes.truncate(at(*fraction, bytes)),
            Self::Only { bytes: other } => bytes.clone_from(other),
        }
    }
}
