//! Where the record lies when nobody says otherwise.

use std::path::{Path, PathBuf};

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

/// What a command has to be given to find the record in `directory` again, with a blank before it: ` --record DIR`; nothing where that is the
/// default.
pub fn record_option(directory: &Path) -> String {
    if default_directory().is_ok_and(|default| default == directory) {
        return String::new();
    }
    let text = directory.display().to_string();
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '.' | '-' | '_' | '+' | '~');
    match !text.is_empty() && text.chars().all(plain) {
        true => format!(" --record {text}"),
        false => format!(" --record '{}'", text.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_elsewhere_is_named_so_that_a_shell_understands_it() {
        assert_eq!(record_option(Path::new("br10")), " --record br10");
        assert_eq!(record_option(Path::new("/data/Bob's runs")), " --record '/data/Bob'\\''s runs'");
        if let Ok(default) = default_directory() {
            assert_eq!(record_option(&default), "");
        }
    }

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
