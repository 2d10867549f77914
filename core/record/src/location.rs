//! Where the record lies when nobody says otherwise.

use std::path::PathBuf;

use crate::RecordError;

/// `$XDG_STATE_HOME/plumb`, else `~/.local/state/plumb`.
///
/// # Errors
/// [`RecordError::NoDefaultDirectory`] when neither variable is set.
pub fn default_directory() -> Result<PathBuf, RecordError> {
    directory_from(
        std::env::var_os("XDG_STATE_HOME").map(PathBuf::from),
        std::env::var_os("HOME").map(PathBuf::from),
    )
}

fn directory_from(state_home: Option<PathBuf>, home: Option<PathBuf>) -> Result<PathBuf, RecordError> {
    let state_home = state_home.filter(|path| path.is_absolute());
    let home = home.filter(|path| !path.as_os_str().is_empty());
    state_home
        .or_else(|| home.map(|home| home.join(".local/state")))
        .map(|state| state.join("plumb"))
        .ok_or(RecordError::NoDefaultDirectory)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_home_comes_before_the_home_and_a_relative_one_is_ignored() {
        let home = Some(PathBuf::from("/home/ada"));
        let from =
            |state: &str| directory_from(Some(PathBuf::from(state)), home.clone()).expect("a directory");
        assert_eq!(from("/state"), PathBuf::from("/state/plumb"));
        assert_eq!(from("state"), PathBuf::from("/home/ada/.local/state/plumb"));
        assert!(directory_from(None, None).is_err());
    }
}
