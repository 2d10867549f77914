//! A plugin of a user's own, in each language: from `plumb plugins new` to a run, with the commands that it prints; and what `plumb plugins check` says
//! of plugins that break the contract.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use crate::lab::{CommandOutput, skipped};

/// From the first command to the end of the run, whatever the language; what has to be compiled first included.
const TEN_MINUTES: Duration = Duration::from_secs(600);

/// A project in a folder of its own, outside the workspace.
pub(crate) struct Own {
    directory: TempDir,
    name: &'static str,
}

impl Own {
    /// As `plumb plugins new` makes it.
    pub(crate) fn new(kind: &str, name: &'static str, language: &str) -> Self {
        let own = Self { directory: tempfile::tempdir().unwrap(), name };
        let arguments = ["plugins", "new", kind, name, "--lang", language];
        let made = own.plumb_in(own.directory.path(), &arguments);
        assert_eq!(made.code(), 0, "{}", made.all());
        own
    }

    pub(crate) fn folder(&self) -> PathBuf {
        self.directory.path().join(self.name)
    }

    fn plumb_in(&self, folder: &Path, arguments: &[&str]) -> CommandOutput {
        let mut command = Command::new(env!("CARGO_BIN_EXE_plumb"));
        command.args(arguments).current_dir(folder).stdin(Stdio::null());
        command.env("XDG_STATE_HOME", self.directory.path().join("state")).env("NO_COLOR", "1");
        CommandOutput::of(command.output().unwrap())
    }

    pub(crate) fn plumb(&self, arguments: &[&str]) -> CommandOutput {
        self.plumb_in(&self.folder(), arguments)
    }

    pub(crate) fn edit(&self, file: &str, from: &str, to: &str) {
        let path = self.folder().join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{file} has `{from}`");
        fs::write(path, text.replace(from, to)).unwrap();
    }

    /// Runs a program in the folder; none where it is not installed, which is said.
    pub(crate) fn tool(&self, program: &str, arguments: &[&str]) -> Option<CommandOutput> {
        let mut command = Command::new(program);
        command.args(arguments).current_dir(self.folder()).stdin(Stdio::null());
        // Where this test's own build goes is no business of the project's.
        command.env_remove("CARGO_TARGET_DIR").env_remove("CARGO_BUILD_TARGET_DIR");
        match command.output() {
            Ok(output) => Some(CommandOutput::of(output)),
            Err(error) if error.kind() == ErrorKind::NotFound => {
                skipped(&format!("there is no `{program}` here"));
                None
            }
            Err(error) => panic!("{program}: {error}"),
        }
    }

    /// Checks, and runs the cell beside it; every check passes.
    fn conforms_and_runs(&self, is_robot: bool) {
        let check: &[&str] =
            if is_robot { &["plugins", "check", ".", "--move"] } else { &["plugins", "check", "."] };
        let checked = self.plumb(check);
        assert_eq!(checked.code(), 0, "{}", checked.all());
        assert!(checked.out().contains(" 0 failed, "), "{}", checked.out());
        for arguments in [&["check", "cell.yaml"][..], &["run", "cell.yaml", "--headless"]] {
            let printed = self.plumb(arguments);
            assert_eq!(printed.code(), 0, "plumb {arguments:?}: {}", printed.all());
        }
    }
}

impl Drop for Own {
    fn drop(&mut self) {
        drop(self.plumb(&["doctor", "--clean", "cell.yaml"]));
    }
}

/// `make`; false without a C compiler.
fn made(own: &Own) -> bool {
    if Command::new("cc").arg("--version").output().is_err() {
        skipped("there is no C compiler 'cc' here");
        return false;
    }
    let Some(made) = own.tool("make", &[]) else { return false };
    assert_eq!(made.code(), 0, "{}", made.all());
    assert!(!made.err().contains("warning"), "{}", made.err());
    true
}

#[test]
fn a_robot_and_a_sensor_in_c_go_from_new_to_a_run() {
    let begin = Instant::now();
    for (kind, name) in [("robot", "quill-c"), ("sensor", "gauge-c")] {
        let own = Own::new(kind, name, "c");
        if !made(&own) {
            return;
        }
        own.conforms_and_runs(kind == "robot");
    }
    assert!(begin.elapsed() < TEN_MINUTES);
}

