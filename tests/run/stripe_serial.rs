//! The light stripe on the PUMA's real driver, which types at an emulated VAL-II controller over the arm of the world: every procedure, and what befalls the
//! line in the middle of a scan.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::WorldCommand;
use serde_json::Value;

use crate::lab::{Lab, PATIENCE, kill, processes_of};

const CELL: &str = "cell-serial.yaml";

fn lab() -> Lab {
    Lab::of("light-stripe")
}

/// Runs a procedure to its end: the events and the exit code.
fn run(lab: &Lab, cell: &str, arguments: &[&str]) -> (Vec<Value>, i32) {
    let output =
        lab.plumb(&[&["run", cell], arguments, &["--headless", "--json", "--record", "record"]].concat());
    let events = output.out().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    (events, output.code())
}

/// What the run said at its end.
fn end(events: &[Value]) -> String {
    events.last().map_or_else(String::new, |event| event["message"].as_str().unwrap_or_default().to_owned())
}

/// A value of each finished step of that name.
fn values(events: &[Value], step: &str, name: &str) -> Vec<f64> {
    let finished = events.iter().filter(|event| event["event"] == "step_finished");
    let of_step = finished.filter(|event| event["step"].as_str().is_some_and(|path| path.ends_with(step)));
    of_step
        .flat_map(|event| event["values"].as_array().cloned().unwrap_or_default())
        .filter(|value| value["name"] == name)
        .map(|value| value["value"].as_f64().unwrap())
        .collect()
}

/// The only value of that name.
fn value(events: &[Value], step: &str, name: &str) -> f64 {
    let found = values(events, step, name);
    assert_eq!(found.len(), 1, "{step}.{name}: {}", end(events));
    found[0]
}

fn apex_error(events: &[Value]) -> f64 {
    let of = |name: &str, truth: f64| (value(events, "scan", name) - truth).powi(2);
    (of("apex_x", 60.0) + of("apex_y", 530.0) + of("apex_z", -260.0)).sqrt()
}

#[test]
fn a_pyramid_is_scanned_through_the_terminal_line_in_both_paces() {
    let lab = lab();
    assert_eq!(lab.plumb(&["check", CELL]).code(), 0);
    for pace in ["fast", "real"] {
        let (events, code) = run(&lab, CELL, &["scan-pyramid", "--set", "step_mm=10", "--pace", pace]);
        assert_eq!(code, 0, "{pace}: {}", end(&events));
        assert!(apex_error(&events) < 0.15, "{pace}: {} mm", apex_error(&events));
    }
}

#[test]
fn random_error_and_direction_error_are_those_of_the_simulated_driver() {
    let lab = lab();
    let (events, code) = run(&lab, CELL, &["random-error"]);
    assert_eq!(code, 0, "{}", end(&events));
    let band = value(&events, "plane", "thickness");
    assert!((0.05..0.4).contains(&band), "{band} mm");
    let (events, code) = run(&lab, CELL, &["direction-error"]);
    assert_eq!(code, 0, "{}", end(&events));
    assert_eq!(values(&events, "scan", "apex_x").len(), 12);
    let spread = value(&events, "spread", "error");
    assert!((0.001..0.2).contains(&spread), "{spread} mm");
}

