//! Files that come from outside: what a person wrote, another program made, or somebody sent.
//!
//! Every reader of such a file opens it here. Only regular files are read, each kind up to a size that has a reason ([`FileKind`]), so that
//! a named pipe, a device or a file without end is refused with words in place of a wait or a full memory.
//! [`yaml`] puts what the YAML library complains of into words.

mod error;
mod kind;
mod read;
pub mod yaml;

pub use error::ReadError;
pub use kind::FileKind;
pub use read::{LimitedReader, lines, open, read_bytes, read_text, text_of};
