//! The screens around a run that was recorded: pages, help, sizes, and the terminal given back on every way out.

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::terminal::{Session, is_given_back};
use crate::{beside, plumb};

/// A recorded run, watched in a terminal of this size.
fn watched(columns: u16, rows: u16) -> Session {
    let events = beside("recorded-run.jsonl");
    let session = Session::start(plumb(), &["watch", &events.display().to_string()], columns, rows);
    session.wait_for("Bring the forearm upright");
    session
}

#[test]
fn pages_and_help_open_and_close() {
    let mut session = watched(80, 24);
    session.press("\t");
    session.wait_for("run 12: initialize in teachmover-simulated");
    session.press("1");
    session.wait_for("Devices");
    session.press("?");
    let help = session.wait_for("Nothing can be stopped from here: this program moves no robot.");
    assert!(!help.contains("Show the Model screen"), "a page that is not there has no keys: {help}");
    session.press("\r");
    session.wait_until_gone("Nothing can be stopped from here: this program moves no robot.");
    session.press("q");
    assert!(session.wait_for_end().success());
    is_given_back(&session);
}

#[test]
fn a_resized_terminal_is_drawn_anew_down_to_one_cell() {
    let session = watched(80, 24);
    session.resize(120, 40);
    session.wait_until("the stop bar in the last row", |screen| {
        screen.rows(0, 120).nth(39).is_some_and(|row| row.contains("Watching only"))
    });
    session.resize(1, 1);
    session.resize(60, 12);
    session.wait_until("the stop bar in the last row", |screen| {
        screen.rows(0, 60).nth(11).is_some_and(|row| row.contains("Watching only"))
    });
}

#[test]
fn signals_end_the_program_and_give_the_terminal_back() {
    for signal in [Signal::SIGTERM, Signal::SIGHUP, Signal::SIGINT] {
        let mut session = watched(80, 24);
        kill(Pid::from_raw(session.process()), signal).expect("the program takes signals");
        assert!(session.wait_for_end().success(), "{signal} ends it in good order");
        is_given_back(&session);
    }
}

#[test]
fn who_only_watches_learns_that_nothing_can_be_stopped() {
    let mut session = watched(80, 24);
    session.wait_for("Watching only: nothing can be stopped from here.");
    session.press("\x1b");
    session.wait_for("Nothing was stopped: this program only watches.");
}

#[test]
fn a_file_that_holds_no_events_is_named_with_its_line() {
    let events = beside("main.rs");
    let mut session = Session::start(plumb(), &["watch", &events.display().to_string()], 100, 24);
    session.wait_for("line 1");
    session.press("q");
    assert_eq!(session.wait_for_end().exit_code(), 2);
    session.wait_for("expected events as `plumb run --json` writes them");
}
