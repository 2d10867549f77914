//! What the lab makes of a cell's stripes.

use std::fs;

use serde_json::Value;

use crate::lab::Lab;

/// The cell with stripes of its own gathered in `record/run-1`.
fn gathered() -> Lab {
    let lab = Lab::of("light-stripe");
    let said = lab.plumb(&["run", "cell.yaml", "gather", "--headless", "--record", "record"]);
    assert_eq!(said.code(), 0, "{}", said.all());
    lab
}

#[test]
fn an_arm_as_on_paper_has_nothing_the_matter_with_it_and_what_cannot_be_told_is_not() {
    let lab = gathered();
    let said = lab.plumb(&["stripe", "diagnose", "cell.yaml", "--scans", "record/run-1", "--json"]);
    assert_eq!(said.code(), 0, "{}", said.all());
    let told: Value = serde_json::from_str(&said.out()).unwrap();
    assert_eq!(told["verdict"], "at_floor", "{told}");
    let found = told["found"].as_array().unwrap();
    let zeros = found.iter().filter(|one| one["name"].as_str().unwrap().starts_with("joint_zero"));
    for zero in zeros {
        let (value, sigma) = (zero["value"].as_f64().unwrap(), zero["sigma"].as_f64().unwrap());
        assert!(value.abs() < 5.0 * sigma && sigma < 5e-5, "{zero}");
    }

    // What is adjusted is written beside the cell, and nothing over it.
    let adjust = ["stripe", "adjust", "cell.yaml", "--scans", "record/run-1", "-o", "cell-true.yaml"];
    let said = lab.plumb(&adjust);
    assert_eq!(said.code(), 0, "{}", said.all());
    assert!(fs::read_to_string(lab.path("cell-true.yaml")).unwrap().contains("rig: cell-true.rig.yaml,"));
    assert_eq!(lab.plumb(&["check", "cell-true.yaml"]).code(), 0);
    let said = lab.plumb(&adjust);
    assert!(said.code() == 2 && said.err().contains("cell-true.arm.yaml"), "{}", said.all());
}

#[test]
fn pictures_exposed_late_are_named_from_scans_in_motion_and_the_cell_that_is_written_allows_for_it() {
    let lab = Lab::of("light-stripe");
    lab.edit("world.yaml", "light:\n", "light:\n  exposure_delay_ms: -9\n");
    let gather = ["run", "cell.yaml", "gather", "--set", "fly_mm_s=120", "--headless", "--record", "record"];
    let said = lab.plumb(&gather);
    assert_eq!(said.code(), 0, "{}", said.all());
    let scans = ["--scans", "record/run-1"];
    let said = lab.plumb(&[&["stripe", "diagnose", "cell.yaml", "--json"], scans.as_slice()].concat());
    assert_eq!(said.code(), 0, "{}", said.all());
    let told: Value = serde_json::from_str(&said.out()).unwrap();
    assert_eq!(
        (told["verdict"].as_str(), told["candidates"][0]["effect"].as_str()),
        (Some("named"), Some("clock_skew")),
        "{told}"
    );
    let adjust = ["stripe", "adjust", "cell.yaml", "--add", "clock_skew", "-o", "cell-true.yaml"];
    let said = lab.plumb(&[adjust.as_slice(), scans.as_slice()].concat());
    assert_eq!(said.code(), 0, "{}", said.all());
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
    let said = lab.plumb(&["run", "cell.yaml", "gather", "--headless", "--record", "record"]);
    assert_eq!(said.code(), 0, "{}", said.all());
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
    let said = lab.plumb(&adjust);
    assert_eq!(said.code(), 0, "{}", said.all());
    assert!(fs::read_to_string(lab.path("cell-true.rig.yaml")).unwrap().contains("bow_per_mm:"));
    let band = |cell: &str| {
        let said = lab.plumb(&["run", cell, "random-error", "--headless", "--json"]);
        let events = said.out();
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
fn what_the_lab_cannot_work_with_is_told() {
    let lab = Lab::of("light-stripe");
    fs::create_dir(lab.path("empty")).unwrap();
    let told = |arguments: &[&str]| {
        let said = lab.plumb(&[&["stripe", "diagnose"], arguments].concat());
        assert_eq!(said.code(), 2, "{}", said.all());
        said.err()
    };
    let none = told(&["cell.yaml", "--scans", "empty"]);
    assert!(none.contains("empty: no scan lies there") && none.contains("`save:`"), "{none}");
    let effect = told(&["cell.yaml", "--scans", "empty", "--add", "joint_complience(shoulder)"]);
    assert!(effect.contains("joint_complience"), "{effect}");
    fs::write(lab.path("empty/a.poses.csv"), "q1_deg\n1\n").unwrap();
    fs::write(lab.path("empty/a.stripes.csv"), "row,u_px,v_px,sigma_px,on\n9,1,1,1,x\n").unwrap();
    assert!(told(&["cell.yaml", "--scans", "empty"]).contains("a.stripes.csv:2: row 9 is none of the 1"));
    lab.edit("scene.yaml", "sphere", "cone");
    assert!(told(&["cell.yaml", "--scans", "empty"]).contains("scene.yaml"));
    lab.edit("cell.yaml", "rig: rig.yaml, ", "");
    assert!(told(&["cell.yaml", "--scans", "empty"]).contains("no device is a light-stripe with a `rig:`"));
}
