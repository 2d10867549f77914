//! The conformance suite over real hosts.

use plumb_bus::Bus;
use plumb_host::{HostArguments, Plugin, WiredInput, check_plugin, check_robot, check_sensor};
use plumb_plugin::Value;
use plumb_plugin::conformance::{CheckOutcome, CheckReport, LISTS, SENSOR_CHECKS, leaves_at_rest};

use crate::c_plugin::{JOINTS, compiled, example, with_another_manifest};
use crate::test_folder::{TestFolder, command, plugin, stream};

#[test]
fn a_robot_in_rust_conforms() {
    let folder = TestFolder::new();
    let report =
        check_robot(folder.bus(), &folder.arguments("arm", "misbehaving_robot", Value::Null), command);
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == CheckOutcome::Passed), "{report}");
}

#[test]
fn a_robot_in_c_conforms() {
    let folder = TestFolder::new();
    let Some(plugin) = compiled(folder.directory.path(), &[]) else { return };
    let report = check_robot(folder.bus(), &HostArguments::new("arm", &folder.domain, &plugin), command);
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == CheckOutcome::Passed), "{report}");
}

#[test]
fn a_robot_that_hangs_or_dies_does_not_conform() {
    let folder = TestFolder::new();
    let bus: &Bus = folder.bus();
    let arguments =
        folder.arguments("arm", "misbehaving_robot", serde_json::json!({"fault": "abort", "in": "move"}));
    let report = check_robot(bus, &arguments, command);
    assert!(!report.is_good());
    let text = report.to_string();
    assert!(text.contains("passed   it is at rest when it is read"), "{text}");
    let failed = "FAILED   a move ends at its target: the host of arm was ended by SIGABRT";
    assert!(text.contains(failed), "{text}");
}

#[test]
fn a_sensor_conforms() {
    let folder = TestFolder::new();
    let report = check_sensor(folder.bus(), &wired_watcher(&folder), command);
    assert!(report.is_good(), "{report}");
}

/// What the host of a sensor on a robot's input lines is given.
fn wired_watcher(folder: &TestFolder) -> HostArguments {
    let mut arguments = folder.arguments("eye", "line_watcher", Value::Null);
    arguments.inputs = vec![WiredInput {
        input: "line".to_owned(),
        device: "arm".to_owned(),
        stream: stream("misbehaving_robot", "inputs"),
    }];
    arguments
}

/// What comes before the checks of a robot or of a sensor.
const OF_ANY_PLUGIN: [&str; 4] =
    ["its manifest is good", "it is loaded and its device is made", "its functions are whole", LISTS];

/// The report on a plugin, once it is seen that each of its rows was heard of when it was done.
fn checked(folder: &TestFolder, plugin: &Plugin, arguments: &HostArguments, may_move: bool) -> CheckReport {
    let mut heard = Vec::new();
    let mut listener = |name: &'static str, outcome: &CheckOutcome| heard.push((name, outcome.clone()));
    let report = check_plugin(folder.bus(), plugin, arguments, may_move, command, &mut listener);
    assert_eq!(heard, report.rows);
    report
}

fn names(report: &CheckReport) -> Vec<&'static str> {
    report.rows.iter().map(|(name, _)| *name).collect()
}

#[test]
fn a_robot_that_may_not_move_is_checked_as_far_as_it_stays_at_rest() {
    let folder = TestFolder::new();
    let arguments = folder.arguments("arm", "misbehaving_robot", Value::Null);
    let report = checked(&folder, &plugin("misbehaving_robot"), &arguments, false);
    let (before, of_robots) = report.rows.split_at(OF_ANY_PLUGIN.len());
    assert_eq!(before, OF_ANY_PLUGIN.map(|name| (name, CheckOutcome::Passed)));
    assert!(of_robots.iter().any(|(name, _)| *name == "a move ends at its target"), "{report}");
    for (name, outcome) in of_robots {
        let would_move = CheckOutcome::Skipped("it would move the robot, or make it ready to".to_owned());
        let expected = if leaves_at_rest(name) { CheckOutcome::Passed } else { would_move };
        assert_eq!(*outcome, expected, "{name}");
    }
}

