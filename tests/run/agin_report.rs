//! The whole of Agin's report in one cell: joints, rig, scan, over the simulated arm and over its VAL-II line.

use plumb_record::Record;

use crate::agin_steps::{apex_error, value, values_of};
use crate::lab::Lab;

/// Where the apex is on the platform.
const APEX_MM: [f64; 3] = [60.0, 530.0, -260.0];

/// The whole report in a cell, with the record `record`: the direction-dependent errors as found, with the zeros, and with the rig, mm.
fn report(lab: &Lab, cell: &str) -> [f64; 3] {
    let arguments =
        ["run", cell, "agin", "--headless", "--set", "quadrants=1", "--json", "--record", "record"];
    let output = lab.plumb(&arguments);
    let out = output.out();
    assert_eq!(output.code(), 0, "{}{}", out.lines().last().unwrap_or_default(), output.err());
    let of = |step: &str, name: &str| {
        let events = out.lines().map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
        let mut found = events.filter(|event| event["event"] == "step_finished" && event["step"] == step);
        value(&found.next().unwrap()["values"], name)
    };
    let errors =
        ["as_found", "after_joints", "after_rig"].map(|stage| of(&format!("{stage}.spread"), "error"));
    let expected = format!("{:.2} mm as found", errors[0]);
    assert!(out.contains(&expected), "the run itself says it: {expected}");
    errors
}

#[test]
fn over_the_terminal_line_of_the_real_driver_the_whole_report_comes_out_as_well() {
    let lab = Lab::of("light-stripe");
    let [as_found, with_zeros, with_rig] = report(&lab, "agin-serial.yaml");
    assert!(as_found > with_zeros && with_zeros > with_rig, "{as_found} {with_zeros} {with_rig} mm");
    assert!(with_rig < 0.5, "{with_rig} mm");
    let left = apex_error(&lab, "agin-serial.yaml", APEX_MM);
    assert!(left < 1.0, "{left} mm");
}

#[test]
fn joints_rig_and_scan_in_one_run_and_the_direction_error_falls_at_each_step() {
    let lab = Lab::of("light-stripe");
    assert_eq!(lab.plumb(&["check", "agin.yaml"]).code(), 0);
    let [as_found, with_zeros, with_rig] = report(&lab, "agin.yaml");
    assert!(as_found > with_zeros && with_zeros > with_rig, "{as_found} {with_zeros} {with_rig} mm");
    assert!(with_rig < 0.5, "{with_rig} mm");

    // The zeros and the rig travel by the record: another run of the cell uses both.
    let left = apex_error(&lab, "agin.yaml", APEX_MM);
    assert!(left < 1.0, "{left} mm");
    let record = Record::open(&lab.path("record")).unwrap();
    let zeros = record.corrections_in_force("agin", "arm").unwrap();
    for (joint, truth) in
        [("shoulder", 0.35), ("elbow", -0.45), ("wrist_roll", 0.4), ("wrist_bend", -0.5), ("flange", 0.6)]
    {
        let found = zeros.iter().find(|one| one.key.site == joint).unwrap();
        assert!((found.value - truth).abs() < 0.06, "{joint}: {} for {truth}", found.value);
    }
    assert_eq!(record.corrections_in_force("agin", "stripe").unwrap().len(), 8);

    let page = lab.path("agin.html");
    let output = lab.plumb(&["certificate", "1", "-o", page.to_str().unwrap(), "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let page = std::fs::read_to_string(page).unwrap();
    for quantity in ["shoulder", "wrist_bend", "camera aim x of stripe", "sheet offset of stripe"] {
        assert!(page.contains(quantity), "{quantity}");
    }
    // Its parts run alone too.
    values_of(&lab, "agin.yaml", "wrist", "found");
}
