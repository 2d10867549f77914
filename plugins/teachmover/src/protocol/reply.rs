//! What the controller answers.

use std::fmt;

use super::{PendantKey, ProgramLine};
use crate::drive::HalfSteps;

/// The digit every command is answered with, when what it caused has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// 0: the controller could not do it.
    Refused,
    /// 1: done.
    Done,
    /// 2: the STOP key of the pendant ended it.
    StopKey,
}

/// What the controller reports to `@READ`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ControllerState {
    /// Half-steps the motors were sent since the last reset.
    pub registers: HalfSteps,
    /// The levels of the input lines.
    pub inputs: u8,
    /// The key pressed last on the pendant.
    pub key: PendantKey,
}

/// Why the text of a reply is not what it should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Fault {
    /// Something else than the digit of a status.
    #[error("a single 0, 1 or 2 should be there")]
    NotAStatus,
    /// Another number of numbers.
    #[error("{expected} numbers should be there, not {found}")]
    Count {
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// Something that is no number.
    #[error("number {position} is no whole number")]
    NotANumber {
        /// Which, from 1.
        position: usize,
    },
    /// A number too large for what it means.
    #[error("number {position} is out of range")]
    OutOfRange {
        /// Which, from 1.
        position: usize,
    },
}

/// Reads the digit of a status from the text of a line, without its carriage return.
///
/// # Errors
/// [`Fault::NotAStatus`].
pub fn parse_status(line: &[u8]) -> Result<Status, Fault> {
    match line.trim_ascii() {
        b"0" => Ok(Status::Refused),
        b"1" => Ok(Status::Done),
        b"2" => Ok(Status::StopKey),
        _ => Err(Fault::NotAStatus),
    }
}

/// Reads the six registers and the seventh number, which holds the inputs in its low half and the pendant key in its high half.
///
/// # Errors
/// [`Fault`], naming the number that is wrong.
pub fn parse_state(line: &[u8]) -> Result<ControllerState, Fault> {
    let numbers = parse_numbers(line)?;
    let &[base, shoulder, elbow, right, left, gripper, last] = numbers.as_slice() else {
        return Err(Fault::Count { expected: 7, found: numbers.len() });
    };
    let mut registers = [0; 6];
    for (index, number) in [base, shoulder, elbow, right, left, gripper].into_iter().enumerate() {
        let register = i32::try_from(number).map_err(|_| Fault::OutOfRange { position: index + 1 })?;
        *registers.get_mut(index).ok_or(Fault::OutOfRange { position: index + 1 })? = register;
    }
    let last = u16::try_from(last).map_err(|_| Fault::OutOfRange { position: 7 })?;
    let [inputs, key] = last.to_le_bytes();
    Ok(ControllerState { registers: HalfSteps(registers), inputs, key: PendantKey(key) })
}

/// Reads a taught program: eight numbers for each of its lines, on lines of their own or run together.
///
/// # Errors
/// [`Fault`], naming the number that is wrong, or that the last line is cut short.
pub fn parse_program(text: &[u8]) -> Result<Vec<ProgramLine>, Fault> {
    let numbers = parse_numbers(text)?;
    let mut lines = Vec::new();
    for (index, words) in numbers.chunks(8).enumerate() {
        let &words: &[i64; 8] =
            words.try_into().map_err(|_| Fault::Count { expected: 8 * (index + 1), found: numbers.len() })?;
        let mut line = [0; 8];
        for (within_line, (word, number)) in line.iter_mut().zip(words).enumerate() {
            // A controller of sixteen bits may well print a word with its high bit set as a negative number.
            let unsigned = u16::try_from(number).ok();
            let signed = || i16::try_from(number).ok().map(|number| number as u16);
            *word = unsigned
                .or_else(signed)
                .ok_or(Fault::OutOfRange { position: 8 * index + within_line + 1 })?;
        }
        lines.push(ProgramLine(line));
    }
    Ok(lines)
}

/// The whole numbers of a text: separated by commas, blanks or line ends, one comma after the last tolerated.
fn parse_numbers(text: &[u8]) -> Result<Vec<i64>, Fault> {
    let text = text.trim_ascii();
    let text = text.strip_suffix(b",").unwrap_or(text).trim_ascii_end();
    if text.is_empty() {
        return Ok(Vec::new());
    }
    let mut numbers = Vec::new();
    for part in text.split(|byte| *byte == b',') {
        let mut words = part.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty()).peekable();
        if words.peek().is_none() {
            return Err(Fault::NotANumber { position: numbers.len() + 1 });
        }
        for word in words {
            let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<i64>().ok());
            numbers.push(number.ok_or(Fault::NotANumber { position: numbers.len() + 1 })?);
        }
    }
    Ok(numbers)
}

