//! Where the events of `tracing` go: a file a run, `--log FILE`, `RUST_LOG`.

use std::fs;

use crate::lab::{CommandOutput, Lab};

#[test]
fn a_run_has_a_log_with_what_the_cell_the_hosts_and_the_plugins_report() {
    let lab = Lab::new();
    let ran = lab.plumb(&["run", "cell-serial.yaml", "--headless", "--log", "all.log"]);
    assert_eq!(ran.code(), 0, "{}", ran.all());
    assert_eq!(ran.err(), "", "nothing on standard error unless RUST_LOG asks for it");
    let own = fs::read_to_string(lab.state().join("logs/run-1.log")).unwrap();
    for part in [
        "plumb::run: {\"event\":\"run_started\"",
        "plumb::run: {\"event\":\"step_finished\"",
        "plumb::run: {\"event\":\"run_ended\"",
        "plumb_host::parent::shared",
        "device=\"arm\"",
    ] {
        assert!(own.contains(part), "{part}\n{own}");
    }
    assert!(
        !own.contains("\"event\":\"joints\"") && !own.contains("fraction="),
        "what comes too often is not kept"
    );
    let all = fs::read_to_string(lab.path("all.log")).unwrap();
    assert!(all.contains("run_ended") && all.len() >= own.len());
    let again = lab.plumb(&["run", "cell-serial.yaml", "--headless"]);
    assert_eq!(again.code(), 0);
    assert!(fs::read_to_string(lab.state().join("logs/run-2.log")).unwrap().contains("\"run\":2"));
    assert_eq!(fs::read_to_string(lab.state().join("logs/run-1.log")).unwrap(), own, "each run has its own");
}

#[test]
fn rust_log_says_how_much_and_puts_it_on_standard_error() {
    let lab = Lab::new();
    let with = |filter: &str| {
        CommandOutput::of(
            lab.command(&["run", "cell.yaml", "--headless"]).env("RUST_LOG", filter).output().unwrap(),
        )
    };
    let much = with("debug");
    assert_eq!(much.code(), 0, "{}", much.all());
    assert!(much.err().lines().count() > 10 && much.err().contains(" INFO "), "{}", much.err());
    let little = with("error");
    assert_eq!((little.code(), little.err().as_str()), (0, ""));
    let wrong = with("plumb=loud");
    assert_eq!(wrong.code(), 2);
    assert!(
        wrong.err().starts_with("plumb: RUST_LOG is `plumb=loud`: ") && wrong.err().contains("write a level"),
        "{}",
        wrong.err()
    );
}

#[test]
fn a_log_that_cannot_be_written_is_refused_before_anything_starts() {
    let lab = Lab::new();
    let refused = lab.plumb(&["--log", "no-such-folder/all.log", "history"]);
    assert_eq!(refused.code(), 2);
    assert!(
        refused.err().starts_with("plumb: the log no-such-folder/all.log cannot be written: "),
        "{}",
        refused.err()
    );
}

#[test]
fn what_a_plugin_reports_is_in_the_spans_of_the_run_the_step_and_the_call() {
    let lab = Lab::new();
    let mut command = lab.command(&["run", "cell-serial.yaml", "--headless"]);
    // The progress of moves is the plugin's, and is reported down to trace.
    let ran = CommandOutput::of(command.env("RUST_LOG", "plumb=trace").output().unwrap());
    assert_eq!(ran.code(), 0, "{}", ran.all());
    let (run, step) = (
        "run{run=1 cell=\"teachmover-serial\" procedure=\"initialize\"}",
        "step{step=waist.lower attempt=1}",
    );
    let of_plugin =
        format!("{run}:{step}:call{{device=\"arm\" request=\"move joints\"}}: plumb_host::parent::shared: ");
    let stderr = ran.err();
    assert!(stderr.lines().any(|line| line.contains(&of_plugin) && line.contains("fraction=")), "{stderr}");
    // What serves no call belongs to the run: how the device was found, and how its host ended.
    for text in ["TeachMover on ", "its host ended in good order"] {
        let line = stderr.lines().find(|line| line.contains(text) && line.contains("device=\"arm\""));
        assert!(line.is_some_and(|line| line.contains(&format!("{run}: plumb_host"))), "{text}: {stderr}");
    }
    // No line of this program's own is outside of the run while it goes on, but for what clears up after it.
    let outside: Vec<&str> = stderr
        .lines()
        .filter(|line| line.contains(" plumb") && !line.contains(run))
        .filter(|line| !line.contains(" plumb::run: ") && !line.contains(" plumb_bus::"))
        .collect();
    assert_eq!(outside, [] as [&str; 0]);
}

#[test]
fn what_the_cell_itself_reports_is_there_too() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--headless", "--pace", "real"]);
    running.until(|event| event["event"] == "step_started");
    let other_program = rusqlite::Connection::open(lab.state().join("plumb.sqlite3")).unwrap();
    other_program.execute_batch("BEGIN EXCLUSIVE").unwrap();
    let (_, code) = running.end();
    drop(other_program);
    assert_eq!(code, Some(2));
    let log = fs::read_to_string(lab.state().join("logs/run-1.log")).unwrap();
    let line = log.lines().find(|line| line.contains("the run cannot be written down"));
    assert!(
        line.is_some_and(
            |line| line.contains("ERROR run{run=1 ") && line.contains(": plumb_cell::engine::start: ")
        ),
        "{log}"
    );
}
