//! A copy of a cell to run in, so that tests do not meet.

use std::fs;
use std::io::{BufRead, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;

/// Nothing here takes nearly as long; what does hangs.
pub(crate) const PATIENCE: Duration = Duration::from_secs(120);

/// The program under test; the studies have one of their own, which starts the commands of `plumb` itself.
const PROGRAM: Option<&str> = match option_env!("CARGO_BIN_EXE_plumb") {
    None => option_env!("CARGO_BIN_EXE_plumb-studies"),
    plumb => plumb,
};

/// The folder `workcells` of the repository, from the package that holds the test.
fn workcells() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let found = package.ancestors().map(|folder| folder.join("workcells")).find(|folder| folder.is_dir());
    found.expect("the repository has a folder `workcells`")
}

/// Says that something was not tested. Not by `println!`: what that prints is shown of a test that fails alone.
#[allow(dead_code, reason = "not every test program that shares this file skips something")]
pub(crate) fn skipped(why: &str) {
    // Where nobody can be informed, nobody is.
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
}

/// A copy of the cell's files, and a record.
pub(crate) struct Lab {
    folder: TempDir,
}

impl Lab {
    /// The TeachMover's.
    pub(crate) fn new() -> Self {
        Self::of("teachmover")
    }

    /// That of a folder of `workcells`, with the models of arms beside it.
    pub(crate) fn of(cell: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let workcells = workcells();
        copy(&workcells.join(cell), &folder.path().join("cell"));
        copy(&workcells.join("arms"), &folder.path().join("arms"));
        if cell == "light-stripe" {
            // Its cell of the whole report uses the arm's procedures.
            copy(&workcells.join("puma"), &folder.path().join("puma"));
        }
        Self { folder }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join("cell").join(name)
    }

    /// Where the record lies that no command names.
    pub(crate) fn state(&self) -> PathBuf {
        self.folder.path().join("state/plumb")
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    /// Replaces a text in one of the files.
    pub(crate) fn edit(&self, name: &str, from: &str, to: &str) {
        let text = fs::read_to_string(self.path(name)).unwrap();
        assert!(text.contains(from), "{name} has `{from}`");
        self.write(name, &text.replace(from, to));
    }

    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(PROGRAM.expect("the program is built with its tests"));
        command.args(arguments).current_dir(self.path("."));
        command
            .env("XDG_STATE_HOME", self.folder.path().join("state"))
            .env("NO_COLOR", "1")
            .stdin(Stdio::null());
        command
    }

    pub(crate) fn plumb(&self, arguments: &[&str]) -> CommandOutput {
        CommandOutput(self.command(arguments).output().unwrap())
    }

    /// Starts a run that writes its events as lines of JSON.
    pub(crate) fn start(&self, arguments: &[&str]) -> Running {
        let mut child = self
            .command(arguments)
            .arg("--json")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap());
        Running { child, lines }
    }

    /// What `plumb show --json` says of a run.
    pub(crate) fn shown(&self, run: &str) -> Value {
        let printed = self.plumb(&["show", run, "--json"]);
        assert_eq!(printed.code(), 0, "{}", printed.err());
        serde_json::from_str(&printed.out()).unwrap()
    }

    /// The zeros that a run found: joint, value.
    pub(crate) fn zeros(&self, run: &str) -> Vec<(String, f64)> {
        let shown = self.shown(run);
        let corrections = shown["corrections"].as_array().unwrap();
        let applied = corrections.iter().filter(|one| !one["revision"].is_null());
        applied.map(|one| (one["place"].as_str().unwrap().to_owned(), one["new"].as_f64().unwrap())).collect()
    }

    /// The zeros of the ideal world were found.
    pub(crate) fn assert_zeros_found(&self, run: &str) {
        let zeros = self.zeros(run);
        for (joint, truth) in [("waist", 1.7), ("shoulder", -2.4), ("elbow", 1.3)] {
            let found = zeros.iter().find(|(name, _)| name == joint).map_or(f64::NAN, |(_, value)| *value);
            assert!((found - truth).abs() < 1e-3, "{joint}: found {found}, true {truth}");
        }
    }
}

/// What a test killed is removed with it: nothing of a cell outlives its folder.
impl Drop for Lab {
    fn drop(&mut self) {
        // Regular files alone: what a test put there may be a pipe, or a link to a device without end.
        let entries = fs::read_dir(self.path(".")).into_iter().flatten().flatten();
        let files = entries
            .filter(|entry| entry.file_type().is_ok_and(|form| form.is_file()))
            .map(|entry| entry.file_name())
            .filter(|name| name.to_string_lossy().ends_with(".yaml"));
        let is_cell = |name: &std::ffi::OsString| {
            let text = fs::read_to_string(self.path(&name.to_string_lossy())).unwrap_or_default();
            text.lines().any(|line| line.starts_with("cell: "))
        };
        let cells: Vec<_> = files.filter(is_cell).collect();
        let cleaned = self.command(&["doctor", "--clean"]).args(cells).stdout(Stdio::null()).status();
        drop(cleaned);
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            fs::copy(&path, &target).unwrap();
        }
    }
}

