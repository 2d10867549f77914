//! An SO-101 as its user has it: a cell over the bus of its servos, emulated, and the calibration of its zeros and directions.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]
#![allow(dead_code, reason = "a part of what the tests of runs share")]

#[path = "run/lab.rs"]
mod lab;

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::PathBuf;
use std::process::{Child, ChildStdout, Stdio};
use std::time::Instant;

use plumb_simulated::client::WorldClient;
use serde_json::{Value, json};

use lab::{CommandOutput, Lab, PATIENCE};

/// By how much the joints of the shipped world are beyond what their servos count, deg.
const ZERO_ERRORS: [(&str, f64); 5] = [
    ("shoulder_pan", 0.0),
    ("shoulder_lift", 0.0),
    ("elbow_flex", 14.4),
    ("wrist_flex", -9.3),
    ("wrist_roll", 0.0),
];
/// The joint whose servo is reversed in that world.
const REVERSED: &str = "shoulder_lift";
/// What inclinometer and ruler leave open, deg.
const SEEN_WITHIN: f64 = 0.45;

/// The servos as a process of their own, and the cell for real hardware at the other end of the line.
struct Arm {
    lab: Lab,
    world: Child,
    servos: Child,
    output: BufReader<ChildStdout>,
}

impl Arm {
    fn new() -> Self {
        let lab = Lab::of("so101");
        let (socket, port) = (lab.path("world.socket"), lab.path("port"));
        let mut world = lab.command(&["world", "--file", "world.yaml", "--pace", "fast", "--socket"]);
        let world = world.arg(&socket).stderr(Stdio::null()).spawn().unwrap();
        let begin = Instant::now();
        while WorldClient::connect(&socket, "test").is_err() {
            assert!(begin.elapsed() < PATIENCE, "the world listens");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let mut servos =
            lab.command(&["emulate", "feetech", "--reversed", "2", "--as-fast-as-possible", "--world"]);
        servos.arg(&socket).arg("--link").arg(&port);
        let mut servos =
            servos.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let output = BufReader::new(servos.stdout.take().unwrap());
        let mut arm = Self { lab, world, servos, output };
        assert!(!arm.line().is_empty(), "the servos have a port");
        arm.lab.edit("cell-hardware.yaml", "/dev/ttyACM0", &port.display().to_string());
        arm.lab.edit(
            "cell-hardware.yaml",
            "settles_within_steps: 4",
            "settles_within_steps: 1\n      reply_within_ms: 500",
        );
        arm.lab.edit("cell-hardware.yaml", "procedures: [", "answers: read.yaml\nprocedures: [");
        arm.lab.write("read.yaml", &read_by_the_operator());
        arm
    }

    /// Something befalls the servos.
    fn befalls(&mut self, line: &str) {
        writeln!(self.servos.stdin.as_mut().unwrap(), "{line}").unwrap();
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        line.trim().to_owned()
    }

    fn run(&self, procedure: &str) -> CommandOutput {
        self.lab.plumb(&["run", "cell-hardware.yaml", procedure, "--headless"])
    }

    /// Where the joints truly are, deg.
    fn joints_deg(&self) -> [f64; 5] {
        let mut client = WorldClient::connect(&self.lab.path("world.socket"), "test").unwrap();
        client.look().unwrap().attitudes.fixed::<5>().unwrap().map(f64::to_degrees)
    }

    fn calibration(&self) -> PathBuf {
        self.lab.path("so101.calibration.json")
    }
}

/// What inclinometer and ruler show at the three poses, worked out from the drawing: the zeros of [`ZERO_ERRORS`]; every joint 15 degrees on, the reversed one 15 back; and
/// the pose at which it is verified.
fn read_by_the_operator() -> String {
    const POSES: [(&str, [f64; 6]); 4] = [
        ("first", [0.0, -14.4, -5.1, 0.0, 348.0, -0.4]),
        ("second", [15.0, -14.4, -20.1, -14.07, 295.9, -81.8]),
        ("proof.seen", [8.0, -12.0, 3.0, -9.99, 328.0, 67.9]),
        ("seen", [8.0, -12.0, 3.0, -9.99, 328.0, 67.9]),
    ];
    let mut text =
        "by: the operator\nanswers:\n  ready: done\n  zeros: accept\n  directions: accept\n".to_owned();
    for (pose, read) in POSES {
        for (instrument, shows) in ["upper_arm", "forearm", "hand", "jaws", "x", "y"].iter().zip(read) {
            text += &format!("  {pose}.{instrument}: {shows}\n");
        }
    }
    text
}

impl Drop for Arm {
    fn drop(&mut self) {
        for process in [&mut self.servos, &mut self.world] {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

/// The result of a step of the last run.
fn result(shown: &Value, step: &str) -> Value {
    let steps = shown["steps"].as_array().unwrap();
    steps.iter().find(|one| one["step"] == step).unwrap_or_else(|| panic!("no step {step}"))["result"].clone()
}

#[test]
fn the_cell_moves_through_its_servos_and_passes_unattended() {
    let lab = Lab::of("so101");
    let output = lab.plumb(&["run", "cell.yaml", "first-moves", "--headless"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(output.all().contains("gripper at 5."), "{}", output.all());
}

#[test]
fn two_zeros_and_a_direction_that_are_wrong_are_found_written_back_and_verified() {
    let lab = Lab::of("so101");
    let before = lab.plumb(&["run", "cell.yaml", "verify", "--headless"]);
    assert_eq!(before.code(), 1, "{}", before.all());
    assert!(
        before.all().contains("shoulder_lift is 16.0 degrees from where it says: run `calibrate`"),
        "{}",
        before.all()
    );
    // What `plumb run` does by itself: the first procedure, without anybody.
    let output = lab.plumb(&["run", "cell.yaml", "--headless"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let shown = lab.shown("2");
    let (first, turned, off) =
        (result(&shown, "zeros"), result(&shown, "turned"), result(&shown, "proof.off"));
    for (joint, error) in ZERO_ERRORS {
        let value =
            |of: &Value, key: String| of[key.as_str()].as_f64().unwrap_or_else(|| panic!("{key} in {of}"));
        let found = value(&first["joints"], format!("{joint}_deg"));
        assert!((found - error).abs() < SEEN_WITHIN, "{joint}: read as {found}, is at {error}");
        let way = value(&turned, format!("{joint}_deg"));
        let expected = if joint == REVERSED { -15.0 } else { 15.0 };
        assert!((way - expected).abs() < 2.0 * SEEN_WITHIN, "{joint} turned by {way}");
        let left = value(&off, format!("{joint}_deg"));
        assert!(left.abs() < SEEN_WITHIN, "{joint} is still {left} off");
    }
}

#[test]
fn what_was_calibrated_is_kept_by_servos_and_file_for_the_next_run() {
    let mut arm = Arm::new();
    let output = arm.run("calibrate");
    assert_eq!(output.code(), 0, "{}", output.all());
    let log = arm.lab.shown("1")["log"].to_string();
    assert!(log.contains("shoulder_lift: its servo counts the other way than it was taken to"), "{log}");
    let kept: Value = serde_json::from_str(&std::fs::read_to_string(arm.calibration()).unwrap()).unwrap();
    for (joint, _) in ZERO_ERRORS {
        assert_eq!(kept[joint]["drive_mode"], json!(u8::from(joint == REVERSED)), "{joint}: {kept}");
    }
    let elbow = kept["elbow_flex"]["homing_offset"].as_i64().unwrap();
    assert!((elbow + 164).abs() <= 5, "14.4 degrees are 164 steps: {elbow}");
    // The power of the arm goes and comes back; a new process verifies.
    arm.befalls("power off");
    arm.befalls("power on");
    let verified = arm.run("verify");
    assert_eq!(verified.code(), 0, "{}", verified.all());
    for (actual, reported) in arm.joints_deg().iter().zip([-12.0, -8.0, 20.0, -15.0, 10.0]) {
        assert!((actual - reported).abs() < 0.3, "{:?}", arm.joints_deg());
    }
    // Without the file the direction is what the cell file says, which is wrong.
    std::fs::remove_file(arm.calibration()).unwrap();
    arm.run("verify");
    assert!((arm.joints_deg()[1] - 8.0).abs() < 0.3, "{:?}", arm.joints_deg());
}

#[test]
fn a_servo_without_an_answer_ends_the_run_with_its_name_and_no_row() {
    let mut arm = Arm::new();
    arm.befalls("silent 4");
    arm.befalls("status");
    arm.line();
    let output = arm.run("first-moves");
    assert_eq!(output.code(), 2, "{}", output.all());
    assert!(output.all().contains("wrist_flex (servo 4) does not answer"), "{}", output.all());
    arm.befalls("answers 4");
    arm.befalls("power off");
    arm.befalls("status");
    arm.line();
    let output = arm.run("first-moves");
    assert_eq!(output.code(), 2, "{}", output.all());
    assert!(output.all().contains("none of the 6 servos answers on"), "{}", output.all());
}

/// Takes a row when a motor is warm.
const WARM: &str = "procedure: warm
title: What the motors report
steps:
  - {id: motors, do: {motors: {robot: arm}}, on_error: abort}
  - {id: row, do: {row: {robot: arm, p1_x_mm: 1, temperature_c: motors.hottest_c}}, when: motors.hottest_c > 45}
";

#[test]
fn a_procedure_reads_the_motors_goes_by_them_and_writes_them_down() {
    let mut arm = Arm::new();
    arm.lab.edit("cell-hardware.yaml", "procedures: [", "procedures: [warm.yaml, ");
    arm.lab.write("warm.yaml", WARM);
    let cool = arm.run("warm");
    assert_eq!(cool.code(), 0, "{}", cool.all());
    arm.befalls("celsius 3 52");
    arm.befalls("status");
    arm.line();
    let warm = arm.run("warm");
    assert_eq!(warm.code(), 0, "{}", warm.all());
    assert!(warm.all().contains("temperature 31.0 to 52.0 degC"), "{}", warm.all());
    assert!(warm.all().contains("voltage 7.4 V, the hottest is elbow_flex"), "{}", warm.all());

    let (cool, warm) = (arm.lab.shown("1"), arm.lab.shown("2"));
    assert_eq!(result(&cool, "motors")["hottest_c"], json!(31.0));
    let motors = result(&warm, "motors");
    let value = |name: &str| motors[name].as_f64().unwrap_or_else(|| panic!("{name} in {motors}"));
    assert_eq!((value("hottest_c"), value("elbow_flex_temperature_c")), (52.0, 52.0));
    assert_eq!((value("gripper_voltage_v"), value("shoulder_lift_load_percent")), (7.4, 6.0));
    let readings = warm["readings"].as_array().unwrap();
    let elbow = readings.iter().find(|reading| reading["name"] == "elbow_flex_temperature").unwrap();
    assert_eq!((&elbow["value"], &elbow["unit"]), (&json!(52.0), &json!("degC")));
    let uncertainty = elbow["uncertainty"].as_f64().unwrap();
    assert!((uncertainty - 1.0 / 12.0_f64.sqrt()).abs() < 1e-9, "a register of whole degrees: {uncertainty}");
    let shown = arm.lab.plumb(&["show", "2"]).out();
    assert!(shown.contains("elbow_flex_temperature"), "{shown}");
    let table = arm.lab.plumb(&["show", "2", "--table"]).out();
    let rows: Vec<Vec<&str>> =
        table.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').collect()).collect();
    let at = rows[0].iter().position(|column| *column == "temperature_c").unwrap();
    assert_eq!(rows[1][at].parse(), Ok(52.0), "{table}");
}

#[test]
fn a_robot_whose_plugin_does_not_report_motors_is_named_with_what_to_do() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "procedures: [", "procedures: [warm.yaml, ");
    lab.write("warm.yaml", WARM);
    let output = lab.plumb(&["run", "cell.yaml", "warm", "--headless"]);
    assert_eq!(output.code(), 2, "{}", output.all());
    let words = "arm: this device cannot read its motors. Its plugin `simulated` does not report motors: take the step out, or name a robot \
                 whose plugin has `read_motors`";
    assert!(output.all().contains(words), "{}", output.all());
}

#[test]
fn the_plugin_conforms_as_anybody_can_check() {
    let arm = Arm::new();
    let port = arm.lab.path("port").display().to_string();
    let joints = json!([{"name": "shoulder_pan", "servo": 1, "from_deg": -100, "to_deg": 100}, {"name": "gripper", "servo": 6, "from_deg": -10, "to_deg": 100}]);
    let config = json!({"port": port, "joints": joints, "reply_within_ms": 500}).to_string();
    let output = arm.lab.plumb(&["plugins", "check", "feetech", "--move", "--config", &config]);
    assert_eq!(output.code(), 0, "{}", output.all());
}

#[test]
fn mistakes_of_the_cell_file_are_shown_where_they_are() {
    let lab = Lab::of("so101");
    lab.edit("cell.yaml", "{name: gripper, servo: 6, from_deg: -10", "{name: gripper, servo: 600, from: -10");
    let output = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(output.code(), 2, "{}", output.all());
    for words in ["device `arm`", "servo", "600", "`from`", "from_deg"] {
        assert!(output.all().contains(words), "{words}: {}", output.all());
    }
    lab.edit("cell.yaml", "{name: gripper, servo: 600, from: -10", "{name: gripper, servo: 6, from_deg: -10");
    lab.edit("cell.yaml", "emulate: feetech --reversed 2", "emulate: feetech --revers 2");
    let output = lab.plumb(&["run", "cell.yaml", "first-moves", "--headless"]);
    assert_eq!(output.code(), 2, "{}", output.all());
    assert!(output.all().contains("unexpected argument '--revers'"), "{}", output.all());
    lab.edit("cell.yaml", "emulate: feetech --revers 2", "emulate: fetech");
    let output = lab.plumb(&["run", "cell.yaml", "first-moves", "--headless"]);
    assert!(
        output.all()
            .contains("there is no emulated controller `fetech`; there are `dobot`, `feetech`, `teachmover`, `universal-robots`, `val2`"),
        "{}",
        output.all()
    );
}
