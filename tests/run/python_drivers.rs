//! Drivers in Python behind the bridge, as a run meets them: stopped while they move, killed, hanging, failing, saying what is no message; and
//! changing between two runs.

use std::fs;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::signal::Signal;

use crate::lab::{Lab, command_of, kill, skipped, wait_gone};

/// The driver of an arm that takes its time, and says in a file when it was commanded to stop.
pub(crate) const SLOW: [(&str, &str); 2] = [
    ("MAX_SPEED = [1.0, 100.0]", "MAX_SPEED = [0.1, 10.0]"),
    ("\"\"\"Brings it to rest, now.\"\"\"", "open('stopped', 'w').close()"),
];

/// A cell with an arm of `plumb plugins new`, its driver changed; none without Python, which is said.
pub(crate) fn cell(changes: &[(&str, &str)]) -> Option<Lab> {
    if Command::new("python3").arg("--version").output().is_err() {
        skipped("there is no `python3` here");
        return None;
    }
    let lab = Lab::new();
    let made = lab.plumb(&["plugins", "new", "robot", "pyarm", "--lang", "python"]);
    assert_eq!(made.code(), 0, "{}", made.all());
    for (from, to) in changes {
        lab.edit("pyarm/driver.py", from, to);
    }
    let text = fs::read_to_string(lab.path("pyarm/cell.yaml")).unwrap();
    lab.write("cell-py.yaml", &text.replace("[procedure.yaml]", "[pyarm/procedure.yaml]"));
    Some(lab)
}

/// The living process of a driver of this lab.
pub(crate) fn driver_of(lab: &Lab) -> Option<u32> {
    let folder = fs::canonicalize(lab.path("pyarm")).unwrap();
    let mut numbers = fs::read_dir("/proc")
        .unwrap()
        .filter_map(|entry| entry.ok()?.file_name().to_str()?.parse::<u32>().ok());
    let is_it = |process: &u32| {
        let directory = fs::read_link(format!("/proc/{process}/cwd")).unwrap_or_default();
        directory == folder && command_of(*process).contains("driver.py")
    };
    numbers.find(is_it)
}

fn message(event: &serde_json::Value) -> String {
    event["message"].as_str().unwrap_or_default().to_owned()
}

#[test]
fn an_arm_in_python_is_stopped_while_it_moves() {
    let Some(lab) = cell(&SLOW) else { return };
    let mut running = lab.start(&["run", "cell-py.yaml"]);
    running.until_moving_in("out");
    let driver = driver_of(&lab).unwrap();
    let asked = Instant::now();
    running.signal(Signal::SIGTERM);
    let (last, code) = running.end();
    assert_eq!(code, Some(3), "{last}");
    assert!(asked.elapsed() < Duration::from_secs(4), "{:?}", asked.elapsed());
    assert!(lab.path("pyarm/stopped").is_file(), "the driver was commanded to stop");
    wait_gone(driver);
}

#[test]
fn a_driver_that_is_killed_while_it_moves_ends_the_step_with_how_it_ended() {
    let Some(lab) = cell(&SLOW) else { return };
    let mut running = lab.start(&["run", "cell-py.yaml"]);
    running.until_moving_in("out");
    let driver = driver_of(&lab).unwrap();
    kill(driver);
    let (last, code) = running.end();
    assert_eq!(code, Some(2), "{last}");
    let error_text = message(&last);
    let expected =
        format!("its driver `python3 driver.py` (process {driver}) has ended (signal: 9 (SIGKILL))");
    assert!(error_text.contains(&expected), "{error_text}");
}

#[test]
fn a_driver_that_was_killed_is_started_anew_when_the_step_is_done_again() {
    let Some(lab) = cell(&SLOW) else { return };
    lab.write("decide.yaml", "answers: {}\non_error: {out: retry}\n");
    let mut running = lab.start(&["run", "cell-py.yaml", "--answers", "decide.yaml"]);
    running.until_moving_in("out");
    let driver = driver_of(&lab).unwrap();
    kill(driver);
    let (last, code) = running.end();
    assert_eq!(code, Some(0), "{last}");
}

#[test]
fn a_driver_ends_with_its_host_and_with_plumb_and_is_asked_to_stop_before() {
    let Some(lab) = cell(&SLOW) else { return };
    let mut running = lab.start(&["run", "cell-py.yaml"]);
    running.until_moving_in("out");
    let driver = driver_of(&lab).unwrap();
    kill(running.host_of("libplumb_bridge"));
    let (last, code) = running.end();
    assert_eq!(code, Some(2), "{last}");
    wait_gone(driver);

    drop(fs::remove_file(lab.path("pyarm/stopped")));
    let mut running = lab.start(&["run", "cell-py.yaml"]);
    running.until_moving_in("out");
    let driver = driver_of(&lab).unwrap();
    kill(running.process());
    wait_gone(driver);
    assert!(lab.path("pyarm/stopped").is_file(), "an arm without plumb is stopped");
}

