//! What goes over a line, recorded between a program and a device, and played in place of the device.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]
#![allow(dead_code, reason = "a part of what the tests of runs share")]

#[path = "run/lab.rs"]
mod lab;

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Instant;

use plumb_simulated::client::WorldClient;

use lab::{CommandOutput, Lab, PATIENCE};

/// A process with a port on its first line, asked to end by `quit`.
struct Process {
    child: Child,
    port: PathBuf,
}

impl Process {
    fn start(lab: &Lab, arguments: &[&str]) -> Self {
        let mut command = lab.command(arguments);
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut first = String::new();
        BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut first).unwrap();
        assert!(!first.trim().is_empty(), "{arguments:?} has a port");
        Self { child, port: PathBuf::from(first.trim()) }
    }

    /// Asks it to end, and waits for that.
    fn quit(mut self) {
        writeln!(self.child.stdin.as_mut().unwrap(), "quit").unwrap();
        assert!(self.child.wait().unwrap().success());
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The cell of an SO-101 on real hardware, and what went over its bus while every joint moved a little.
fn recorded_so101() -> Lab {
    let lab = Lab::of("so101");
    let servos = Process::start(&lab, &["emulate", "feetech"]);
    let port = servos.port.display().to_string();
    let recorder = Process::start(&lab, &["wire", "record", &port, "--baud", "1000000", "-o", "arm.wire"]);
    lab.edit("cell-hardware.yaml", "procedures: [", "answers: answers.yaml\nprocedures: [");
    // A servo that a busy machine keeps from answering is asked again, which is not in the record.
    let patient = "full_speed_deg_per_s: 120\n      reply_within_ms: 500";
    lab.edit("cell-hardware.yaml", "full_speed_deg_per_s: 20", patient);
    let line = format!("arm={}", recorder.port.display());
    let output = lab.plumb(&["run", "cell-hardware.yaml", "first-moves", "--headless", "--port", &line]);
    assert_eq!(output.code(), 0, "{}", output.all());
    recorder.quit();
    servos.quit();
    lab
}

fn replay(lab: &Lab, more: &[&str]) -> CommandOutput {
    lab.plumb(&[&["wire", "replay", "arm.wire", "cell-hardware.yaml"], more].concat())
}

#[test]
fn a_recorded_bus_plays_instead_of_the_servos_and_shows_where_something_else_is_sent() {
    let lab = recorded_so101();
    let text = std::fs::read_to_string(lab.path("arm.wire")).unwrap();
    assert!(text.starts_with("# plumb wire 1: /dev/") && text.contains(" > ff ff fe "), "{}", &text[..200]);
    let output = replay(&lab, &[]);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(output.out().contains("\nAS THEN\n"), "{}", output.out());
    // Another speed is another goal's block of registers: the first move differs, and nothing is answered after it.
    lab.edit("cell-hardware.yaml", "full_speed_deg_per_s: 120", "full_speed_deg_per_s: 60");
    let output = replay(&lab, &[]);
    assert_eq!(output.code(), 1, "{}", output.all());
    let line =
        output.out().lines().find(|line| line.starts_with("DIFFERS: line ")).unwrap_or_default().to_owned();
    assert!(
        line.contains(" of the transcript, turn ") && line.contains("it sent ff ff fe "),
        "{line:?} in {}",
        output.all()
    );
    // A procedure that sends less.
    lab.edit("cell-hardware.yaml", "full_speed_deg_per_s: 60", "full_speed_deg_per_s: 120");
    let longer = format!("{text}> ff ff 01 02 01 fb\n< ff ff 01 02 00 fc\n");
    lab.write("arm.wire", &longer);
    let output = replay(&lab, &[]);
    assert_eq!(output.code(), 1, "{}", output.all());
    assert!(output.out().contains("SHORTER: what was sent is as then"), "{}", output.out());
}

#[test]
fn the_log_of_a_terminal_is_played_to_the_driver_of_a_teachmover() {
    let lab = Lab::new();
    let socket = lab.path("world.socket");
    let mut world = lab
        .command(&["world", "--file", "world-ideal.yaml", "--pace", "fast", "--socket"])
        .arg(&socket)
        .spawn()
        .unwrap();
    until_it_listens(&socket);
    let path = socket.display().to_string();
    let arm = Process::start(&lab, &["emulate", "teachmover", "--as-fast-as-possible", "--world", &path]);
    let port = arm.port.display().to_string();
    let recorder = Process::start(&lab, &["wire", "record", &port, "-o", "arm.wire"]);
    lab.write("small.yaml", "procedure: small\ntitle: A small move\nsteps:\n  - {id: out, do: {move: {robot: arm, by_deg: {waist: 3}, speed: 0.5}}}\n");
    lab.edit("cell-hardware.yaml", "  - procedures/first-day.yaml", "  - small.yaml");
    let line = format!("arm={}", recorder.port.display());
    let output = lab.plumb(&["run", "cell-hardware.yaml", "small", "--headless", "--port", &line]);
    recorder.quit();
    arm.quit();
    world.kill().unwrap();
    world.wait().unwrap();
    assert_eq!(output.code(), 0, "{}", output.all());
    let text = std::fs::read_to_string(lab.path("arm.wire")).unwrap();
    assert!(text.contains(" > \"@READ\\r\""), "{text}");
    let output = replay(&lab, &["small"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    // An owner's log in which the arm was commanded another thing: where and what.
    let step = text.lines().position(|line| line.contains("> \"@STEP")).unwrap() + 1;
    let other = text.replacen("> \"@STEP ", "> \"@STEP 9", 1);
    lab.write("arm.wire", &other);
    let output = replay(&lab, &["small"]);
    assert_eq!(output.code(), 1, "{}", output.all());
    assert!(output.out().contains(&format!("DIFFERS: line {step} of the transcript")), "{}", output.out());
    assert!(output.out().contains("it sent \"@STEP 9"), "{}", output.out());
}

fn until_it_listens(socket: &Path) {
    let begin = Instant::now();
    while WorldClient::connect(socket, "test").is_err() {
        assert!(begin.elapsed() < PATIENCE, "the world listens");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
}

#[test]
fn what_cannot_be_recorded_or_played_is_refused_with_what_would_be_right() {
    let lab = Lab::of("so101");
    lab.write("bad.wire", "> \"@READ\\r\"\nfoo\n");
    for (arguments, words) in [
        (
            &["wire", "replay", "bad.wire", "cell-hardware.yaml"][..],
            "bad.wire, line 2: it has neither `>` nor `<`; write `TIME > BYTES`",
        ),
        (&["wire", "replay", "none.wire"][..], "the transcript none.wire cannot be read"),
        (
            &["wire", "replay", "good.wire", "cell.yaml"][..],
            "cell `so101` has no device with a port that a transcript could stand in for",
        ),
        (
            &["wire", "record", "/dev/ttyACM-none", "-o", "new.wire"][..],
            "/dev/ttyACM-none: there is no such port",
        ),
        (
            &["run", "cell-hardware.yaml", "--headless", "--port", "arn=/dev/null"][..],
            "has no device `arn` with a port of its own: did you mean `arm`?",
        ),
        (
            &["run", "cell-hardware.yaml", "--headless", "--port", "arm"][..],
            "write DEVICE=PORT, as in arm=/dev/ttyUSB1",
        ),
    ] {
        lab.write("good.wire", "> \"@READ\\r\"\n");
        let output = lab.plumb(arguments);
        assert_eq!(output.code(), 2, "{arguments:?}: {}", output.all());
        assert!(output.err().contains(words), "{arguments:?}: {}", output.err());
    }
    let servos = Process::start(&lab, &["emulate", "feetech"]);
    let output = lab.plumb(&["wire", "record", &servos.port.display().to_string(), "-o", "good.wire"]);
    assert_eq!(output.code(), 2, "what is there is not overwritten: {}", output.all());
    assert!(output.err().contains("good.wire cannot be written"), "{}", output.err());
}

#[test]
fn a_run_that_ends_before_it_sends_anything_is_not_said_to_have_sent_the_same() {
    let lab = Lab::new();
    lab.write("arm.wire", "0.00 > \"@READ\\r\"\n0.05 < \"1\\r0,0,0,0,0,0,0\\r\"\n");
    // Its first procedure asks an operator.
    let output = replay(&lab, &[]);
    assert_eq!(output.code(), 1, "{}", output.all());
    assert!(output.err().contains("this needs an operator"), "{}", output.all());
    assert!(output.out().contains("NOTHING SENT") && !output.out().contains("SHORTER"), "{}", output.out());
}
