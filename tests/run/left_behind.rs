//! What stays on the machine when a run is over: nothing.

use std::fs;
use std::path::PathBuf;

use nix::sys::signal::Signal;
use plumb_cell::device::CellResources;

use crate::lab::{Lab, command_of, hosts_of, processes_of, wait_gone};

/// Everything in shared memory that belongs to the lab's cell.
fn in_shared_memory(lab: &Lab) -> Vec<PathBuf> {
    let resources = CellResources::of_cell(&lab.path("cell.yaml")).unwrap();
    let name = resources.domain().root().file_name().unwrap().to_str().unwrap().to_owned();
    let number = name.strip_prefix("plumb-cell-").unwrap().to_owned();
    let entries = fs::read_dir("/dev/shm").unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.to_string_lossy().contains(&number)).collect()
}

/// The lab's processes, by what they were started as.
fn processes(lab: &Lab) -> Vec<String> {
    let resources = CellResources::of_cell(&lab.path("cell.yaml")).unwrap();
    processes_of(&resources.world_socket().display().to_string()).into_iter().map(command_of).collect()
}

fn assert_nothing_is_left(lab: &Lab, after: &str) {
    assert_eq!(in_shared_memory(lab), [] as [PathBuf; 0], "after {after}");
    assert_eq!(processes(lab), [] as [&str; 0], "after {after}");
}

#[test]
fn a_run_that_ended_leaves_nothing_however_it_ended() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    assert_nothing_is_left(&lab, "a run that passed");

    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    running.until_moving_in("waist.lower");
    assert!(
        !in_shared_memory(&lab).is_empty() && !processes(&lab).is_empty(),
        "this test can see what is there"
    );
    running.signal(Signal::SIGTERM);
    assert_eq!(running.end().1, Some(3));
    assert_nothing_is_left(&lab, "a run that was aborted");

    lab.edit("answers.yaml", "place: done", "place: {pose_deg: {shoulder: 50, elbow: -65}}");
    assert_eq!(lab.plumb(&["run", "cell.yaml"]).code(), 1);
    assert_nothing_is_left(&lab, "a run that failed");

    lab.edit("world-ideal.yaml", "table: {solid: true}", "tabel: {solid: true}");
    let run = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.all().contains("did you mean `table`?"), "{}", run.all());
    assert_nothing_is_left(&lab, "a world that never began");
}

#[test]
fn what_a_killed_run_leaves_is_reported_and_removed_by_the_doctor() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    running.until_moving_in("waist.lower");
    let program = running.process();
    let while_it_runs = lab.plumb(&["doctor", "--clean", "cell.yaml"]);
    assert!(
        while_it_runs.out().contains(&format!("cell.yaml is run by process {program}")),
        "{}",
        while_it_runs.all()
    );
    let hosts = hosts_of(program);
    assert!(!hosts.is_empty());
    running.signal(Signal::SIGKILL);
    running.end();
    // Each ends once its device is put away; on a busy machine that takes a moment.
    hosts.into_iter().for_each(wait_gone);

    let output = lab.plumb(&["doctor", "cell.yaml"]);
    assert_eq!(output.code(), 1, "{}", output.all());
    assert!(
        output.out().contains(&format!("left behind by process {program}, which was killed")),
        "{}",
        output.out()
    );
    assert!(output.out().contains("a simulated world (process "), "{}", output.out());
    assert!(output.out().contains("plumb run --resume goes on with the run"), "{}", output.out());

    let cleaned = lab.plumb(&["doctor", "--clean", "cell.yaml"]);
    assert_eq!(cleaned.code(), 0, "{}", cleaned.all());
    assert!(cleaned.out().contains("cell.yaml: what it left behind is removed"), "{}", cleaned.out());
    assert_nothing_is_left(&lab, "the doctor");
}

#[test]
fn the_controllers_of_a_killed_run_end_with_it_and_the_doctor_ends_its_world() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell-serial.yaml", "--pace", "real"]);
    running.until(|event| event["event"] == "step_started" && event["step"] == "target");
    let resources = CellResources::of_cell(&lab.path("cell-serial.yaml")).unwrap();
    let socket = resources.world_socket().display().to_string();
    let of_cell = || processes_of(&socket).into_iter().map(command_of).collect::<Vec<_>>();
    assert!(of_cell().iter().any(|command| command.contains("emulate")), "{:?}", of_cell());
    running.signal(Signal::SIGKILL);
    running.end();
    let begin = std::time::Instant::now();
    while of_cell().iter().any(|command| command.contains("emulate")) {
        assert!(begin.elapsed() < crate::lab::PATIENCE, "{:?}", of_cell());
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let cleaned = lab.plumb(&["doctor", "--clean", "cell-serial.yaml"]);
    assert_eq!(cleaned.code(), 0, "{}", cleaned.all());
    assert_eq!(of_cell(), [] as [&str; 0]);
}

#[test]
fn the_doctor_gives_hosts_of_a_killed_run_time_to_put_their_devices_away() {
    let lab = Lab::new();
    // A host ends too soon to be met, and one that is frozen is woken by the death of its run: a shell of the name takes its part for a second.
    std::os::unix::fs::symlink("/bin/sh", lab.path("plumb")).unwrap();
    lab.write("host", "sleep 1\n");
    let mut killed = std::process::Command::new("sh");
    killed.args(["-c", "./plumb host </dev/null >/dev/null 2>&1 &"]).current_dir(lab.path("."));
    assert!(killed.status().unwrap().success());
    let output = lab.plumb(&["doctor", "cell.yaml"]);
    assert_eq!(output.code(), 0, "{}", output.all());
}

#[test]
fn a_run_that_can_be_resumed_keeps_its_world_alone() {
    let lab = Lab::new();
    lab.write("procedures/broken.yaml", "procedure: broken\nsteps:\n  - {id: sum, do: {compute: {values: {a_mm: 1.0 / arm.joints.waist_deg * 0.0 + sqrt(-1.0)}}}}\n");
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/broken.yaml, ");
    let run = lab.plumb(&["run", "cell.yaml", "broken"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    let resources = CellResources::of_cell(&lab.path("cell.yaml")).unwrap();
    assert_eq!(in_shared_memory(&lab), [resources.world_socket().parent().unwrap()]);
    let output = lab.plumb(&["doctor", "cell.yaml"]);
    assert!(output.out().contains("waits for a run to be resumed"), "{}", output.out());
}
