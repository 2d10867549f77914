//! Sealed world files: a cell whose faults nobody sees by looking at its file. It keeps a glance from giving them away; it is not
//! cryptography, for anyone who has this program can open it.

use super::WorldFileError;
use crate::chance;

/// The first line of a sealed file.
const HEADING: &str =
    "# plumb world, sealed (a seal, not a cipher): its faults stay hidden until it is revealed";
/// The keys with which it is a world file to anything that recognises files by their keys.
const KEYS: &str = "world: sealed\nsealed: |";
const COLUMNS: usize = 100;

/// Whether a text is a sealed world file.
pub(crate) fn is_sealed(text: &str) -> bool {
    text.lines().next() == Some(HEADING)
}

/// Seals the text of a world file.
pub fn seal(text: &str) -> String {
    let digits: String = veiled(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect();
    let mut sealed = format!("{HEADING}\n{KEYS}\n");
    let mut rest = digits.as_str();
    while !rest.is_empty() {
        let (line, after) = rest.split_at(rest.len().min(COLUMNS));
        sealed.push_str("  ");
        sealed.push_str(line);
        sealed.push('\n');
        rest = after;
    }
    sealed
}

/// The text under a seal; `file` is the name its errors bear.
pub(crate) fn open(file: &str, sealed: &str) -> Result<String, WorldFileError> {
    let broken = || WorldFileError::BrokenSeal { file: file.to_owned() };
    let body = sealed.strip_prefix(HEADING).and_then(|rest| rest.trim_start().strip_prefix(KEYS));
    let digits: String = body.ok_or_else(broken)?.split_whitespace().collect();
    let hidden = digits
        .as_bytes()
        .chunks(2)
        .map(|pair| {
            let pair = std::str::from_utf8(pair).ok().filter(|pair| pair.len() == 2)?;
            u8::from_str_radix(pair, 16).ok()
        })
        .collect::<Option<Vec<u8>>>()
        .ok_or_else(broken)?;
    String::from_utf8(veiled(&hidden)).map_err(|_| broken())
}

/// The same operation veils and unveils.
fn veiled(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().zip(0..).map(|(byte, index)| byte ^ (chance::uniform(0x5ea1, index) * 256.0) as u8).collect()
}
