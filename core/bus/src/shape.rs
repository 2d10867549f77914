//! How much shared memory a stream takes.

use plumb_plugin::StreamDescription;
use plumb_plugin::message::{Layout, PREFIX_LENGTH};

use crate::service::WORD;

/// The most receivers of a stream of small messages.
const SMALL_RECEIVERS: usize = 8;

/// The most receivers of a stream of large messages, each of which costs `depth` more of them in memory.
const LARGE_RECEIVERS: usize = 3;

/// A second of a fast robot's states: at 1 kHz a receiver may be busy that long before it loses one.
const SMALL_DEPTH: usize = 1024;

/// Large messages are wanted fresh.
const LARGE_DEPTH: usize = 2;

/// From how many bytes on a message is large.
const LARGE: usize = 16 * 1024;

/// How much shared memory a stream takes. Sender and receivers work it out from the same description, so they agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StreamShape {
    /// The longest message in bytes.
    pub max_bytes: usize,
    /// The length every message has, for a layout of fixed length.
    pub exact_bytes: Option<usize>,
    /// How many messages wait for a slow receiver before the oldest is lost.
    pub depth: usize,
    /// How many receivers there may be.
    pub receivers: usize,
}

impl StreamShape {
    /// The shape of a stream.
    pub fn of(stream: &StreamDescription) -> Self {
        let exact_bytes = Layout::of(stream).and_then(|layout| layout.length());
        let max_bytes = exact_bytes.or(stream.max_bytes).unwrap_or(LARGE);
        let large = max_bytes > LARGE;
        Self {
            max_bytes,
            exact_bytes,
            depth: stream.depth.unwrap_or(if large { LARGE_DEPTH } else { SMALL_DEPTH }).max(1),
            receivers: if large { LARGE_RECEIVERS } else { SMALL_RECEIVERS },
        }
    }

    /// Whether a message of a length may go on the stream.
    ///
    /// # Errors
    /// What would be right.
    pub(crate) fn check_length(&self, length: usize) -> Result<(), String> {
        match self.exact_bytes {
            Some(exact) if exact != length => Err(format!("its layout has {exact}")),
            None if length > self.max_bytes => Err(format!("its longest has {}", self.max_bytes)),
            _ if !length.is_multiple_of(WORD) => Err(format!("a length is a multiple of {WORD}")),
            _ if length < PREFIX_LENGTH => {
                Err(format!("every message begins with {PREFIX_LENGTH}, its time and number"))
            }
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plumb_plugin::JointState;

    /// A stream of messages of a plugin's own.
    fn own(max_bytes: Option<usize>) -> StreamShape {
        let mut stream = StreamDescription::of::<JointState>("pictures");
        stream.message = "picture/1".to_owned();
        (stream.max_bytes, stream.depth) = (max_bytes, None);
        StreamShape::of(&stream)
    }

    #[test]
    fn a_stream_of_a_fixed_layout_takes_that_length_only() {
        let shape = StreamShape::of(&StreamDescription::of::<JointState>("joints"));
        let exact = size_of::<JointState>();
        assert_eq!(shape.check_length(exact), Ok(()));
        for wrong in [exact - 8, exact + 8, 0] {
            assert_eq!(shape.check_length(wrong), Err(format!("its layout has {exact}")));
        }
    }

    #[test]
    fn a_stream_of_any_length_takes_whole_words_from_the_prefix_to_its_longest() {
        let shape = own(Some(64));
        assert_eq!([16, 24, 64].map(|length| shape.check_length(length)), [Ok(()), Ok(()), Ok(())]);
        assert_eq!(shape.check_length(72), Err("its longest has 64".to_owned()));
        assert_eq!(shape.check_length(63), Err("a length is a multiple of 8".to_owned()));
        assert_eq!(
            shape.check_length(8),
            Err("every message begins with 16, its time and number".to_owned())
        );
        assert!(shape.check_length(0).is_err());
    }

    #[test]
    fn only_small_messages_are_queued_deep_and_for_many() {
        let (small, large) = (own(Some(LARGE)), own(Some(LARGE + 8)));
        assert_eq!((small.depth, small.receivers), (SMALL_DEPTH, SMALL_RECEIVERS));
        assert_eq!((large.depth, large.receivers), (LARGE_DEPTH, LARGE_RECEIVERS));
        assert_eq!(own(None).max_bytes, 16_384);
    }
}
