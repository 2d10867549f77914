//! `plumb model add` of what the lab would not name: a question at a terminal, a refusal where nobody can be asked.

#![allow(clippy::expect_used, reason = "a test that cannot go on has failed")]

use std::path::Path;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

use crate::exploring::machine;
use crate::plumb;
use crate::terminal::Session;

/// Adds without a terminal.
fn add(pair: &[String; 2], effect: &str, more: &[&str]) -> Output {
    let mut command = Command::new(plumb());
    command.args(["model", "add", &pair[0], effect, "--data", &pair[1]]).args(more).stdin(Stdio::null());
    command.output().expect("the program runs")
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Whether the model has a revision of this number.
fn is_written(folder: &TempDir, number: u32) -> bool {
    folder.path().join(format!("model.rev{number}.yaml")).exists()
}

#[test]
fn what_the_lab_would_not_name_is_not_added_where_nobody_can_be_asked() {
    let folder = TempDir::new().expect("a folder for the files");
    let pair = machine(folder.path());
    for more in [&[][..], &["--json"]] {
        let refused = add(&pair, "joint_gain( elbow )", more);
        let printed = message(&refused);
        assert_eq!(refused.status.code(), Some(2), "{printed}");
        assert!(
            printed.contains("joint_gain( elbow ) was not named: ") && printed.contains("--yes"),
            "{printed}"
        );
        assert!(refused.stdout.is_empty() && !is_written(&folder, 1));
    }
    // What is named, and what only frees numbers, needs no leave.
    let added = add(&pair, "joint_zero(shoulder)", &[]);
    assert_eq!(added.status.code(), Some(0), "{}", message(&added));
    let freed = add(&pair, "link_length(*)", &[]);
    assert_eq!(freed.status.code(), Some(0), "{}", message(&freed));
    assert!(is_written(&folder, 1) && is_written(&folder, 2) && !is_written(&folder, 3));
    // At the floor chance explains the rest: adding more is asked about too.
    let refused = add(&pair, "joint_gain(elbow)", &[]);
    assert_eq!(refused.status.code(), Some(2), "{}", message(&refused));
    let forced = add(&pair, "joint_gain(elbow)", &["--yes"]);
    assert_eq!(forced.status.code(), Some(0), "{}", message(&forced));
    assert!(is_written(&folder, 3));
}

#[test]
fn at_a_terminal_it_asks_and_only_a_yes_adds() {
    let folder = TempDir::new().expect("a folder for the files");
    let pair = machine(folder.path());
    let asked = |answer: &str, expected: &str| {
        let arguments = ["model", "add", &pair[0], "joint_gain(elbow)", "--data", &pair[1]];
        let mut session = Session::start(Path::new(plumb()), &arguments, 120, 40);
        session.wait_for("Add it all the same? [y/N]");
        assert!(session.text().contains("joint_gain(elbow) was not named: "), "{}", session.text());
        session.press(answer);
        let text = session.wait_for(expected);
        (session.wait_for_end().exit_code(), text)
    };
    for answer in ["\r", "n\r", "what\r"] {
        let (code, text) = asked(answer, "nothing was added");
        assert!(code == 2 && !is_written(&folder, 1), "{code}: {text}");
    }
    let (code, text) = asked("y\r", "revision 1 is");
    assert!(code == 0 && is_written(&folder, 1), "{code}: {text}");
}
