//! Plugins written in C, compiled here against the header.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use plumb_host::{HostArguments, HostEvent, Plugin, StopOutcome, verify};
use plumb_plugin::{ContractVersion, DigitalInputs, JointVector, LogLevel, Motion, PluginError};

use crate::test_folder::{LONG, TestFolder};

/// The repository's `core/abi`.
fn abi() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../abi")
}

/// The worked example compiled into a directory, with further definitions; `None`, said in words, without a C compiler.
pub(crate) fn compiled(directory: &Path, definitions: &[&str]) -> Option<Plugin> {
    compiled_from(&abi().join("examples/counting_arm/counting_arm.c"), directory, definitions)
}

/// The worked example's source.
pub(crate) fn example() -> PathBuf {
    abi().join("examples/counting_arm/counting_arm.c")
}

/// A changed source of the worked example, compiled; `None`, said in words, without a C compiler.
pub(crate) fn compiled_from_text(text: &str, directory: &Path) -> Option<Plugin> {
    let source = directory.join("counting_arm.c");
    fs::write(&source, text).unwrap();
    compiled_from(&source, directory, &["-include", "stddef.h"])
}

/// The worked example, or a changed source of it, with another line in its manifest, the one built into it and the one beside it alike. `None`, said
/// in words, without a C compiler.
pub(crate) fn with_another_manifest(
    source: &str,
    (line, other): (&str, &str),
    directory: &Path,
) -> Option<Plugin> {
    let built_in = |line: &str| line.lines().map(|line| format!("    \"{line}\\n\"\n")).collect::<String>();
    let changed = source.replace(&built_in(line), &built_in(other));
    assert_ne!(changed, source);
    let plugin = compiled_from_text(&changed, directory)?;
    let manifest = fs::read_to_string(&plugin.manifest_path).unwrap();
    fs::write(&plugin.manifest_path, manifest.replace(line, other)).unwrap();
    Some(Plugin::at_library(&plugin.manifest_path, &plugin.library_path).unwrap())
}

/// The line of the worked example's manifest that declares its stream of joints.
pub(crate) const JOINTS: &str = "  - {name: joints, message: joint-state/1}\n";

/// The line that declares its stream of input lines, and one that declares a stream of another name.
const RENAMED_INPUTS: (&str, &str) =
    ("  - {name: inputs, message: digital-inputs/1}\n", "  - {name: lines, message: digital-inputs/1}\n");

/// A sensor's source and manifest, compiled as `libgauge.so`; `None`, said in words, without a C compiler.
pub(crate) fn compiled_sensor(text: &str, manifest: &str, directory: &Path) -> Option<Plugin> {
    let (source, library) = (directory.join("gauge.c"), directory.join("libgauge.so"));
    fs::write(&source, text).unwrap();
    let manifest_path = directory.join("plugin.yaml");
    fs::write(&manifest_path, manifest).unwrap();
    compile(&source, &library, &[]).then(|| Plugin::at_library(&manifest_path, &library).unwrap())
}

fn compiled_from(source: &Path, directory: &Path, definitions: &[&str]) -> Option<Plugin> {
    let library = directory.join("libcounting_arm.so");
    if !compile(source, &library, definitions) {
        return None;
    }
    let manifest = directory.join("plugin.yaml");
    fs::copy(abi().join("examples/counting_arm/plugin.yaml"), &manifest).unwrap();
    Some(Plugin::at_library(&manifest, &library).unwrap())
}

/// Compiles a library; false, said in words, without a C compiler.
fn compile(source: &Path, library: &Path, definitions: &[&str]) -> bool {
    let output = Command::new("cc")
        .args(["-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-shared", "-fPIC"])
        .args(definitions)
        .arg("-I")
        .arg(abi().join("include"))
        .arg("-o")
        .arg(library)
        .arg(source)
        .arg("-lm")
        .output();
    match output {
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            true
        }
        Err(error) if error.kind() == ErrorKind::NotFound => {
            println!("skipped: there is no C compiler 'cc' here");
            false
        }
        Err(error) => panic!("cc cannot be run: {error}"),
    }
}

