//! `plumb init`, and plugins that lie where an installed program and a cell have them.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

use crate::lab::CommandOutput;

/// An empty folder, with a folder for the record that no test shares.
struct Elsewhere(TempDir);

impl Elsewhere {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn command(&self, program: &Path, arguments: &[&str]) -> CommandOutput {
        let mut command = Command::new(program);
        command.args(arguments).current_dir(self.0.path()).env("XDG_STATE_HOME", self.path("state"));
        CommandOutput::of(command.env("NO_COLOR", "1").stdin(Stdio::null()).output().unwrap())
    }

    fn plumb(&self, arguments: &[&str]) -> CommandOutput {
        self.command(Path::new(env!("CARGO_BIN_EXE_plumb")), arguments)
    }
}

/// Every YAML file with a key at its beginning, under a folder.
fn files_with(folder: &Path, key: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files_with(&path, key));
        } else if path.extension().is_some_and(|ending| ending == "yaml")
            && fs::read_to_string(&path).is_ok_and(|text| text.lines().any(|line| line.starts_with(key)))
        {
            found.push(path);
        }
    }
    found
}

#[test]
fn an_example_cell_is_put_where_the_user_is_and_the_printed_commands_run() {
    let elsewhere = Elsewhere::new();
    let output = elsewhere.plumb(&["init", "my lab"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(
        output.out().starts_with("my lab/teachmover: TeachMover over a T target, simulated\n"),
        "{}",
        output.out()
    );
    let lines: Vec<String> =
        output.out().lines().filter(|line| line.contains("plumb ")).map(str::to_owned).collect();
    assert_eq!(lines.len(), 3, "{}", output.out());
    for line in lines {
        assert!(line.contains("'my lab/teachmover/cell.yaml'"), "a path with a blank is quoted: {line}");
        let command = line.split_whitespace().nth(1).unwrap();
        let mut arguments = vec![command, "my lab/teachmover/cell.yaml"];
        arguments.extend(line.contains("--dry-run").then_some("--dry-run"));
        let ran = elsewhere.plumb(&arguments);
        assert_eq!(ran.code(), 0, "{line}\n{}", ran.all());
    }
}

/// The folders of example cells in the repository, by name.
fn shipped() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../workcells");
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let folders = entries.filter(|entry| entry.file_type().unwrap().is_dir());
    let mut names: Vec<String> = folders.map(|entry| entry.file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn every_example_comes_with_what_it_needs_and_is_in_order() {
    let folder = Elsewhere::new();
    let list = folder.plumb(&["init", "--list"]).out();
    let names: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(names, shipped(), "{list}");
    assert!(names.contains(&"teachmover"), "the hour's own: {list}");
    assert!(list.lines().all(|line| line.len() > 20), "each has a title: {list}");
    for name in &names {
        let output = folder.plumb(&["init", name, "--cell", name]);
        assert_eq!(output.code(), 0, "{name}: {}", output.all());
        let page = format!("Read on in {name}/{name}/README.md");
        assert!(output.out().contains(&page), "{}", output.out());
        let cells = files_with(&folder.path(name), "cell: ");
        assert!(!cells.is_empty() || *name == "arms", "{name} holds a cell");
        for cell in cells {
            let checked = folder.plumb(&["check", cell.to_str().unwrap()]);
            assert_eq!(checked.code(), 0, "{}: {}", cell.display(), checked.all());
        }
    }
}

#[test]
fn what_is_there_is_not_overwritten_and_nothing_else_is_written_then() {
    let folder = Elsewhere::new();
    fs::create_dir_all(folder.path("lab/puma")).unwrap();
    let output = folder.plumb(&["init", "lab", "--cell", "ur5", "--cell", "light-stripe"]);
    assert_eq!(output.code(), 2);
    assert!(
        output.err().starts_with("plumb: lab/puma is there already, and nothing is overwritten"),
        "{}",
        output.err()
    );
    assert!(!folder.path("lab/ur5").exists() && !folder.path("lab/light-stripe").exists());
    assert_eq!(fs::read_dir(folder.path("lab/puma")).unwrap().count(), 0);
}

#[test]
fn an_example_whose_files_another_uses_too_may_be_there_already() {
    let folder = Elsewhere::new();
    assert_eq!(folder.plumb(&["init", "lab", "--cell", "puma"]).code(), 0);
    let own = folder.path("lab/puma/cell.yaml");
    fs::write(&own, format!("{}\n# mine\n", fs::read_to_string(&own).unwrap())).unwrap();
    let output = folder.plumb(&["init", "lab", "--cell", "light-stripe"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(fs::read_to_string(&own).unwrap().ends_with("# mine\n"), "it is left as it is");
    let output = folder.plumb(&["init", "other", "--cell", "light-stripe"]);
    assert!(
        output.out().contains("other/puma: ") && output.out().contains("whose files are used too"),
        "{}",
        output.out()
    );
}

#[test]
fn the_folder_of_a_model_template_is_made() {
    let folder = Elsewhere::new();
    let output = folder.plumb(&["model", "template", "ur5", "-o", "new/calibration"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(
        folder.path("new/calibration/ur5.yaml").is_file() && folder.path("new/calibration/ur5.csv").is_file()
    );
    fs::write(folder.path("file"), "").unwrap();
    let output = folder.plumb(&["model", "template", "ur5", "-o", "file"]);
    assert_eq!(output.code(), 2);
    assert!(output.err().starts_with("plumb: file: "), "{}", output.err());
}

#[test]
fn a_misspelled_example_and_a_folder_without_examples_are_refused_with_what_would_be_right() {
    let folder = Elsewhere::new();
    let output = folder.plumb(&["init", "--cell", "teachmoover"]);
    assert_eq!(output.code(), 2);
    assert_eq!(output.err(), "plumb: there is no example `teachmoover`: did you mean `teachmover`?\n");
    fs::create_dir(folder.path("empty")).unwrap();
    let output = folder.plumb(&["init", "--from", "empty"]);
    assert_eq!(output.code(), 2);
    assert!(output.err().contains("looked in empty; name their folder"), "{}", output.err());
}

/// A prefix as an installation makes it, with one plugin and one example.
fn installed(elsewhere: &Elsewhere) -> PathBuf {
    let built = Path::new(env!("CARGO_BIN_EXE_plumb"));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let plugin = elsewhere.path("usr/lib/plumb/plugins/ir-proximity");
    let example = elsewhere.path("usr/share/plumb/workcells/only");
    for folder in [&elsewhere.path("usr/bin"), &plugin, &example] {
        fs::create_dir_all(folder).unwrap();
    }
    fs::copy(source.join("plugins/ir-proximity/plugin.yaml"), plugin.join("plugin.yaml")).unwrap();
    let library = "libplumb_ir_proximity.so";
    fs::copy(built.parent().unwrap().join("deps").join(library), plugin.join(library)).unwrap();
    fs::write(example.join("cell.yaml"), "title: The only one\ncell: only\n").unwrap();
    let program = elsewhere.path("usr/bin/plumb");
    fs::copy(built, &program).unwrap();
    program
}

#[test]
fn an_installed_program_has_the_plugins_and_examples_of_its_prefix_and_no_others() {
    let elsewhere = Elsewhere::new();
    let program = installed(&elsewhere);
    let list = elsewhere.command(&program, &["plugins", "list"]).out();
    assert_eq!(list.lines().count(), 1, "the source's are left alone: {list}");
    assert!(list.starts_with("ir-proximity"), "{list}");
    assert_eq!(elsewhere.command(&program, &["plugins", "verify"]).out(), "ir-proximity: good\n");
    assert_eq!(elsewhere.command(&program, &["init", "--list"]).out(), "only          The only one\n");
}

/// As `cargo install` leaves it: the program alone, and the source with what was built there.
#[test]
fn a_program_without_its_plugins_takes_those_that_were_built_with_it() {
    let folder = Elsewhere::new();
    let program = folder.path("plumb");
    fs::copy(env!("CARGO_BIN_EXE_plumb"), &program).unwrap();
    let verified = folder.command(&program, &["plugins", "verify", "simulated", "teachmover"]);
    assert_eq!(verified.out(), "simulated: good\nteachmover: good\n", "{}", verified.all());
    let listed = folder.command(&program, &["init", "--list"]);
    assert!(listed.out().contains("teachmover"), "{}", listed.all());
}

#[test]
fn a_plugin_beside_the_cell_file_is_found_and_one_that_others_may_change_is_not() {
    let elsewhere = Elsewhere::new();
    assert_eq!(elsewhere.plumb(&["init", "."]).code(), 0);
    let folder = elsewhere.path("teachmover/plugins/my-eye");
    fs::create_dir_all(&folder).unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plugins/ir-proximity/plugin.yaml");
    let manifest = fs::read_to_string(source).unwrap().replace("id: ir-proximity", "id: my-eye");
    fs::write(folder.join("plugin.yaml"), manifest).unwrap();
    let cell = elsewhere.path("teachmover/cell.yaml");
    let text = fs::read_to_string(&cell).unwrap();
    assert!(text.contains("plugin: ir-proximity"));
    fs::write(&cell, text.replace("plugin: ir-proximity", "plugin: my-eye")).unwrap();
    let checked = elsewhere.plumb(&["check", "teachmover/cell.yaml"]);
    assert_eq!(checked.code(), 0, "{}", checked.all());
    fs::set_permissions(&folder, fs::Permissions::from_mode(0o777)).unwrap();
    let refused = elsewhere.plumb(&["check", "teachmover/cell.yaml"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("everybody may write to"), "{}", refused.err());
}
