//! What was told already, kept in a file beside the record, so that a program that starts anew does not say it again.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::trouble::Trouble;

/// The name of the file.
const FILE: &str = "alerts.json";

/// The name of the file of what was told of all cells. A cell's own alerts may run beside it, and each would forget what the other told.
const FLEET_FILE: &str = "fleet-alerts.json";

/// Why the file is of no use.
#[derive(Debug, thiserror::Error)]
pub(super) enum ToldError {
    #[error("what was told already cannot be read from {}: {cause}; remove the file, and it is told again", path.display())]
    Read { path: PathBuf, cause: io::Error },
    #[error("what was told cannot be written to {}: {cause}", path.display())]
    Write { path: PathBuf, cause: io::Error },
}

/// What was told already: trouble, and over which channels.
#[derive(Debug)]
pub(super) struct Told {
    path: PathBuf,
    told: BTreeMap<String, BTreeSet<String>>,
}

impl Told {
    pub(super) fn read(directory: &Path) -> Result<Self, ToldError> {
        Self::read_file(directory.join(FILE))
    }

    /// Of all cells. The folder is made where no run has made it.
    pub(super) fn of_the_fleet(directory: &Path) -> Result<Self, ToldError> {
        let path = directory.join(FLEET_FILE);
        match fs::create_dir_all(directory) {
            Ok(()) => Self::read_file(path),
            Err(cause) => Err(ToldError::Write { path, cause }),
        }
    }

    fn read_file(path: PathBuf) -> Result<Self, ToldError> {
        let told = match fs::read_to_string(&path) {
            Ok(text) => serde_json::from_str(&text).map_err(io::Error::from),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(BTreeMap::new()),
            Err(cause) => Err(cause),
        };
        match told {
            Ok(told) => Ok(Self { path, told }),
            Err(cause) => Err(ToldError::Read { path, cause }),
        }
    }

    pub(super) fn has(&self, key: &str, channel: &str) -> bool {
        self.told.get(key).is_some_and(|channels| channels.contains(channel))
    }

    pub(super) fn note(&mut self, key: &str, channel: &str) -> Result<(), ToldError> {
        self.told.entry(key.to_owned()).or_default().insert(channel.to_owned());
        self.write()
    }

    /// Forgets what is over.
    pub(super) fn keep_only(&mut self, found: &[Trouble]) -> Result<(), ToldError> {
        let before = self.told.len();
        self.told.retain(|key, _| found.iter().any(|trouble| trouble.key == *key));
        if self.told.len() == before { Ok(()) } else { self.write() }
    }

    /// Replaced whole: a program that is killed meanwhile leaves the old file or the new one.
    fn write(&self) -> Result<(), ToldError> {
        let new = self.path.with_extension("json.new");
        let text = serde_json::to_string(&self.told).map_err(io::Error::from);
        let written = text.and_then(|text| fs::write(&new, text)).and_then(|()| fs::rename(&new, &self.path));
        written.map_err(|cause| ToldError::Write { path: self.path.clone(), cause })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_told_is_known_after_a_restart_until_it_is_over() {
        let place = tempfile::tempdir().expect("a folder");
        let mut told = Told::read(place.path()).expect("nothing yet");
        told.note("test", "a").expect("written");
        let mut again = Told::read(place.path()).expect("read");
        assert!(again.has("test", "a") && !again.has("test", "b") && !again.has("other", "a"));
        again.keep_only(&[Trouble::test()]).expect("kept");
        assert!(again.has("test", "a"));
        again.keep_only(&[]).expect("written");
        assert!(!Told::read(place.path()).expect("read").has("test", "a"));
        fs::write(place.path().join(FILE), "shopping list").expect("written");
        let error = Told::read(place.path()).expect_err("refused").to_string();
        assert!(error.contains("alerts.json") && error.contains("remove the file"), "{error}");
    }
}
