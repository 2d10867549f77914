//! `plumb emulate teachmover` as a user runs it: a process with a port, its input and its signals.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

const PATIENCE: Duration = Duration::from_secs(30);

struct Emulation {
    child: Child,
    output: BufReader<ChildStdout>,
    port: PathBuf,
}

impl Emulation {
    fn start(arguments: &[&str]) -> Emulation {
        let mut child = Command::new(env!("CARGO_BIN_EXE_plumb"))
            .args(["emulate", "teachmover"])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut output = BufReader::new(child.stdout.take().unwrap());
        let mut port = String::new();
        output.read_line(&mut port).unwrap();
        Emulation { child, output, port: PathBuf::from(port.trim()) }
    }

    fn type_line(&mut self, line: &str) {
        let input = self.child.stdin.as_mut().unwrap();
        writeln!(input, "{line}").unwrap();
    }

    fn read_line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        line.trim().to_owned()
    }

    /// Its exit code, once it has ended, and what it said on standard error.
    fn ended(mut self) -> (Option<i32>, String) {
        let deadline = Instant::now() + PATIENCE;
        while self.child.try_wait().unwrap().is_none() && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(5));
        }
        let code = self.child.try_wait().unwrap().and_then(|status| status.code());
        if code.is_none() {
            self.child.kill().unwrap();
        }
        let mut printed = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut printed).unwrap();
        (code, printed)
    }
}

fn converse(port: &Path, say: &str, length: usize) -> String {
    let mut port = File::options().read(true).write(true).open(port).unwrap();
    port.write_all(say.as_bytes()).unwrap();
    let mut heard = Vec::new();
    while heard.len() < length {
        let mut polled = [PollFd::new(port.as_fd(), PollFlags::POLLIN)];
        if poll(&mut polled, PollTimeout::try_from(PATIENCE).unwrap()).unwrap() == 0 {
            break;
        }
        let mut bytes = [0; 256];
        let count = port.read(&mut bytes).unwrap();
        heard.extend_from_slice(&bytes[..count]);
    }
    String::from_utf8(heard).unwrap()
}

#[test]
fn a_controller_on_a_bench_answers_and_takes_what_is_typed() {
    let mut emulation = Emulation::start(&["--as-fast-as-possible"]);
    emulation.type_line("stop-after 3");
    emulation.type_line("status");
    assert_eq!(emulation.read_line(), format!("{} registers 0,0,0,0,0,0 waiting", emulation.port.display()));
    assert_eq!(converse(&emulation.port, "@STEP 220,10,0,0,0,0,0\r", 2), "2\r");
    assert_eq!(converse(&emulation.port, "@READ\r", 19), "1\r3,0,0,0,0,0,1792\r");
    emulation.type_line("explode");
    emulation.type_line("quit");
    let (code, printed) = emulation.ended();
    assert_eq!(code, Some(0), "{printed}");
    assert!(printed.contains("(as fast as it can), driving motors on a bench"), "{printed}");
    assert!(printed.contains("`explode` is nothing that can happen to the arm"), "{printed}");
}

#[test]
fn sigterm_ends_it_cleanly_and_takes_its_link_away() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("arm");
    let emulation = Emulation::start(&["--link", link.to_str().unwrap()]);
    assert_eq!(std::fs::read_link(&link).unwrap(), emulation.port);
    assert_eq!(converse(&link, "@READ\r", 16), "1\r0,0,0,0,0,0,0\r");
    kill(Pid::from_raw(emulation.child.id() as i32), Signal::SIGTERM).unwrap();
    let (code, printed) = emulation.ended();
    assert_eq!(code, Some(0), "{printed}");
    assert!(std::fs::symlink_metadata(&link).is_err());
}

#[test]
fn what_cannot_be_is_refused_with_what_would_be_right() {
    for (arguments, text) in [
        (&["--baud", "19200"][..], "the controller's switches offer 110, 150, 300"),
        (&["--fault", "drop"], "`drop` is no fault of a line; write `KIND WAY N`"),
        (&["--fault-rate", "2"], "give a probability from 0 to 1"),
        (&["--world", "/nowhere/world"], "no world listens at /nowhere/world"),
    ] {
        let (code, printed) = Emulation::start(arguments).ended();
        assert_eq!(code, Some(2), "{printed}");
        assert!(printed.contains(text), "{printed}");
    }
}