#[test]
fn a_plugin_that_makes_no_device_is_not_checked_further() {
    let folder = TestFolder::new();
    let config = serde_json::json!({"fault": "refuse", "in": "create"});
    let arguments = folder.arguments("arm", "misbehaving_robot", config);
    let report = checked(&folder, &plugin("misbehaving_robot"), &arguments, true);
    assert_eq!(names(&report), OF_ANY_PLUGIN[..2]);
    let refused = CheckOutcome::Failed("arm: the robot does not want to".to_owned());
    assert_eq!(report.rows[1].1, refused);
}

#[test]
fn a_sensors_plugin_is_checked_as_one_of_a_sensor() {
    let folder = TestFolder::new();
    let report = checked(&folder, &plugin("line_watcher"), &wired_watcher(&folder), false);
    let of_sensors = SENSOR_CHECKS.iter().map(|(name, _)| *name);
    assert_eq!(names(&report), OF_ANY_PLUGIN.into_iter().chain(of_sensors).collect::<Vec<_>>());
    assert!(report.is_good(), "{report}");
}

/// The worked example in C with another line in its manifest.
fn example_with(folder: &TestFolder, change: (&str, &str)) -> Option<Plugin> {
    let source = std::fs::read_to_string(example()).unwrap();
    with_another_manifest(&source, change, folder.directory.path())
}

#[test]
fn what_could_be_better_in_a_plugins_functions_fails_its_check() {
    let folder = TestFolder::new();
    let Some(plugin) = example_with(&folder, (JOINTS, "")) else { return };
    let report = checked(&folder, &plugin, &HostArguments::new("arm", &folder.domain, &plugin), false);
    let note = "it declares no stream `joints` of joint-state/1 messages: nobody can watch it move";
    assert_eq!(report.rows[2], (OF_ANY_PLUGIN[2], CheckOutcome::Failed(note.to_owned())));
}

#[test]
fn lines_that_a_manifest_counts_otherwise_than_the_robot_fail_their_check() {
    let folder = TestFolder::new();
    let counted = ("config:\n", "input_lines: 3\nconfig:\n");
    let Some(plugin) = example_with(&folder, counted) else { return };
    let report = checked(&folder, &plugin, &HostArguments::new("arm", &folder.domain, &plugin), false);
    let wrong = "the manifest says 3 input lines; the robot describes the bits [0]";
    assert_eq!(report.rows[3], (LISTS, CheckOutcome::Failed(wrong.to_owned())));
}

/// A sensor in C, changed, with a manifest that says how long a reading may take.
fn gauge(
    directory: &std::path::Path,
    read_time_limit_s: f64,
    change: impl Fn(&str) -> String,
) -> Option<plumb_host::Plugin> {
    let manifest = format!(
        "id: gauge\ntitle: A gauge that takes its time\nversion: 1.0.0\ncontract: [1, 0]\nkind: sensor\nlibrary: libgauge.so\nread_time_limit_s: {read_time_limit_s}\n"
    );
    let source = change(GAUGE).replace("MANIFEST", &format!("{manifest:?}"));
    crate::c_plugin::compiled_sensor(&source, &manifest, directory)
}

/// The same as it is: a reading takes it a second.
fn slow_gauge(directory: &std::path::Path, read_time_limit_s: f64) -> Option<plumb_host::Plugin> {
    gauge(directory, read_time_limit_s, str::to_owned)
}

