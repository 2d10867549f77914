//! `plumb plugins check` on the plugins that are shipped, as far as they work without a machine: drivers of arms on their emulated controllers.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};

use crate::lab::CommandOutput;

fn check(arguments: &[&str]) -> CommandOutput {
    let elsewhere = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(["plugins", "check"]).args(arguments).current_dir(elsewhere.path());
    CommandOutput::of(command.stdin(Stdio::null()).output().unwrap())
}

/// An emulated controller and the port it prints.
fn emulated(arguments: &[&str]) -> (Child, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.arg("emulate").args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut port = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut port).unwrap();
    (child, port.trim().to_owned())
}

#[test]
fn the_proximity_sensor_passes() {
    let checked = check(&["ir-proximity", "--config", "{bit: 0}", "--input", "line"]);
    assert_eq!(checked.code(), 0, "{}", checked.all());
    assert!(
        checked.out().contains("passed   it does not claim to have seen what has not come"),
        "{}",
        checked.out()
    );
}

#[test]
fn the_teachmovers_driver_passes_on_its_emulated_controller() {
    let (mut controller, port) = emulated(&["teachmover", "--as-fast-as-possible"]);
    let checked = check(&["teachmover", "--config", &format!("{{port: {port}}}"), "--move"]);
    controller.kill().unwrap();
    controller.wait().unwrap();
    assert_eq!(checked.code(), 0, "{}", checked.all());
    assert!(checked.out().contains("passed   its input stream closes every move"), "{}", checked.out());
}
