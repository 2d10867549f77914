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
    assert!(text.contains("passed   it stands when it is read"), "{text}");
    let failed = "FAILED   a move ends where it was told to: the host of arm was ended by SIGABRT";
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
