//! Agin's stages of calibrating camera and projector, run one after the other by their answers, and held against the world's truth.

use serde_json::Value;

use crate::lab::Lab;

/// Camera and projector beside their drawing, by so many degrees about the hand's x, y, z, and another lens.
pub(crate) fn out_of_true() -> Lab {
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

/// Runs a procedure in a cell, with the record `record`: the values of the step whose path ends so.
pub(crate) fn values_of(lab: &Lab, cell: &str, procedure: &str, step: &str) -> Value {
    let output = lab.plumb(&["run", cell, procedure, "--headless", "--json", "--record", "record"]);
    let out = output.out();
    assert_eq!(output.code(), 0, "{}{}", out.lines().last().unwrap_or_default(), output.err());
    let events = out.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut found = events.filter(|event| {
        event["event"] == "step_finished" && event["step"].as_str().is_some_and(|path| path.ends_with(step))
    });
    found.next().unwrap()["values"].clone()
}

pub(crate) fn value(values: &Value, name: &str) -> f64 {
    let found = values.as_array().unwrap().iter().find(|value| value["name"] == name);
    found.unwrap_or_else(|| panic!("{name} in {values}"))["value"].as_f64().unwrap()
}

/// How far from where it is the pyramid's apex comes out, mm.
pub(crate) fn apex_error(lab: &Lab, cell: &str, apex_mm: [f64; 3]) -> f64 {
    let values = values_of(lab, cell, "scan-pyramid", "scan");
    let found = ["apex_x", "apex_y", "apex_z"].map(|axis| value(&values, axis));
    found.iter().zip(apex_mm).map(|(found, truth)| (found - truth).powi(2)).sum::<f64>().sqrt()
}

/// Where the apex is on the platform.
pub(crate) const APEX_MM: [f64; 3] = [60.0, 530.0, -260.0];

#[test]
fn aim_scale_roll_and_sheet_are_found_one_after_the_other_from_a_rig_file_that_is_about_right() {
    let lab = out_of_true();
    assert!(apex_error(&lab, "cell.yaml", APEX_MM) > 2.0);
    // A value lies within two of its own standard uncertainties, and these promise what the paper's procedure can do.
    let found = |values: &Value, name: &str, truth: f64, most: f64| {
        let one = values.as_array().unwrap().iter().find(|value| value["name"] == name).unwrap();
        let (value, standard) = (one["value"].as_f64().unwrap(), one["uncertainty"].as_f64().unwrap());
        assert!((value - truth).abs() < 2.0 * standard, "{name} {value} +- {standard}, truly {truth}");
        assert!(standard < most, "{name} +- {standard}");
    };
    let aim = values_of(&lab, "cell.yaml", "camera-aim", "correction");
    found(&aim, "aim_x", 0.4, 0.06);
    found(&aim, "aim_y", -0.3, 0.06);

    let scale = values_of(&lab, "cell.yaml", "camera-scale", "correction");
    found(&scale, "scale_u", 708.3 / 694.4, 0.003);
    found(&scale, "scale_v", 684.0 / 694.4, 0.003);
    found(&scale, "roll", 0.5, 0.07);

    let sheet = values_of(&lab, "cell.yaml", "projector", "correction");
    // Of a projector turned by Rz(0.4) Ry(-18.1) Rx(0.3) the sheet's normal is the turned x.
    let (yaw, pitch) = (0.4_f64.to_radians(), (-18.1_f64).to_radians());
    let normal = [yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), -pitch.sin()];
    for (name, truth) in ["normal_x", "normal_y", "normal_z"].into_iter().zip(normal) {
        found(&sheet, name, truth, 0.002);
    }
    // The drawn sheet is turned by what lies between both normals.
    let drawn = -18.434948822922_f64.to_radians();
    let tilt = normal[0].atan2(normal[2]) - drawn.cos().atan2(-drawn.sin());
    found(&sheet, "tilt", tilt.to_degrees(), 0.08);

    let left = apex_error(&lab, "cell.yaml", APEX_MM);
    assert!(left < 0.5, "{left} mm");
}

#[test]
fn a_filter_forgotten_at_the_projector_and_one_left_on_at_the_camera_are_noticed() {
    let lab = Lab::of("light-stripe");
    let output = |procedure: &str| lab.plumb(&["run", "cell.yaml", procedure, "--headless"]);
    // The operator answers that all is done, and has done nothing.
    lab.edit("world.yaml", "light:\n", "light:\n  filter: out\n");
    lab.edit("procedures/projector.yaml", "        simulated: {shine: {laser: 'on', filter: in}}\n", "");
    let projector = output("projector");
    assert!(
        projector.code() == 1 && projector.all().contains("the infrared filter is not before the lens"),
        "{}",
        projector.all()
    );
    lab.edit("world.yaml", "  filter: out\n", "");
    lab.edit("procedures/camera-aim.yaml", "        simulated: {shine: {laser: 'off', filter: out}}\n", "");
    let aim = output("camera-aim");
    assert!(
        aim.code() == 2 && aim.all().contains("is the filter out, the threshold right?"),
        "{}",
        aim.all()
    );
}
