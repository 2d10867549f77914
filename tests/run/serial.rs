//! The cell for a real arm, with its port leading to an emulated controller over the arm of a world: whatever befalls the line.

use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::os::fd::AsRawFd as _;
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use nix::pty::{OpenptyResult, openpty};
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;
use plumb_teachmover::reply_line::ReplyLine;

use crate::lab::{CommandOutput, Lab, PATIENCE, Running};

/// Half-steps for a degree, and the true zeros: waist, shoulder, elbow.
const ZEROS: [(&str, f64, f64); 3] =
    [("waist", 1.7, 7072.0 / 360.0), ("shoulder", -2.4, 7072.0 / 360.0), ("elbow", 1.3, 4158.0 / 360.0)];

/// A world, a controller of its arm, and the cell for real hardware at the other end of the line.
struct Bench {
    lab: Lab,
    world: Child,
    emulator: Child,
    socket: PathBuf,
}

impl Bench {
    /// In no more time than it takes, with a driver that waits long for a machine that has other work.
    fn new() -> Self {
        Self::with_driver("full_speed_code: 220, reply_within_ms: 10000")
    }

    fn with_driver(config: &str) -> Self {
        let lab = Lab::new();
        // Nothing reads a spirit level on a real arm: an operator writes what it shows.
        lab.edit("answers.yaml", "level: offered", "level: 0");
        let (socket, port) = (lab.path("world.socket"), lab.path("port"));
        let world = lab
            .command(&["world", "--file", "world-ideal.yaml", "--pace", "fast", "--socket"])
            .arg(&socket)
            .spawn()
            .unwrap();
        until("the world's socket", || WorldClient::connect(&socket, "test").is_ok());
        let mut command = lab.command(&["emulate", "teachmover", "--world"]);
        command.arg(&socket).arg("--link").arg(&port);
        command.arg("--as-fast-as-possible");
        let mut emulator =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut first = String::new();
        BufReader::new(emulator.stdout.as_mut().unwrap()).read_line(&mut first).unwrap();
        assert!(!first.trim().is_empty(), "the controller has a port");
        lab.edit("cell-hardware.yaml", "/dev/ttyUSB0", &port.display().to_string());
        // The world's controller counts from where it believes the arm to be straight out.
        let zero = "      registers_zero: {waist_deg: 8, shoulder_deg: 41, elbow_deg: -78, wrist_pitch_deg: -90, wrist_roll_deg: 0, gripper_mm: 20}\n";
        lab.edit("cell-hardware.yaml", zero, "");
        lab.edit("cell-hardware.yaml", "full_speed_code: 100", &config.replace(", ", "\n      "));
        Self { lab, world, emulator, socket }
    }

    /// Something befalls the controller.
    fn befalls(&mut self, line: &str) {
        writeln!(self.emulator.stdin.as_mut().unwrap(), "{line}").unwrap();
    }

    fn arguments(&self) -> [&'static str; 5] {
        ["run", "cell-hardware.yaml", "initialize", "--answers", "answers.yaml"]
    }

    fn run(&self) -> CommandOutput {
        self.lab.plumb(&[&self.arguments()[..], &["--headless"]].concat())
    }

    fn start(&self) -> Running {
        self.lab.start(&self.arguments())
    }

    fn resume(&self) -> CommandOutput {
        self.lab.plumb(&["run", "--resume", "--headless"])
    }

    /// Where the motors are, half-steps.
    fn registers(&self) -> [i64; 6] {
        let mut client = WorldClient::connect(&self.socket, "test").unwrap();
        client
            .read(WorldCommand::Read {})
            .unwrap()
            .half_steps
            .fixed::<6>()
            .unwrap()
            .map(|count| count.round() as i64)
    }

    fn assert_zeros_found(&self, run: &str) {
        let zeros = self.lab.zeros(run);
        for (joint, truth, half_steps_per_degree) in ZEROS {
            let found = zeros.iter().find(|(name, _)| name == joint).map_or(f64::NAN, |(_, value)| *value);
            assert!(
                (found - truth).abs() * half_steps_per_degree <= 1.0,
                "{joint}: found {found}, true {truth}"
            );
        }
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
        let _ = self.world.kill();
        let _ = self.world.wait();
    }
}