#[test]
fn a_sensor_in_c_reads_what_the_cell_file_gives_it() {
    let own = Own::new("sensor", "gauge-set", "c");
    own.edit("plugin.yaml", "  properties: {}", "  properties: {offset_mm: {type: number}, over: {type: string}, up: {type: boolean}, far: {type: array}}");
    own.edit("cell.yaml", "{plugin: gauge-set}", "{plugin: gauge-set, config: {far: [{offset_mm: 7}], offset_mm: -2.5, over: 'the \"table\" of \u{fc}', up: true}}");
    own.edit(
        "gauge_set.c",
        "#include \"plumb_plugin.h\"",
        "#include \"plumb_config.h\"\nstatic double height = 12.5;",
    );
    own.edit("gauge_set.c", "return 12.5;", "return height;");
    let read = "
    double number = 0;
    char words[32] = \"\";
    int flag = 0, none = 5;
    int found = plumb_config_number(config, \"offset_mm\", &number) + plumb_config_text(config, \"over\", words, sizeof words) + plumb_config_flag(config, \"up\", &flag);
    int absent = plumb_config_flag(config, \"down\", &none), wrong = plumb_config_number(config, \"far\", &number), narrow = plumb_config_text(config, \"over\", words, 5);
    if (found == 3 && flag && strcmp(words, \"the \\\"table\\\" of \u{fc}\") == 0 && absent == 0 && none == 5 && wrong == -1 && narrow == -1) {
        height += number;
    }";
    own.edit("gauge_set.c", "    (void)config;", read);
    if !made(&own) {
        return;
    }
    let run = own.plumb(&["run", "cell.yaml", "--headless"]);
    assert!(run.code() == 0 && run.out().contains("10.000"), "{}", run.all());
}

#[test]
fn a_robot_and_a_sensor_in_rust_go_from_new_to_a_run_without_a_network() {
    let begin = Instant::now();
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    // What both projects and further runs of this test build is kept.
    let kept = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own-plugins");
    fs::create_dir_all(&kept).unwrap();
    for (kind, name) in [("robot", "quill-rust"), ("sensor", "gauge-rust")] {
        let own = Own::new(kind, name, "rust");
        std::os::unix::fs::symlink(&kept, own.folder().join("target")).unwrap();
        let Some(tested) = own.tool(&cargo, &["test", "--offline", "--quiet"]) else { return };
        assert_eq!(tested.code(), 0, "{}", tested.all());
        let Some(built) = own.tool(&cargo, &["build", "--offline", "--quiet"]) else { return };
        assert_eq!(built.code(), 0, "{}", built.all());
        own.conforms_and_runs(kind == "robot");
    }
    assert!(begin.elapsed() < TEN_MINUTES);
}

#[test]
fn a_robot_and_a_sensor_in_python_go_from_new_to_a_run() {
    let begin = Instant::now();
    for (kind, name) in [("robot", "quill-python"), ("sensor", "gauge-python")] {
        let own = Own::new(kind, name, "python");
        if own.tool("python3", &["--version"]).is_none() {
            return;
        }
        own.conforms_and_runs(kind == "robot");
    }
    assert!(begin.elapsed() < TEN_MINUTES);
}

#[test]
fn a_name_that_cannot_be_and_a_folder_that_is_there_are_refused() {
    let own = Own::new("sensor", "gauge", "python");
    let again = own.plumb_in(own.directory.path(), &["plugins", "new", "sensor", "gauge"]);
    assert_eq!(again.code(), 2, "{}", again.all());
    assert!(again.err().contains("gauge is already there; nothing was written"), "{}", again.err());
    for name in ["Gauge", "4bar", "my_gauge", "a/b", "gauge-"] {
        let refused = own.plumb_in(own.directory.path(), &["plugins", "new", "robot", name]);
        assert_eq!(refused.code(), 2, "{name}: {}", refused.all());
        assert!(
            refused.err().contains("use lower-case letters, digits and hyphens, a letter first"),
            "{}",
            refused.err()
        );
    }
}

/// What a plugin in Rust is written against can be packed for a registry, each crate with all that it needs.
#[test]
fn the_crates_that_a_plugin_is_written_against_can_be_published() {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(cargo);
    command
        .args(["package", "--offline", "--locked", "--no-verify", "--allow-dirty", "--target-dir"])
        .arg(folder.path());
    command.args(["-p", "plumb-abi", "-p", "plumb-document", "-p", "plumb-plugin"]);
    let packed = CommandOutput::of(command.current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap());
    assert_eq!(packed.code(), 0, "{}", packed.all());
    for name in ["abi", "document", "plugin"] {
        assert!(
            folder.path().join(format!("package/plumb-{name}-{}.crate", env!("CARGO_PKG_VERSION"))).is_file(),
            "{}",
            packed.all()
        );
    }
}

/// A fault put into the C file of a project, and the check that has to name it.
struct Fault {
    kind: &'static str,
    from: &'static str,
    to: &'static str,
    check: &'static str,
    message: &'static str,
}

const SENSOR_TIME: &str = "uint64_t time_ns = gauge->host->now_ns(gauge->host->context);";
const ROBOT_TIME: &str = "state.time_ns = arm->host->now_ns(arm->host->context);";
const ROBOT_STOP: &str = "if (arm->host->should_stop(arm->host->context)) {";

const FAULTS: &[Fault] = &[
    Fault {
        kind: "sensor",
        from: SENSOR_TIME,
        to: "uint64_t time_ns = 0;",
        check: "its readings are dated by the cell's clock",
        message: "is 0: take it from the host's clock",
    },
    Fault {
        kind: "sensor",
        from: SENSOR_TIME,
        to: "uint64_t time_ns = 5;",
        check: "a reading asked for after a moment is not an older one",
        message: "gave one of 5 ns",
    },
    Fault {
        kind: "sensor",
        from: SENSOR_TIME,
        to: "uint64_t time_ns = 1780000000000000000u;",
        check: "it can be armed, polled and read at once",
        message: "Its plugin has to date with its host's `now_ns`",
    },
    Fault {
        kind: "sensor",
        from: "\\\"unit\\\": \\\"mm\\\"",
        to: "\\\"unit\\\": \\\"furlong\\\"",
        check: "its description makes sense",
        message: "'furlong' of 'height' is no unit plumb knows",
    },
    Fault {
        kind: "sensor",
        from: "[{\\\"name\\\": \\\"height\\\", \\\"unit\\\": \\\"mm\\\"}]",
        to: "[{\\\"name\\\": \\\"height\\\", \\\"unit\\\": \\\"mm\\\"}, {\\\"name\\\": \\\"width\\\", \\\"unit\\\": \\\"mm\\\"}]",
        check: "its readings hold what its description says",
        message: "lacks 'width'",
    },
    Fault {
        kind: "sensor",
        from: "\\\"name\\\": \\\"height\\\", \\\"unit\\\"",
        to: "\\\"name\\\": \\\"hight\\\", \\\"unit\\\"",
        check: "its manifest lists the quantities, input lines and joints it describes",
        message: "the manifest lists height [mm]; the sensor describes hight [mm]",
    },
    Fault {
        kind: "sensor",
        from: "    char words[160];",
        to: "    char words[160]; volatile int *nowhere = NULL; *nowhere = 1;",
        check: "it can be armed, polled and read at once",
        message: "ended by SIGSEGV",
    },
    Fault {
        kind: "robot",
        from: "\\\"name\\\": \\\"waist\\\"",
        to: "\\\"name\\\": \\\"joint-1\\\"",
        check: "its description makes sense",
        message: "joint 'joint-1' cannot be named in an expression: use letters, digits and '_', a letter first",
    },
    Fault {
        kind: "robot",
        from: "\\\"lower\\\": -1.5707963267948966, \\\"upper\\\": 1.5707963267948966",
        to: "\\\"lower\\\": -90, \\\"upper\\\": 90",
        check: "its description makes sense",
        message: "waist goes from -90 to 90 rad, which is 28.6 turns: are these degrees?",
    },
    Fault {
        kind: "robot",
        from: "\\\"lower\\\": 0, \\\"upper\\\": 200",
        to: "\\\"lower\\\": 0, \\\"upper\\\": 150",
        check: "its manifest lists the quantities, input lines and joints it describes",
        message: "by the manifest slide goes from 0.000000 to 200.000000 mm; the robot describes 0.000000 to 150.000000",
    },
    Fault {
        kind: "robot",
        from: ROBOT_TIME,
        to: "state.time_ns = 0;",
        check: "it is at rest before anything is asked of it",
        message: "Its plugin has to date with its host's `now_ns`",
    },
    Fault {
        kind: "robot",
        from: "    *state = state_now(arm, 0);\n    return PLUMB_OK;\n}\n\n/* Brings",
        to: "    *state = state_now(arm, 1);\n    return PLUMB_OK;\n}\n\n/* Brings",
        check: "a move ends at its target",
        message: "returns while it still moves",
    },
    Fault {
        kind: "robot",
        from: "(motion->relative ? 0 : from[joint])",
        to: "from[joint]",
        check: "a relative move adds to where the joints are",
        message: "ends at",
    },
    Fault {
        kind: "robot",
        from: "if ((motion->joint_mask >> joint) & 1u) {",
        to: "if (joint != 0 || ((motion->joint_mask >> joint) & 1u)) {",
        check: "joints that take no part stay where they are",
        message: "",
    },
    Fault {
        kind: "robot",
        from: "+ way[joint] * (step / steps)",
        to: "+ (joint == 1 ? 0.1 : 1) * way[joint] * (step / steps)",
        check: "a move ends at its target",
        message: "slide ends at",
    },
    Fault {
        kind: "robot",
        from: ROBOT_STOP,
        to: "if (0) {",
        check: "a stop ends a move in time",
        message: "",
    },
    Fault {
        kind: "robot",
        from: "    .stop = stop,\n",
        to: "",
        check: "it is loaded and its device is made",
        message: "lacks stop",
    },
];

#[test]
fn each_fault_fails_the_check_that_names_it_and_is_taught() {
    for fault in FAULTS {
        let own = Own::new(fault.kind, "faulty", "c");
        own.edit("faulty.c", fault.from, fault.to);
        // A function that is left out is no matter for the compiler here.
        own.edit("Makefile", "-Wall -Wextra", "-w");
        if !made(&own) {
            return;
        }
        let checked = own.plumb(&["plugins", "check", ".", "--move"]);
        assert_eq!(checked.code(), 1, "{}: {}", fault.to, checked.all());
        let out = checked.out();
        let mut lines =
            out.lines().skip_while(|line| !line.starts_with(&format!("FAILED   {}: ", fault.check)));
        let seen = lines.next().unwrap_or_else(|| panic!("`{}` passed '{}':\n{out}", fault.to, fault.check));
        assert!(seen.contains(fault.message), "`{}`:\n{out}", fault.to);
        let taught: Vec<&str> = lines.take(2).map(str::trim_start).collect();
        assert!(taught[0].starts_with("contract: ") && taught[1].starts_with("change:   "), "{out}");
        // A clock is reported once, with the lesson of clocks, in however many checks it shows.
        if fault.message.contains("now_ns`") {
            assert!(taught[0].contains("every time_ns is taken from the host's now_ns"), "{out}");
            assert_eq!(out.matches(fault.message).count(), 1, "{out}");
            assert!(out.contains(&format!("for the same reason as '{}'", fault.check)), "{out}");
        }
    }
}

#[test]
fn checks_that_move_a_robot_wait_for_leave() {
    let own = Own::new("robot", "quill", "c");
    if !made(&own) {
        return;
    }
    let checked = own.plumb(&["plugins", "check", "."]);
    assert_eq!(checked.code(), 0, "{}", checked.all());
    let out = checked.out();
    assert!(out.contains("skipped  a move ends at its target: it would move the robot"), "{out}");
    assert!(out.contains("to check how it moves, keep clear of it and add --move"), "{out}");
    assert!(out.contains("passed   it is at rest when it is read"), "{out}");
}

#[test]
fn a_misspelt_measurement_of_a_new_sensor_is_found_before_anything_runs() {
    let own = Own::new("sensor", "gauge", "python");
    own.edit("procedure.yaml", "reading.height_mm > 0", "reading.heigth_mm > 0");
    let checked = own.plumb(&["check", "cell.yaml"]);
    assert_eq!(checked.code(), 2, "{}", checked.all());
    assert!(checked.all().contains("did you mean `height_mm`?"), "{}", checked.all());
}

#[test]
fn what_a_gauge_says_of_another_moment_or_leaves_out_is_no_value() {
    for (reading, expected) in [
        (
            "{\"time_ns\": 5, \"quantities\": [{\"name\": \"height\", \"value\": 12.5, \"standard_uncertainty\": 0}]}",
            "the reading of gauge is stale: it is dated ",
        ),
        ("{}", "the reading of gauge has no value; it describes `height`"),
        ("None", "gauge says that it has nothing to read yet"),
    ] {
        let own = Own::new("sensor", "gauge", "python");
        if own.tool("python3", &["--version"]).is_none() {
            return;
        }
        own.edit("driver.py", "{\"height\": (12.5, 0.01)}", reading);
        let run = own.plumb(&["run", "cell.yaml", "--headless"]);
        assert_eq!(run.code(), 2, "{reading}: {}", run.all());
        assert!(run.all().contains(expected) && !run.all().contains("is lost"), "{reading}: {}", run.all());
    }
}

#[test]
fn what_cannot_be_checked_is_said_with_what_would_be_right() {
    let own = Own::new("sensor", "gauge", "python");
    let refused = own.plumb(&["plugins", "check", ".", "--config", "{port: /dev/ttyUSB0}"]);
    assert_eq!(refused.code(), 2, "{}", refused.all());
    assert!(refused.err().contains("`config` has no key `port`"), "{}", refused.err());
    let refused = own.plumb(&["plugins", "check", ".", "--input", "line"]);
    assert!(refused.err().contains("gauge has no input 'line'"), "{}", refused.err());
    own.edit("plugin.yaml", "title:", "tittle:");
    let checked = own.plumb(&["plugins", "check", "."]);
    assert_eq!(checked.code(), 1, "{}", checked.all());
    assert!(
        checked.out().contains("did you mean `title`?") && checked.out().contains("contract: "),
        "{}",
        checked.out()
    );
}

/// The worked drivers.
fn worked_drivers() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../plugins/bridge/examples")
}

/// A worked driver in a folder of its own; none where a module that it needs is not installed, which is said.
fn worked(own: &Own, name: &str, module: &str) -> bool {
    let found = Command::new("python3").args(["-c", &format!("import {module}")]).output();
    if !found.is_ok_and(|output| output.status.success()) {
        skipped(&format!("python3 has no module `{module}` here"));
        return false;
    }
    for file in ["plugin.yaml", "driver.py"] {
        fs::copy(worked_drivers().join(name).join(file), own.folder().join(file)).unwrap();
    }
    true
}

#[test]
fn a_sensor_on_pyserial_conforms_on_a_pseudo_terminal() {
    let own = Own::new("sensor", "gauge", "python");
    if !worked(&own, "serial-gauge", "serial") {
        return;
    }
    let pair = nix::pty::openpty(None, None).unwrap();
    let port = nix::unistd::ttyname(&pair.slave).unwrap();
    // The gauge: a height for each question mark, until the terminal is closed.
    thread::spawn(move || {
        let mut line = fs::File::from(pair.master);
        let mut letter = [0];
        while std::io::Read::read_exact(&mut line, &mut letter).is_ok() {
            if letter == *b"?" {
                std::io::Write::write_all(&mut line, b"12.503\r").unwrap();
            }
        }
    });
    let config = format!("{{port: {}}}", port.display());
    let checked = own.plumb(&["plugins", "check", ".", "--config", &config]);
    assert_eq!(checked.code(), 0, "{}", checked.all());
    assert!(
        checked.out().contains("passed   its readings hold what its description says"),
        "{}",
        checked.out()
    );
    let absent = own.plumb(&["plugins", "check", ".", "--config", "{port: /dev/no-such-port}"]);
    assert!(absent.out().contains("/dev/no-such-port cannot be opened"), "{}", absent.out());
    drop(pair.slave);
}

#[test]
fn an_axis_of_ophyd_conforms() {
    let own = Own::new("robot", "axis", "python");
    if !worked(&own, "ophyd-axis", "ophyd") {
        return;
    }
    let checked = own.plumb(&["plugins", "check", ".", "--move"]);
    assert_eq!(checked.code(), 0, "{}", checked.all());
    assert!(checked.out().contains("passed   a move ends at its target"), "{}", checked.out());
}
