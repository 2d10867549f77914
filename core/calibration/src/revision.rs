//! Revisions of a model file: each change is written as a new file beside the original; nothing is overwritten.

use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::arm_model::{Model, Revision};
use crate::file::{ModelFileError, model_text};
use crate::reading_unit::RmsError;

/// Why a revision cannot be read or written.
#[derive(Debug, Error)]
pub enum RevisionError {
    /// A model file of the family is broken.
    #[error(transparent)]
    Model(#[from] ModelFileError),
    /// The folder cannot be read, or the file not written.
    #[error("{path}: {source}")]
    File {
        /// The file or folder.
        path: String,
        /// What the system said.
        source: std::io::Error,
    },
    /// There is nothing to go back to.
    #[error("{0}: nothing has been added yet; there is nothing to undo")]
    NothingToUndo(String),
    /// The path names no file.
    #[error("{0}: this is a folder; name a file in it")]
    NoFileName(String),
}

/// A model file and its revisions.
#[derive(Debug, Clone)]
pub struct Family {
    folder: PathBuf,
    stem: String,
    original: String,
}

/// One revision, read.
#[derive(Debug, Clone)]
pub struct Entry {
    /// 0 for the original.
    pub number: u32,
    /// Its file.
    pub path: PathBuf,
    /// What it says.
    pub model: Model,
}

impl Family {
    /// The family a path belongs to, whether it names the original or a revision.
    ///
    /// # Errors
    /// The path names no file.
    pub fn of(path: &Path) -> Result<Self, RevisionError> {
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.ok_or_else(|| RevisionError::NoFileName(path.display().to_string()))?;
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        let (stem, ending) = name.rsplit_once('.').unwrap_or((name, "yaml"));
        // A revision names its family: `arm.rev3.yaml` is of `arm.yaml`.
        let stem = match stem.rsplit_once(".rev") {
            Some((original, number)) if number.parse::<u32>().is_ok() => original,
            _ => stem,
        };
        Ok(Self { folder, stem: stem.to_owned(), original: format!("{stem}.{ending}") })
    }

    fn path_of(&self, number: u32) -> PathBuf {
        match number {
            0 => self.folder.join(&self.original),
            number => self.folder.join(format!("{}.rev{number}.yaml", self.stem)),
        }
    }

    /// The file name of the original, which every revision is named after.
    pub fn original(&self) -> &str {
        &self.original
    }

    /// The newest revision's number; 0 if there is none.
    pub fn newest(&self) -> u32 {
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
        let numbers = names.filter_map(|name| {
            let rest = name.strip_prefix(&self.stem)?.strip_prefix(".rev")?;
            rest.strip_suffix(".yaml")?.parse::<u32>().ok()
        });
        numbers.max().unwrap_or(0)
    }

    /// The file that what names `path` works on: the newest revision where `path` is the original of a family, else `path` itself.
    pub fn newest_file(path: &Path) -> PathBuf {
        match Self::of(path) {
            Ok(family)
                if path.file_name().and_then(|name| name.to_str()) == Some(family.original.as_str()) =>
            {
                family.path_of(family.newest())
            }
            _ => path.to_path_buf(),
        }
    }

    /// One revision.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn entry(&self, number: u32) -> Result<Entry, RevisionError> {
        let path = self.path_of(number);
        let model = Model::read(&path)?;
        Ok(Entry { number, path, model })
    }

