//! What the lab makes of a cell's stripes.

use std::fs;

use serde_json::Value;

use crate::lab::Lab;

/// The cell with stripes of its own gathered in `record/run-1`.
fn gathered() -> Lab {
    let lab = Lab::of("light-stripe");
    let output = lab.plumb(&["run", "cell.yaml", "gather", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    lab
}

#[test]
fn an_arm_as_on_paper_has_nothing_the_matter_with_it_and_what_cannot_be_determined_is_not() {
    let lab = gathered();
    let output = lab.plumb(&["stripe", "diagnose", "cell.yaml", "--scans", "record/run-1", "--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let report: Value = serde_json::from_str(&output.out()).unwrap();
    assert_eq!(report["verdict"], "at_floor", "{report}");
    let found = report["stripes"]["found"].as_array().unwrap();
    let zeros = found.iter().filter(|one| one["name"].as_str().unwrap().starts_with("joint_zero"));
    for zero in zeros {
        let (value, sigma) = (zero["value"].as_f64().unwrap(), zero["sigma"].as_f64().unwrap());
        assert!(value.abs() < 5.0 * sigma && sigma < 0.004 && zero["unit"] == "deg", "{zero}");
    }

    // What is adjusted is written beside the cell, and nothing over it.
    let adjust = ["stripe", "adjust", "cell.yaml", "--scans", "record/run-1", "-o", "cell-true.yaml"];
    let output = lab.plumb(&adjust);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(fs::read_to_string(lab.path("cell-true.yaml")).unwrap().contains("rig: cell-true.rig.yaml,"));
    assert_eq!(lab.plumb(&["check", "cell-true.yaml"]).code(), 0);
    let output = lab.plumb(&adjust);
    assert!(output.code() == 2 && output.err().contains("cell-true.arm.yaml"), "{}", output.all());
}

/// What the lab says of stripes that an arm with this imperfection has seen.
fn diagnosed(imperfection: &str) -> Value {
    let lab = Lab::of("light-stripe");
    let faulty = format!("    resolution: encoder\n    imperfections:\n      - {imperfection}\n");
    lab.edit("world.yaml", "    resolution: encoder\n", &faulty);
    let output = lab.plumb(&["run", "cell.yaml", "gather", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let output = lab.plumb(&["stripe", "diagnose", "cell.yaml", "--scans", "record/run-1", "--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    serde_json::from_str(&output.out()).unwrap()
}

/// The effect that was named, as it is written.
fn named(report: &Value) -> String {
    let named = &report["named"];
    let with = named["with"].as_str().map(|with| format!(", {with}"));
    let order = named["n"].as_f64().map(|order| format!(", {order}"));
    let site = named["where"].as_str().unwrap_or_default();
    let (with, order) = (with.unwrap_or_default(), order.unwrap_or_default());
    format!("{}({site}{with}{order})", named["effect"].as_str().unwrap_or_default())
}

/// The size that was named lies within three standard errors of the truth, and they are no larger than a tenth of it.
fn is_right(report: &Value, size: f64) {
    let (found, error) = (report["named"]["size"].as_f64().unwrap(), report["named"]["se"].as_f64().unwrap());
    assert!((found - size).abs() < 3.0 * error && error < 0.1 * size.abs(), "{found} +- {error}, not {size}");
}

#[test]
fn a_joint_that_another_drags_along_is_named_whichever_it_is() {
    let report = diagnosed("joint_coupling: {joint: flange, driver: wrist_bend, deg_per_deg: 0.02}");
    assert_eq!(named(&report), "joint_coupling(flange, wrist_bend)", "{}", report["sentence"]);
    is_right(&report, 0.02);
    let report = diagnosed("joint_coupling: {joint: wrist_bend, driver: wrist_roll, deg_per_deg: 0.015}");
    assert_eq!(named(&report), "joint_coupling(wrist_bend, wrist_roll)", "{}", report["sentence"]);
    is_right(&report, 0.015);
}

#[test]
fn a_wheel_of_many_teeth_out_of_true_is_named_by_its_order() {
    let report =
        diagnosed("joint_harmonic: {joint: shoulder, per_turn: 8, amplitude_deg: 0.1, phase_deg: 40}");
    assert_eq!(named(&report), "joint_harmonic(shoulder, 8)", "{}", report["sentence"]);
    is_right(&report, 0.1);
}

#[test]
fn a_joint_that_stiffens_is_not_taken_for_one_that_gives_way_evenly() {
    let report = diagnosed("joint_stiffening: {joint: shoulder, rad_per_nm: 3.0e-4, knee_nm: 12}");
    assert_eq!(named(&report), "joint_stiffening(shoulder)", "{}", report["sentence"]);
}

#[test]
fn the_size_of_a_soft_joint_is_right_with_what_hangs_on_the_flange() {
    let report = diagnosed("joint_compliance: {joint: elbow, rad_per_nm: 2.5e-4}");
    assert_eq!(named(&report), "joint_compliance(elbow)", "{}", report["sentence"]);
    is_right(&report, 2.5e-4);
}

/// What comes with time is given its own name or none.
#[test]
fn an_arm_that_warms_up_is_not_given_another_name() {
    let report = diagnosed("warm_up: {joint: elbow, zero_deg: 0.3, time_constant_s: 300}");
    assert!(report["named"].is_null() || report["named"]["effect"] == "warm_up", "{}", report["sentence"]);
    assert_ne!(report["verdict"], "at_floor");
}

#[test]
fn pictures_exposed_late_are_named_from_scans_in_motion_and_the_cell_that_is_written_allows_for_it() {
    let lab = Lab::of("light-stripe");
    lab.edit("world.yaml", "light:\n", "light:\n  exposure_delay_ms: -9\n");
    let gather = ["run", "cell.yaml", "gather", "--set", "fly_mm_s=120", "--headless", "--record", "record"];
    let output = lab.plumb(&gather);
    assert_eq!(output.code(), 0, "{}", output.all());
    let scans = ["--scans", "record/run-1"];
    let output = lab.plumb(&[&["stripe", "diagnose", "cell.yaml", "--json"], scans.as_slice()].concat());
    assert_eq!(output.code(), 0, "{}", output.all());
    let report: Value = serde_json::from_str(&output.out()).unwrap();
    assert_eq!(
        (report["verdict"].as_str(), report["named"]["effect"].as_str()),
        (Some("named"), Some("clock_skew")),
        "{report}"
    );
    let adjust = ["stripe", "adjust", "cell.yaml", "--add", "clock_skew", "-o", "cell-true.yaml"];
    let output = lab.plumb(&[adjust.as_slice(), scans.as_slice()].concat());
    assert_eq!(output.code(), 0, "{}", output.all());
    let cell = fs::read_to_string(lab.path("cell-true.yaml")).unwrap();
    let (_, delay) = cell.split_once("exposure_delay_ms: ").unwrap();
    let delay: f64 = delay.split('}').next().unwrap().parse().unwrap();
    assert!((delay + 9.0).abs() < 0.1, "{delay} ms");
    assert_eq!(lab.plumb(&["check", "cell-true.yaml"]).code(), 0);
}

#[test]
fn a_bent_sheet_is_kept_in_the_rig_file_and_scans_with_it_come_out_straight() {
    let lab = Lab::of("light-stripe");
    lab.edit("world.yaml", "    width_mm: 1\n", "    width_mm: 1\n    bow: 0.03\n");
    let output = lab.plumb(&["run", "cell.yaml", "gather", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let adjust = [
        "stripe",
        "adjust",
        "cell.yaml",
        "--scans",
        "record/run-1",
        "--add",
        "stripe_bow",
        "-o",
        "cell-true.yaml",
    ];
    let output = lab.plumb(&adjust);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(fs::read_to_string(lab.path("cell-true.rig.yaml")).unwrap().contains("bow_per_mm:"));
    let band = |cell: &str| {
        let output = lab.plumb(&["run", cell, "random-error", "--headless", "--json"]);
        let events = output.out();
        let events = events.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        let scan = events.filter(|event| event["step"] == "plane" && event["event"] == "step_finished");
        let values: Vec<Value> = scan.flat_map(|event| event["values"].as_array().unwrap().clone()).collect();
        let band = values.iter().find(|value| value["name"] == "thickness");
        band.unwrap()["value"].as_f64().unwrap()
    };
    let (before, after) = (band("cell.yaml"), band("cell-true.yaml"));
    assert!(before > 0.5 && after < 0.4, "the plane's band was {before} mm thick, and is {after} mm");
}

#[test]
fn pictures_to_take_next_lie_within_the_joints_limits_and_can_be_gone_through_by_a_procedure() {
    let lab = gathered();
    let next = |more: &[&str]| {
        let next = ["stripe", "next", "cell.yaml", "--scans", "record/run-1", "-n", "3"];
        lab.plumb(&[next.as_slice(), more].concat())
    };
    let output = next(&["--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let report: Value = serde_json::from_str(&output.out()).unwrap();
    // Three new ones, and returns to two of them.
    let poses = report["next"].as_array().unwrap();
    assert_eq!(poses.len(), 5, "{report}");
    let limits =
        [(-160.0, 160.0), (-225.0, 45.0), (-45.0, 225.0), (-110.0, 170.0), (-100.0, 100.0), (-266.0, 266.0)];
    for pose in poses {
        let joints = pose["q_deg"].as_array().unwrap().iter().map(|joint| joint.as_f64().unwrap());
        assert!(joints.zip(limits).all(|(joint, (low, high))| low < joint && joint < high), "{pose}");
    }
    let output = next(&["--csv"]);
    assert!(output.code() == 0 && output.out().starts_with("q1_deg,q2_deg,"), "{}", output.all());
    assert_eq!(next(&["--csv", "--json"]).code(), 2);
}

/// A model file knows no rig: it is reported where such an effect belongs.
#[test]
fn an_effect_of_the_rig_is_refused_for_a_model_file() {
    let lab = Lab::of("light-stripe");
    fs::write(
        lab.path("table.csv"),
        "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,p1_x_mm\n0,0,90,0,0,0,1\n10,0,90,0,0,0,2\n",
    )
    .unwrap();
    let output = lab.plumb(&["model", "add", "arm.yaml", "lens_distortion", "--data", "table.csv"]);
    assert_eq!(output.code(), 2, "{}", output.all());
    assert!(
        output.err().contains("of the rig of a light stripe") && output.err().contains("`plumb stripe`"),
        "{}",
        output.err()
    );
    assert!(lab.plumb(&["model", "effects", "lens_distortion"]).out().contains("plumb stripe adjust"));
}

#[test]
fn what_the_lab_cannot_work_with_is_reported() {
    let lab = Lab::of("light-stripe");
    fs::create_dir(lab.path("empty")).unwrap();
    let message_for = |arguments: &[&str]| {
        let output = lab.plumb(&[&["stripe", "diagnose"], arguments].concat());
        assert_eq!(output.code(), 2, "{}", output.all());
        output.err()
    };
    let none = message_for(&["cell.yaml", "--scans", "empty"]);
    assert!(none.contains("empty: no scan lies there") && none.contains("`save:`"), "{none}");
    let effect = message_for(&["cell.yaml", "--scans", "empty", "--add", "joint_complience(shoulder)"]);
    assert!(effect.contains("joint_complience"), "{effect}");
    fs::write(lab.path("empty/a.poses.csv"), "q1_deg\n1\n").unwrap();
    fs::write(lab.path("empty/a.stripes.csv"), "row,u_px,v_px,sigma_px,on\n9,1,1,1,x\n").unwrap();
    assert!(
        message_for(&["cell.yaml", "--scans", "empty"]).contains("a.stripes.csv:2: row 9 is none of the 1")
    );
    lab.edit("scene.yaml", "sphere", "cone");
    assert!(message_for(&["cell.yaml", "--scans", "empty"]).contains("scene.yaml"));
    lab.edit("cell.yaml", "rig: rig.yaml, ", "");
    assert!(
        message_for(&["cell.yaml", "--scans", "empty"]).contains("no device is a light-stripe with a `rig:`")
    );
}
