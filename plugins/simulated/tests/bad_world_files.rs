//! Every file in `bad_worlds/` is refused with the message its first line gives.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;

use plumb_simulated::world::file::{self, parse};

#[test]
fn each_bad_world_file_is_refused_with_its_message() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad_worlds");
    let mut seen = 0;
    for entry in std::fs::read_dir(directory).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        let expected = text.lines().next().unwrap().strip_prefix("# refused: ").unwrap();
        let error = parse("world.yaml", &text).unwrap_err().to_string();
        assert_eq!(error, expected, "{}", path.display());
        seen += 1;
    }
    assert!(seen >= 14, "{seen} files");
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
