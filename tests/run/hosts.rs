//! The processes around devices, as a run meets them: frozen, dead, flooding, exchanged while it runs, and written in C by the published contract.

use std::fs;
use std::io::ErrorKind;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use plumb_cell::device::CellResources;
use plumb_simulated::client::WorldClient;

use crate::lab::{Lab, PATIENCE, Running, command_of, kill, send, skipped};

/// What `core/README.md` states, and what a busy machine adds.
const ORCHESTRATOR_SILENT: Duration = Duration::from_secs(2);
const HOST_SILENT: Duration = Duration::from_secs(5);
const BUSY_MACHINE: Duration = Duration::from_secs(4);

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The arm in C of the published contract, its source changed, compiled into a folder of the lab; false, said in words, without a C compiler.
pub(crate) fn arm_in_c(lab: &Lab, change: impl Fn(String) -> String) -> bool {
    let example = root().join("core/abi/examples/counting_arm");
    let folder = lab.path("counting");
    fs::create_dir_all(&folder).unwrap();
    fs::copy(example.join("plugin.yaml"), folder.join("plugin.yaml")).unwrap();
    let source = folder.join("counting_arm.c");
    fs::write(&source, change(fs::read_to_string(example.join("counting_arm.c")).unwrap())).unwrap();
    // A new file each time: one that a process has loaded must not be written to.
    let library = folder.join("libcounting_arm.so");
    drop(fs::remove_file(&library));
    let output = Command::new("cc")
        .args(["-std=c11", "-shared", "-fPIC", "-I"])
        .arg(root().join("core/abi/include"))
        .arg("-o")
        .args([&library, &source])
        .arg("-lm")
        .output();
    match output {
        Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            skipped("there is no C compiler 'cc' here");
            return false;
        }
        Err(error) => panic!("cc cannot be run: {error}"),
    }
    lab.write(
        "cell-c.yaml",
        "cell: counting\nplugins: [counting]\ndevices:\n  arm: {plugin: counting-arm}\n  \
         eye: {plugin: ir-proximity, inputs: {line: arm/inputs}, config: {bit: 0}}\nrobots:\n  \
         arm: {joints: {waist: deg, shoulder: deg}}\nprocedures: [edge.yaml]\n",
    );
    lab.write(
        "edge.yaml",
        "procedure: edge\nsteps:\n  - {id: aside, do: {move: {robot: arm, to_deg: {waist: 20}}}}\n  \
         - {id: edge, do: {search: {robot: arm, joint: waist, travel_deg: 20, until: {sensor: eye, is: on},\n      \
         fast: {chunk_deg: 2, speed: 1}, slow: {chunk_deg: 0.2, speed: 0.5}, back_off_deg: 1}}}\n",
    );
    true
}

