//! `plumb streams`: what a cell's devices emit, while it runs.

use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

use nix::sys::signal::Signal;
use plumb_cell::device::{CellResources, Occupancy};
use serde_json::Value;

use crate::lab::{CommandOutput, Lab, skipped};

#[test]
fn the_streams_of_a_cell_are_listed_without_a_run() {
    let lab = Lab::new();
    let listed = lab.plumb(&["streams", "cell.yaml"]);
    assert_eq!(listed.code(), 0, "{}", listed.all());
    let row =
        |name: &str| listed.out().lines().find(|line| line.starts_with(name)).map(str::to_owned).unwrap();
    assert!(
        row("arm/joints").contains("joint-state/1") && row("arm/joints").contains("of plugin simulated"),
        "{}",
        listed.out()
    );
    assert!(row("eye/edges").contains("proximity-edge/1"), "{}", listed.out());
    let refused = lab.plumb(&["streams", "cell.yaml", "arm/joint"]);
    assert_eq!(refused.code(), 2, "{}", refused.all());
    assert!(
        refused.err().contains("the cell has no stream 'arm/joint': did you mean `arm/joints`?"),
        "{}",
        refused.err()
    );
    let early = lab.plumb(&["streams", "cell.yaml", "arm/joints"]);
    assert_eq!(early.code(), 2, "{}", early.all());
    assert!(
        early.err().contains("nobody runs cell.yaml") && early.err().contains("--wait"),
        "{}",
        early.err()
    );
}

#[test]
fn streams_are_printed_live_and_nothing_is_left_behind() {
    let lab = Lab::new();
    let listen = |arguments: &[&str]| {
        let mut command = lab.command(&["streams", "cell.yaml"]);
        command
            .args(arguments)
            .args(["--wait", "60"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    };
    let all = listen(&["all", "--json"]);
    let few = listen(&["arm/joints", "--count", "3"]);
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let all = CommandOutput::of(all.wait_with_output().unwrap());
    assert_eq!(all.code(), 0, "{}", all.err());
    let lines: Vec<Value> = all.out().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let of =
        |name: &str| lines.iter().filter(|line| line["stream"] == name && line["fields"].is_object()).count();
    assert!(of("arm/joints") > 50 && of("eye/edges") > 0 && of("arm/health") > 0, "{} lines", lines.len());
    let joints =
        lines.iter().find(|line| line["stream"] == "arm/joints" && line["fields"].is_object()).unwrap();
    assert_eq!(joints["message"], "joint-state/1");
    assert!(
        joints["fields"]["joints"].as_array().unwrap().len() > 3
            && joints["fields"]["time_ns"].as_u64() > Some(0),
        "{joints}"
    );

    let few = CommandOutput::of(few.wait_with_output().unwrap());
    assert_eq!(few.code(), 0, "{}", few.err());
    assert_eq!(few.out().lines().filter(|line| line.starts_with("arm/joints ")).count(), 3, "{}", few.out());
    let resources = CellResources::of_cell(&lab.path("cell.yaml")).unwrap();
    assert_eq!(resources.state(), Occupancy::Empty);
}

#[test]
fn a_program_in_python_reads_a_stream() {
    let lab = Lab::new();
    let program = Path::new(env!("CARGO_BIN_EXE_plumb")).parent().unwrap().display().to_string();
    let reader = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plugins/bridge/examples/read_stream.py");
    let mut python = Command::new("python3");
    python.arg(reader).args(["cell.yaml", "arm/joints"]).current_dir(lab.path(".")).stdin(Stdio::null());
    python.env("PATH", format!("{program}:{}", std::env::var("PATH").unwrap_or_default()));
    let Ok(mut reading) = python.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn() else {
        skipped("there is no `python3` here");
        return;
    };
    // A run that takes its time: on a busy machine Python has hardly begun when a fast one is over.
    let running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    let lines = BufReader::new(reading.stdout.take().unwrap()).lines();
    let read = lines.map_while(Result::ok).filter(|line| line.contains('[')).take(51).count();
    running.signal(Signal::SIGTERM);
    running.end();
    let finished = CommandOutput::of(reading.wait_with_output().unwrap());
    assert_eq!(read, 51, "{}", finished.all());
}

#[test]
fn the_streams_of_a_run_become_curves_in_rerun() {
    let has_rerun = Command::new("python3").args(["-c", "import rerun"]).output();
    if !has_rerun.is_ok_and(|output| output.status.success()) {
        skipped("python3 has no module `rerun` here");
        return;
    }
    let lab = Lab::new();
    let program = Path::new(env!("CARGO_BIN_EXE_plumb")).parent().unwrap().display().to_string();
    let view = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plugins/bridge/examples/rerun_view.py");
    let viewer = |more: &[&str]| {
        let mut python = Command::new("python3");
        python.arg(&view).arg("cell.yaml").args(more).current_dir(lab.path(".")).stdin(Stdio::null());
        python.env("PATH", format!("{program}:{}", std::env::var("PATH").unwrap_or_default()));
        python.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let early = CommandOutput::of(viewer(&["--save", "none.rrd", "--wait", "0"]).wait_with_output().unwrap());
    assert_eq!(early.code(), 1, "{}", early.all());
    assert!(early.err().contains("nobody runs cell.yaml"), "{}", early.err());
    let viewing = viewer(&["--save", "run.rrd"]);
    // A run that takes its time: on a busy machine Python has hardly begun when a fast one is over.
    let running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    let written = || std::fs::metadata(lab.path("run.rrd")).map_or(0, |file| file.len());
    let begin = std::time::Instant::now();
    while written() < 40_000 && begin.elapsed() < crate::lab::PATIENCE {
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    running.signal(Signal::SIGTERM);
    running.end();
    let finished = CommandOutput::of(viewing.wait_with_output().unwrap());
    assert_eq!(finished.code(), 0, "{}", finished.all());
    let shown = finished.out().split(' ').next().and_then(|count| count.parse::<u64>().ok());
    assert!(shown > Some(10), "{}", finished.out());
    // Rerun reads it back, with a curve for each joint.
    let mut print = Command::new("python3");
    print.args(["-m", "rerun", "rrd", "print"]).arg(lab.path("run.rrd"));
    let printed = CommandOutput::of(print.output().unwrap());
    assert!(printed.all().contains(" /arm/joints/joints/0 "), "{}", printed.all());
}
