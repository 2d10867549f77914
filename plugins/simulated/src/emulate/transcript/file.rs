//! Transcripts as text: a line for what one side sent.
//!
//! ```text
//! # plumb wire 1
//! 0.000 > "@READ\r"
//! 0.052 < "1\r0,0,0,0,0,0,0\r"
//! 1.200 > ff ff 01 04 02 38 02 be
//! ```
//!
//! The time, s, may be left out. `>` is what the program sent, `<` what the device did. Bytes are as pairs of hexadecimal digits, or as text in quotation marks with
//! `\r`, `\n`, `\t`, `\"`, `\\` and `\xNN`. What follows a `#` is a remark.

use std::fmt::{self, Write as _};

/// Bytes in a line at most, as it is written.
const BYTES_A_LINE: usize = 64;

/// Who sent something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sender {
    /// The program.
    Program,
    /// The device.
    Device,
}

/// What one side sent before the other did.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// When its first byte came, s after the beginning; none where the file does not say.
    pub time_s: Option<f64>,
    /// Who.
    pub sender: Sender,
    /// What.
    pub bytes: Vec<u8>,
    /// The line of the file on which it begins, from 1.
    pub line: usize,
}

/// Everything that went over a line.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Transcript {
    /// In turns: no two of one sender follow one another.
    pub entries: Vec<Entry>,
}

/// A line that says nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "line {line}: {problem}; write `TIME > BYTES` for what the program sent and `TIME < BYTES` for the device, BYTES as `ff 01` or as \"text\\r\""
)]
pub struct TranscriptError {
    /// From 1.
    pub line: usize,
    /// What is wrong.
    pub problem: String,
}

impl Transcript {
    /// Reads a transcript.
    ///
    /// # Errors
    /// [`TranscriptError`]: the first line that says nothing.
    pub fn parse(text: &str) -> Result<Self, TranscriptError> {
        let mut transcript = Self::default();
        for (index, line) in text.lines().enumerate() {
            let number = index + 1;
            let entry = parse_line(line).map_err(|problem| TranscriptError { line: number, problem })?;
            if let Some((time_s, sender, bytes)) = entry {
                transcript.add(Entry { time_s, sender, bytes, line: number });
            }
        }
        if transcript.entries.is_empty() {
            return Err(TranscriptError { line: 1, problem: "nothing went over this line".to_owned() });
        }
        Ok(transcript)
    }

    /// Adds what was sent, to what the same side has sent just before.
    pub fn add(&mut self, entry: Entry) {
        match self.entries.last_mut() {
            Some(last) if last.sender == entry.sender => last.bytes.extend(entry.bytes),
            _ => self.entries.push(entry),
        }
    }
}

/// The sign of a sender.
fn sign(sender: Sender) -> char {
    match sender {
        Sender::Program => '>',
        Sender::Device => '<',
    }
}

impl fmt::Display for Entry {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for bytes in self.bytes.chunks(BYTES_A_LINE) {
            let time = self.time_s.map_or(String::new(), |time| format!("{time:.4} "));
            writeln!(formatter, "{time}{} {}", sign(self.sender), shown(bytes))?;
        }
        Ok(())
    }
}

/// Bytes as a transcript has them: text where all can be read, else pairs of digits.
pub(super) fn shown(bytes: &[u8]) -> String {
    let readable = |byte: &u8| (0x20..0x7f).contains(byte) || matches!(byte, b'\r' | b'\n' | b'\t');
    let mut text = String::new();
    if !bytes.iter().all(readable) {
        for byte in bytes {
            let _ = write!(text, "{}{byte:02x}", if text.is_empty() { "" } else { " " });
        }
        return text;
    }
    text.push('"');
    for byte in bytes {
        match byte {
            b'\r' => text.push_str("\\r"),
            b'\n' => text.push_str("\\n"),
            b'\t' => text.push_str("\\t"),
            b'"' | b'\\' => text.extend(['\\', char::from(*byte)]),
            _ => text.push(char::from(*byte)),
        }
    }
    text.push('"');
    text
}

type Line = Option<(Option<f64>, Sender, Vec<u8>)>;

