//! A panic while the terminal is taken over: the terminal is given back before the message is printed.

use crate::screens::terminal::OpenTerminal;

#[path = "../../../../tests/screens/terminal.rs"]
#[expect(dead_code, reason = "the journeys use more of it")]
mod pseudo_terminal;

use pseudo_terminal::{Session, is_given_back};

/// What the test is called, and how it informs the copy of itself inside the pseudo-terminal to panic.
const TEST: &str = "screens::tests::panicking::a_panic_gives_the_terminal_back_and_can_be_read";
const INSIDE: &str = "PLUMB_TEST_INSIDE_A_PSEUDO_TERMINAL";

#[test]
fn a_panic_gives_the_terminal_back_and_can_be_read() {
    if std::env::var_os(INSIDE).is_some() {
        let mut terminal = OpenTerminal::open("plumb").expect("the terminal opens");
        terminal.draw(|frame| frame.render_widget("taken over", frame.area())).expect("the terminal draws");
        panic!("the arm fell off");
    }
    let program = std::env::current_exe().expect("the tests know their program");
    let arguments = ["--exact", TEST, "--nocapture", "--test-threads=1"];
    let mut session =
        Session::start_with(&program, &arguments, &[("RUST_BACKTRACE", "0"), (INSIDE, "1")], 100, 30);
    session.wait_for("the arm fell off");
    assert!(!session.wait_for_end().success());
    is_given_back(&session);
}
