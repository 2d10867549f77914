//! Plugins and files that are no good: one clear message, the right exit code, and nothing moves.

use std::fs;
use std::path::Path;
use std::process::Command;

use plumb_plugin::ContractVersion;

use crate::lab::Lab;

/// A plugin in a folder of the lab: its manifest, and the library beside it if one is given.
fn plugin(lab: &Lab, contract: &str, library: Option<&[u8]>) {
    let folder = lab.path("plugins/bad-arm");
    fs::create_dir_all(&folder).unwrap();
    let manifest = format!(
        "id: bad-arm\ntitle: An arm that is no good\nversion: 0.1.0\ncontract: {contract}\nkind: robot\nlibrary: libbad_arm.so\n\
         streams:\n  - {{name: joints, message: joint-state/1}}\n  - {{name: inputs, message: digital-inputs/1}}\n\
         config: {{type: object, properties: {{arm: {{type: string}}}}}}\n"
    );
    fs::write(folder.join("plugin.yaml"), manifest).unwrap();
    if let Some(library) = library {
        fs::write(folder.join("libbad_arm.so"), library).unwrap();
    }
    lab.edit("cell.yaml", "plugin: simulated", "plugin: bad-arm");
}

/// Runs the cell with that plugin: it ends with 2 and says this, and the arm was never asked for anything.
fn assert_refused(lab: &Lab, message: &str) {
    let run = lab.plumb(&["run", "cell.yaml", "--plugins", "plugins"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.all().contains(message), "{message}: {}", run.all());
    assert!(!run.all().contains("there is no plugin"), "it is there: {}", run.all());
    assert!(!run.out().contains("waist.lower"), "{}", run.out());
}

#[test]
fn a_plugin_of_another_contract_is_refused_before_anything_starts() {
    let lab = Lab::new();
    plugin(&lab, "[2, 0]", None);
    let speaks = ContractVersion::CURRENT;
    assert_refused(
        &lab,
        &format!("plugin 'bad-arm' was built for contract 2.0; this program speaks {speaks}"),
    );
    assert!(lab.plumb(&["history"]).out().contains("no runs"), "nothing was started");
}

#[test]
fn a_plugin_that_is_no_library_is_named() {
    let lab = Lab::new();
    plugin(&lab, "[1, 0]", Some(b"#!/bin/sh\necho I am no library\n"));
    assert_refused(&lab, "libbad_arm.so");
    let verified = lab.plumb(&["plugins", "verify", "bad-arm", "--plugins", "plugins"]);
    assert_eq!(verified.code(), 1, "{}", verified.all());
}

#[test]
fn a_plugin_without_its_symbol_is_named_with_what_it_lacks() {
    let lab = Lab::new();
    let folder = lab.path("plugins/bad-arm");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("empty.c"), "int nothing_of_a_plugin(void) { return 0; }\n").unwrap();
    let library = folder.join("libbad_arm.so");
    let compiled = Command::new("cc")
        .args(["-shared", "-fPIC", "-o"])
        .arg(&library)
        .arg(folder.join("empty.c"))
        .status();
    assert!(compiled.unwrap().success(), "a C compiler is needed to build the project anyway");
    plugin(&lab, "[1, 0]", None);
    assert_refused(&lab, "plumb_plugin");
}

#[test]
fn a_plugin_whose_library_is_gone_is_named() {
    let lab = Lab::new();
    plugin(&lab, "[1, 0]", None);
    assert_refused(&lab, "libbad_arm.so");
}

#[test]
fn a_plugin_that_panics_in_create_is_one_line_with_the_position() {
    let lab = Lab::new();
    let built = Path::new(env!("CARGO_BIN_EXE_plumb")).with_file_name("examples/libmisbehaving_robot.so");
    if !built.is_file() {
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
        let arguments = ["build", "--quiet", "--workspace", "--example", "misbehaving_robot"];
        assert!(Command::new(cargo).args(arguments).status().unwrap().success());
    }
    let folder = lab.path("plugins/misbehaving-robot");
    fs::create_dir_all(&folder).unwrap();
    fs::copy(&built, folder.join("libmisbehaving_robot.so")).unwrap();
    let manifest =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../core/host/examples/misbehaving_robot/plugin.yaml");
    fs::copy(manifest, folder.join("plugin.yaml")).unwrap();
    let arm = "plugin: simulated, config: {arm: teachmover}";
    lab.edit("cell.yaml", arm, "plugin: misbehaving-robot, config: {fault: panic, in: create}");
    let run = lab.plumb(&["run", "cell.yaml", "--plugins", "plugins"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.all().contains("the plugin panicked at "), "{}", run.all());
    assert!(run.all().contains("the robot lost its head"), "{}", run.all());
    assert!(!run.out().contains("waist.lower"), "{}", run.out());
}

#[test]
fn a_mistake_in_a_devices_configuration_is_shown_before_anything_starts() {
    let lab = Lab::new();
    lab.edit("cell.yaml", "config: {bit: 0}", "config: {bti: 0}");
    for command in ["check", "run"] {
        let output = lab.plumb(&[command, "cell.yaml"]);
        assert_eq!(output.code(), 2, "{}", output.all());
        assert!(output.err().contains("device `eye`: `config` has no key `bti`"), "{}", output.err());
        assert!(output.err().contains("did you mean `bit`?"), "{}", output.err());
    }
    assert!(lab.plumb(&["history"]).out().contains("no runs"));
}

#[test]
fn a_deep_and_a_huge_file_are_refused_at_once() {
    let lab = Lab::new();
    let bombs = [
        ("deep", format!("cell: {}", "[".repeat(200_000))),
        ("huge", format!("cell: a\ntitle: {}\n", "a".repeat(40_000_000))),
        (
            "wide",
            format!(
                "cell: a\ndevices: {{{}}}\n",
                (0..400_000).map(|n| format!("d{n}: {{plugin: p}}, ")).collect::<String>()
            ),
        ),
        (
            "laughs",
            format!(
                "a0: &a0 [x, x, x, x, x, x, x, x, x]\n{}cell: *a9\n",
                (1..10)
                    .map(|n| format!("a{n}: &a{n} [{}]\n", format!("*a{}, ", n - 1).repeat(9)))
                    .collect::<String>()
            ),
        ),
    ];
    for (name, text) in bombs {
        let file = format!("{name}.yaml");
        lab.write(&file, &text);
        let check = lab.plumb(&["check", &file]);
        assert_eq!(check.code(), 2, "{name}: {}", check.all());
        assert!(check.err().contains(&file) && check.err().len() < 4000, "{name}: {:.4000}", check.err());
        let run = lab.plumb(&["run", &file]);
        assert_eq!(run.code(), 2, "{name}: {:.4000}", run.all());
    }
}
