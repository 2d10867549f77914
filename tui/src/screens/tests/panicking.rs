//! A panic while the terminal is taken over: the terminal is given back before the message is printed.

use crate::screens::terminal::OpenTerminal;

#[path = "../../../../tests/screens/terminal.rs"]
#[expect(dead_code, reason = "the journeys use more of it")]
mod pseudo_terminal;

use pseudo_terminal::{Session, is_given_back};

/// What the test below runs inside a pseudo-terminal of its own.
const INSIDE: &str = "screens::tests::panicking::take_the_terminal_over_and_panic";

#[test]
#[ignore = "panics on purpose; the next test runs it in a pseudo-terminal"]
fn take_the_terminal_over_and_panic() {
    let mut terminal = OpenTerminal::open("plumb").expect("the terminal opens");
    terminal.draw(|frame| frame.render_widget("taken over", frame.area())).expect("the terminal draws");
    panic!("the arm fell off");
}

#[test]
fn a_panic_gives_the_terminal_back_and_can_be_read() {
    let program = std::env::current_exe().expect("the tests know their program");
    let arguments = ["--exact", INSIDE, "--ignored", "--nocapture", "--test-threads=1"];
    let mut session = Session::start_with(&program, &arguments, &[("RUST_BACKTRACE", "0")], 100, 30);
    session.wait_for("the arm fell off");
    assert!(!session.wait_for_end().success());
    is_given_back(&session);
}