#[test]
fn a_plugin_written_in_c_moves_reports_and_stops() {
    let folder = TestFolder::new();
    let Some(plugin) = compiled(folder.directory.path(), &[]) else { return };
    let inputs = plugin.manifest.streams.iter().find(|stream| stream.name == "inputs").unwrap();
    let mut lines = folder.bus().subscriber("arm", inputs).unwrap();
    let host = folder.spawn(&HostArguments::new("arm", &folder.domain, &plugin)).unwrap();
    let (robot, stop) = (host.robot().unwrap(), host.stop_handle().unwrap());
    assert_eq!(robot.describe().unwrap().model, "counting arm");
    robot.activate().unwrap();

    let target = JointVector::from_slice(&[0.6, -0.2]).unwrap();
    let end = robot.move_joints(&Motion::absolute(target, 1.0), LONG).unwrap();
    assert_eq!(end.joints, target);
    let changes: Vec<DigitalInputs> = std::iter::from_fn(|| lines.receive().unwrap()).collect();
    assert!(changes[0].has_changed(0) && changes[0].level(0));
    assert!(changes[1].changed == 0 && changes[1].time_ns >= end.time_ns);

    let error =
        robot.move_joints(&Motion::absolute(JointVector::from_slice(&[1.6, 0.0]).unwrap(), 1.0), LONG);
    assert!(matches!(error.unwrap_err().plugin_error(), Some(PluginError::OutOfRange(_))));

    std::thread::scope(|scope| {
        let back = Motion::absolute(JointVector::from_slice(&[-1.4, 0.0]).unwrap(), 0.5);
        let robot = &robot;
        let moving = scope.spawn(move || robot.move_joints(&back, LONG));
        std::thread::sleep(std::time::Duration::from_millis(50));
        assert!(matches!(stop.stop(LONG), StopOutcome::Stopped { .. }));
        let error = moving.join().unwrap().unwrap_err();
        assert_eq!(error.to_string(), "arm: the counting arm was stopped on its way");
    });
    assert!(host.finish(LONG).is_orderly());
}

#[test]
fn a_library_of_another_contract_is_refused_with_both_versions() {
    let folder = TestFolder::new();
    let Some(plugin) = compiled(folder.directory.path(), &["-DPLUMB_CONTRACT_MAJOR=7u"]) else { return };
    let message = verify(&plugin).unwrap_err().to_string();
    let path = plugin.library_path.display();
    assert_eq!(
        message,
        format!(
            "{path}: was built for plugin contract 7.{}; this program speaks {}: rebuild the plugin against contract 1.x",
            ContractVersion::CURRENT.1,
            ContractVersion::CURRENT
        )
    );
}

#[test]
fn a_library_with_something_else_under_the_entrys_name_is_refused() {
    let folder = TestFolder::new();
    let magic = "-DPLUMB_MAGIC={'N','O','T','P','L','U','M','B'}";
    let Some(plugin) = compiled(folder.directory.path(), &[magic]) else { return };
    let message = verify(&plugin).unwrap_err().to_string();
    assert!(
        message.ends_with("is not a usable plugin: it begins with \"NOTPLUMB\" instead of 'PLUMBPLG'"),
        "{message}"
    );
}

/// The size of the worked example's table of functions.
const WHOLE_TABLE: &str = "sizeof(plumb_robot_functions)";

/// The same of a table that ends where `read_inputs` would begin.
const TABLE_WITHOUT_INPUTS: &str = "offsetof(plumb_robot_functions, read_inputs)";

#[test]
fn a_robot_of_an_older_minor_version_with_a_shorter_table_is_loaded() {
    let folder = TestFolder::new();
    // Its table ends where `read_inputs` would begin: what lies behind is not the table's.
    let example = fs::read_to_string(abi().join("examples/counting_arm/counting_arm.c")).unwrap();
    let shorter = example.replace(WHOLE_TABLE, TABLE_WITHOUT_INPUTS);
    assert_ne!(shorter, example);
    let source = folder.directory.path().join("counting_arm.c");
    fs::write(&source, shorter).unwrap();
    let Some(plugin) = compiled_from(&source, folder.directory.path(), &["-include", "stddef.h"]) else {
        return;
    };
    let host = folder.spawn(&HostArguments::new("arm", &folder.domain, &plugin)).unwrap();
    let robot = host.robot().unwrap();
    assert_eq!(robot.describe().unwrap().model, "counting arm");
    let error = robot.read_inputs().unwrap_err().to_string();
    assert!(error.contains("this device cannot read inputs"), "{error}");
    assert!(host.finish(LONG).is_orderly());
}

#[test]
fn of_a_robot_without_a_stream_of_its_lines_none_is_emitted_when_it_is_read() {
    let folder = TestFolder::new();
    let example = fs::read_to_string(example()).unwrap();
    let Some(plugin) = with_another_manifest(&example, RENAMED_INPUTS, folder.directory.path()) else {
        return;
    };
    let (host, events) = folder.spawn_listening(&HostArguments::new("arm", &folder.domain, &plugin));
    assert!(!host.robot().unwrap().read_joints().unwrap().is_moving());
    assert!(host.finish(LONG).is_orderly());
    let errors: Vec<HostEvent> = events
        .iter()
        .filter(|event| matches!(event, HostEvent::Log { level: LogLevel::Error, .. }))
        .collect();
    assert_eq!(errors, []);
}