/// What a command had to say.
pub(crate) struct CommandOutput(Output);

impl CommandOutput {
    #[allow(dead_code, reason = "for the table of faults, which starts the program in other ways too")]
    pub(crate) fn of(output: Output) -> Self {
        Self(output)
    }

    pub(crate) fn code(&self) -> i32 {
        self.0.status.code().unwrap_or(-1)
    }

    pub(crate) fn out(&self) -> String {
        String::from_utf8_lossy(&self.0.stdout).into_owned()
    }

    pub(crate) fn err(&self) -> String {
        String::from_utf8_lossy(&self.0.stderr).into_owned()
    }

    pub(crate) fn all(&self) -> String {
        format!("{}{}", self.out(), self.err())
    }
}

/// A run that goes on.
pub(crate) struct Running {
    child: Child,
    lines: BufReader<ChildStdout>,
}

impl Running {
    pub(crate) fn process(&self) -> u32 {
        self.child.id()
    }

    /// The next event; none when the program has closed its output.
    pub(crate) fn event(&mut self) -> Option<Value> {
        let mut line = String::new();
        match self.lines.read_line(&mut line).unwrap() {
            0 => None,
            _ => Some(serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error}: {line}"))),
        }
    }

    /// The next event; none when the program has closed its output, perhaps in the middle of one.
    pub(crate) fn event_if_whole(&mut self) -> Option<Value> {
        let mut line = String::new();
        self.lines.read_line(&mut line).ok().filter(|length| *length > 0)?;
        serde_json::from_str(&line).ok()
    }

    /// Reads on to the first event that fits.
    pub(crate) fn until(&mut self, fits: impl Fn(&Value) -> bool) -> Value {
        let mut last = Value::Null;
        loop {
            let event =
                self.event().unwrap_or_else(|| panic!("the run ended first: {last} {}", self.message()));
            if fits(&event) {
                return event;
            }
            last = event;
        }
    }

    /// Reads on to a moment at which the arm moves in a step.
    pub(crate) fn until_moving_in(&mut self, step: &str) {
        self.until(|event| event["event"] == "step_started" && event["step"] == step);
        self.until(|event| event["event"] == "joints" && event["moving"] == true);
    }

    /// Reads to the end; the last event and the exit code (none after a signal).
    pub(crate) fn end(mut self) -> (Value, Option<i32>) {
        let mut last = Value::Null;
        while let Some(event) = self.event() {
            last = event;
        }
        let code = self.child.wait().unwrap().code();
        (last, code)
    }

    pub(crate) fn signal(&self, signal: nix::sys::signal::Signal) {
        send(self.process(), signal);
    }

    /// The process that hosts the plugin of this library.
    pub(crate) fn host_of(&self, library: &str) -> u32 {
        let begin = Instant::now();
        while begin.elapsed() < PATIENCE {
            let found = children_of(self.process()).into_iter().find(|process| {
                let maps = fs::read_to_string(format!("/proc/{process}/maps")).unwrap_or_default();
                maps.contains(library) && command_of(*process).contains("host")
            });
            if let Some(process) = found {
                return process;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("no host has loaded {library}");
    }

    pub(crate) fn hosts(&self) -> Vec<u32> {
        hosts_of(self.process())
    }

    fn message(&mut self) -> String {
        let mut text = String::new();
        if let Some(mut errors) = self.child.stderr.take() {
            let _ = std::io::Read::read_to_string(&mut errors, &mut text);
        }
        text
    }
}

/// The hosts that a program has started.
pub(crate) fn hosts_of(program: u32) -> Vec<u32> {
    children_of(program).into_iter().filter(|process| command_of(*process).contains(" host ")).collect()
}

/// The living processes whose command line names this.
pub(crate) fn processes_of(text: &str) -> Vec<u32> {
    let numbers =
        fs::read_dir("/proc").unwrap().filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    numbers.filter(|number| command_of(*number).contains(text)).collect()
}

fn children_of(process: u32) -> Vec<u32> {
    let mut children = Vec::new();
    let tasks = fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    for task in tasks {
        let listed = fs::read_to_string(task.path().join("children")).unwrap_or_default();
        children.extend(listed.split_whitespace().filter_map(|number| number.parse::<u32>().ok()));
    }
    children
}

pub(crate) fn command_of(process: u32) -> String {
    let line = fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
    String::from_utf8_lossy(&line).trim_end_matches('\0').replace('\0', " ")
}

pub(crate) fn kill(process: u32) {
    send(process, nix::sys::signal::Signal::SIGKILL);
}

/// Sends a process a signal.
pub(crate) fn send(process: u32, signal: nix::sys::signal::Signal) {
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(process.cast_signed()), signal).unwrap();
}

/// Waits for a process to be gone.
pub(crate) fn wait_gone(process: u32) {
    let begin = Instant::now();
    while Path::new(&format!("/proc/{process}")).exists() {
        let state = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        if state.contains(") Z ") {
            return;
        }
        assert!(begin.elapsed() < PATIENCE, "process {process} lives on");
        std::thread::sleep(Duration::from_millis(10));
    }
}