#[test]
fn an_arm_in_c_by_the_published_contract_can_be_searched_with() {
    let lab = Lab::new();
    if !arm_in_c(&lab, |text| text) {
        return;
    }
    let verified = lab.plumb(&["plugins", "verify", "counting/plugin.yaml"]);
    assert_eq!(verified.out(), "counting/plugin.yaml: good\n", "{}", verified.err());
    let run = lab.plumb(&["run", "cell-c.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    // Its line is high above 0.5 rad.
    let found = lab.shown("1")["steps"].to_string();
    assert!(found.contains("eye came on with waist at 28."), "{found}");
}

#[test]
fn what_is_wrong_with_the_functions_of_a_plugin_is_said_by_verify_and_by_a_run() {
    let table = "static const plumb_robot_functions robot = {\n    .size = sizeof(plumb_robot_functions),";
    let size = |bytes: &str| table.replace("sizeof(plumb_robot_functions),", bytes);
    for (from, to, expected) in [
        ("    .read_joints = read_joints,\n", String::new(), "lacks read_joints"),
        (
            table,
            size("0,"),
            "the `size` of its table 'plumb.robot/1' is 0: set it to sizeof(plumb_robot_functions)",
        ),
        (table, size("8,"), "the `size` of its table 'plumb.robot/1' is 8"),
        (table, size("40,"), "of 40 bytes lacks move_joints, stop"),
        ("        return &robot;", "        return NULL;".to_owned(), "gives NULL for 'plumb.robot/1'"),
        (
            "\"plumb.robot/1\"",
            "\"plumb.sensor/1\"".to_owned(),
            "it has one for 'plumb.sensor/1': is it a sensor?",
        ),
        (
            "    if (name.length == sizeof robot_name - 1 && memcmp(name.data, robot_name, name.length) == 0) {",
            "    (void)name; (void)robot_name; if (1) {".to_owned(),
            "gives a table for any name",
        ),
    ] {
        let lab = Lab::new();
        let change = |text: String| {
            assert!(text.contains(from), "{from}");
            text.replace(from, &to)
        };
        if !arm_in_c(&lab, change) {
            return;
        }
        let verified = lab.plumb(&["plugins", "verify", "counting/plugin.yaml"]);
        assert_eq!(verified.code(), 1, "{expected}: {}", verified.all());
        assert!(verified.out().contains(expected), "{expected}: {}", verified.out());
        assert_eq!(verified.out().lines().count(), 1, "{}", verified.out());
        if expected.contains("any name") {
            continue;
        }
        let run = lab.plumb(&["run", "cell-c.yaml"]);
        assert_eq!(run.code(), 2, "{}", run.all());
        assert!(run.all().contains(expected), "{expected}: {}", run.all());
    }
}

#[test]
fn a_plugin_that_has_changed_is_a_question_before_it_is_loaded() {
    let lab = Lab::new();
    let marked = |text: String| {
        text.replace("#include <math.h>\n", "#include <math.h>\nint changed_by_somebody = 1;\n")
    };
    if !arm_in_c(&lab, |text| text) {
        return;
    }
    assert_eq!(lab.plumb(&["run", "cell-c.yaml"]).code(), 0);
    arm_in_c(&lab, marked);
    let refused = lab.plumb(&["run", "cell-c.yaml"]);
    assert_eq!(refused.code(), 4, "{}", refused.all());
    assert!(
        refused.err().contains("a plugin has changed since this cell ran with it last: ")
            && refused.err().contains("counting/libcounting_arm.so (SHA-256 ")
            && refused.err().contains(" in run 1, "),
        "{}",
        refused.err()
    );
    // Somebody who is there is asked, and may leave it at that: then it is asked again.
    let mut running = lab.start(&["run", "cell-c.yaml", "--attended"]);
    let asked = running.until(|event| event["event"] == "prompt_asked");
    assert_eq!(asked["prompt"]["title"], "A plugin has changed. Run with it?");
    running.signal(Signal::SIGTERM);
    assert_eq!(running.end().1, Some(3));
    assert_eq!(lab.plumb(&["run", "cell-c.yaml"]).code(), 4);
    assert_eq!(lab.plumb(&["run", "cell-c.yaml", "--accept-plugins"]).code(), 0);
    assert_eq!(lab.plumb(&["run", "cell-c.yaml"]).code(), 0, "what was accepted is what it ran with last");
}

#[test]
fn a_plugin_that_is_exchanged_while_the_run_goes_on_is_not_loaded() {
    let lab = Lab::new();
    let slow = |text: String| text.replace("#define MAX_SPEED_RAD_S 1.0", "#define MAX_SPEED_RAD_S 0.1");
    if !arm_in_c(&lab, slow) {
        return;
    }
    lab.write("decide.yaml", "answers: {}\non_error: {aside: retry}\n");
    let mut running = lab.start(&["run", "cell-c.yaml", "--answers", "decide.yaml"]);
    running.until_moving_in("aside");
    let arm = running.host_of("libcounting_arm");
    arm_in_c(&lab, |text| text);
    kill(arm);
    let (last, code) = running.end();
    assert_eq!(code, Some(2), "{last}");
    let message = last["message"].as_str().unwrap();
    assert!(message.contains("libcounting_arm.so was changed while the run goes on"), "{message}");
}

#[test]
fn a_plugin_outside_the_known_folders_is_loaded_only_when_it_is_named() {
    let lab = Lab::new();
    if !arm_in_c(&lab, |text| text) {
        return;
    }
    lab.edit("cell-c.yaml", "plugins: [counting]\n", "");
    // What lies in the cell's own folder is found; this lies deeper.
    fs::create_dir(lab.path("away")).unwrap();
    fs::rename(lab.path("counting"), lab.path("away/counting")).unwrap();
    let run = lab.plumb(&["run", "cell-c.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.all().contains("there is no plugin 'counting-arm'"), "{}", run.all());
    let named = lab.plumb(&["run", "cell-c.yaml", "--plugins", "away/counting"]);
    assert_eq!(named.code(), 0, "{}", named.all());
    lab.edit("cell-c.yaml", "devices:\n", "plugins: [nowhere]\ndevices:\n");
    let checked = lab.plumb(&["check", "cell-c.yaml"]);
    assert_eq!(checked.code(), 2, "{}", checked.all());
    assert!(checked.all().contains("there is no directory nowhere"), "{}", checked.all());
}

#[test]
fn a_plugin_that_floods_slows_nothing_and_fills_nothing() {
    let lab = Lab::new();
    let floods = |text: String| {
        text.replace("#include <math.h>\n", "#include <math.h>\n#include <stdio.h>\n").replace(
            "    double from[JOINTS], way",
            "    for (int line = 0; line < 20000; line++) printf(\"line %d of what nobody wants to read, and rather long at that\\n\", line);\n    double from[JOINTS], way",
        )
    };
    if !arm_in_c(&lab, floods) {
        return;
    }
    let run = lab.plumb(&["run", "cell-c.yaml", "--record", "record"]);
    assert_eq!(run.code(), 0, "{}", run.err());
    let size: u64 =
        fs::read_dir(lab.path("record")).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    assert!(size < 3_000_000, "the record has {size} bytes");
    assert!(run.all().len() < 500_000, "{} bytes were printed", run.all().len());
    assert!(
        run.all().contains("left out here: they came faster than the log takes them"),
        "{}",
        run.all().len()
    );
}

#[test]
fn a_plugin_that_takes_more_memory_than_its_cell_gives_it_is_ended_with_words() {
    let lab = Lab::new();
    let eats = |text: String| {
        text.replace(
            "    double from[JOINTS], way",
            "    for (;;) { char *more = malloc(10000000); if (more == NULL) break; memset(more, 1, 10000000); wait_one_step(); }\n    double from[JOINTS], way",
        )
    };
    if !arm_in_c(&lab, eats) {
        return;
    }
    lab.edit("cell-c.yaml", "{plugin: counting-arm}", "{plugin: counting-arm, memory_limit_mb: 150}");
    let run = lab.plumb(&["run", "cell-c.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.all().contains("MB of memory and may use 150 MB: the host ends"), "{}", run.all());
    assert!(
        run.all().contains("run 1 ended with an error: step `aside`: arm: its process uses "),
        "{}",
        run.all()
    );
    lab.edit("cell-c.yaml", "memory_limit_mb: 150", "memory_limit_mb: 1");
    let checked = lab.plumb(&["check", "cell-c.yaml"]);
    assert!(
        checked.all().contains("`memory_limit_mb` is 1") && checked.all().contains("give 64 to"),
        "{}",
        checked.all()
    );
}

/// A simulated cell that runs, with a look at what its arm truly does.
pub(crate) struct Watched {
    pub(crate) running: Running,
    pub(crate) world: WorldClient,
}

impl Watched {
    pub(crate) fn moving_in(lab: &Lab, step: &str) -> Self {
        let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
        running.until_moving_in(step);
        let socket = CellResources::of_cell(&lab.path("cell.yaml")).unwrap().world_socket();
        Self { running, world: WorldClient::connect(&socket, "test").unwrap() }
    }

    /// The arm's true joints.
    pub(crate) fn joints(&mut self) -> Vec<f64> {
        self.world.look().unwrap().attitudes.to_vec()
    }

    /// How long the arm still moves, until it has been at rest for a quarter of a second.
    pub(crate) fn time_to_rest(&mut self) -> Duration {
        const REST: Duration = Duration::from_millis(250);
        let begin = Instant::now();
        let (mut last, mut since) = (self.joints(), Instant::now());
        while since.elapsed() < REST {
            assert!(begin.elapsed() < PATIENCE, "the arm moves on");
            thread::sleep(Duration::from_millis(5));
            let now = self.joints();
            if now != last {
                (last, since) = (now, Instant::now());
            }
        }
        since - begin
    }
}

/// A procedure with a move of a minute, for the arm of the lab's cell.
pub(crate) fn long_move(lab: &Lab) {
    lab.write(
        "procedures/long.yaml",
        "procedure: long\nsteps:\n  - {id: far, do: {move: {robot: arm, to_deg: {waist: 70}, speed: 0.02}}, time_limit_s: 600}\n",
    );
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/long.yaml, ");
}

#[test]
fn an_arm_is_stopped_when_the_program_that_moves_it_is_frozen() {
    let lab = Lab::new();
    long_move(&lab);
    let mut cell = Watched::moving_in(&lab, "far");
    let before = cell.joints();
    thread::sleep(Duration::from_millis(200));
    assert_ne!(cell.joints(), before, "the arm moves");
    cell.running.signal(Signal::SIGSTOP);
    let took = cell.time_to_rest();
    assert!(took > Duration::from_secs(1), "it is no stop that another cause explains: {took:?}");
    assert!(took < ORCHESTRATOR_SILENT + BUSY_MACHINE, "it took {took:?}");
    let stopped = cell.joints();
    cell.running.signal(Signal::SIGCONT);
    let log = cell
        .running
        .until(|event| event["event"] == "log" && event["source"] == "arm" && event["level"] == "error");
    assert!(
        log["message"].as_str().unwrap().contains("the program that runs the cell was not heard for 2s"),
        "{log}"
    );
    let (last, code) = cell.running.end();
    // Nobody is there to resume: the run is kept, and the arm is where it was stopped.
    assert_eq!(code, Some(4), "{last}");
    assert_eq!(cell.world.look().unwrap().attitudes.to_vec(), stopped);
}

#[test]
fn an_arm_is_stopped_at_once_when_a_sensor_dies_in_mid_move() {
    let lab = Lab::new();
    long_move(&lab);
    let mut cell = Watched::moving_in(&lab, "far");
    kill(cell.running.host_of("libplumb_ir_proximity"));
    let took = cell.time_to_rest();
    // 0.1 s until the robot is informed, its own stop time, and the time it takes to see it.
    assert!(took < Duration::from_millis(1500), "it took {took:?}");
    let (last, code) = cell.running.end();
    assert_eq!(code, Some(2), "{last}");
    let message = last["message"].as_str().unwrap();
    assert!(message.contains("eye is lost: the host of eye was ended by SIGKILL"), "{message}");
}

#[test]
fn a_sensor_that_is_frozen_in_mid_search_stops_the_arm_and_is_named() {
    let lab = Lab::new();
    let cell = Watched::moving_in(&lab, "waist.find_a");
    let eye = cell.running.host_of("libplumb_ir_proximity");
    send(eye, Signal::SIGSTOP);
    let begin = Instant::now();
    let (last, code) = cell.running.end();
    assert!(begin.elapsed() < HOST_SILENT + 2 * BUSY_MACHINE, "it took {:?}", begin.elapsed());
    assert_eq!(code, Some(2), "{last}");
    assert!(last["message"].as_str().unwrap().contains("eye is lost"), "{last}");
}

#[test]
fn a_host_that_is_frozen_while_it_starts_ends_the_run_in_time_with_its_name() {
    for moment in [0, 20, 60, 120] {
        let lab = Lab::new();
        let running = lab.start(&["run", "cell.yaml", "--pace", "fast"]);
        let begin = Instant::now();
        let eye = loop {
            assert!(begin.elapsed() < PATIENCE, "no host came");
            if let Some(eye) =
                running.hosts().into_iter().find(|host| command_of(*host).contains("host eye of "))
            {
                break eye;
            }
        };
        thread::sleep(Duration::from_millis(moment));
        send(eye, Signal::SIGSTOP);
        let frozen = Instant::now();
        let (last, code) = running.end();
        let limit = Duration::from_secs(15) + HOST_SILENT + 2 * BUSY_MACHINE;
        assert!(frozen.elapsed() < limit, "frozen after {moment} ms: it took {:?}", frozen.elapsed());
        // A run without anybody to ask may have passed before it was frozen.
        if code != Some(0) {
            assert_eq!(code, Some(2), "{last}");
            assert!(last["message"].as_str().unwrap().contains("eye"), "{last}");
        }
    }
}

#[test]
fn a_signal_is_recorded_with_who_sent_it_and_not_as_the_operators_abort() {
    let lab = Lab::new();
    for signal in [Signal::SIGTERM, Signal::SIGINT] {
        let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
        running.until_moving_in("waist.lower");
        running.signal(signal);
        let (last, code) = running.end();
        assert_eq!(code, Some(3));
        let message = last["message"].as_str().unwrap();
        let sender = format!("ended by {} from process {} (", signal.as_str(), std::process::id());
        assert!(message.starts_with(&sender), "{message}");
        assert!(!message.contains("operator"), "{message}");
    }
}

#[test]
fn what_a_cell_shares_and_records_is_its_owners_alone() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    running.until_moving_in("waist.lower");
    let resources = CellResources::of_cell(&lab.path("cell.yaml")).unwrap();
    let root = resources.domain().root().to_owned();
    let mut paths = resources.domain().shared_memory();
    assert!(paths.len() > 5, "{paths:?}");
    paths.extend([root, resources.lock_file(), resources.world_socket().parent().unwrap().to_owned()]);
    let record = lab.path("../state/plumb");
    paths.extend(fs::read_dir(&record).unwrap().map(|entry| entry.unwrap().path()));
    paths.push(record);
    for path in paths {
        // A piece of shared memory may have gone meanwhile.
        let Ok(found) = fs::metadata(&path) else { continue };
        let mode = found.permissions().mode();
        assert_eq!(mode & 0o077, 0, "{} has {mode:o}", path.display());
    }
    running.signal(Signal::SIGTERM);
    running.end();
}

#[test]
fn too_few_open_files_are_reported_with_both_numbers_and_the_doctor_says_so_too() {
    let lab = Lab::new();
    for (arguments, code) in [("run cell.yaml", 2), ("doctor cell.yaml", 1)] {
        let script = format!("ulimit -n 40; exec {} {arguments}", env!("CARGO_BIN_EXE_plumb"));
        let output = Command::new("sh")
            .args(["-c", &script])
            .current_dir(lab.path("."))
            .env("XDG_STATE_HOME", lab.path("../state"))
            .output()
            .unwrap();
        let printed =
            format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(
            printed.contains("too many open files: raise `ulimit -n` (40 now, 256 needed)"),
            "{arguments}: {printed}"
        );
        assert_eq!(output.status.code(), Some(code), "{printed}");
    }
}
