//! A controller on a bench that is switched off and on between two runs: its registers begin anew, and yesterday's zeros no longer hold.

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};

use crate::lab::{CommandOutput, Lab};

/// A controller with nothing but motors behind it, and the cell for real hardware at the other end of the line.
struct Bench {
    lab: Lab,
    controller: Child,
}

/// Puts zeros in force and moves; needs no target.
const KNOWN: &str = "procedure: known
title: Put known zeros in force
finds_zeros: [arm]
steps:
  - id: shift
    title: Known zeros
    do:
      apply:
        robot: arm
        ask: false
        joint_zero:
          waist: {shift_deg: 1.5, uncertainty_deg: 0.1}
          shoulder: {shift_deg: -2, uncertainty_deg: 0.1}
          elbow: {shift_deg: 1, uncertainty_deg: 0.1}
  - {id: out, title: Out, do: {move: {robot: arm, by_deg: {waist: 20}}}}
";

/// Needs the zeros.
const TURN: &str = "procedure: turn
title: Turn by the zeros
steps:
  - {id: turn, title: Turn, do: {move: {robot: arm, to_deg: {waist: 30}}}}
";

impl Bench {
    fn new() -> Self {
        let lab = Lab::new();
        let controller = switched_on(&lab);
        lab.edit("cell-hardware.yaml", "/dev/ttyUSB0", &lab.path("port").display().to_string());
        lab.edit(
            "cell-hardware.yaml",
            "full_speed_code: 100",
            "full_speed_code: 220\n      reply_within_ms: 10000",
        );
        lab.write("procedures/known.yaml", KNOWN);
        lab.write("procedures/turn.yaml", TURN);
        let first = "  - procedures/first-day.yaml\n";
        lab.edit(
            "cell-hardware.yaml",
            first,
            &format!("{first}  - procedures/known.yaml\n  - procedures/turn.yaml\n"),
        );
        Self { lab, controller }
    }

    fn switch_off_and_on(&mut self) {
        let _ = self.controller.kill();
        let _ = self.controller.wait();
        let _ = std::fs::remove_file(self.lab.path("port"));
        self.controller = switched_on(&self.lab);
    }

    fn run(&self, procedure: &str, more: &[&str]) -> CommandOutput {
        self.lab.plumb(&[&["run", "cell-hardware.yaml", procedure, "--headless"], more].concat())
    }
}

fn switched_on(lab: &Lab) -> Child {
    let mut command = lab.command(&["emulate", "teachmover", "--as-fast-as-possible", "--link"]);
    command.arg(lab.path("port"));
    let mut child =
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut port = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut port).unwrap();
    assert!(!port.trim().is_empty(), "the controller has a port");
    child
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = self.controller.kill();
        let _ = self.controller.wait();
    }
}

#[test]
fn zeros_outlive_a_run_but_not_the_controllers_power() {
    let mut bench = Bench::new();
    let known = bench.run("known", &[]);
    assert_eq!(known.code(), 0, "{}", known.all());
    let turned = bench.run("turn", &[]);
    assert_eq!(turned.code(), 0, "{}", turned.all());
    assert!(!turned.out().contains("ZEROS LOST"), "{}", turned.out());

    bench.switch_off_and_on();
    let lost = bench.run("turn", &[]);
    assert_eq!(lost.code(), 4, "{}", lost.all());
    let output = lost.out();
    assert!(
        output.contains("ZEROS LOST: arm (waist, shoulder, elbow): its drive reads 8.000 deg at the waist"),
        "{output}"
    );
    assert!(output.contains("run 2 left it at 28.5"), "{output}");
    assert!(
        output.contains("arm has lost its zeros")
            && output.contains("Find them with procedure `first-day` first"),
        "{output}"
    );
    let again = bench.run("turn", &[]);
    assert_eq!(again.code(), 4, "an arm left alone since has not got them back: {}", again.all());

    let listed = bench.lab.plumb(&["record", "zeros", "teachmover-hardware"]).out();
    assert_eq!(listed.matches("   LOST").count(), 3, "{listed}");
    assert!(listed.contains("zeros last lost in run 3: its drive reads 8.000 deg"), "{listed}");

    let found = bench.run("known", &["--json"]);
    assert_eq!(found.code(), 0, "{}", found.all());
    let turned = bench.run("turn", &[]);
    assert_eq!(turned.code(), 0, "{}", turned.all());
    let listed = bench.lab.plumb(&["record", "zeros", "teachmover-hardware"]).out();
    assert!(!listed.contains("   LOST"), "{listed}");
}