fn until(what: &str, mut so: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !so() {
        assert!(begin.elapsed() < PATIENCE, "{what} did not come");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn the_cell_for_a_real_arm_initializes_what_is_behind_its_port() {
    let bench = Bench::new();
    let run = bench.run();
    assert_eq!(run.code(), 0, "{}", run.all());
    bench.assert_zeros_found("1");
}

#[test]
fn the_cell_for_a_real_arm_begins_with_the_first_day_and_asks_a_person() {
    let bench = Bench::new();
    let before = bench.registers();
    let run = bench.lab.plumb(&["run", "cell-hardware.yaml"]);
    assert_eq!(run.code(), 4, "{}", run.all());
    assert!(run.err().contains("no answers"), "{}", run.err());
    assert_eq!(bench.registers(), before);
}

/// A damaged byte of a reading is read again. One of a move's reply ends the run before another move; so does one of a command that the controller
/// understood otherwise or not at all. Then a resumed run finds what an undisturbed one finds.
#[test]
fn whatever_happens_to_one_byte_the_run_ends_well_or_says_why_and_goes_on_when_resumed() {
    let (mut mended, mut ended) = (0, 0);
    for fault in [
        "drop from-arm 300",
        "drop from-arm 1000",
        "double from-arm 301",
        "garble from-arm 302",
        "garble from-arm 1003",
        "late:6000 from-arm 304",
        "drop to-arm 400",
        "double to-arm 417",
        "garble to-arm 429",
        "late:6000 to-arm 403",
    ] {
        // What is late is later than the driver waits; and it waits longer than a busy machine may hold back a byte of a pseudo-terminal, for a reply that comes late for that reason
        // is out of step as well.
        let mut bench = Bench::with_driver("full_speed_code: 220, reply_within_ms: 4000");
        bench.befalls(&format!("fault {fault}"));
        let run = bench.run();
        match run.code() {
            0 => mended += 1,
            2 => {
                ended += 1;
                let output = run.all();
                assert!(
                    output.contains("the reply to @") || output.contains("the controller "),
                    "{fault}: {output}"
                );
                let resumed = bench.resume();
                assert_eq!(resumed.code(), 0, "{fault}: {output}\n{}", resumed.all());
            }
            code => panic!("{fault}: {code} {}", run.all()),
        }
        bench.assert_zeros_found("1");
    }
    assert!(mended > 0 && ended > 0, "{mended} mended, {ended} ended");
}

#[test]
fn an_arm_unplugged_in_mid_move_ends_the_run_and_a_resumed_run_finds_it_again() {
    let mut bench = Bench::new();
    bench.befalls("unplug-after 5");
    let (last, code) = bench.start().end();
    assert_eq!(code, Some(2), "{last}");
    let message = last["message"].as_str().unwrap();
    assert!(
        message.contains("the port is gone") && message.contains("check that the adapter is plugged in"),
        "{message}"
    );
    let missing = bench.resume();
    assert_eq!(missing.code(), 2, "{}", missing.all());
    assert!(missing.all().contains("there is no such port"), "{}", missing.all());
    bench.befalls("plug");
    until("the port", || bench.lab.path("port").exists());
    let resumed = bench.resume();
    assert_eq!(resumed.code(), 0, "{}", resumed.all());
    bench.assert_zeros_found("1");
}

#[test]
fn stop_on_the_pendant_in_mid_move_is_a_stop_and_no_error() {
    let mut bench = Bench::new();
    bench.befalls("stop-after 5");
    let mut running = bench.start();
    let stopped = running.until(|event| event["event"] == "stopped");
    let reason = stopped["reason"].as_str().unwrap();
    assert!(
        reason.contains("the STOP key on the pendant ended the move; the arm is at waist 9.3 deg"),
        "{reason}"
    );
    let (last, code) = running.end();
    let halted = bench.registers();
    assert_eq!(code, Some(4), "somebody has to look at the arm: {last}");
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(bench.registers(), halted, "nothing moves after a stop");
    let resumed = bench.resume();
    assert_eq!(resumed.code(), 0, "{}", resumed.all());
    bench.assert_zeros_found("1");
}

/// A cell whose port is at nobody's, or at somebody's who is no arm.
fn run_on_port(port: &str) -> CommandOutput {
    let lab = Lab::new();
    lab.edit("cell-hardware.yaml", "/dev/ttyUSB0", port);
    lab.plumb(&["run", "cell-hardware.yaml", "initialize", "--answers", "answers.yaml", "--headless"])
}

#[track_caller]
fn assert_refused(run: &CommandOutput, text: &str) {
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.all().contains(text), "{}", run.all());
    assert!(!run.out().contains("target:"), "no step began: {}", run.out());
    assert!(!run.out().contains("ended with code"), "one line says it: {}", run.out());
}

#[test]
fn a_port_that_is_not_there_is_named_with_what_to_check() {
    assert_refused(
        &run_on_port("/dev/ttyUSB77"),
        "cannot open the serial port /dev/ttyUSB77: there is no such port; check that the adapter is plugged in, and its name (ls /dev/serial/by-id)",
    );
}

#[test]
fn a_port_that_another_program_has_is_named_with_how_to_find_that() {
    let bench = Bench::new();
    let port = bench.lab.path("port").display().to_string();
    let before = bench.registers();
    let held = ReplyLine::open(&port, 9600).unwrap();
    let run = bench.run();
    assert_refused(&run, "another program has it open; end that program (fuser ");
    drop(held);
    assert_eq!(bench.registers(), before);
}

#[test]
fn a_port_that_says_nothing_is_named_with_what_to_check() {
    let pair = openpty(None, None).unwrap();
    assert_refused(
        &run_on_port(&name_of(&pair)),
        "nothing came within 1058 ms; check that the arm is switched on, the cable and the port it is plugged into, and the rate",
    );
}

#[test]
fn a_port_at_which_something_else_talks_is_named_with_what_to_check() {
    let pair = openpty(None, None).unwrap();
    let name = name_of(&pair);
    let talks = Arc::new(AtomicBool::new(true));
    let talker = {
        let (talks, mut end) = (Arc::clone(&talks), File::from(pair.master.try_clone().unwrap()));
        nix::fcntl::fcntl(&end, nix::fcntl::FcntlArg::F_SETFL(nix::fcntl::OFlag::O_NONBLOCK)).unwrap();
        std::thread::spawn(move || {
            while talks.load(Ordering::SeqCst) {
                let _ = end.write(b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M ");
                std::thread::sleep(Duration::from_millis(1));
            }
        })
    };
    let run = run_on_port(&name);
    talks.store(false, Ordering::SeqCst);
    talker.join().unwrap();
    assert_refused(&run, "check that the device is a TeachMover, and the rate");
}

fn name_of(pair: &OpenptyResult) -> String {
    let end = format!("/proc/self/fd/{}", pair.slave.as_raw_fd());
    std::fs::read_link(end).unwrap().display().to_string()
}

#[test]
fn a_sensor_on_a_gpio_chip_that_is_not_there_is_named_with_what_would_be_right() {
    let bench = Bench::new();
    let before = bench.registers();
    bench.lab.edit(
        "cell-hardware.yaml",
        "    inputs: {line: arm/inputs}\n",
        "    inputs: {joints: arm/joints}\n",
    );
    bench.lab.edit(
        "cell-hardware.yaml",
        "config: {bit: 0, active: high}",
        "config: {gpio: {chip: /dev/gpiochip9, line: 17}}",
    );
    let run = bench.run();
    assert_refused(&run, "there is no GPIO chip /dev/gpiochip9; ");
    assert_eq!(bench.registers(), before);
}