/// Agin's four stages, from a rig that is not as drawn.
#[test]
fn the_four_stages_find_wrist_aim_scale_roll_and_sheet() {
    let lab = lab();
    let edit = |from: &str, to: &str| lab.edit("world.yaml", from, to);
    edit("    resolution: encoder", "    resolution: encoder\n    zero_error: {flange_deg: 0.8}");
    edit("xyz_mm: [-30, 0, 60]}", "xyz_mm: [-30, 0, 60], rpy_deg: [0.4, -0.3, 0.5]}");
    let (events, code) = run(&lab, CELL, &["wrist"]);
    assert_eq!(code, 0, "{}", end(&events));
    assert!((value(&events, "found", "correction") - 0.8).abs() < 0.03, "{}", end(&events));
    let (events, code) = run(&lab, CELL, &["camera-aim"]);
    assert_eq!(code, 0, "{}", end(&events));
    let (x, y) = (value(&events, "correction", "aim_x"), value(&events, "correction", "aim_y"));
    assert!((x - 0.4).abs() < 0.05 && (y + 0.3).abs() < 0.05, "{x} {y}");
    let (events, code) = run(&lab, CELL, &["camera-scale"]);
    assert_eq!(code, 0, "{}", end(&events));
    assert!((value(&events, "correction", "scale_u") - 1.0).abs() < 0.01, "{}", end(&events));
    assert!((value(&events, "correction", "roll") - 0.5).abs() < 0.06, "{}", end(&events));
    let (events, code) = run(&lab, CELL, &["projector"]);
    assert_eq!(code, 0, "{}", end(&events));
    assert!(value(&events, "fit", "off") < 0.3, "{}", end(&events));
}

