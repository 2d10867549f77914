//! Runs that are interrupted from outside.

use nix::sys::signal::Signal;

use crate::lab::{Lab, wait_gone};

#[test]
fn a_run_killed_in_mid_move_loses_no_answer_and_goes_on_at_the_step_where_it_died() {
    for step in ["waist.lower", "waist.find_a", "shoulder_elbow.cycle[1].edge"] {
        let lab = Lab::new();
        let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
        running.until_moving_in(step);
        let hosts = running.hosts();
        assert_eq!(hosts.len(), 2, "{hosts:?}");
        running.signal(Signal::SIGKILL);
        assert_eq!(running.end().1, None);
        for host in hosts {
            wait_gone(host);
        }
        let history = lab.plumb(&["history"]).out();
        assert!(history.contains("not ended"), "{history}");

        let resumed = lab.plumb(&["run", "--resume", "1"]);
        assert_eq!(resumed.code(), 0, "killed in {step}: {}", resumed.all());
        assert!(resumed.out().contains(&format!("resumed at {step}")), "{}", resumed.out());
        lab.assert_zeros_found("1");
        let shown = lab.shown("1");
        let prompts = shown["prompts"].as_array().unwrap();
        for asked in ["target", "hand", "level", "place"] {
            assert_eq!(
                prompts.iter().filter(|prompt| prompt["step"] == asked).count(),
                1,
                "{asked} is asked once"
            );
        }
        let attempts = shown["steps"].as_array().unwrap().iter().filter(|attempt| attempt["step"] == step);
        let outcomes: Vec<_> = attempts.map(|attempt| attempt["outcome"].clone()).collect();
        assert_eq!(
            outcomes,
            [serde_json::Value::Null, "passed".into()],
            "the attempt that was killed never ended"
        );
    }
}

#[test]
fn a_resumed_run_reports_again_what_it_had_found_so_that_its_last_page_shows_the_whole_run() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    running.until_moving_in("shoulder_elbow.cycle[1].edge");
    let hosts = running.hosts();
    running.signal(Signal::SIGKILL);
    running.end();
    hosts.into_iter().for_each(wait_gone);
    let resumed = lab.plumb(&["run", "--resume", "1", "--json"]);
    assert_eq!(resumed.code(), 0, "{}", resumed.all());
    let events: Vec<serde_json::Value> =
        resumed.out().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let count_of = |event: &str, key: &str, value: &str| {
        let of = |one: &&serde_json::Value| one["event"] == event;
        events.iter().filter(of).filter(|one| one.pointer(key).is_some_and(|found| found == value)).count()
    };
    for joint in ["waist", "shoulder", "elbow"] {
        assert_eq!(count_of("correction_applied", "/correction/place", joint), 1, "{joint}");
    }
    assert_eq!(count_of("trigger_found", "/step", "waist.find_a"), 1);
    // Steps that hold others are done as well.
    assert_eq!(count_of("step_finished", "/step", "waist"), 1);
    // The record has it once.
    assert_eq!(lab.zeros("1").len(), 3, "{:?}", lab.zeros("1"));
}

#[test]
fn an_ended_run_is_not_resumed_and_neither_is_one_whose_files_were_changed() {
    let lab = Lab::new();
    let run = lab.plumb(&["run", "cell-paper.yaml", "--set", "cycles=1"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let resumed = lab.plumb(&["run", "--resume", "1"]);
    assert_eq!(resumed.code(), 2, "{}", resumed.all());
    assert!(resumed.err().contains("run 1 cannot be resumed: it has ended: passed"), "{}", resumed.err());

    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    running.until_moving_in("waist.lower");
    running.signal(Signal::SIGKILL);
    running.end();
    lab.edit("procedures/waist-initialization.yaml", "default: 0.6", "default: 0.7");
    let resumed = lab.plumb(&["run", "--resume", "2"]);
    assert_eq!(resumed.code(), 2, "{}", resumed.all());
    assert!(
        resumed.err().contains("waist-initialization.yaml was changed since it began"),
        "{}",
        resumed.err()
    );
}

#[test]
fn an_interrupt_from_the_keyboard_stops_the_arm_and_aborts() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    running.until_moving_in("waist.lower");
    running.signal(Signal::SIGINT);
    let (last, code) = running.end();
    assert_eq!(code, Some(3));
    assert_eq!(last["outcome"], "aborted");
    assert!(lab.zeros("1").is_empty());
    let shown = lab.shown("1");
    let attempt = shown["steps"]
        .as_array()
        .unwrap()
        .iter()
        .find(|attempt| attempt["step"] == "waist.lower")
        .unwrap()
        .clone();
    assert_eq!(attempt["outcome"], "interrupted");
}

#[test]
fn a_second_program_learns_who_runs_the_cell() {
    let lab = Lab::new();
    let mut running = lab.start(&["run", "cell.yaml", "--pace", "real"]);
    running.until_moving_in("waist.lower");
    let second = lab.plumb(&["run", "cell.yaml"]);
    assert_eq!(second.code(), 2, "{}", second.all());
    let process = running.process().to_string();
    assert!(
        second.err().contains("already run by another plumb") && second.err().contains(&process),
        "{}",
        second.err()
    );
    running.signal(Signal::SIGTERM);
    assert_eq!(running.end().1, Some(3));
}
