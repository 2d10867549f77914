//! The sensor as its host sees it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use plumb_ir_proximity::IrProximity;
use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{
    ContractVersion, DeviceKind, DigitalInputs, JointVector, Manifest, PluginError, ProximityEdge, Sensor,
    Value,
};
use serde_json::json;

fn sensor(config: &Value) -> (RecordingHost, IrProximity) {
    let recording = RecordingHost::new();
    let sensor = IrProximity::create(config, recording.host()).unwrap();
    (recording, sensor)
}

fn levels(time_ns: u64, levels: u64, changed: u64) -> DigitalInputs {
    let joints = JointVector::from_slice(&[time_ns as f64, -1.0]).unwrap();
    DigitalInputs { time_ns, levels, changed, joints, ..Default::default() }
}

#[test]
fn a_reading_waits_until_the_input_has_been_seen_up_to_the_moment_asked_for() {
    let (recording, mut sensor) = sensor(&json!({"bit": 0}));
    assert_eq!(sensor.read(100).unwrap(), None);
    recording.feed("line", &levels(50, 1, 1));
    assert_eq!(sensor.read(100).unwrap(), None);
    recording.feed("line", &levels(100, 1, 0));
    let reading = sensor.read(100).unwrap().unwrap();
    assert_eq!(reading.time_ns, 100);
    assert_eq!(reading.fired, Some(true));
    assert_eq!(reading.edges.len(), 1);
    assert_eq!(reading.edges[0].joints.as_slice(), [50.0, -1.0]);
}

#[test]
fn each_edge_is_read_once_and_emitted_once() {
    let (recording, mut sensor) = sensor(&json!({"bit": 1}));
    for message in [levels(10, 2, 2), levels(20, 0, 2), levels(30, 0, 0)] {
        recording.feed("line", &message);
        sensor.poll().unwrap();
    }
    let fired: Vec<bool> =
        sensor.read(30).unwrap().unwrap().edges.iter().map(ProximityEdge::has_fired).collect();
    assert_eq!(fired, [true, false]);
    assert!(sensor.read(30).unwrap().unwrap().edges.is_empty());
    assert_eq!(recording.emitted::<ProximityEdge>("edges").len(), 2);
}

#[test]
fn arming_forgets_edges_and_keeps_the_level() {
    let (recording, mut sensor) = sensor(&json!({"bit": 0}));
    recording.feed("line", &levels(10, 1, 1));
    sensor.arm().unwrap();
    let reading = sensor.read(0).unwrap().unwrap();
    assert!(reading.edges.is_empty());
    assert_eq!(reading.fired, Some(true));
}

#[test]
fn lost_messages_are_an_error_and_the_level_is_unknown_after_it() {
    let (recording, mut sensor) = sensor(&json!({"bit": 0}));
    recording.feed("line", &levels(10, 1, 1));
    recording.feed_loss("line");
    assert!(matches!(sensor.read(0), Err(PluginError::InputLost(_))));
    assert_eq!(sensor.read(0).unwrap().unwrap().fired, None);
}

#[test]
fn a_change_of_the_settings_takes_effect() {
    let (recording, mut sensor) = sensor(&json!({"bit": 0}));
    sensor.configure(&json!({"active": "low"})).unwrap();
    recording.feed("line", &levels(10, 0, 1));
    assert_eq!(sensor.read(10).unwrap().unwrap().fired, Some(true));
    let error = sensor.configure(&json!({"debounce_ms": -1})).unwrap_err();
    assert_eq!(error.to_string(), "`debounce_ms` is -1; it must be 0 to 1000");
}

#[test]
fn bad_configurations_are_refused_with_what_would_be_right() {
    for (config, sentence) in [
        (Value::Null, "invalid type: null"),
        (json!({}), "say where the sensor's line ends, once: `bit: 0` for an input of the robot"),
        (json!({"bit": 64}), "`bit` is 64; a line's bit is 0 to 63"),
        (json!({"bit": 0, "polarity": "low"}), "unknown field `polarity`"),
        (json!({"bit": 0, "active": "left"}), "unknown variant `left`, expected `high` or `low`"),
        (json!({"bit": 0, "debounce_ms": 2000}), "`debounce_ms` is 2000; it must be 0 to 1000"),
    ] {
        let error = IrProximity::create(&config, RecordingHost::new().host()).unwrap_err();
        assert!(matches!(error, PluginError::Refused(_)));
        assert!(error.to_string().contains(sentence), "{error}");
    }
}

#[test]
fn the_manifest_is_of_this_contract() {
    let manifest = Manifest::parse(include_str!("../plugin.yaml"), "plugin.yaml").unwrap();
    assert_eq!(manifest.id, "ir-proximity");
    assert_eq!(manifest.kind, DeviceKind::Sensor);
    // The first version that has all it uses: a later one would ask for a newer program without need.
    assert_eq!(manifest.contract, ContractVersion(1, 0));
}