/// Bytes from the line for a message: printable ones as they are, others as `\xNN`, at most 60 of them.
#[derive(Debug)]
pub struct PrintableBytes<'a>(pub &'a [u8]);

impl fmt::Display for PrintableBytes<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        const LONGEST: usize = 60;
        for byte in self.0.iter().take(LONGEST) {
            write!(formatter, "{}", byte.escape_ascii())?;
        }
        if self.0.len() > LONGEST {
            write!(formatter, "... ({} bytes)", self.0.len())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn registers_inputs_and_key_are_read_from_seven_numbers() {
        let state = parse_state(b"-5,0,1162, 384,384,-1162,1797").unwrap();
        assert_eq!(state.registers, HalfSteps([-5, 0, 1162, 384, 384, -1162]));
        assert_eq!(state.inputs, 5);
        assert_eq!(state.key, PendantKey::STOP);
    }

    #[test]
    fn blanks_and_a_last_comma_are_tolerated() {
        let plain = parse_state(b"1,2,3,4,5,6,7").unwrap();
        assert_eq!(parse_state(b" 1 , 2,3,4,5,6,7, "), Ok(plain));
        assert_eq!(parse_state(b"1 2 3 4 5 6 7"), Ok(plain));
    }

    #[test]
    fn a_wrong_number_is_named() {
        assert_eq!(parse_state(b"1,2,3"), Err(Fault::Count { expected: 7, found: 3 }));
        assert_eq!(parse_state(b"1,2,x,4,5,6,7"), Err(Fault::NotANumber { position: 3 }));
        assert_eq!(parse_state(b"1,,3,4,5,6,7"), Err(Fault::NotANumber { position: 2 }));
        assert_eq!(parse_state(b"1,2,3,4,5,99999999999,7"), Err(Fault::OutOfRange { position: 6 }));
        assert_eq!(parse_state(b"1,2,3,4,5,6,-7"), Err(Fault::OutOfRange { position: 7 }));
        assert_eq!(parse_state(b"1,2,3,4,5,6,65536"), Err(Fault::OutOfRange { position: 7 }));
    }

    #[test]
    fn a_status_is_one_digit_and_nothing_else() {
        assert_eq!(parse_status(b"1"), Ok(Status::Done));
        assert_eq!(parse_status(b" 2 "), Ok(Status::StopKey));
        for wrong in [&b"11"[..], b"3", b"", b"1,2", b"\x81"] {
            assert_eq!(parse_status(wrong), Err(Fault::NotAStatus));
        }
    }

    #[test]
    fn a_program_is_eight_numbers_a_line_however_they_are_broken_up() {
        let expected = vec![ProgramLine([0, 1, 2, 3, 4, 5, 6, 7]), ProgramLine([1, 0, 0, 0, 0, 0, 0, 65535])];
        assert_eq!(parse_program(b"0,1,2,3,4,5,6,7\r1 0 0 0 0 0 0 -1\r"), Ok(expected));
        assert_eq!(parse_program(b""), Ok(Vec::new()));
        assert_eq!(parse_program(b"1,2,3"), Err(Fault::Count { expected: 8, found: 3 }));
        assert_eq!(parse_program(b"0,1,2,3,4,5,6,70000"), Err(Fault::OutOfRange { position: 8 }));
    }

    #[test]
    fn unprintable_and_long_bytes_are_shown_short() {
        assert_eq!(PrintableBytes(b"1\x8f\r").to_string(), "1\\x8f\\r");
        assert!(PrintableBytes(&[b'a'; 200]).to_string().ends_with("a... (200 bytes)"));
    }

    proptest! {
        #[test]
        fn no_bytes_make_a_parser_panic(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = (parse_status(&bytes), parse_state(&bytes), parse_program(&bytes));
            let _ = PrintableBytes(&bytes).to_string();
        }

        #[test]
        fn no_text_of_digits_and_separators_makes_a_parser_panic(text in "[-0-9, \r]{0,80}") {
            let _ = (parse_status(text.as_bytes()), parse_state(text.as_bytes()), parse_program(text.as_bytes()));
        }

        #[test]
        fn every_state_is_read_back(registers in prop::array::uniform6(any::<i32>()), inputs: u8, key: u8) {
            let mut line: Vec<String> = registers.iter().map(i32::to_string).collect();
            line.push((u32::from(key) * 256 + u32::from(inputs)).to_string());
            let state = parse_state(line.join(",").as_bytes()).unwrap();
            prop_assert_eq!(state, ControllerState { registers: HalfSteps(registers), inputs, key: PendantKey(key) });
        }
    }
}
