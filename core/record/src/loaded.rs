//! What a run was made of: every file read, by its hash.

use rusqlite::{Transaction, params};
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use crate::error::During;
use crate::{Record, RecordError, RunId};

/// A file a run read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LoadedFile {
    /// What it was read as: `cell`, `procedure`, `model`, `answers`, `world`, `plugin`.
    pub role: String,
    /// Where it lay.
    pub path: String,
    /// Its SHA-256, hexadecimal.
    pub sha256: String,
    /// Its bytes, kept for text files.
    #[serde(skip)]
    pub content: Option<Vec<u8>>,
}

/// A library that is not the one that a cell ran with last.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChangedLibrary {
    /// Where it lies now.
    pub path: String,
    /// Its SHA-256 now, hexadecimal.
    pub sha256: String,
    /// The SHA-256 it had.
    pub before: String,
    /// The run that loaded it then.
    pub run: RunId,
}

/// SHA-256 of `bytes`, hexadecimal.
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Record {
    /// The files of a run, as they were.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn loaded(&self, run: RunId) -> Result<Vec<LoadedFile>, RecordError> {
        let mut statement = self
            .connection
            .prepare("SELECT role, path, sha256, content FROM loaded WHERE run = ?1 ORDER BY rowid")
            .during("read the files of a run")?;
        let rows = statement
            .query_map(params![run.0], |row| {
                Ok(LoadedFile {
                    role: row.get(0)?,
                    path: row.get(1)?,
                    sha256: row.get(2)?,
                    content: row.get(3)?,
                })
            })
            .during("read the files of a run")?;
        rows.collect::<Result<_, _>>().during("read the files of a run")
    }
}

impl Record {
    /// Those plugins' libraries among `files` that differ from what the cell last ran with. A run that ended before its devices were started ran with
    /// nothing. One that was never there before is not among them. Libraries are known by their file name: a program may be moved.
    ///
    /// # Errors
    /// When the record cannot be read.
    pub fn changed_libraries(
        &self,
        cell: &str,
        files: &[LoadedFile],
    ) -> Result<Vec<ChangedLibrary>, RecordError> {
        const WHAT: &str = "look for changed plugins";
        let mut statement = self
            .connection
            .prepare(
                "SELECT loaded.run, loaded.path, loaded.sha256 FROM loaded JOIN runs ON runs.id = loaded.run
                 WHERE loaded.role = 'plugin' AND runs.cell = ?1
                   AND EXISTS (SELECT 1 FROM plan WHERE plan.run = loaded.run)
                 ORDER BY loaded.run DESC, loaded.rowid",
            )
            .during(WHAT)?;
        let rows = statement
            .query_map(params![cell], |row| {
                Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?, row.get::<_, String>(2)?))
            })
            .during(WHAT)?;
        let known: Vec<(i64, String, String)> = rows.collect::<Result<_, _>>().during(WHAT)?;
        let changed = |file: &LoadedFile| {
            let name = library_name(&file.path)?;
            let (run, _, before) = known.iter().find(|(_, path, _)| library_name(path) == Some(name))?;
            (*before != file.sha256).then(|| ChangedLibrary {
                path: file.path.clone(),
                sha256: file.sha256.clone(),
                before: before.clone(),
                run: RunId(*run),
            })
        };
        Ok(files.iter().filter(|file| file.role == "plugin").filter_map(changed).collect())
    }
}

/// The file name of a library; none for a manifest, whose name every plugin shares. A driver's files may have any name: its folder's comes with it.
fn library_name(path: &str) -> Option<&str> {
    let name = path.rsplit('/').next().filter(|name| !name.ends_with(".yaml"))?;
    if name.ends_with(".so") {
        return Some(name);
    }
    let folder_begins =
        path[..path.len() - name.len()].trim_end_matches('/').rfind('/').map_or(0, |at| at + 1);
    path.get(folder_begins..)
}

pub(crate) fn insert(
    transaction: &Transaction<'_>,
    run: RunId,
    files: &[LoadedFile],
) -> rusqlite::Result<()> {
    for file in files {
        transaction.execute(
            "INSERT INTO loaded (run, role, path, sha256, content) VALUES (?1, ?2, ?3, ?4, ?5)",
            params![run.0, file.role, file.path, file.sha256, file.content],
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_hash_is_sha256() {
        assert_eq!(
            super::sha256_hex(b"abc"),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
        );
    }
}
