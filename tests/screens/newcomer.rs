//! A newcomer who places the hand on the wrong side, too low and too far, and gets out of each without ending the run.

#![allow(clippy::expect_used, reason = "a test that cannot go on has failed")]

use std::fs;
use std::process::Command;

use crate::bench::Bench;
use crate::plumb;
use crate::terminal::Session;

/// Keys of a jog, as a terminal sends them.
const RIGHT: &str = "\x1b[C";
const LEFT: &str = "\x1b[D";

/// Where the chosen joint is by the page, deg.
fn chosen(page: &str, joint: &str) -> Option<f64> {
    let mark = format!("\u{25b8} {joint} ");
    let line = page.lines().find(|line| line.contains(&mark))?;
    line.split(&mark).nth(1)?.split_whitespace().next()?.parse().ok()
}

/// Jogs the chosen joint so many steps of ten degrees, each once the one before is over.
#[track_caller]
fn jog(session: &mut Session, joint: &str, key: &str, times: u32) {
    for _ in 0..times {
        let before = chosen(&session.text(), joint).expect("the joint is chosen");
        let expected = before + if key == RIGHT { 10.0 } else { -10.0 };
        session.press(key);
        session.wait_until(&format!("{joint} at {expected}"), |screen| {
            chosen(&screen.contents(), joint).is_some_and(|now| (now - expected).abs() < 0.02)
        });
        // Keys that come while the arm still moves are dropped.
        std::thread::sleep(std::time::Duration::from_millis(150));
    }
}

/// A failed search of line A: what is said of it, however the lines break.
#[track_caller]
fn line_a_is_missed(session: &Session) {
    session.wait_until("line A missed", |screen| {
        let words: Vec<String> = screen.contents().split_whitespace().map(str::to_owned).collect();
        let page = words.join(" ");
        page.contains("Line A not found") && page.contains("Move arm yourself")
    });
}

fn newcomer(columns: u16, rows: u16) {
    let bench = Bench::new();
    let mut session = bench.run(&["--pace", "fast"], columns, rows);
    session.wait_for("Lay the T target");
    session.wait_for("Simulated: done already, Enter goes on.");
    session.press("\r");
    session.wait_for("Set the hand with the teach pendant");
    // What has no room is read on with PgDn.
    if session.text().contains("PgDn reads on") {
        session.press("\x1b[6~");
        session.wait_for("next.");
    }
    session.press("\r");

    // A level that is read wrong ends nothing: it is read again.
    session.wait_for("How far from straight down does it point");
    session.press("1.5\r");
    let page = session.wait_for("m  Move arm yourself, then answer");
    assert!(page.contains("t  Answer \u{201c}How straight down"), "{page}");
    session.press("t");
    session.wait_for("How far from straight down does it point");
    session.press("\r");

    on_the_wrong_side(&mut session);
    too_low_and_too_far(&mut session);

    session.wait_for("zero of waist");
    session.press("\r");
    session.wait_for("zero of shoulder");
    session.press("\r");
    true_zeros_are_found(&mut session, &bench);
}

/// Places the hand where line A is not met, and goes back to the prompt that asked to place it.
fn on_the_wrong_side(session: &mut Session) {
    // On the wrong side of line A, where the paper is white too.
    session.wait_for("\u{2713} over the white quadrant");
    let page = session.wait_for("the arm is in position");
    // A ruler is beside the arm, the edges are called as on the target, and what makes a prompt readable from the arm is never left out.
    assert!(page.contains("ruler 0") && page.contains("mm high"), "{page}");
    assert!(page.contains("line B") && !page.contains("line b"), "{page}");
    assert!(page.contains("z large") && page.contains("a abort"), "{page}");
    session.press("]]");
    session.wait_for("jog by 10 deg");
    jog(session, "waist", LEFT, 3);
    let page = session.wait_for("not over the white quadrant");
    assert!(page.contains("right of A"), "{page}");
    session.press("\r");
    line_a_is_missed(session);
    // Esc leaves no question that looks live, and r asks it anew, from another page too.
    session.press("\x1b");
    let page = session.wait_for("Nothing moves until you press r to resume.");
    assert!(!page.contains("m  Move arm yourself"), "{page}");
    session.press("5");
    session.wait_for("stopped by the operator");
    session.press("r");
    session.press("2");
    line_a_is_missed(session);
    session.press("b");
}

/// Begins too low over the paper, then too far from line A, and moves the arm both times.
fn too_low_and_too_far(session: &mut Session) {
    // Back at the first prompt, and now too far to the other side.
    session.wait_for("the arm is in position");
    jog(session, "waist", RIGHT, 9);
    session.press("\r");
    // Still as low as the search left it.
    session.wait_for("eye is already ON at the start");
    session.press("m");
    session.wait_for("\u{25a0} eye is ON");
    session.press("]]");
    session.wait_for("jog by 10 deg");
    jog(session, "shoulder", RIGHT, 1);
    session.wait_for("\u{25a1} eye is OFF");
    session.press("\r");
    // Too far from line A: where the search has ended it is nearer.
    line_a_is_missed(session);
    session.press("m");
    // With all that is shown of the hand, what is asked and the button stay in sight; what was found before makes room.
    session.wait_for("ruler 0");
    let page = session.wait_for("eye is ON");
    assert!(page.contains("Move the arm to where") && page.contains("the arm is in position"), "{page}");
    assert!(chosen(&session.text(), "waist").is_some(), "the joint that searches is chosen");
    session.press("\r");
}

/// The zeros that the world hides are in force at the end, and certified.
fn true_zeros_are_found(session: &mut Session, bench: &Bench) {
    let page = session.wait_for("\u{2713} passed");
    assert!(page.contains("All steps passed"), "{page}");
    for (joint, zero) in [("waist", "1.700"), ("shoulder", "-2.400"), ("elbow", "1.300")] {
        let line =
            page.lines().find(|line| line.contains(&format!("\u{2713} {joint} zero"))).unwrap_or_default();
        assert!(line.contains(zero), "{joint}: {line}\n{page}");
    }
    session.press("q");
    assert_eq!(session.wait_for_end().exit_code(), 0);

    let certificate = bench.path("certificate.html");
    let mut command = Command::new(plumb());
    command.args(["certificate", "1", "--record"]).arg(bench.path("record")).arg("-o").arg(&certificate);
    assert!(command.output().expect("plumb certifies").status.success());
    let page = fs::read_to_string(certificate).expect("the certificate");
    for zero in ["1.7000", "-2.4000", "1.3000"] {
        assert!(page.contains(zero) || page.contains(&zero.replace('-', "\u{2212}")), "{zero}");
    }
}

#[test]
fn a_newcomer_gets_out_of_every_corner_in_a_small_terminal() {
    newcomer(80, 24);
}

#[test]
fn a_newcomer_gets_out_of_every_corner_in_a_large_terminal() {
    newcomer(120, 40);
}
