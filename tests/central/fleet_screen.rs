//! The fleet's terminal screen, in a pseudo-terminal, over a database that goes and comes back.

use std::path::Path;

use crate::fleet::fleet;
use crate::lab::Lab;
use crate::server::Server;
use crate::terminal::{Session, is_given_back};

fn start(address: &str, columns: u16, rows: u16) -> Session {
    let program = Path::new(env!("CARGO_BIN_EXE_plumb"));
    Session::start(program, &["fleet", "--from", address, "--screen"], columns, rows)
}

#[test]
fn the_fleets_screen_shows_who_waits_first_and_goes_on_when_the_database_is_back() {
    let Some(mut server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    fleet(&lab, &server);
    server.ask("UPDATE records SET last_seen = now() + interval '1 hour'");
    let mut session = start(&address, 80, 24);
    let page = session.wait_for("20 cells; 1 waits for an answer, 0 are silent");
    let lines: Vec<&str> = page.lines().collect();
    assert!(
        lines[2].starts_with("> cell-03") && lines[2].contains("WAITS for") && lines[3].contains("cell-00"),
        "{page}"
    );
    assert!(page.contains("cell-03 (1 of 20)") && page.contains("Lay the target & fix it"), "{page}");

    // From cell to cell; the last one is reached, and the chosen one is shown in full.
    session.press("jjj");
    let page = session.wait_for("cell-02 (4 of 20)");
    assert!(page.contains("initialize, ") && page.contains("arm ur5; began 2026-"), "{page}");
    session.press("G");
    session.wait_for("> cell-19");
    session.press("k");
    session.wait_for("cell-18 (19 of 20)");
    // What is written meanwhile is seen, and the same cell stays chosen.
    server.ask("UPDATE records SET last_seen = now() - interval '3 hours' WHERE directory LIKE '%-0'");
    session.wait_for("1 is silent");
    session.wait_for("> cell-18");

    // The database goes, and comes back.
    server.kill();
    session.wait_for("and is read again every 2 s: the central database");
    session.wait_for("> cell-18");
    server.start();
    session.wait_until_gone("is read again every 2 s");
    // On a larger terminal there is more to be seen.
    session.resize(140, 40);
    session.wait_for("last passed");
    session.wait_for("cell-00 ");
    session.press("q");
    assert!(session.wait_for_end().success());
    is_given_back(&session);
}

#[test]
fn a_screen_that_cannot_be_shown_says_why_and_leaves_the_terminal_alone() {
    let Some(server) = Server::new() else { return };
    let (lab, address) = (Lab::new(), server.address());
    let mut empty = start(&address, 80, 24);
    empty.wait_for("No cell has shipped anything yet");
    empty.press("Gjq");
    assert!(empty.wait_for_end().success());
    for (arguments, expected) in [
        (&["--from", &address, "--screen"][..], "the screens need a terminal"),
        (&["--from", "lab-server", "--screen"], "postgres://USER@HOST/DATABASE"),
        (&["--from", "postgres://localhost:9/plumb", "--screen"], "does not answer"),
        (&["--from", &address, "--screen", "--json"], "cannot be used with"),
    ] {
        let output = lab.plumb(&[&["fleet"], arguments].concat());
        assert!(output.code() == 2 && output.err().contains(expected), "{arguments:?}: {}", output.all());
        assert!(!output.all().contains('\u{1b}'), "nothing for a terminal: {:?}", output.all());
    }
}
