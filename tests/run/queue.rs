//! The queue of a cell: edited while a run goes on, killed in the middle of one, and carried out to its end with nothing run twice and
//! nothing lost.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;
use serde_json::Value;

use crate::lab::{Lab, PATIENCE, hosts_of, kill, wait_gone};

/// The cell with answers that let a killed run go on by itself.
fn lab() -> Lab {
    let lab = Lab::new();
    let answers = std::fs::read_to_string(lab.path("answers.yaml")).unwrap();
    lab.write("answers.yaml", &format!("{answers}confirm_pose: true\n"));
    lab
}

fn add(lab: &Lab, arguments: &[&str]) -> String {
    let output = lab.plumb(&[&["queue", "add", "cell.yaml"], arguments].concat());
    assert_eq!(output.code(), 0, "{}", output.all());
    output.out()
}

/// The entries that are not over: number, procedure, run.
fn list(lab: &Lab) -> Vec<(i64, String, Option<i64>)> {
    let output = lab.plumb(&["queue", "list", "cell.yaml", "--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let entry = |line: &str| {
        let entry: Value = serde_json::from_str(line).unwrap();
        (
            entry["id"].as_i64().unwrap(),
            entry["procedure"].as_str().unwrap().to_owned(),
            entry["run"].as_i64(),
        )
    };
    output.out().lines().map(entry).collect()
}

fn numbers(lab: &Lab) -> Vec<i64> {
    list(lab).into_iter().map(|(number, ..)| number).collect()
}

/// Runs of the record, the oldest first: number, procedure, state.
fn history(lab: &Lab) -> Vec<(i64, String, String)> {
    let output = lab.plumb(&["history", "--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let mut runs: Vec<_> = output
        .out()
        .lines()
        .map(|line| {
            let run: Value = serde_json::from_str(line).unwrap();
            let text = |key: &str| run[key].as_str().unwrap_or_default().to_owned();
            (run["run"].as_i64().unwrap(), text("procedure"), text("state"))
        })
        .collect();
    runs.sort();
    runs
}

/// `plumb queue run`, whose events are read.
struct Carried {
    child: Child,
    lines: BufReader<std::process::ChildStdout>,
}

impl Carried {
    fn start(lab: &Lab, arguments: &[&str]) -> Self {
        let mut command = lab.command(&["queue", "run", "cell.yaml", "--json"]);
        let mut child =
            command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap());
        Self { child, lines }
    }

    /// Reads on to the first event that fits; false where the output ends before.
    fn until(&mut self, fits: impl Fn(&Value) -> bool) -> bool {
        let mut line = String::new();
        while self.lines.read_line(&mut line).unwrap() > 0 {
            if serde_json::from_str(&line).is_ok_and(|event: Value| fits(&event)) {
                return true;
            }
            line.clear();
        }
        false
    }

    fn until_step(&mut self, step: &str) {
        assert!(self.until(|event| event["event"] == "step_started" && event["step"] == step), "step {step}");
    }

    /// Kills it with -9, and waits until its devices' processes have gone too.
    fn kill(mut self) {
        let hosts = hosts_of(self.child.id());
        kill(self.child.id());
        self.child.wait().unwrap();
        hosts.into_iter().for_each(wait_gone);
    }

    fn end(mut self) -> Option<i32> {
        self.until(|_| false);
        self.child.wait().unwrap().code()
    }
}

impl Drop for Carried {
    fn drop(&mut self) {
        let _over = self.child.kill();
        let _over = self.child.wait();
    }
}

#[test]
fn a_queue_is_edited_while_a_run_goes_on_and_then_done_in_the_new_order() {
    let lab = lab();
    // Long enough to be edited meanwhile.
    add(&lab, &["initialize", "--set", "cycles=20"]);
    add(&lab, &["initialize", "--set", "Br_deg=6"]);
    let output = add(&lab, &["shoulder-elbow-initialization"]);
    assert!(
        output.starts_with("entry 3: shoulder-elbow-initialization of teachmover")
            && output.contains("2 wait before it"),
        "{output}"
    );
    let mut carried = Carried::start(&lab, &["--pace", "fast"]);
    assert!(carried.until(|event| event["event"] == "run_started"));
    // The first goes on: it is moved no more, nor taken off, and the others are.
    let moved = lab.plumb(&["queue", "move", "1", "--last"]);
    assert!(moved.code() == 2 && moved.err().contains("entry 1 does not wait"), "{}", moved.all());
    let removed = lab.plumb(&["queue", "remove", "1"]);
    assert!(removed.code() == 2 && removed.err().contains("end run 1 first"), "{}", removed.all());
    let twice = lab.plumb(&["queue", "run", "cell.yaml"]);
    assert!(twice.code() == 2 && twice.err().contains("carried out already, by process"), "{}", twice.all());
    let moved = lab.plumb(&["queue", "move", "3", "--before", "2"]);
    assert!(moved.out().contains("run 1 goes on"), "{}", moved.all());
    add(&lab, &["waist-initialization", "--first"]);
    assert_eq!(lab.plumb(&["queue", "remove", "2"]).code(), 0);
    assert_eq!(carried.end(), Some(0));
    let done: Vec<(String, String)> = history(&lab).into_iter().map(|(_, what, how)| (what, how)).collect();
    let passed = |what: &str| (what.to_owned(), "passed".to_owned());
    let expected =
        [passed("initialize"), passed("waist-initialization"), passed("shoulder-elbow-initialization")];
    assert_eq!(done, expected);
    assert_eq!(numbers(&lab), Vec::<i64>::new());
    let empty = lab.plumb(&["queue", "list"]);
    assert!(empty.out().contains("nothing waits"), "{}", empty.out());
}

#[test]
fn killed_in_the_middle_of_a_run_the_queue_goes_on_with_it_and_runs_nothing_twice() {
    let lab = lab();
    add(&lab, &["initialize", "--set", "Br_deg=6"]);
    add(&lab, &["waist-initialization"]);
    add(&lab, &["waist-initialization"]);
    // Killed in three steps of the first run, and in one of the second.
    for step in ["waist.lower", "waist.find_a", "shoulder_elbow.cycle"] {
        let mut carried = Carried::start(&lab, &["--pace", "fast"]);
        let reached = carried.until(|event| {
            event["event"] == "step_started" && event["step"].as_str().is_some_and(|at| at.starts_with(step))
        });
        if !reached {
            break;
        }
        carried.kill();
        let shown = lab.plumb(&["queue", "list"]).out();
        assert!(shown.contains("run 1 was killed"), "{shown}");
    }
    let mut carried = Carried::start(&lab, &["--pace", "fast"]);
    assert!(carried.until(|event| event["event"] == "run_started" && event["run"] == 2), "the second run");
    assert!(carried.until(|event| event["event"] == "step_finished"));
    carried.kill();
    assert_eq!(Carried::start(&lab, &["--pace", "fast"]).end(), Some(0));
    let done = history(&lab);
    let expected = ["initialize", "waist-initialization", "waist-initialization"];
    let as_expected = done.iter().zip(expected).all(|(run, what)| run.1 == what && run.2 == "passed");
    assert!(done.len() == 3 && as_expected, "{done:?}");
    assert_eq!(lab.shown("1")["run"]["parameters"]["Br_deg"], 6.0, "a run that goes on keeps its parameters");
    lab.assert_zeros_found("1");
    assert_eq!(numbers(&lab), Vec::<i64>::new());
}

#[test]
fn a_run_that_is_asked_to_end_is_kept_and_gone_on_with() {
    let lab = lab();
    add(&lab, &[]);
    let mut carried = Carried::start(&lab, &["--pace", "fast"]);
    carried.until_step("waist.lower");
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(carried.child.id().cast_signed()), Signal::SIGTERM)
        .unwrap();
    assert_eq!(carried.end(), Some(4));
    assert_eq!(history(&lab)[0].2, "needs_operator");
    assert_eq!(Carried::start(&lab, &["--pace", "fast"]).end(), Some(0));
    assert_eq!(history(&lab).len(), 1);
    lab.assert_zeros_found("1");
}

#[test]
fn what_does_not_pass_stops_the_queue_until_a_person_takes_it_off() {
    let lab = lab();
    let answers = std::fs::read_to_string(lab.path("answers.yaml")).unwrap();
    lab.write("tilted.yaml", &answers.replace("level: offered", "level: 1.5"));
    add(&lab, &["initialize", "--answers", "tilted.yaml"]);
    add(&lab, &["waist-initialization"]);
    let stopped = lab.plumb(&["queue", "run", "cell.yaml", "--pace", "fast"]);
    assert_eq!(stopped.code(), 1, "{}", stopped.all());
    assert!(stopped.out().contains("the queue stops at entry 1; 1 waits"), "{}", stopped.all());
    let again = lab.plumb(&["queue", "run", "cell.yaml", "--pace", "fast"]);
    assert_eq!(again.code(), 4, "{}", again.all());
    assert!(
        again.err().contains("entry 1 is in the way: run 1 failed")
            && again.err().contains("plumb queue remove 1"),
        "{}",
        again.err()
    );
    assert_eq!(history(&lab).len(), 1, "nothing was run meanwhile");
    let past = lab.plumb(&["queue", "run", "cell.yaml", "--pace", "fast", "--past-failed"]);
    assert_eq!(past.code(), 0, "{}", past.all());
    assert_eq!(history(&lab).len(), 2);
    assert_eq!(numbers(&lab), [1], "a failed run stays to be seen");
    assert_eq!(lab.plumb(&["queue", "remove", "1"]).code(), 0);
    assert_eq!(numbers(&lab), Vec::<i64>::new());
}

/// As in `plumb queue run CELL | head -1`.
#[test]
fn a_queue_whose_reader_goes_away_stops_and_its_exit_code_says_so() {
    let lab = lab();
    add(&lab, &["initialize"]);
    add(&lab, &["waist-initialization"]);
    let carried_out = |lines_read: usize| {
        let mut command = lab.command(&["queue", "run", "cell.yaml", "--pace", "real"]);
        let mut running = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(running.stdout.take().unwrap()).lines();
        lines.by_ref().take(lines_read).for_each(|line| assert!(!line.unwrap().is_empty()));
        drop(lines);
        let ended = running.wait_with_output().unwrap();
        (ended.status.code(), String::from_utf8(ended.stderr).unwrap())
    };
    let (code, message) = carried_out(0);
    assert_eq!(code, Some(2), "{message}");
    assert!(
        message.contains("the queue stops, since its standard output cannot be written: Broken pipe"),
        "{message}"
    );
    assert_eq!(numbers(&lab), [1, 2], "nothing has begun");
    assert_eq!(history(&lab).len(), 0);
    let (code, message) = carried_out(2);
    assert_eq!(code, Some(3), "{message}");
    assert_eq!(history(&lab), [(1, "initialize".to_owned(), "aborted".to_owned())], "{message}");
}

#[test]
fn what_could_not_run_is_refused_when_it_is_queued() {
    let lab = lab();
    lab.write("few.yaml", "by: nobody\nanswers:\n  target: done\n");
    lab.write("wrong.yaml", "by: nobody\nanswers:\n  targett: done\n");
    for (arguments, code, expected) in [
        (&["cell.yaml", "waist-initialisation"][..], 2, "has no procedure `waist-initialisation`"),
        (&["cell.yaml", "initialize", "--answers", "few.yaml"], 4, "no answers are given for"),
        (&["cell.yaml", "initialize", "--answers", "wrong.yaml"], 2, "targett"),
        (&["cell.yaml", "initialize", "--answers", "none.yaml"], 2, "none.yaml"),
        (&["cell.yaml", "initialize", "--set", "Br=5"], 2, "no parameter `Br`"),
        (&["cell.yaml", "initialize", "--set", "Br_deg=-400"], 2, "Br_deg"),
        (&["nothing.yaml"], 2, "nothing.yaml"),
    ] {
        let output = lab.plumb(&[&["queue", "add"], arguments].concat());
        assert!(
            output.code() == code && output.err().contains(expected),
            "{arguments:?}: {} {}",
            output.code(),
            output.all()
        );
    }
    assert_eq!(numbers(&lab), Vec::<i64>::new(), "nothing was queued");
    for (arguments, expected) in [
        (&["move", "7", "--first"][..], "there is no entry 7"),
        (&["remove", "7"], "there is no entry 7"),
        (&["remove"], "name the entries"),
        (&["run", "nothing.yaml"], "there is no cell file nothing.yaml"),
    ] {
        let output = lab.plumb(&[&["queue"], arguments].concat());
        assert!(output.code() == 2 && output.err().contains(expected), "{arguments:?}: {}", output.all());
    }
}

/// A queue that waits carries out what is added later, and ends when it is asked to.
#[test]
fn a_queue_that_waits_takes_what_comes() {
    let lab = lab();
    let mut carried = Carried::start(&lab, &["--pace", "fast", "--wait"]);
    let begin = Instant::now();
    add(&lab, &["waist-initialization"]);
    assert!(carried.until(|event| event["event"] == "run_ended"));
    assert!(begin.elapsed() < PATIENCE);
    std::thread::sleep(Duration::from_millis(100));
    nix::sys::signal::kill(nix::unistd::Pid::from_raw(carried.child.id().cast_signed()), Signal::SIGTERM)
        .unwrap();
    assert_eq!(carried.end(), Some(4));
    assert_eq!(history(&lab)[0].2, "passed");
}
