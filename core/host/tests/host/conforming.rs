//! The conformance suite over real hosts.

use plumb_bus::Bus;
use plumb_host::{HostArguments, WiredInput, check_robot, check_sensor};
use plumb_plugin::Value;
use plumb_plugin::conformance::CheckOutcome;

use crate::c_plugin::compiled;
use crate::place::{Place, command, stream};

#[test]
fn a_robot_in_rust_conforms() {
    let place = Place::new();
    let report = check_robot(place.bus(), &place.arguments("arm", "misbehaving_robot", Value::Null), command);
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == CheckOutcome::Passed), "{report}");
}

#[test]
fn a_robot_in_c_conforms() {
    let place = Place::new();
    let Some(plugin) = compiled(place.directory.path(), &[]) else { return };
    let report = check_robot(place.bus(), &HostArguments::new("arm", &place.domain, &plugin), command);
    assert!(report.rows.iter().all(|(_, outcome)| *outcome == CheckOutcome::Passed), "{report}");
}

#[test]
fn a_robot_that_hangs_or_dies_does_not_conform() {
    let place = Place::new();
    let bus: &Bus = place.bus();
    let arguments =
        place.arguments("arm", "misbehaving_robot", serde_json::json!({"fault": "abort", "in": "move"}));
    let report = check_robot(bus, &arguments, command);
    assert!(!report.is_good());
    let text = report.to_string();
    assert!(text.contains("passed   it is at rest when it is read"), "{text}");
    let failed = "FAILED   a move ends at its target: the host of arm was ended by SIGABRT";
    assert!(text.contains(failed), "{text}");
}

#[test]
fn a_sensor_conforms() {
    let place = Place::new();
    let mut arguments = place.arguments("eye", "line_watcher", Value::Null);
    arguments.inputs = vec![WiredInput {
        input: "line".to_owned(),
        device: "arm".to_owned(),
        stream: stream("misbehaving_robot", "inputs"),
    }];
    let report = check_sensor(place.bus(), &arguments, command);
    assert!(report.is_good(), "{report}");
}

/// A sensor in C that takes a second for a reading, with a manifest that says how long it may.
fn slow_gauge(directory: &std::path::Path, read_time_limit_s: f64) -> Option<plumb_host::Plugin> {
    let manifest = format!(
        "id: gauge\ntitle: A gauge that takes its time\nversion: 1.0.0\ncontract: [1, 0]\nkind: sensor\nlibrary: libgauge.so\nread_time_limit_s: {read_time_limit_s}\n"
    );
    let source = r#"
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
    let source = source.replace("MANIFEST", &format!("{manifest:?}"));
    crate::c_plugin::compiled_sensor(&source, &manifest, directory)
}

#[test]
fn a_sensor_that_blocks_longer_than_it_says_does_not_conform() {
    let place = Place::new();
    let Some(plugin) = slow_gauge(place.directory.path(), 0.3) else { return };
    let report = check_sensor(place.bus(), &HostArguments::new("gauge", &place.domain, &plugin), command);
    assert!(!report.is_good(), "{report}");
    assert!(report.to_string().contains("gauge did not answer 'read' within 300ms"), "{report}");
    assert!(!report.to_string().contains("it has nothing to read before its inputs have come"), "{report}");
}

#[test]
fn a_sensor_has_the_time_that_its_manifest_says() {
    let place = Place::new();
    let Some(plugin) = slow_gauge(place.directory.path(), 10.0) else { return };
    let report = check_sensor(place.bus(), &HostArguments::new("gauge", &place.domain, &plugin), command);
    assert!(report.is_good(), "{report}");
}
