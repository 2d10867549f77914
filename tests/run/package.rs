//! What `cargo xtask package` writes, made of the programs these tests were built with: unpacked elsewhere, it works without the source.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use plumb_xtask::package::{Options, package};

use crate::lab::{CommandOutput, skipped};

/// Runs a program in a folder, with nothing of this test's environment but the search path.
fn run(folder: &Path, program: &str, arguments: &[&str]) -> CommandOutput {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder).env_clear().env("PATH", "/usr/bin:/bin").env("HOME", folder);
    CommandOutput::of(command.stdin(Stdio::null()).output().unwrap())
}

#[test]
fn the_archive_runs_wherever_it_is_unpacked_and_the_debian_package_holds_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let built = Path::new(env!("CARGO_BIN_EXE_plumb")).parent().unwrap();
    let has_dpkg = Command::new("dpkg-deb").arg("--version").output().is_ok();
    let options = Options {
        output: Some(folder.path().join("packages")),
        built: Some(built.to_owned()),
        archive_only: !has_dpkg,
    };
    let files = package(&options).unwrap_or_else(|error| panic!("{error}"));
    let unpacked = run(folder.path(), "tar", &["-xzf", files[0].to_str().unwrap()]);
    assert_eq!(unpacked.code(), 0, "{}", unpacked.all());
    let name = files[0].file_name().unwrap().to_str().unwrap().trim_end_matches(".tar.gz");
    let tree = folder.path().join(name);

    let program = tree.join("bin/plumb");
    let plumb = |arguments: &[&str]| run(folder.path(), program.to_str().unwrap(), arguments);
    let verified = plumb(&["plugins", "verify"]);
    assert_eq!(verified.code(), 0, "{}", verified.all());
    assert_eq!(verified.out().lines().count(), 10, "each plugin: {}", verified.out());
    // A driver of another language runs in a library that is installed beside the plugins.
    assert_eq!(plumb(&["plugins", "new", "sensor", "gauge", "--lang", "python"]).code(), 0);
    let bridged = plumb(&["plugins", "verify", "gauge/plugin.yaml"]);
    assert_eq!(bridged.out(), "gauge/plugin.yaml: good\n", "{}", bridged.all());
    let listed = plumb(&["plugins", "list"]).all();
    assert!(!listed.contains("unusable"), "{listed}");
    assert_eq!(plumb(&["init", "lab"]).code(), 0);
    let ran = plumb(&["run", "lab/teachmover/cell.yaml", "--headless"]);
    assert_eq!(ran.code(), 0, "{}", ran.all());

    for file in [
        "share/man/man1/plumb-run.1",
        "share/bash-completion/completions/plumb",
        "share/plumb/schemas/cell.schema.json",
        "share/doc/plumb/INSTALL.md",
        "lib/udev/rules.d/70-plumb-serial.rules",
    ] {
        assert!(tree.join(file).is_file(), "{file}");
    }
    a_plugin_in_rust_is_built_against_what_was_installed(folder.path(), &tree, &program);
    every_kind_of_schema_is_there(&tree, &plumb(&["schema", "--help"]).out());
    every_link_of_the_manual_leads_somewhere(&tree.join("share/doc/plumb"));
    let licences = fs::read_to_string(tree.join("share/doc/plumb/THIRD-PARTY-LICENSES")).unwrap();
    assert!(
        licences.contains("iceoryx2 0.10.0") && !licences.contains("insta 1."),
        "what is built in, and no more"
    );

    let Some(debian) = files.get(1) else {
        skipped("dpkg-deb is not there, so no Debian package was made");
        return;
    };
    let debian = debian.to_str().unwrap();
    let extracted = run(folder.path(), "dpkg-deb", &["-x", debian, "installed"]);
    assert_eq!(extracted.code(), 0, "{}", extracted.all());
    let installed = run(folder.path(), "installed/usr/bin/plumb", &["plugins", "verify"]);
    assert_eq!(installed.out(), verified.out(), "{}", installed.all());
    let information = run(folder.path(), "dpkg-deb", &["-f", debian, "Package", "Depends"]).out();
    assert!(information.contains("Package: plumb") && information.contains("libc6 (>= 2."), "{information}");
}

/// The project of a plugin in Rust names the installed crates, and cargo builds it with them.
fn a_plugin_in_rust_is_built_against_what_was_installed(folder: &Path, tree: &Path, program: &Path) {
    let new = ["plugins", "new", "sensor", "quick", "--lang", "rust"];
    assert_eq!(run(folder, program.to_str().unwrap(), &new).code(), 0);
    let project = folder.join("quick");
    let crates = fs::canonicalize(tree.join("share/plumb/source/core/plugin")).unwrap();
    let manifest = fs::read_to_string(project.join("Cargo.toml")).unwrap();
    assert!(manifest.contains(&format!("plumb-plugin = {{ path = {crates:?} }}")), "{manifest}");
    assert!(tree.join("share/plumb/source/core/abi/examples/counting_arm").is_dir());
    // What its dependencies build into is kept.
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own-plugins");
    fs::create_dir_all(&kept).unwrap();
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let mut build = Command::new(cargo);
    build.args(["build", "--offline", "--quiet", "--target-dir"]).arg(&kept).current_dir(&project);
    build.env_remove("CARGO_TARGET_DIR").env_remove("CARGO_BUILD_TARGET_DIR");
    let built = CommandOutput::of(build.stdin(Stdio::null()).output().unwrap());
    assert_eq!(built.code(), 0, "{}", built.all());
}

/// A schema for each kind that `plumb schema --help` lists.
fn every_kind_of_schema_is_there(tree: &Path, help: &str) {
    let kinds: Vec<&str> =
        help.lines().filter_map(|line| line.trim().strip_prefix("- ")?.split(':').next()).collect();
    assert!(kinds.contains(&"model") && kinds.contains(&"events"), "{help}");
    for kind in kinds {
        let file = tree.join(format!("share/plumb/schemas/{kind}.schema.json"));
        assert!(file.is_file(), "{}", file.display());
    }
}

/// What README.md links to is installed beside it, but the research that no installation needs.
fn every_link_of_the_manual_leads_somewhere(documents: &Path) {
    let manual = fs::read_to_string(documents.join("README.md")).unwrap();
    let links = manual.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let paths = links.filter(|link| !link.contains("://")).filter_map(|link| link.split('#').next());
    for path in paths.filter(|path| !path.is_empty() && *path != "tests/studies") {
        assert!(documents.join(path).exists(), "{path}");
    }
}

#[test]
fn what_is_not_built_is_named_with_the_command_that_builds_it() {
    let folder = tempfile::tempdir().unwrap();
    let options = Options {
        output: Some(folder.path().join("packages")),
        built: Some(folder.path().join("nothing")),
        archive_only: true,
    };
    let error = package(&options).unwrap_err().to_string();
    assert!(
        error.ends_with("nothing/plumb is not there; build it first: cargo build --release --locked"),
        "{error}"
    );
}
