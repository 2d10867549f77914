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
fn a_shoulder_that_gives_way_is_named_and_the_error_measured_afresh_falls_below_a_millimetre() {
    let lab = Lab::of("light-stripe");
    let study =
        ["stripe", "study", "cell.yaml", "--hidden", "shoulder", "-n", "1", "--seed", "5", "-o", "study"];
    let said = lab.plumb(&study);
    assert_eq!(said.code(), 0, "{}", said.all());
    let table = fs::read_to_string(lab.path("study/direction-error.csv")).unwrap();
    let row = table.lines().nth(1).unwrap().to_owned();
    assert!(row.ends_with("named,\"joint_compliance(shoulder)\""), "{row}");
    let numbers: Vec<f64> = row.split(',').filter_map(|cell| cell.parse().ok()).collect();
    let [_, on_paper, zeros_and_rig, with_it] = numbers.as_slice() else { panic!("{row}") };
    assert!(*on_paper > 2.0 && *zeros_and_rig > 1.0 && *with_it < 0.5, "{row}");
    assert!(fs::read_to_string(lab.path("study/direction-error.svg")).unwrap().starts_with("<svg"));
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
