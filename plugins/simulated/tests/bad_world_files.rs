//! Every file in `bad_worlds/` is refused with the message beside it. To accept new messages, run with `ACCEPT=1` and read what changed.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;

use plumb_simulated::world::file::{self, parse};

#[test]
fn each_bad_world_file_is_refused_with_its_message() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_worlds");
    let mut seen = 0;
    let mut wrong = Vec::new();
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "yaml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let found = parse("world.yaml", &text).unwrap_err().to_string() + "\n";
        let expected_file = path.with_extension("txt");
        if std::env::var_os("ACCEPT").is_some() {
            std::fs::write(&expected_file, &found).unwrap();
        }
        let expected = std::fs::read_to_string(&expected_file).unwrap_or_default();
        if found != expected {
            wrong.push(format!("--- {}\nexpected:\n{expected}\nfound:\n{found}", path.display()));
        }
        seen += 1;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(seen >= 24, "{seen} files");
}

#[test]
fn all_mistakes_of_a_world_file_are_shown_at_once() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_worlds");
    let message = std::fs::read_to_string(directory.join("many_mistakes.txt")).unwrap();
    let mistakes = message.lines().filter(|line| line.starts_with("world.yaml:")).count();
    assert_eq!(mistakes, 6, "{message}");
}

#[test]
fn a_file_that_is_not_there_is_said_so() {
    let error = file::read(Path::new("/nowhere/world.yaml")).unwrap_err();
    assert_eq!(
        error.to_string(),
        "cannot read world file /nowhere/world.yaml: No such file or directory (os error 2)"
    );
}

#[test]
fn a_bomb_of_aliases_is_stopped() {
    let mut text = "a0: &a0 [x, x, x, x, x, x, x, x]\n".to_owned();
    for level in 1..9 {
        let before = level - 1;
        let aliases = vec![format!("*a{before}"); 8].join(", ");
        text.push_str(&format!("a{level}: &a{level} [{aliases}]\n"));
    }
    assert!(parse("world.yaml", &text).is_err());
    let deep = format!("world: {}{}", "[".repeat(5000), "]".repeat(5000));
    assert!(parse("world.yaml", &deep).is_err());
}
