//! Rig files and pictures that no point may come from.

use std::fs;

use crate::lab::Lab;

/// What a scan says of a rig file with these changes; it must end in an error and leave no cloud.
fn told_of(changes: &[(&str, &str)]) -> String {
    let lab = Lab::of("light-stripe");
    for (from, to) in changes {
        lab.edit("rig.yaml", from, to);
    }
    let said = lab.plumb(&["run", "cell.yaml", "scan-pyramid", "--headless", "--record", "record"]);
    assert_eq!(said.code(), 2, "{}", said.all());
    assert!(!lab.path("record/run-1/pyramid.ply").exists(), "a false cloud");
    // The lab reads the same file, and refuses it in the same words.
    fs::create_dir(lab.path("scans")).unwrap();
    let lab_said = lab.plumb(&["stripe", "diagnose", "cell.yaml", "--scans", "scans"]);
    assert!(lab_said.code() == 2 && lab_said.err().contains("rig.yaml"), "{}", lab_said.all());
    said.all()
}

const D: &str = "d_mm: -85.381496824546";

#[test]
fn a_lens_in_the_sheet_is_no_calibration() {
    let told = told_of(&[(D, "d_mm: 9.486833")]);
    assert!(told.contains("rig.yaml") && told.contains("mm from the sheet of light"), "{told}");
    assert!(told.contains("camera and projector stand side by side"), "{told}");
}

#[test]
fn a_plane_of_the_other_convention_is_recognised_and_the_cure_is_told() {
    let told = told_of(&[(D, "d_mm: 85.381496824546")]);
    assert!(told.contains("the plane is of the convention n.x = d"), "{told}");
    let told = told_of(&[("convention: n.x + d = 0", "convention: n.x = d")]);
    assert!(told.contains("for `n.x = d` change the sign of d_mm"), "{told}");
}

#[test]
fn a_rig_in_metres_or_a_focal_length_in_millimetres_is_told_as_such() {
    let told = told_of(&[
        ("[-30, 0, 60]", "[-0.03, 0, 0.06]"),
        (D, "d_mm: -0.085381496824546"),
        ("[-30, 0, 360]", "[-0.03, 0, 0.36]"),
    ]);
    assert!(told.contains("a file in metres is to be multiplied by 1000"), "{told}");
    let told = told_of(&[("fx_px: 694.4", "fx_px: 25")]);
    assert!(
        told.contains("fx_px and fy_px count in pixels; 25 mm behind pixels of 0.036 mm are 694 px"),
        "{told}"
    );
}

#[test]
fn a_calibration_that_contradicts_its_own_test_point_is_refused() {
    let told = told_of(&[("rpy_deg: [0, 0, 0]", "rpy_deg: [0, 1, 0]")]);
    assert!(told.contains("do not belong together"), "{told}");
}

#[test]
fn a_picture_that_comes_too_late_to_know_where_the_arm_was_gives_no_point() {
    let lab = Lab::of("light-stripe");
    // The camera's clock is a second behind: of its first picture nobody knows where the arm stood then.
    lab.edit("world.yaml", "light:\n", "light:\n  exposure_delay_ms: 1000\n");
    lab.write(
        "procedures/extra.yaml",
        "procedure: extra\nsteps:\n  - {id: look, do: {measure: {sensor: stripe, trigger: camera}}, on_error: abort}\n",
    );
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/extra.yaml, ");
    let said = lab.plumb(&["run", "cell.yaml", "extra", "--headless"]);
    assert_eq!(said.code(), 2, "{}", said.all());
    assert!(
        said.all()
            .contains("so late that where the robot was at its exposure is no longer known; it is left out"),
        "{}",
        said.all()
    );
}