fn parse_line(line: &str) -> Result<Line, String> {
    let line = line.trim();
    if line.is_empty() || line.starts_with('#') {
        return Ok(None);
    }
    let at = line.find(['<', '>']).ok_or("it has neither `>` nor `<`")?;
    let (time, rest) = line.split_at(at);
    let sender = if rest.starts_with('>') { Sender::Program } else { Sender::Device };
    let time_s = match time.trim() {
        "" => None,
        time => Some(
            time.parse()
                .ok()
                .filter(|time: &f64| time.is_finite() && *time >= 0.0)
                .ok_or(format!("`{time}` is no time in seconds"))?,
        ),
    };
    let bytes = parse_bytes(rest.get(1..).unwrap_or_default().trim())?;
    if bytes.is_empty() {
        return Err("no bytes follow".to_owned());
    }
    Ok(Some((time_s, sender, bytes)))
}

fn parse_bytes(text: &str) -> Result<Vec<u8>, String> {
    if let Some(quoted) = text.strip_prefix('"') {
        return parse_quoted(quoted);
    }
    let digits = text.split('#').next().unwrap_or_default();
    let pair = |word: &str| {
        let is_pair = word.len() == 2 && word.bytes().all(|digit| digit.is_ascii_hexdigit());
        let byte = u8::from_str_radix(word, 16).ok().filter(|_| is_pair);
        byte.ok_or_else(|| format!("`{word}` is no byte of two hexadecimal digits"))
    };
    digits.split_whitespace().map(pair).collect()
}

fn parse_quoted(text: &str) -> Result<Vec<u8>, String> {
    let (mut bytes, mut rest) = (Vec::new(), text.chars());
    while let Some(next) = rest.next() {
        match next {
            '"' => {
                let after = rest.as_str().trim();
                let ends = after.is_empty() || after.starts_with('#');
                return if ends {
                    Ok(bytes)
                } else {
                    Err(format!("`{after}` follows the closing quotation mark"))
                };
            }
            '\\' => bytes.push(match rest.next() {
                Some('r') => b'\r',
                Some('n') => b'\n',
                Some('t') => b'\t',
                Some('"') => b'"',
                Some('\\') => b'\\',
                Some('x') => {
                    let digits: String = rest.by_ref().take(2).collect();
                    u8::from_str_radix(&digits, 16).map_err(|_| format!("`\\x{digits}` is no byte"))?
                }
                other => return Err(format!("`\\{}` means nothing", other.unwrap_or(' '))),
            }),
            other => {
                let byte = u8::try_from(other).ok().filter(u8::is_ascii);
                bytes.push(
                    byte.ok_or_else(|| format!("`{other}` is no character of ASCII: write it as \\xNN"))?,
                );
            }
        }
    }
    Err("the closing quotation mark is missing".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_transcript_reads_as_it_was_written() {
        let text = "# plumb wire 1\n0.0000 > \"@READ\\r\"\n\n0.0520 < \"1\\r\"\n< \"0,0\\r\" # the same turn\n> ff ff 01\n";
        let transcript = Transcript::parse(text).unwrap();
        let turns: Vec<(Sender, &[u8], usize)> = transcript
            .entries
            .iter()
            .map(|entry| (entry.sender, entry.bytes.as_slice(), entry.line))
            .collect();
        assert_eq!(
            turns,
            [
                (Sender::Program, &b"@READ\r"[..], 2),
                (Sender::Device, &b"1\r0,0\r"[..], 4),
                (Sender::Program, &[0xff, 0xff, 1][..], 6)
            ]
        );
        let again: String = transcript.entries.iter().map(Entry::to_string).collect();
        let reread = Transcript::parse(&again).unwrap();
        assert!(
            reread.entries.iter().zip(&transcript.entries).all(|(again, first)| again.bytes == first.bytes)
        );
    }

    #[test]
    fn every_line_that_says_nothing_is_named() {
        for (text, problem) in [
            ("", "line 1: nothing went over this line"),
            ("> \"a\"\nREAD", "line 2: it has neither `>` nor `<`"),
            ("soon > 01", "line 1: `soon` is no time in seconds"),
            ("> 1", "line 1: `1` is no byte of two hexadecimal digits"),
            (">", "line 1: no bytes follow"),
            ("> \"abc", "line 1: the closing quotation mark is missing"),
            ("> \"a\\q\"", "line 1: `\\q` means nothing"),
            ("> \"a\" b", "line 1: `b` follows the closing quotation mark"),
        ] {
            let error = Transcript::parse(text).unwrap_err().to_string();
            assert!(error.starts_with(problem), "{error}");
        }
    }
}