#[test]
fn a_driver_that_hangs_ends_with_its_host_and_is_named() {
    let Some(lab) = cell(&[("return self.joints\n\n    def move", "while True: pass\n\n    def move")])
    else {
        return;
    };
    let mut running = lab.start(&["run", "cell-py.yaml"]);
    let begun = Instant::now();
    let mut driver = None;
    while driver.is_none() && begun.elapsed() < Duration::from_secs(10) {
        driver = driver_of(&lab);
        thread::sleep(Duration::from_millis(20));
    }
    let mut output = String::new();
    while let Some(event) = running.event() {
        output += &event.to_string();
    }
    let (_, code) = running.end();
    assert_eq!(code, Some(2), "{output}");
    assert!(output.contains("did not answer 'read joints' within 5s"), "{output}");
    assert!(begun.elapsed() < Duration::from_secs(20), "{:?}", begun.elapsed());
    wait_gone(driver.unwrap());
}

/// As at a breakpoint: 7 s in a call that may take 5.
#[test]
fn a_driver_that_a_debugger_holds_for_longer_than_a_call_may_take_ends_nothing() {
    let held = "if not hasattr(self, 'held'):\n            self.held = time.sleep(7)\n        return self.joints\n\n    def move";
    let changes = [("import math", "import math, time"), ("return self.joints\n\n    def move", held)];
    let Some(lab) = cell(&changes) else { return };
    let run = lab.plumb(&["run", "cell-py.yaml", "--headless", "--no-watchdog"]);
    assert_eq!(run.code(), 0, "{}", run.all());
    let run = lab.plumb(&["run", "cell-py.yaml", "--headless"]);
    assert_eq!(run.code(), 2, "without it the call is too late: {}", run.all());
}

#[test]
fn an_exception_is_the_error_of_its_call_with_its_kind() {
    for (raised, expected) in [
        (
            "raise ConnectionRefusedError(111, 'Connection refused')",
            "ConnectionRefusedError: [Errno 111] Connection refused",
        ),
        (
            "raise plumb_driver.Disconnected('the controller is switched off')",
            "the controller is switched off",
        ),
        ("return [float('nan'), 0.0]", "Out of range float values are not JSON compliant"),
        ("return {'joint': [0, 0]}", "its layout has no field 'joint'"),
        (
            "self.host.emit('diary', joints=[0.0]); return self.joints",
            "emits on 'diary', which its plugin.yaml does not declare",
        ),
        (
            "import os; os.write(self.host._sink.fileno(), b'hello\\n'); return self.joints",
            "what is no message of its protocol",
        ),
        ("import os; os._exit(3)", "has ended (exit status: 3)"),
    ] {
        let Some(lab) = cell(&[("return self.joints\n\n    def move", &format!("{raised}\n\n    def move"))])
        else {
            return;
        };
        let run = lab.plumb(&["run", "cell-py.yaml", "--headless"]);
        assert_eq!(run.code(), 2, "{raised}: {}", run.all());
        assert!(run.all().contains(expected), "{raised}: {}", run.all());
    }
}

/// A driver whose arm an operator drives with its pendant, and whose motors report themselves.
const WITH_PENDANT: [(&str, &str); 2] = [
    ("\"interruptible\": True", "\"jog\": True, \"interruptible\": True"),
    (
        "    def read_joints(self):",
        "    def jog(self, on):\n        self.joints = [0.0, 12.0]\n        return self.joints\n\n    \
             def read_motors(self):\n        return {\"temperature\": [31.5, None], \"temperature_uncertainty\": 0.5}\n\n    \
             def read_joints(self):",
    ),
];

/// Driven by the pendant to where the next step wants it, and its motors read.
const BY_PENDANT: &str = "procedure: extra
steps:
  - {id: motors, do: {motors: {robot: arm}}, on_error: abort}
  - {id: warm, do: {check: {that: motors.hottest_c > 31, otherwise: Too cold}}, on_error: abort}
  - {id: place, title: By hand, do: {prompt: {text: There, jog_to: {robot: arm}}}}
  - {id: there, do: {check: {that: abs(arm.joints.slide_mm - 12) < 0.001, otherwise: Somewhere else}}, on_error: abort}
";

