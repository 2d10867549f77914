//! `plumb doctor`, as a person with a machine that does not work meets it.

use std::fs;

use crate::lab::Lab;

#[test]
fn a_machine_that_is_right_is_reported_part_by_part() {
    let lab = Lab::new();
    let output = lab.plumb(&["doctor", "cell.yaml"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    for part in [
        "shared memory  good",
        "cells          good",
        "serial ports ",
        "terminal       note",
        "record         good",
    ] {
        assert!(output.out().contains(part), "{part}: {}", output.out());
    }
    assert!(output.out().contains("plugins        good   simulated"), "{}", output.out());
    assert!(output.out().ends_with("nothing is wrong\n"), "{}", output.out());
}

#[test]
fn what_is_wrong_is_reported_with_how_to_mend_it_and_ends_with_one() {
    let lab = Lab::new();
    let old = lab.path("plugins/old");
    fs::create_dir_all(&old).unwrap();
    fs::write(old.join("plugin.yaml"), "id: old-arm\ncontract: [0, 3]\n").unwrap();
    fs::create_dir(lab.path("record")).unwrap();
    fs::write(lab.path("record/plumb.sqlite3"), "no database at all, ".repeat(200)).unwrap();
    lab.edit("cell.yaml", "config: {bit: 0}", "config: {bit: 0, port: /dev/ttyUSB77}");
    let output = lab.plumb(&["doctor", "cell.yaml", "--plugins", "plugins", "--record", "record"]);
    assert_eq!(output.code(), 1, "{}", output.all());
    for (what, mend) in [
        ("plugin 'old-arm' was built for contract 0.3", "plumb plugins verify says more"),
        ("file is not a database", "the last copy that `plumb record backup` made"),
        ("/dev/ttyUSB77 is not there", "switch the controller on"),
    ] {
        assert!(output.out().contains(what) && output.out().contains(mend), "{what}: {}", output.out());
    }
    assert!(output.out().ends_with("3 things are wrong\n"), "{}", output.out());
    let json = lab.plumb(&["doctor", "cell.yaml", "--json", "--plugins", "plugins"]);
    let wrong = json.out().lines().filter(|line| line.contains(r#""mark":"wrong""#)).count();
    assert_eq!((json.code(), wrong), (1, 2), "{}", json.out());
}

/// Ten plugins that nobody had built, nor needed, were ten things wrong; of a program alone the plugins that are not there were one.
#[test]
fn a_plugin_that_is_not_built_is_wrong_only_for_a_cell_that_needs_it() {
    let lab = Lab::new();
    let spare = lab.path("plugins/spare");
    fs::create_dir_all(&spare).unwrap();
    let manifest = "id: spare\ntitle: Not built\nversion: 0.1.0\ncontract: [1, 0]\nkind: sensor\nlibrary: libspare.so\nquantities: []\n";
    fs::write(spare.join("plugin.yaml"), manifest).unwrap();
    let doctor = || lab.plumb(&["doctor", "cell.yaml", "--plugins", "plugins"]);
    let fine = doctor();
    assert_eq!(fine.code(), 0, "{}", fine.all());
    assert!(
        fine.out()
            .contains("plugins        note   not built: spare; a cell needs that of each of its devices"),
        "{}",
        fine.out()
    );
    assert!(
        fine.out().contains("cargo build --release") && fine.out().ends_with("nothing is wrong\n"),
        "{}",
        fine.out()
    );
    lab.edit("cell.yaml", "plugin: ir-proximity", "plugin: spare");
    let needed = doctor();
    assert_eq!(needed.code(), 1, "{}", needed.all());
    assert!(needed.out().contains("library libspare.so of plugin 'spare' is not there"), "{}", needed.out());
    assert!(needed.out().ends_with("one thing is wrong\n"), "{}", needed.out());
}

#[test]
fn a_cell_file_that_is_not_there_is_named() {
    let lab = Lab::new();
    let output = lab.plumb(&["doctor", "--clean", "cel.yaml"]);
    assert_eq!(output.code(), 2, "{}", output.all());
    assert!(output.err().contains("there is no cell file cel.yaml"), "{}", output.err());
}