    /// What a command on `path` works on: the revision itself if the path names one, else the newest of the family.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn resolve(path: &Path) -> Result<Entry, RevisionError> {
        let family = Self::of(path)?;
        let named = path.file_name().and_then(|name| name.to_str()) != Some(family.original.as_str());
        if named {
            let model = Model::read(path)?;
            let number = model.revision.as_ref().map_or(0, |revision| revision.number);
            return Ok(Entry { number, path: path.to_path_buf(), model });
        }
        family.entry(family.newest())
    }

    /// Writes `model` as the next revision; `parent` is the one an undo goes back to, `did` what was done.
    ///
    /// # Errors
    /// The file cannot be written; an existing one is never touched.
    pub fn write(
        &self,
        mut model: Model,
        parent: Option<u32>,
        did: &str,
        data: Option<&str>,
        rms: Option<RmsError>,
    ) -> Result<Entry, RevisionError> {
        // Numbers are never used twice, though an undo goes back.
        let number = self.newest() + 1;
        let path = self.path_of(number);
        model.revision = Some(Revision {
            number,
            of: self.original.clone(),
            did: did.to_owned(),
            data: data.map(str::to_owned),
            parent,
            rms,
        });
        // Made anew or not at all: what wrote the same number a moment ago keeps it.
        std::fs::File::create_new(&path)
            .and_then(|mut file| std::io::Write::write_all(&mut file, model_text(&model).as_bytes()))
            .map_err(|source| RevisionError::File { path: path.display().to_string(), source })?;
        Ok(Entry { number, path, model })
    }

    /// All revisions, the original first.
    ///
    /// # Errors
    /// One of them cannot be read.
    pub fn history(&self) -> Result<Vec<Entry>, RevisionError> {
        // Somebody may have deleted a revision in the middle.
        let numbers = (0..=self.newest()).filter(|number| *number == 0 || self.path_of(*number).exists());
        numbers.map(|number| self.entry(number)).collect()
    }

    /// Takes the last change back: writes what was before it as the next revision.
    ///
    /// # Errors
    /// Nothing was changed yet, or files cannot be read or written.
    pub fn undo(&self) -> Result<Entry, RevisionError> {
        let newest = self.newest();
        let current = self.entry(newest)?;
        let parent = current.model.revision.as_ref().and_then(|revision| revision.parent);
        let (Some(parent), Some(revision)) = (parent, current.model.revision.as_ref()) else {
            return Err(RevisionError::NothingToUndo(self.path_of(0).display().to_string()));
        };
        let before = self.entry(parent)?;
        let did = format!("undo: {}", revision.did);
        // Undoing once more goes back from where this content came from.
        match before.model.revision.clone() {
            Some(old) => self.write(before.model, old.parent, &did, old.data.as_deref(), old.rms),
            None => self.write(before.model, None, &did, None, None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::reading_unit::ReadingUnit;

    const ARM: &str =
        "arm: arm\nconvention: distal\njoints: [{name: one, a_mm: 100}]\ntargets: {p1: {}}\neffects: []\n";

    fn family() -> (tempfile::TempDir, Family) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("arm.yaml");
        std::fs::write(&file, ARM).unwrap();
        let family = Family::of(&file).unwrap();
        (folder, family)
    }

    /// Adds an effect as the next revision.
    fn add(family: &Family, effect: &str) -> Entry {
        let newest = family.newest();
        let mut model = family.entry(newest).unwrap().model;
        model.free.push(effect.to_owned());
        family
            .write(
                model,
                Some(newest),
                &format!("add {effect}"),
                Some("table.csv"),
                Some(RmsError { value: 0.5, unit: ReadingUnit::Mm }),
            )
            .unwrap()
    }

    fn free(entry: &Entry) -> String {
        entry.model.free.join(" ")
    }

    #[test]
    fn the_original_means_its_newest_revision_and_a_revision_itself() {
        let (folder, family) = family();
        let original = folder.path().join("arm.yaml");
        assert_eq!((family.newest(), Family::resolve(&original).unwrap().number), (0, 0));
        add(&family, "joint_zero(one)");
        add(&family, "link_length(one)");
        let newest = Family::resolve(&original).unwrap();
        assert_eq!((newest.number, free(&newest)), (2, "joint_zero(one) link_length(one)".to_owned()));
        let first = Family::resolve(&folder.path().join("arm.rev1.yaml")).unwrap();
        assert_eq!((first.number, free(&first)), (1, "joint_zero(one)".to_owned()));
        assert_eq!(Family::newest_file(&original), folder.path().join("arm.rev2.yaml"));
        let named = folder.path().join("arm.rev1.yaml");
        assert_eq!(Family::newest_file(&named), named);
        assert_eq!(Family::of(&named).unwrap().newest(), 2, "a revision knows its family");
        assert_eq!(std::fs::read_to_string(original).unwrap(), ARM, "the original is never touched");
    }

    #[test]
    fn an_undo_is_a_new_revision_and_goes_back_one_change_a_time() {
        let (_folder, family) = family();
        add(&family, "joint_zero(one)");
        add(&family, "link_length(one)");
        let once = family.undo().unwrap();
        assert_eq!((once.number, free(&once)), (3, "joint_zero(one)".to_owned()));
        let twice = family.undo().unwrap();
        assert_eq!((twice.number, free(&twice)), (4, String::new()));
        let nothing = family.undo().unwrap_err().to_string();
        assert!(nothing.contains("there is nothing to undo"), "{nothing}");
        let did: Vec<String> = family
            .history()
            .unwrap()
            .into_iter()
            .filter_map(|entry| Some(entry.model.revision?.did))
            .collect();
        assert_eq!(did.len(), 4);
        assert_eq!((did[0].as_str(), did[2].as_str()), ("add joint_zero(one)", "undo: add link_length(one)"));
    }

    #[test]
    fn a_file_of_another_name_is_no_revision_and_a_folder_no_model() {
        let (folder, family) = family();
        std::fs::write(folder.path().join("arm.revised.yaml"), ARM).unwrap();
        std::fs::write(folder.path().join("other.rev7.yaml"), ARM).unwrap();
        assert_eq!(family.newest(), 0);
        assert!(matches!(Family::of(Path::new("/")), Err(RevisionError::NoFileName(_))));
        assert!(matches!(Family::resolve(&folder.path().join("none.yaml")), Err(RevisionError::Model(_))));
    }
}