/// The source of a sensor that takes a second for a reading.
const GAUGE: &str = r#"
#define _POSIX_C_SOURCE 199309L
#include "plumb_plugin.h"
#include <stdio.h>
#include <string.h>
#include <time.h>
struct plumb_instance { const plumb_host_functions *host; };
static plumb_instance gauge;
static plumb_bytes text(const char *words) {
    plumb_bytes bytes = { (const uint8_t *)words, strlen(words) };
    return bytes;
}
static plumb_status create(const plumb_host_functions *host, plumb_bytes config, plumb_instance **instance) {
    (void)config;
    gauge.host = host;
    *instance = &gauge;
    return PLUMB_OK;
}
static void destroy(plumb_instance *instance) { (void)instance; }
static plumb_status describe(plumb_instance *instance, const plumb_sink *answer) {
    (void)instance;
    answer->write(answer->context, text("{\"model\": \"gauge\", \"quantities\": [{\"name\": \"height\", \"unit\": \"mm\"}]}"));
    return PLUMB_OK;
}
static plumb_status read_it(plumb_instance *instance, uint64_t after_ns, const plumb_sink *answer) {
    char words[200];
    struct timespec second = { 1, 0 };
    (void)after_ns;
    nanosleep(&second, NULL);
    snprintf(words, sizeof words,
             "{\"time_ns\": %llu, \"quantities\": [{\"name\": \"height\", \"value\": 1.5, \"standard_uncertainty\": 0.1}]}",
             (unsigned long long)instance->host->now_ns(instance->host->context));
    answer->write(answer->context, text(words));
    return PLUMB_OK;
}
static const plumb_sensor_functions sensor = { .size = sizeof(plumb_sensor_functions), .describe = describe, .read = read_it };
static const void *extension(plumb_bytes name) {
    static const char wanted[] = "plumb.sensor/1";
    return name.length == sizeof wanted - 1 && memcmp(name.data, wanted, name.length) == 0 ? &sensor : NULL;
}
static const char manifest[] = MANIFEST;
PLUMB_PLUGIN_ENTRY(gauge) = {
    .magic = PLUMB_MAGIC, .contract_major = PLUMB_CONTRACT_MAJOR, .contract_minor = PLUMB_CONTRACT_MINOR,
    .size = sizeof(plumb_entry), .manifest = { (const uint8_t *)manifest, sizeof manifest - 1 },
    .create = create, .destroy = destroy, .extension = extension,
};
"#;

/// The same with no pause in a reading, and a function that refuses to arm it.
fn gauge_that_is_never_armed(source: &str) -> String {
    let (table, pause) =
        ("static const plumb_sensor_functions sensor = {", "    nanosleep(&second, NULL);\n");
    let armed =
        "static plumb_status arm(plumb_instance *instance) { (void)instance; return PLUMB_REFUSED; }\n";
    assert!(source.contains(table) && source.contains(pause));
    source.replace(table, &format!("{armed}{table} .arm = arm,")).replace(pause, "    (void)second;\n")
}

#[test]
fn a_sensor_that_refuses_to_be_armed_does_not_conform() {
    let folder = TestFolder::new();
    let Some(plugin) = gauge(folder.directory.path(), 1.0, gauge_that_is_never_armed) else { return };
    let report = check_sensor(folder.bus(), &HostArguments::new("gauge", &folder.domain, &plugin), command);
    let armed = report.rows.iter().find(|(name, _)| *name == "it can be armed, polled and read at once");
    assert_eq!(armed.unwrap().1, CheckOutcome::Failed("the plugin does not say why".to_owned()), "{report}");
}

#[test]
fn a_sensor_that_blocks_longer_than_it_says_does_not_conform() {
    let folder = TestFolder::new();
    let Some(plugin) = slow_gauge(folder.directory.path(), 0.3) else { return };
    let report = check_sensor(folder.bus(), &HostArguments::new("gauge", &folder.domain, &plugin), command);
    assert!(!report.is_good(), "{report}");
    assert!(report.to_string().contains("gauge did not answer 'read' within 300ms"), "{report}");
    assert!(!report.to_string().contains("it has nothing to read before its inputs have come"), "{report}");
}

#[test]
fn a_sensor_has_the_time_that_its_manifest_says() {
    let folder = TestFolder::new();
    let Some(plugin) = slow_gauge(folder.directory.path(), 10.0) else { return };
    let report = check_sensor(folder.bus(), &HostArguments::new("gauge", &folder.domain, &plugin), command);
    assert!(report.is_good(), "{report}");
}
