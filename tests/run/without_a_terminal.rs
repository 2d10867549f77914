//! The program where nobody sits at a terminal: in a pipe, a service, a container.

use std::io::{BufRead as _, BufReader, Read as _};
use std::process::Stdio;

use crate::lab::Lab;

#[test]
fn screens_without_a_terminal_are_refused_without_a_letter_for_one() {
    let lab = Lab::new();
    assert_eq!(lab.plumb(&["run", "cell.yaml", "--headless"]).code(), 0);
    let refused = lab.plumb(&["watch", "1"]);
    assert_eq!(refused.code(), 2, "{}", refused.all());
    assert_eq!(refused.out(), "", "no escapes");
    assert!(refused.err().contains("the screens need a terminal"), "{}", refused.err());
}

#[test]
fn who_runs_it_is_known_where_no_variable_gives_it() {
    let lab = Lab::new();
    let mut command = lab.command(&["run", "cell.yaml", "--headless"]);
    let ran = command.env_remove("USER").env_remove("LOGNAME").output().unwrap();
    assert!(ran.status.success());
    let shown = lab.plumb(&["show", "1"]).out();
    assert!(shown.contains(", by ") && !shown.contains(", by unknown"), "{shown}");
}

/// As in `plumb run | head`: what read along has gone, and nobody would learn how the run went on.
#[test]
fn a_run_whose_reader_goes_away_is_aborted_and_its_exit_code_says_so() {
    let lab = Lab::new();
    let mut command = lab.command(&["run", "cell.yaml", "--headless", "--pace", "real"]);
    let mut running = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut read = BufReader::new(running.stdout.take().unwrap());
    let mut line = String::new();
    read.read_line(&mut line).unwrap();
    assert!(line.starts_with("run 1 of teachmover"), "{line}");
    drop(read);
    let mut message = String::new();
    running.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    assert_eq!(running.wait().unwrap().code(), Some(3), "{message}");
    let by = "ended by its standard output, which cannot be written: Broken pipe";
    assert!(message.contains(&format!("the run was aborted: {by}")), "{message}");
    let run = lab.shown("1")["run"].clone();
    assert_eq!(run["state"], "aborted");
    assert!(run["message"].as_str().unwrap().contains(by), "{run}");
}
