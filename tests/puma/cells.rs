//! A user's folder of cells around the PUMA, and what a run in it said.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use plumb_simulated::world_file::{Described, read};
use serde_json::Value;

/// A user's folder of cells around the PUMA, with a world of its own.
pub(crate) struct Cells {
    folder: tempfile::TempDir,
}

impl Drop for Cells {
    /// Puts away the world that a run which can be resumed keeps.
    fn drop(&mut self) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(["doctor", "--clean", "--record", "record", "cell.yaml", "cell-serial.yaml"]);
        drop(command.current_dir(self.puma()).stdout(Stdio::null()).status());
    }
}

impl Cells {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells");
        for part in ["arms", "puma", "puma/procedures"] {
            let to = folder.path().join(part);
            std::fs::create_dir_all(&to).unwrap();
            for entry in std::fs::read_dir(from.join(part)).unwrap() {
                let entry = entry.unwrap().path();
                if entry.is_file() {
                    std::fs::copy(&entry, to.join(entry.file_name().unwrap())).unwrap();
                }
            }
        }
        Self { folder }
    }

    pub(crate) fn puma(&self) -> PathBuf {
        self.folder.path().join("puma")
    }

    /// Changes the world's file.
    pub(crate) fn change_world(&self, change: impl FnOnce(String) -> String) {
        let file = self.puma().join("world.yaml");
        let text = std::fs::read_to_string(&file).unwrap();
        std::fs::write(&file, change(text)).unwrap();
    }

    /// The errors of joints 2 to 6 in this world, deg.
    pub(crate) fn true_errors(&self) -> Vec<f64> {
        let Described::Arm(world) = read(&self.puma().join("world.yaml")).unwrap() else { panic!("no PUMA") };
        world.drawn_zero_error().iter().skip(1).map(|error| error.to_degrees()).collect()
    }

    /// Runs the program in the folder, and gives its exit code, what it said and what it complained of.
    pub(crate) fn plumb(&self, arguments: &[&str]) -> (Option<i32>, String, String) {
        let output = Command::new(env!("CARGO_BIN_EXE_plumb"))
            .args(arguments)
            .current_dir(self.puma())
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code(), text(&output.stdout), text(&output.stderr))
    }

    /// Writes a file of the folder.
    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.puma().join(name), text).unwrap();
    }

    /// Runs a procedure of a cell, and gives its exit code and events.
    pub(crate) fn run(&self, cell: &str, more: &[&str]) -> (Option<i32>, Vec<Value>, String) {
        let mut arguments = vec!["run", cell];
        arguments.extend(more);
        arguments.extend(["--headless", "--json", "--record", "record"]);
        let (code, events, printed) = self.plumb(&arguments);
        let events = events.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        (code, events, printed)
    }
}

/// A value that a step worked out.
pub(crate) fn value(events: &[Value], step: &str, name: &str) -> f64 {
    let finished = events.iter().find(|event| event["event"] == "step_finished" && event["step"] == step);
    let finished = finished.unwrap_or_else(|| panic!("no step {step} was finished"));
    let values = finished["values"].as_array().unwrap();
    let found = values.iter().find(|value| value["name"] == name);
    found
        .and_then(|value| value["value"].as_f64())
        .unwrap_or_else(|| panic!("{step} has no {name}: {values:?}"))
}

/// The errors that a pass found, and their standard errors, deg: joints 2 to 6.
pub(crate) fn found(events: &[Value], step: &str) -> Vec<(f64, f64)> {
    (2..=6)
        .map(|joint| {
            let of = |what: &str| value(events, step, &format!("{what}_{joint}"));
            (of("joint"), of("uncertainty"))
        })
        .collect()
}
