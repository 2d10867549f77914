//! What the system says when a file cannot be read, in words a user can act on.

use std::io::{Error, ErrorKind};

/// Why a file cannot be read.
pub(crate) fn why(error: &Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".to_owned(),
        ErrorKind::IsADirectory => "this is a folder; name a file in it".to_owned(),
        ErrorKind::PermissionDenied => "it may not be read; see who owns it".to_owned(),
        _ => error.to_string(),
    }
}
