//! A copy of a cell with a record of its own, so that tests do not share an arm.

#![allow(clippy::expect_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

use crate::plumb;
use crate::terminal::Session;

/// A copy of a cell's folder, and a record.
pub(crate) struct Bench {
    folder: TempDir,
}

impl Bench {
    /// The TeachMover's.
    pub(crate) fn new() -> Self {
        Self::of("teachmover")
    }

    /// That of a folder of `workcells`, with the models of arms beside it.
    pub(crate) fn of(cell: &str) -> Self {
        let folder = TempDir::new().expect("a folder for the cell");
        let workcells = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells");
        copy(&workcells.join(cell), &folder.path().join("cell"));
        copy(&workcells.join("arms"), &folder.path().join("arms"));
        Self { folder }
    }

    /// A file or folder beside the record.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Replaces a text in one of the cell's files.
    pub(crate) fn edit(&self, name: &str, from: &str, to: &str) {
        let path = self.path("cell").join(name);
        let text = fs::read_to_string(&path).expect("the cell can be read");
        assert!(text.contains(from), "{name} has `{from}`");
        fs::write(path, text.replace(from, to)).expect("the cell can be written");
    }

    pub(crate) fn run(&self, more: &[&str], columns: u16, rows: u16) -> Session {
        self.run_cell("cell.yaml", more, columns, rows)
    }

    pub(crate) fn run_cell(&self, cell: &str, more: &[&str], columns: u16, rows: u16) -> Session {
        let cell = self.path("cell").join(cell).display().to_string();
        let record = self.path("record").display().to_string();
        let mut arguments = vec!["run", &cell, "--record", &record, "--operator", "ada"];
        arguments.extend(more);
        Session::start(plumb(), &arguments, columns, rows)
    }
}

/// What a test left running is ended with it, once its program has gone.
impl Drop for Bench {
    fn drop(&mut self) {
        let files = fs::read_dir(self.path("cell")).into_iter().flatten().flatten();
        let files = files.map(|entry| entry.path());
        let is_cell =
            |file: &PathBuf| file.file_name().is_some_and(|name| name.to_string_lossy().starts_with("cell"));
        let cells: Vec<PathBuf> = files.filter(is_cell).collect();
        let mut command = Command::new(plumb());
        command.args(["doctor", "--clean", "--record"]).arg(self.path("record")).args(cells);
        drop(command.stdout(Stdio::null()).status());
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder can be made");
    for entry in fs::read_dir(from).expect("the cell can be read") {
        let entry = entry.expect("the cell can be read");
        let to = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &to);
        } else {
            fs::copy(entry.path(), to).expect("a file can be copied");
        }
    }
}