/// The worked example with motors, whose table of functions has this size: the first reports 31.5 degrees Celsius, the second nothing.
fn with_motors(size: &str) -> String {
    const READS_MOTORS: &str = "
static plumb_status read_motors(plumb_instance *arm, plumb_motor_state *motors) {
    const plumb_joint_vector nothing = { .count = JOINTS, .values = { NAN, NAN } };
    motors->time_ns = arm->host->now_ns(arm->host->context);
    motors->temperature = motors->load = motors->voltage = nothing;
    motors->temperature.values[0] = 31.5;
    motors->temperature_uncertainty = 0.25;
    motors->load_uncertainty = motors->voltage_uncertainty = NAN;
    return PLUMB_OK;
}

static const plumb_robot_functions robot = {
    .read_motors = read_motors,";
    let example = fs::read_to_string(example()).unwrap();
    let (table, whole) = ("\nstatic const plumb_robot_functions robot = {", "sizeof(plumb_robot_functions)");
    assert!(example.contains(table) && example.contains(whole));
    example.replace(table, READS_MOTORS).replace(whole, size)
}

#[test]
fn motors_of_a_robot_in_c_are_read_and_not_where_its_table_is_that_of_contract_1_0() {
    let robot_of = |folder: &TestFolder, size: &str| {
        let plugin = compiled_from_text(&with_motors(size), folder.directory.path())?;
        Some(folder.spawn(&HostArguments::new("arm", &folder.domain, &plugin)).unwrap())
    };
    let folder = TestFolder::new();
    let Some(host) = robot_of(&folder, "sizeof(plumb_robot_functions)") else { return };
    let motors = host.robot().unwrap().read_motors().unwrap();
    assert_eq!(motors.temperature.get(0), Some(31.5));
    assert!(motors.temperature.get(1).unwrap().is_nan() && motors.load.get(0).unwrap().is_nan());
    assert!(motors.temperature_uncertainty == 0.25 && motors.voltage_uncertainty.is_nan());
    assert!(host.finish(LONG).is_orderly());

    let folder = TestFolder::new();
    let host = robot_of(&folder, "offsetof(plumb_robot_functions, read_motors)").unwrap();
    let error = host.robot().unwrap().read_motors().unwrap_err().to_string();
    assert_eq!(error, "arm: this device cannot read motors");
    assert!(host.finish(LONG).is_orderly());
}

#[test]
fn a_robot_with_the_functions_of_a_sensor_is_refused_with_what_it_seems_to_be() {
    let folder = TestFolder::new();
    let example = fs::read_to_string(example()).unwrap();
    let other = example.replace("\"plumb.robot/1\"", "\"plumb.sensor/1\"");
    assert_ne!(other, example);
    let Some(plugin) = compiled_from_text(&other, folder.directory.path()) else { return };
    let message = verify(&plugin).unwrap_err().to_string();
    assert!(
        message.contains(
            "its `extension` gives NULL for 'plumb.robot/1': it has one for 'plumb.sensor/1': is it a sensor?"
        ),
        "{message}"
    );
}

#[test]
fn a_robot_that_nobody_can_watch_is_verified_with_a_note() {
    let nobody_watches = "it declares no stream `joints` of joint-state/1 messages: nobody can watch it move";
    let example = fs::read_to_string(example()).unwrap();
    for other in
        ["", "  - {name: elbow, message: joint-state/1}\n", "  - {name: joints, message: health/1}\n"]
    {
        let folder = TestFolder::new();
        let Some(plugin) = with_another_manifest(&example, (JOINTS, other), folder.directory.path()) else {
            return;
        };
        assert_eq!(verify(&plugin).unwrap(), [nobody_watches], "{other}");
    }
}

#[test]
fn a_robot_whose_lines_cannot_be_read_at_rest_is_verified_with_a_note_if_it_has_a_stream_of_them() {
    let waits_in_vain = "it declares a stream `inputs` and has no read_inputs: a sensor that is wired to it waits in vain while the robot is at rest";
    let example = fs::read_to_string(example()).unwrap();
    let unread = example.replace(WHOLE_TABLE, TABLE_WITHOUT_INPUTS);
    assert_ne!(unread, example);
    let folder = TestFolder::new();
    let Some(plugin) = compiled_from_text(&unread, folder.directory.path()) else { return };
    assert_eq!(verify(&plugin).unwrap(), [waits_in_vain]);
    let folder = TestFolder::new();
    let plugin = with_another_manifest(&unread, RENAMED_INPUTS, folder.directory.path()).unwrap();
    assert_eq!(verify(&plugin).unwrap(), [] as [&str; 0]);
}
