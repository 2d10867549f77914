//! What the primary interface reports, as far as it matters here: why a program does not run, and texts.
//!
//! Messages are a length (int32, big-endian, itself included), a kind (uint8), and what the kind has.
//! <https://docs.universal-robots.com/tutorials/communication-protocol-tutorials/primary-secondary-guide.html>

/// Bytes of a message's header.
const HEADER: usize = 5;

/// The longest message that is waited for, bytes: states are some hundreds long, popups some thousands.
const LONGEST: usize = 1 << 16;

/// A message of the robot, not its state.
const ROBOT_MESSAGE: u8 = 20;
const TEXT: u8 = 0;
const RUNTIME_EXCEPTION: u8 = 10;

/// What the controller says of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PrimaryMessage {
    /// An error in a program.
    Error {
        /// From 1.
        line: i32,
        /// From 1.
        column: i32,
        /// In the controller's words.
        text: String,
    },
    /// A text for the log.
    Text(String),
}

/// What came is not the primary interface's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a message claims to be {0} bytes long: what answers is not a primary or secondary interface")]
pub struct NotPrimary(pub usize);

/// Messages out of what has come so far, in pieces of any size.
#[derive(Debug, Default)]
pub struct Messages {
    bytes: Vec<u8>,
}

impl Messages {
    /// Adds what has come.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// The next thing said; states and messages of other kinds are passed over.
    ///
    /// # Errors
    /// [`NotPrimary`]; nothing after it can be trusted.
    pub fn take(&mut self) -> Result<Option<PrimaryMessage>, NotPrimary> {
        while let Some(length) = self.bytes.first_chunk().map(|four| u32::from_be_bytes(*four)) {
            let length = usize::try_from(length).unwrap_or(usize::MAX);
            if !(HEADER..=LONGEST).contains(&length) {
                return Err(NotPrimary(length));
            }
            if self.bytes.len() < length {
                break;
            }
            let message: Vec<u8> = self.bytes.drain(..length).collect();
            if let Some(reported) = reported(&message) {
                return Ok(Some(reported));
            }
        }
        Ok(None)
    }
}

/// What a whole message says: its header, a time (uint64), a source (int8), a kind (int8), and what the kind has.
fn reported(message: &[u8]) -> Option<PrimaryMessage> {
    let [_, _, _, _, ROBOT_MESSAGE, _, _, _, _, _, _, _, _, _source, kind, rest @ ..] = message else {
        return None;
    };
    let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).trim_end_matches('\0').trim().to_owned();
    match *kind {
        TEXT => Some(PrimaryMessage::Text(words(rest))),
        RUNTIME_EXCEPTION => {
            let (line, rest) = rest.split_first_chunk()?;
            let (column, rest) = rest.split_first_chunk()?;
            Some(PrimaryMessage::Error {
                line: i32::from_be_bytes(*line),
                column: i32::from_be_bytes(*column),
                text: words(rest),
            })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A runtime exception as the client library of Universal Robots reads one: line 3, column 1.
    const EXCEPTION: [u8; 28] = [
        0, 0, 0, 28, 20, 0, 0, 0, 0, 0, 0, 0, 9, 253, 10, 0, 0, 0, 3, 0, 0, 0, 1, b'w', b'r', b'o', b'n',
        b'g',
    ];

    #[test]
    fn an_error_is_read_in_any_pieces_and_states_are_passed_over() {
        let mut messages = Messages::default();
        messages.push(&[0, 0, 0, 6, 16, 1]);
        for byte in EXCEPTION {
            assert_eq!(messages.take(), Ok(None));
            messages.push(&[byte]);
        }
        let wrong = PrimaryMessage::Error { line: 3, column: 1, text: "wrong".to_owned() };
        assert_eq!(messages.take(), Ok(Some(wrong)));
    }

    #[test]
    fn what_is_no_message_is_named() {
        let mut messages = Messages::default();
        messages.push(b"HTTP/1.1 400");
        assert_eq!(messages.take(), Err(NotPrimary(0x4854_5450)));
    }
}
