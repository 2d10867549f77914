//! How much shared memory a stream takes.

use plumb_plugin::StreamDescription;
use plumb_plugin::message::known_length;

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
        let exact_bytes = known_length(&stream.message);
        let max_bytes = exact_bytes.or(stream.max_bytes).unwrap_or(LARGE);
        let large = max_bytes > LARGE;
        Self {
            max_bytes,
            exact_bytes,
            depth: stream.depth.unwrap_or(if large { LARGE_DEPTH } else { SMALL_DEPTH }).max(1),
            receivers: if large { LARGE_RECEIVERS } else { SMALL_RECEIVERS },
        }
    }
}
