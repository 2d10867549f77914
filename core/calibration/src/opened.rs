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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_user_can_act_on_is_said_in_words() {
        let of = |kind: ErrorKind| why(&Error::from(kind));
        assert_eq!(of(ErrorKind::NotFound), "there is no such file");
        assert_eq!(of(ErrorKind::IsADirectory), "this is a folder; name a file in it");
        assert_eq!(of(ErrorKind::PermissionDenied), "it may not be read; see who owns it");
        assert_eq!(why(&Error::other("the disk is full")), "the disk is full");
    }
}
