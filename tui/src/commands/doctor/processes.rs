//! Worlds and hosts that nobody looks after.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use plumb_cell::device::{CellResources, Occupancy};

use super::finding::Finding;

const TOPIC: &str = "processes";

/// How long the hosts of a killed program may take to put their devices away.
pub(super) const PUTTING_AWAY: Duration = Duration::from_secs(10);

/// How often it is looked whether they have.
pub(super) const LOOK: Duration = Duration::from_millis(20);

/// One process of this program.
struct Process {
    number: u32,
    parent: u32,
    arguments: Vec<String>,
}

pub(super) fn look() -> Vec<Finding> {
    let of_cells: Vec<PathBuf> = CellResources::all().iter().map(CellResources::world_socket).collect();
    let runs_somewhere =
        CellResources::all().iter().any(|resources| matches!(resources.state(), Occupancy::InUse(_)));
    let mut findings = Vec::new();
    for process in settled_processes() {
        match process.arguments.get(1).map(String::as_str) {
            Some(_) if process.is_lone_host() => findings.push(Finding::wrong(
                TOPIC,
                format!(
                    "process {}: the host of a device, without the program that started it",
                    process.number
                ),
                format!(
                    "it ends by itself once its device is put away; if it does not: kill {}",
                    process.number
                ),
            )),
            Some("world") if !of_cells.iter().any(|socket| process.names(socket)) => findings.push(
                Finding::note(TOPIC, format!("process {}: a simulated world of no cell", process.number))
                    .mend(format!("one that was started by hand is right; else: kill {}", process.number)),
            ),
            _ => {}
        }
    }
    if findings.is_empty() {
        let text = if runs_somewhere {
            "all belong to cells that run"
        } else {
            "no hosts and no worlds without a cell"
        };
        findings.push(Finding::good(TOPIC, text));
    }
    findings
}

impl Process {
    /// It is the host of a device, and the program that started it has gone.
    fn is_lone_host(&self) -> bool {
        self.parent == 1 && self.arguments.get(1).is_some_and(|command| command == "host")
    }

    fn names(&self, path: &Path) -> bool {
        self.arguments.iter().any(|argument| Path::new(argument) == path)
    }
}

/// The living processes of this program, once hosts of a killed one have had the time to put their devices away.
fn settled_processes() -> Vec<Process> {
    let begin = Instant::now();
    loop {
        let processes = processes();
        if begin.elapsed() >= PUTTING_AWAY || !processes.iter().any(Process::is_lone_host) {
            return processes;
        }
        std::thread::sleep(LOOK);
    }
}

/// The living processes of this program.
fn processes() -> Vec<Process> {
    let Ok(entries) = fs::read_dir("/proc") else { return Vec::new() };
    let numbers = entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    numbers.filter_map(process).collect()
}

fn process(number: u32) -> Option<Process> {
    let line = fs::read(format!("/proc/{number}/cmdline")).ok()?;
    let arguments: Vec<String> =
        line.split(|byte| *byte == 0).map(|word| String::from_utf8_lossy(word).into_owned()).collect();
    let program = Path::new(arguments.first()?).file_name()?;
    let state = fs::read_to_string(format!("/proc/{number}/stat")).ok()?;
    let parent = state.rsplit_once(") ")?.1.split_whitespace().nth(1)?.parse().ok()?;
    (program == "plumb").then_some(Process { number, parent, arguments })
}