#[test]
fn a_pendant_and_motors_of_a_driver_in_python_have_their_part_in_a_run() {
    let Some(lab) = cell(&WITH_PENDANT) else { return };
    lab.write("pyarm/procedure.yaml", BY_PENDANT);
    let mut running = lab.start(&["run", "cell-py.yaml", "extra", "--attended", "--pace", "fast"]);
    running.until(|event| event["event"] == "prompt_asked" && event["prompt"]["step"] == "place");
    let answered = lab.plumb(&["answer", "done"]);
    assert_eq!(answered.code(), 0, "{}", answered.all());
    let (last, _) = running.end();
    assert_eq!(last["outcome"], "passed", "{last}");
    let shown = lab.plumb(&["show", "1"]);
    assert!(shown.out().contains("waist_temperature") && shown.out().contains("31.5"), "{}", shown.out());
    assert!(!shown.out().contains("slide_temperature"), "its motor does not report it: {}", shown.out());
}

const MOTORS: &str = "procedure: extra\nsteps: [{id: motors, do: {motors: {robot: arm}}}]\n";

#[test]
fn motors_that_a_driver_in_python_misspells_or_lacks_end_the_step_with_what_to_do() {
    for (reports, expected) in [
        ("{\"temprature\": [31.5, 30]}", "unknown field `temprature`, expected one of"),
        ("{\"temperature\": [31.5]}", "`temperature` has 1 numbers for 2 joints; give one for each"),
        (
            "{\"temperature\": [31.5, 30], \"temperature_uncertainty\": 0}",
            "`temperature_uncertainty` is 0; give more than 0, or leave it out where it is not known",
        ),
    ] {
        let answer =
            format!("    def read_motors(self):\n        return {reports}\n\n    def read_joints(self):");
        let Some(lab) = cell(&[("    def read_joints(self):", answer.as_str())]) else { return };
        lab.write("pyarm/procedure.yaml", MOTORS);
        let run = lab.plumb(&["run", "cell-py.yaml", "--headless"]);
        assert_eq!(run.code(), 2, "{reports}: {}", run.all());
        assert!(run.all().contains(expected), "{reports}: {}", run.all());
    }
    let Some(lab) = cell(&[]) else { return };
    lab.write("pyarm/procedure.yaml", MOTORS);
    let run = lab.plumb(&["run", "cell-py.yaml", "--headless"]);
    assert_eq!(run.code(), 2, "{}", run.all());
    assert!(run.all().contains("name a robot whose plugin has `read_motors`"), "{}", run.all());
}

#[test]
fn a_driver_that_cannot_start_says_why() {
    let Some(lab) = cell(&[("import math", "import math\nimport no_such_module")]) else { return };
    let checked = lab.plumb(&["plugins", "check", "pyarm"]);
    assert_eq!(checked.code(), 1, "{}", checked.all());
    assert!(
        checked.out().contains("ModuleNotFoundError: No module named 'no_such_module'"),
        "{}",
        checked.out()
    );
    lab.edit("pyarm/plugin.yaml", "[python3, driver.py]", "[no-such-python, driver.py]");
    let checked = lab.plumb(&["plugins", "check", "pyarm"]);
    assert!(checked.out().contains("no-such-python: No such file or directory"), "{}", checked.out());
    assert!(
        checked.out().contains("name another command under `driver:` in plugin.yaml"),
        "{}",
        checked.out()
    );
}

#[test]
fn a_manifest_names_a_library_or_a_driver() {
    let Some(lab) = cell(&[]) else { return };
    let given = "driver: [python3, driver.py]";
    for (wrong, expected) in [
        ("", "a manifest needs the key `library`, or `driver`"),
        (
            "driver: [python3, driver.py]\nlibrary: libarm.so",
            "a manifest has `library` or `driver`, not both",
        ),
        ("driver: []", "`driver` is empty"),
        ("driver: python3", "plugin.yaml:"),
    ] {
        lab.edit("pyarm/plugin.yaml", given, wrong);
        let checked = lab.plumb(&["check", "pyarm/plugin.yaml"]);
        assert_eq!(checked.code(), 2, "{wrong}: {}", checked.all());
        assert!(checked.err().contains(expected), "{wrong}: {}", checked.err());
        let text = fs::read_to_string(lab.path("pyarm/plugin.yaml")).unwrap();
        let line = if wrong.is_empty() { "kind: robot\n\n" } else { wrong };
        let mended = if wrong.is_empty() { "kind: robot\ndriver: [python3, driver.py]\n" } else { given };
        assert!(text.contains(line), "{text}");
        lab.write("pyarm/plugin.yaml", &text.replace(line, mended));
    }
}

#[test]
fn a_driver_that_has_changed_is_a_question_before_it_runs() {
    let Some(lab) = cell(&[]) else { return };
    assert_eq!(lab.plumb(&["run", "cell-py.yaml", "--headless"]).code(), 0);
    lab.edit("pyarm/driver.py", "import math", "import math  # changed");
    let refused = lab.plumb(&["run", "cell-py.yaml", "--headless"]);
    assert_eq!(refused.code(), 4, "{}", refused.all());
    assert!(refused.err().contains("pyarm/driver.py (SHA-256 "), "{}", refused.err());
}
