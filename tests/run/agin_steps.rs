//! Agin's stages of calibrating camera and projector, run one after the other by their answers, and held against the world's truth.

use serde_json::Value;

use crate::lab::Lab;

/// Camera and projector beside their drawing, by so many degrees about the hand's x, y, z, and another lens.
fn out_of_true() -> Lab {
    let lab = Lab::of("light-stripe");
    lab.edit(
        "world.yaml",
        "    in_flange: {xyz_mm: [-30, 0, 60]}",
        "    in_flange: {xyz_mm: [-30, 0, 60], rpy_deg: [0.4, -0.3, 0.5]}",
    );
    lab.edit("world.yaml", "rpy_deg: [0, -18.434948822922, 0]", "rpy_deg: [0.3, -18.1, 0.4]");
    lab.edit("world.yaml", "focal_px: [694.4, 694.4]", "focal_px: [708.3, 684.0]");
    lab
}

/// Runs a procedure in a cell: the values of its step `correction`.
fn correction(lab: &Lab, cell: &str, procedure: &str) -> Value {
    let said = lab.plumb(&["run", cell, procedure, "--headless", "--json", "--record", "record"]);
    assert_eq!(said.code(), 0, "{}", said.all());
    let out = said.out();
    let events = out.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut found = events.filter(|event| event["event"] == "step_finished" && event["step"] == "correction");
    found.next().unwrap()["values"].clone()
}

fn value(values: &Value, name: &str) -> f64 {
    let found = values.as_array().unwrap().iter().find(|value| value["name"] == name);
    found.unwrap_or_else(|| panic!("{name} in {values}"))["value"].as_f64().unwrap()
}

/// Writes what the newest run found into a rig, and a cell that uses it.
fn correct(lab: &Lab, cell: &str, to: &str) -> String {
    let said = lab.plumb(&["stripe", "correct", cell, "--record", "record", "-o", to]);
    assert_eq!(said.code(), 0, "{}", said.all());
    said.out()
}

/// How far from where it stands the pyramid's apex comes out, mm.
fn apex_error(lab: &Lab, cell: &str) -> f64 {
    let said = lab.plumb(&["run", cell, "scan-pyramid", "--headless", "--json"]);
    let out = said.out();
    let events = out.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut scans = events.filter(|event| event["event"] == "step_finished" && event["step"] == "scan");
    let values = scans.next().unwrap()["values"].clone();
    let away = |name, truth: f64| (value(&values, name) - truth).powi(2);
    (away("apex_x", 60.0) + away("apex_y", 530.0) + away("apex_z", -260.0)).sqrt()
}

#[test]
fn aim_scale_roll_and_sheet_are_found_one_after_the_other_from_a_rig_file_that_is_about_right() {
    let lab = out_of_true();
    assert!(apex_error(&lab, "cell.yaml") > 2.0);
    let aim = correction(&lab, "cell.yaml", "camera-aim");
    let near = |found: f64, truth: f64, within: f64| {
        assert!((found - truth).abs() < within, "{found}, truly {truth}")
    };
    near(value(&aim, "aim_x"), 0.4, 0.03);
    near(value(&aim, "aim_y"), -0.3, 0.03);
    let told = correct(&lab, "cell.yaml", "aimed.yaml");
    assert!(
        told.contains("deg about the hand's x")
            && told.contains("written: ")
            && told.contains("aimed.rig.yaml"),
        "{told}"
    );

    let scale = correction(&lab, "aimed.yaml", "camera-scale");
    near(value(&scale, "scale_u"), 708.3 / 694.4, 0.002);
    near(value(&scale, "scale_v"), 684.0 / 694.4, 0.002);
    near(value(&scale, "roll"), 0.5, 0.05);
    correct(&lab, "aimed.yaml", "scaled.yaml");

    let sheet = correction(&lab, "scaled.yaml", "projector");
    // Of a projector turned by Rz(0.4) Ry(-18.1) Rx(0.3) the sheet's normal is the turned x.
    let (yaw, pitch) = (0.4_f64.to_radians(), (-18.1_f64).to_radians());
    let normal = [yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), -pitch.sin()];
    for (name, truth) in ["normal_x", "normal_y", "normal_z"].into_iter().zip(normal) {
        near(value(&sheet, name), truth, 0.002);
    }
    assert!(value(&sheet, "off") < 0.2, "{sheet}");
    correct(&lab, "scaled.yaml", "calibrated.yaml");
    assert_eq!(lab.plumb(&["check", "calibrated.yaml"]).code(), 0);
    let left = apex_error(&lab, "calibrated.yaml");
    assert!(left < 0.5, "{left} mm");

    // Nothing is written over, and a run that calibrates nothing corrects nothing.
    let again =
        lab.plumb(&["stripe", "correct", "scaled.yaml", "--record", "record", "-o", "calibrated.yaml"]);
    assert!(again.code() == 2 && again.err().contains("calibrated.rig.yaml"), "{}", again.all());
    let said = lab.plumb(&["run", "cell.yaml", "random-error", "--headless", "--record", "other"]);
    assert!(said.code() <= 1, "{}", said.all());
    let none = lab.plumb(&["stripe", "correct", "cell.yaml", "--record", "other", "-o", "none.yaml"]);
    assert!(none.code() == 2 && none.err().contains("no step `correction`"), "{}", none.all());
}

#[test]
fn a_filter_forgotten_at_the_projector_and_one_left_on_at_the_camera_are_noticed() {
    let lab = Lab::of("light-stripe");
    let said = |procedure: &str| lab.plumb(&["run", "cell.yaml", procedure, "--headless"]);
    // The operator answers that all is done, and has done nothing.
    lab.edit("world.yaml", "light:\n", "light:\n  filter: out\n");
    lab.edit("procedures/projector.yaml", "        simulated: {shine: {laser: 'on', filter: in}}\n", "");
    let projector = said("projector");
    assert!(
        projector.code() == 1 && projector.all().contains("the infrared filter is not before the lens"),
        "{}",
        projector.all()
    );
    lab.edit("world.yaml", "  filter: out\n", "");
    lab.edit("procedures/camera-aim.yaml", "        simulated: {shine: {laser: 'off', filter: out}}\n", "");
    let aim = said("camera-aim");
    assert!(
        aim.code() == 2 && aim.all().contains("is the filter out, the threshold right?"),
        "{}",
        aim.all()
    );
}