#[test]
fn stripes_are_gathered_for_the_lab_and_an_ideal_arm_is_found_to_be_one() {
    let lab = lab();
    let (events, code) = run(&lab, CELL, &["gather"]);
    assert_eq!(code, 0, "{}", end(&events));
    let output = lab.plumb(&["stripe", "diagnose", CELL, "--scans", "record/run-1", "--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let report: Value = serde_json::from_str(&output.out()).unwrap();
    assert_eq!(report["verdict"], "at_floor", "{report}");
}

#[test]
fn one_stripe_and_cup_and_spoon_come_through_the_line_as_well() {
    let lab = lab();
    let (events, code) = run(&lab, CELL, &["one-stripe", "--set", "z_mm=-300", "--set", "x_mm=180"]);
    assert_eq!(code, 0, "{}", end(&events));
    assert!(value(&events, "stripe", "points") > 100.0);
    let (events, code) = run(&lab, "cup-serial.yaml", &["scan-cup", "--set", "step_mm=10"]);
    assert_eq!(code, 0, "{}", end(&events));
    assert!(value(&events, "scan", "points") > 2000.0);
}

/// The controller reports where the arm is only when it is at rest. What is between is not made up: a scan in motion ends with words and keeps nothing.
#[test]
fn a_scan_in_motion_over_a_line_that_reports_no_pose_on_the_way_keeps_nothing() {
    let lab = lab();
    for pace in ["fast", "real"] {
        let (events, code) = run(&lab, CELL, &["exposure-delay", "--pace", pace]);
        let message = end(&events);
        assert_eq!(code, 2, "{message}");
        assert!(
            message.contains("arm does not report where it is while it moves")
                && message.contains("Scan at rest"),
            "{message}"
        );
        assert!(values(&events, "scan", "points").is_empty(), "no cloud of it");
    }
}

/// No cloud of the run that ended in the middle of its scan, no apex, and nothing for the lab.
fn assert_nothing_false_was_kept(lab: &Lab) {
    let kept = fs::read_dir(lab.path("record/run-1")).into_iter().flatten().flatten();
    let clouds: Vec<_> = kept.map(|entry| entry.file_name()).filter(|name| name != "log.jsonl").collect();
    let shown = lab.plumb(&["show", "1", "--record", "record", "--json"]);
    let shown: Value = serde_json::from_str(&shown.out()).unwrap();
    let readings = shown["readings"].as_array().unwrap();
    assert!(!readings.iter().any(|reading| reading.to_string().contains("apex")), "{readings:?}");
    let tables = clouds.iter().filter(|name| {
        let name = name.to_string_lossy();
        name.ends_with(".ply") || name.ends_with(".pcd") || name.ends_with(".csv")
    });
    assert_eq!(tables.count(), 0, "{clouds:?}");
}

#[test]
fn a_controller_that_is_gone_in_mid_scan_ends_the_run_with_words() {
    let lab = lab();
    let mut running =
        lab.start(&["run", CELL, "scan-pyramid", "--headless", "--pace", "real", "--record", "record"]);
    running.until(|event| event["event"] == "step_started" && event["step"] == "scan");
    running.until(|event| event["event"] == "step_progress" && event["step"] == "scan");
    let controllers: Vec<u32> = processes_of("emulate val2")
        .into_iter()
        .filter(|process| parent_of(*process) == Some(running.process()))
        .collect();
    assert_eq!(controllers.len(), 1);
    kill(controllers[0]);
    let (last, code) = running.end();
    let message = last["message"].as_str().unwrap();
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("arm: ") && message.contains("the port is gone"), "{message}");
    assert_nothing_false_was_kept(&lab);
}

fn parent_of(process: u32) -> Option<u32> {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    stat.rsplit_once(") ")?.1.split(' ').nth(1)?.parse().ok()
}

/// A world and a controller of its arm on a bench, and the cell as for real hardware: its port is given, and its camera finds the world by itself.
struct Bench {
    lab: Lab,
    world: Child,
    controller: Child,
}

impl Bench {
    fn new() -> Self {
        let lab = lab();
        let (socket, port) = (lab.path("world.socket"), lab.path("port"));
        let world = lab
            .command(&["world", "--file", "world.yaml", "--pace", "real", "--socket"])
            .arg(&socket)
            .spawn()
            .unwrap();
        until("the world's socket", || WorldClient::connect(&socket, "test").is_ok());
        let mut command = lab.command(&["emulate", "val2", "--world"]);
        command.arg(&socket).arg("--link").arg(&port);
        let mut controller =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut first = String::new();
        BufReader::new(controller.stdout.as_mut().unwrap()).read_line(&mut first).unwrap();
        assert!(!first.trim().is_empty(), "the controller has a port");
        lab.edit(CELL, "world: {file: world.yaml, pace: real}\n", "");
        let arm = format!(
            "arm: {{plugin: puma, config: {{port: {}, typing: fast, reply_within_ms: 10000}}}}",
            port.display()
        );
        lab.edit(CELL, "arm: {plugin: puma, emulate: val2}", &arm);
        let camera = format!("camera: {{plugin: simulated-camera, config: {{world: {}}}}}", socket.display());
        lab.edit(CELL, "camera: {plugin: simulated-camera}", &camera);
        Self { lab, world, controller }
    }

    /// Scans the pyramid while something befalls the controller in mid-scan: how the run ended.
    fn scan_while(&mut self, befalls: &str) -> (String, Option<i32>) {
        let mut running = self.lab.start(&["run", CELL, "scan-pyramid", "--headless", "--record", "record"]);
        running.until(|event| event["event"] == "step_started" && event["step"] == "scan");
        running.until(|event| event["event"] == "step_progress" && event["step"] == "scan");
        writeln!(self.controller.stdin.as_mut().unwrap(), "{befalls}").unwrap();
        let (last, code) = running.end();
        (last["message"].as_str().unwrap_or_default().to_owned(), code)
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        if let Ok(mut client) = WorldClient::connect(&self.lab.path("world.socket"), "test") {
            let _ = client.call(WorldCommand::Shutdown {}, || false, |_| {});
        }
        for child in [&mut self.controller, &mut self.world] {
            let _ = child.kill();
            let _ = child.wait();
        }
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
fn a_line_that_is_cut_in_mid_scan_ends_it_with_words_and_without_a_cloud() {
    let mut bench = Bench::new();
    let (message, code) = bench.scan_while("unplug");
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("arm: ") && message.contains("the port is gone"), "{message}");
    assert_nothing_false_was_kept(&bench.lab);
}

#[test]
fn an_error_of_the_controller_in_mid_scan_ends_it_with_words_and_without_a_cloud() {
    let mut bench = Bench::new();
    let (message, code) = bench.scan_while("envelope 2");
    assert_eq!(code, Some(2), "{message}");
    assert!(message.contains("Envelope error") || message.contains("power"), "{message}");
    assert_nothing_false_was_kept(&bench.lab);
}
