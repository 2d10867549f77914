//! What was reported already, kept in a file beside the record, so that a program that starts anew does not say it again.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::trouble::Trouble;

/// The name of the file.
const FILE: &str = "alerts.json";

/// The name of the file of what was reported of all cells. A cell's own alerts may run beside it, and each would forget what the other reported.
const FLEET_FILE: &str = "fleet-alerts.json";

/// Why the file is of no use.
#[derive(Debug, thiserror::Error)]
pub(super) enum ReportedError {
    #[error("what was reported already cannot be read from {}: {cause}; remove the file, and it is reported again", path.display())]
    Read { path: PathBuf, cause: io::Error },
    #[error("what was reported cannot be written to {}: {cause}", path.display())]
    Write { path: PathBuf, cause: io::Error },
}

/// What was reported already: trouble, and over which channels.
#[derive(Debug)]
pub(super) struct Reported {
    path: PathBuf,
    reported: BTreeMap<String, BTreeSet<String>>,
}

impl Reported {
    pub(super) fn read(directory: &Path) -> Result<Self, ReportedError> {
        Self::read_file(directory.join(FILE))
    }

    /// Of all cells. The folder is made where no run has made it.
    pub(super) fn of_the_fleet(directory: &Path) -> Result<Self, ReportedError> {
        let path = directory.join(FLEET_FILE);
        match fs::create_dir_all(directory) {
            Ok(()) => Self::read_file(path),
            Err(cause) => Err(ReportedError::Write { path, cause }),
        }
    }

    fn read_file(path: PathBuf) -> Result<Self, ReportedError> {
        let reported = match fs::read_to_string(&path) {
            Ok(text) => serde_json::from_str(&text).map_err(io::Error::from),
            Err(cause) if cause.kind() == io::ErrorKind::NotFound => Ok(BTreeMap::new()),
            Err(cause) => Err(cause),
        };
        match reported {
            Ok(reported) => Ok(Self { path, reported }),
            Err(cause) => Err(ReportedError::Read { path, cause }),
        }
    }

    pub(super) fn has(&self, key: &str, channel: &str) -> bool {
        self.reported.get(key).is_some_and(|channels| channels.contains(channel))
    }

    pub(super) fn note(&mut self, key: &str, channel: &str) -> Result<(), ReportedError> {
        self.reported.entry(key.to_owned()).or_default().insert(channel.to_owned());
        self.write()
    }

    /// Forgets what is over.
    pub(super) fn keep_only(&mut self, found: &[Trouble]) -> Result<(), ReportedError> {
        let before = self.reported.len();
        self.reported.retain(|key, _| found.iter().any(|trouble| trouble.key == *key));
        if self.reported.len() == before { Ok(()) } else { self.write() }
    }

    /// Replaced whole: a program that is killed meanwhile leaves the old file or the new one.
    fn write(&self) -> Result<(), ReportedError> {
        let new = self.path.with_extension("json.new");
        let text = serde_json::to_string(&self.reported).map_err(io::Error::from);
        let written = text.and_then(|text| fs::write(&new, text)).and_then(|()| fs::rename(&new, &self.path));
        written.map_err(|cause| ReportedError::Write { path: self.path.clone(), cause })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_reported_is_known_after_a_restart_until_it_is_over() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut reported = Reported::read(folder.path()).expect("nothing yet");
        reported.note("test", "a").expect("written");
        let mut again = Reported::read(folder.path()).expect("read");
        assert!(again.has("test", "a") && !again.has("test", "b") && !again.has("other", "a"));
        again.keep_only(&[Trouble::test()]).expect("kept");
        assert!(again.has("test", "a"));
        again.keep_only(&[]).expect("written");
        assert!(!Reported::read(folder.path()).expect("read").has("test", "a"));
        fs::write(folder.path().join(FILE), "shopping list").expect("written");
        let error = Reported::read(folder.path()).expect_err("refused").to_string();
        assert!(error.contains("alerts.json") && error.contains("remove the file"), "{error}");
    }
}
