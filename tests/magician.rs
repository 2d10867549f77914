//! A Dobot Magician as its user has it: a cell over its serial line, emulated, whose angle sensors are off; and whatever befalls a run.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test that cannot go on fails")]
#![allow(dead_code, reason = "a part of what the tests of runs share")]

#[path = "run/lab.rs"]
mod lab;

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdout, Stdio};
use std::time::Instant;

use plumb_calibration::arm_model::Model;
use plumb_kinematics::LinkFrames;
use plumb_simulated::client::WorldClient;
use serde_json::json;

use lab::{CommandOutput, Lab, PATIENCE};

/// The true error of the reflector that `verify` measures, root mean square, mm.
fn true_error(lab: &Lab) -> f64 {
    let printed = lab.plumb(&["run", "cell.yaml", "verify", "--headless"]);
    assert_eq!(printed.code(), 0, "{}", printed.all());
    let all = printed.all();
    let line = all.lines().find(|line| line.contains("The error over all ")).expect("verify tells the error");
    line.split("rms = ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn two_sensors_that_are_off_are_found_over_the_serial_line_and_the_true_error_falls() {
    let lab = Lab::of("magician");
    // Not a test of late answers: Linux, under the load of other builds, has handed on no byte of a pseudo-terminal for seconds.
    let config = "config: {full_speed_deg_per_s: 160";
    lab.edit("cell.yaml", config, &format!("{config}, reply_within_ms: 2000"));
    let before = true_error(&lab);
    let printed = lab.plumb(&["run", "cell.yaml", "measure-tip", "--headless"]);
    assert_eq!(printed.code(), 0, "{}", printed.all());
    let table = lab.plumb(&["show", "2", "--table"]).out();
    lab.write("table.csv", &table);
    let printed = lab.plumb(&["model", "accept", "magician.model.yaml", "--data", "table.csv"]);
    assert_eq!(printed.code(), 0, "{}\n{table}", printed.all());
    // What a sensor says beyond what is so is what the model's zero takes off.
    for (joint, truth) in [("rear_arm", -1.2), ("forearm", 0.8)] {
        let zero = zero_of(&printed.all(), joint);
        assert!((zero - truth).abs() < 0.06, "joint_zero({joint}) is {zero}, not {truth}: {}", printed.all());
    }
    let after = true_error(&lab);
    assert!(before > 2.0 && after < 0.2, "{before} mm before, {after} mm after");
}

/// The zero of a joint as `model accept` says it, deg.
fn zero_of(printed: &str, joint: &str) -> f64 {
    let name = format!("joint_zero({joint})");
    let line =
        printed.lines().find(|line| line.contains(&name)).unwrap_or_else(|| panic!("{name}: {printed}"));
    let before_the_uncertainty = line.split("+-").next().and_then(|text| text.split_whitespace().last());
    before_the_uncertainty.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{line}"))
}

/// The joints at which homing ends are (0, 45, 45, 0) (protocol, 1.6); there an owner's Magician reads x 259.1198, y 0, z -8.5687 of its suction cup. And the maker's
/// forward calculation: the forearm's angle is against the level, whatever the rear arm does.
#[test]
fn the_model_puts_the_cup_where_a_magician_reads_it() {
    let lab = Lab::of("magician");
    let model = Model::read(&lab.path("magician.model.yaml")).unwrap();
    let cup = |base: f64, rear_arm: f64, forearm: f64| {
        let joints = [base, rear_arm, forearm, 0.0, 0.0].map(f64::to_radians);
        let position = LinkFrames::of(&model.chain, &joints, &[]).flange.translation.vector;
        // The maker counts z from the shoulder.
        [position.x, position.y, position.z - 138.0]
    };
    let home = cup(0.0, 45.0, 45.0);
    for (modelled, read) in home.iter().zip([259.1198, 0.0, -8.5687]) {
        assert!((modelled - read).abs() < 0.1, "{home:?}");
    }
    for (base, rear_arm, forearm) in
        [(0.0, 0.0, 0.0), (30.0, 20.0, 70.0), (-60.0, 65.0, 25.0), (90.0, 80.0, 40.0)]
    {
        let [turn, rear, fore] = [base, rear_arm, forearm].map(f64::to_radians);
        let out = 135.0 * rear.sin() + 147.0 * fore.cos() + 59.7;
        let expected = [out * turn.cos(), out * turn.sin(), 135.0 * rear.cos() - 147.0 * fore.sin()];
        for (modelled, expected) in cup(base, rear_arm, forearm).iter().zip(expected) {
            assert!(
                (modelled - expected).abs() < 1e-9,
                "({base}, {rear_arm}, {forearm}): {modelled} {expected}"
            );
        }
    }
}

/// World and controller as processes of their own, and the cell for real hardware at the other end of the line.
struct Arm {
    lab: Lab,
    world: Child,
    controller: Child,
    printed: BufReader<ChildStdout>,
}

impl Arm {
    fn new() -> Self {
        let lab = Lab::of("magician");
        let (socket, port) = (lab.path("world.socket"), lab.path("port"));
        let mut world = lab.command(&["world", "--file", "world.yaml", "--pace", "real", "--socket"]);
        let world = world.arg(&socket).stderr(Stdio::null()).spawn().unwrap();
        let begin = Instant::now();
        while WorldClient::connect(&socket, "test").is_err() {
            assert!(begin.elapsed() < PATIENCE, "the world listens");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let mut controller = lab.command(&["emulate", "dobot", "--world"]);
        controller.arg(&socket).arg("--link").arg(&port);
        let mut controller =
            controller.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let printed = BufReader::new(controller.stdout.take().unwrap());
        let mut arm = Self { lab, world, controller, printed };
        assert!(!arm.line().is_empty(), "the controller has a port");
        arm.lab.edit("cell-hardware.yaml", "/dev/ttyUSB0", &port.display().to_string());
        arm.lab.edit(
            "cell-hardware.yaml",
            "procedures: [",
            "answers: answers.yaml\nprocedures: [there.yaml, ",
        );
        let steps = "  - {id: there, do: {move: {robot: arm, to_deg: {base: 60}, speed: 1}}}\n  - {id: row, do: {row: {robot: arm, p1_x_mm: 1, p1_y_mm: 2, p1_z_mm: 3}}}\n";
        arm.lab
            .write("there.yaml", &format!("procedure: there\ntitle: A long way and a row\nsteps:\n{steps}"));
        arm
    }

    fn line(&mut self) -> String {
        let mut line = String::new();
        self.printed.read_line(&mut line).unwrap();
        line.trim().to_owned()
    }

    /// Something befalls the controller.
    fn befalls(&mut self, line: &str) {
        writeln!(self.controller.stdin.as_mut().unwrap(), "{line}").unwrap();
    }

    fn status(&mut self) -> String {
        self.befalls("status");
        self.line()
    }

    /// Runs a long move and a row, and lets something happen in the middle of the move.
    fn interrupted(&mut self, event: &str) -> (Option<i32>, String) {
        let mut run = self.lab.command(&["run", "cell-hardware.yaml", "there", "--headless"]);
        let run = run.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let begin = Instant::now();
        while !self.status().contains(" moving ") {
            assert!(begin.elapsed() < PATIENCE, "the arm moves");
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        self.befalls(event);
        let output = run.wait_with_output().unwrap();
        (output.status.code(), String::from_utf8([output.stdout, output.stderr].concat()).unwrap())
    }

    fn run(&self, procedure: &str) -> CommandOutput {
        self.lab.plumb(&["run", "cell-hardware.yaml", procedure, "--headless"])
    }
}

impl Drop for Arm {
    fn drop(&mut self) {
        for process in [&mut self.controller, &mut self.world] {
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

#[test]
fn what_befalls_a_move_ends_the_run_with_its_reason_and_leaves_no_row() {
    for (event, words) in [
        ("alarm 0x51", "alarm 0x51: a joint lost steps: the arm's position is not known any more (rear_arm)"),
        ("block", "though the Dobot has ended its move without an alarm: does it touch something?"),
        ("lose 1000", "is its 12 V supply in and its power button lit"),
        ("unplug", "the port is gone"),
    ] {
        let mut arm = Arm::new();
        let (code, printed) = arm.interrupted(event);
        assert_eq!(code, Some(2), "{event}: {printed}");
        assert!(printed.contains(words), "{event}: {printed}");
        let shown = arm.lab.plumb(&["show", "1", "--table"]).all();
        assert!(!shown.contains("1,2,3"), "{event}: {shown}");
    }
}

#[test]
fn the_first_moves_pass_and_the_plugin_conforms_as_anybody_can_check() {
    let arm = Arm::new();
    arm.lab.edit("cell-hardware.yaml", "full_speed_deg_per_s: 15", "full_speed_deg_per_s: 60");
    let printed = arm.run("first-moves");
    assert_eq!(printed.code(), 0, "{}", printed.all());
    let config = json!({"port": arm.lab.path("port")}).to_string();
    let printed = arm.lab.plumb(&["plugins", "check", "dobot", "--move", "--config", &config]);
    assert_eq!(printed.code(), 0, "{}", printed.all());
}

#[test]
fn mistakes_of_the_cell_file_are_shown_where_they_are() {
    let lab = Lab::of("magician");
    lab.edit("cell.yaml", "full_speed_deg_per_s: 160", "full_speed_deg_per_s: 1600, hnad: true");
    let printed = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(printed.code(), 2, "{}", printed.all());
    for words in ["device `arm`", "1600", "`hnad`", "did you mean `hand`?"] {
        assert!(printed.all().contains(words), "{words}: {}", printed.all());
    }
    lab.edit("cell.yaml", "full_speed_deg_per_s: 1600, hnad: true", "full_speed_deg_per_s: 160");
    for (wrong, words) in [
        ("--sensors-off 0,1.2", "give four angles in degrees, within 20 either way, such as 0,1.2,-0.8,0"),
        ("--sensors 1", "unexpected argument '--sensors'"),
    ] {
        lab.edit("cell.yaml", "--sensors-off 0,1.2,-0.8,0", wrong);
        let printed = lab.plumb(&["run", "cell.yaml", "measure-tip", "--headless"]);
        assert_eq!(printed.code(), 2, "{}", printed.all());
        assert!(printed.all().contains(words), "{}", printed.all());
        lab.edit("cell.yaml", wrong, "--sensors-off 0,1.2,-0.8,0");
    }
}

/// A controller over an arm of another kind says which arm it needs.
#[test]
fn a_world_with_another_arm_is_refused() {
    let lab = Lab::of("magician");
    let world = std::fs::read_to_string(lab.path("magician.arm.yaml")).unwrap();
    lab.write(
        "magician.arm.yaml",
        &world.replace(
            "  - {name: hand, limits_deg: [-90, 90], speed_deg_per_s: 480, step_deg: 0.01125}\n",
            "",
        ),
    );
    let printed = lab.plumb(&["run", "cell.yaml", "measure-tip", "--headless"]);
    assert_eq!(printed.code(), 2, "{}", printed.all());
    assert!(printed.all().contains("that world's arm has 4 joints; a Magician's has 5"), "{}", printed.all());
}
