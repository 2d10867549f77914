//! The bytes of a table's file as text.

use std::borrow::Cow;

/// The text of a table whose lines end as on Windows, with line feeds alone: the `csv` crate ends a row at the carriage return, and counts the line of the next
/// one before the line feed.
pub fn with_line_feeds(text: &str) -> Cow<'_, str> {
    match text.contains("\r\n") {
        true => text.replace("\r\n", "\n").into(),
        false => text.into(),
    }
}

/// The text of a file: UTF-8, or UTF-16 with its mark in front, as some spreadsheets write it.
pub(super) fn decoded(bytes: Vec<u8>) -> String {
    let units = |read: fn([u8; 2]) -> u16| -> String {
        let units = bytes.chunks_exact(2).skip(1).filter_map(|pair| Some(read(pair.try_into().ok()?)));
        char::decode_utf16(units).map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
    };
    match bytes.as_slice() {
        [0xff, 0xfe, ..] => units(u16::from_le_bytes),
        [0xfe, 0xff, ..] => units(u16::from_be_bytes),
        // Without a copy where it is UTF-8 throughout: a table may be large.
        _ => String::from_utf8(bytes)
            .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()),
    }
}
