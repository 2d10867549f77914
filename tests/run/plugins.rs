//! `plumb plugins` and `plumb host`, as a person meets them.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use plumb_plugin::ContractVersion;

use crate::lab::skipped;

fn plumb(arguments: &[&str], directory: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
    command.args(arguments).current_dir(directory).stdin(Stdio::null()).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_plugins_of_the_project_are_found_and_good() {
    let elsewhere = tempfile::tempdir().unwrap();
    let listed = plumb(&["plugins", "list"], elsewhere.path());
    let list = text(&listed.stdout);
    assert!(listed.status.success(), "{list}");
    for (id, kind) in [("simulated", "robot"), ("ir-proximity", "sensor"), ("teachmover", "robot")] {
        let row = list.lines().find(|line| line.starts_with(id));
        assert!(row.is_some_and(|row| row.contains(kind) && row.contains("contract 1.0")), "{list}");
    }
    let verified = plumb(&["plugins", "verify", "simulated", "ir-proximity", "teachmover"], elsewhere.path());
    assert_eq!(text(&verified.stdout), "simulated: good\nir-proximity: good\nteachmover: good\n");
    assert!(verified.status.success());
}

#[test]
fn a_program_built_into_a_folder_elsewhere_finds_the_plugins_of_its_source() {
    let elsewhere = tempfile::tempdir().unwrap();
    let built = Path::new(env!("CARGO_BIN_EXE_plumb"));
    let program = elsewhere.path().join("plumb");
    fs::copy(built, &program).unwrap();
    let library = "libplumb_ir_proximity.so";
    fs::copy(built.parent().unwrap().join("deps").join(library), elsewhere.path().join(library)).unwrap();
    let mut command = Command::new(&program);
    let verified = command.args(["plugins", "verify", "ir-proximity"]).stdin(Stdio::null()).output().unwrap();
    assert_eq!(text(&verified.stdout), "ir-proximity: good\n");
}

#[test]
fn a_program_built_into_a_folder_elsewhere_runs_drivers_in_python() {
    if Command::new("python3").arg("--version").output().is_err() {
        skipped("there is no `python3` here");
        return;
    }
    let elsewhere = tempfile::tempdir().unwrap();
    let program = elsewhere.path().join("plumb");
    fs::copy(env!("CARGO_BIN_EXE_plumb"), &program).unwrap();
    let run = |arguments: &[&str]| {
        let mut command = Command::new(&program);
        command
            .args(["plugins"])
            .args(arguments)
            .current_dir(elsewhere.path())
            .stdin(Stdio::null())
            .output()
            .unwrap()
    };
    assert!(run(&["new", "sensor", "gauge", "--lang", "python"]).status.success());
    let manifest = fs::read_to_string(elsewhere.path().join("gauge/plugin.yaml")).unwrap();
    assert!(!manifest.contains("library"), "a driver in Python has none: {manifest}");
    let checked = run(&["check", "gauge"]);
    assert!(checked.status.success(), "{}{}", text(&checked.stdout), text(&checked.stderr));
}

#[test]
fn a_bad_plugin_is_one_line_and_does_not_hide_the_others() {
    let directory = tempfile::tempdir().unwrap();
    let old = directory.path().join("old");
    fs::create_dir(&old).unwrap();
    fs::write(old.join("plugin.yaml"), "id: old-arm\ncontract: [0, 3]\nheadline: An arm of long ago\n")
        .unwrap();
    let listed = plumb(&["plugins", "list", "--plugins", "."], directory.path());
    let list = text(&listed.stdout);
    assert_eq!(listed.status.code(), Some(1), "{list}");
    let row = list.lines().find(|line| line.starts_with("unusable: ")).unwrap();
    assert_eq!(
        row,
        format!(
            "unusable: ./old/plugin.yaml: plugin 'old-arm' was built for contract 0.3; this program speaks {}: \
             rebuild the plugin against contract 1.x",
            ContractVersion::CURRENT
        )
    );
    assert!(list.contains("simulated"), "{list}");
}

#[test]
fn an_unknown_plugin_is_named_with_those_there_are() {
    let elsewhere = tempfile::tempdir().unwrap();
    let verified = plumb(&["plugins", "verify", "simulatd"], elsewhere.path());
    let answer = text(&verified.stdout);
    assert_eq!(verified.status.code(), Some(1));
    assert!(answer.starts_with("simulatd: there is no plugin 'simulatd'; there are "), "{answer}");
    assert!(answer.contains("simulated"), "{answer}");
}

#[test]
fn a_host_started_by_hand_says_what_it_is_for() {
    let elsewhere = tempfile::tempdir().unwrap();
    let host = plumb(&["host"], elsewhere.path());
    assert_eq!(host.status.code(), Some(70));
    let message = text(&host.stderr);
    assert!(message.starts_with("plumb host is started by plumb itself: "), "{message}");
}
