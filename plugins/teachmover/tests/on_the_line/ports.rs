//! Ports that cannot be used, and lines that take no bytes: what the driver says.

use std::time::Duration;

use crate::pseudo_terminal::PseudoTerminal;
use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{PluginError, Robot};
use plumb_serial_line::WriteFailure;
use plumb_teachmover::TeachMover;
use plumb_teachmover::reply_line::{ReplyLine, SerialError};
use serde_json::json;

fn error_of(port: &str) -> PluginError {
    TeachMover::create(&json!({ "port": port }), RecordingHost::new().host()).unwrap_err()
}

#[test]
fn a_port_that_is_not_there_is_named_with_what_to_check() {
    assert_eq!(
        error_of("/dev/ttyUSB-none"),
        PluginError::Disconnected(
            "cannot open the serial port /dev/ttyUSB-none: there is no such port; check that the adapter is plugged in, and its name (ls /dev/serial/by-id)"
                .to_owned()
        )
    );
}

#[test]
fn a_port_another_program_has_open_is_named_with_how_to_find_it() {
    let terminal = PseudoTerminal::open();
    let port = terminal.path.display().to_string();
    let _holder = ReplyLine::open(&port, 9600).unwrap();
    assert_eq!(
        error_of(&port),
        PluginError::Disconnected(format!(
            "cannot open the serial port {port}: another program has it open; end that program (fuser {port} names it)"
        ))
    );
}

#[test]
fn a_file_that_is_no_port_is_refused() {
    for path in ["/dev/null", "/"] {
        assert_eq!(
            error_of(path),
            PluginError::Refused(format!(
                "cannot open the serial port {path}: that is no serial port; check the name (ls /dev/serial/by-id)"
            ))
        );
    }
}

#[test]
fn a_peer_that_reads_nothing_cannot_hold_a_long_write() {
    let terminal = PseudoTerminal::open();
    let mut line = ReplyLine::open(&terminal.path.display().to_string(), 9600).unwrap();
    let error = line.write("a long command", &[b'x'; 100_000], Duration::from_millis(200)).unwrap_err();
    let SerialError::WriteCommand { sent, length: 100_000, failure, .. } = error else { panic!("{error}") };
    assert!(sent < 100_000);
    assert_eq!(failure, WriteFailure::Full { waited: Duration::from_millis(200) });
}

#[test]
fn what_waited_in_the_port_before_it_was_opened_is_thrown_away() {
    let mut terminal = PseudoTerminal::open();
    terminal.send(b"1\r1\r");
    let mut line = ReplyLine::open(&terminal.path.display().to_string(), 9600).unwrap();
    line.drain().unwrap();
    assert_eq!(line.line_at_hand(), Ok(None));
}
