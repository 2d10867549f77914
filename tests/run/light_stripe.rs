//! The light stripe on the hand of a PUMA: scans, and what goes wrong with them.

use std::fs;

use serde_json::Value;

use crate::lab::{Lab, kill};

const CAMERA: &str = "camera: {plugin: simulated-camera}";

fn lab() -> Lab {
    Lab::of("light-stripe")
}

/// Runs a procedure to its end: the events and the exit code.
fn run(lab: &Lab, procedure: &str) -> (Vec<Value>, i32) {
    let output = lab.plumb(&["run", "cell.yaml", procedure, "--headless", "--json"]);
    let events = output.out().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    (events, output.code())
}

/// What the run said at its end.
fn end(events: &[Value]) -> String {
    events.last().map_or_else(String::new, |event| event["message"].as_str().unwrap_or_default().to_owned())
}

/// A value of each finished step of that name.
fn values(events: &[Value], step: &str, name: &str) -> Vec<f64> {
    let finished = events.iter().filter(|event| event["event"] == "step_finished");
    let of_step = finished.filter(|event| event["step"].as_str().is_some_and(|path| path.ends_with(step)));
    of_step
        .flat_map(|event| event["values"].as_array().cloned().unwrap_or_default())
        .filter(|value| value["name"] == name)
        .map(|value| value["value"].as_f64().unwrap())
        .collect()
}

/// The cell with one procedure more, of these steps.
fn with_steps(lab: &Lab, steps: &str) {
    lab.write("procedures/extra.yaml", &format!("procedure: extra\n{steps}"));
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/extra.yaml, ");
}

#[test]
fn an_arm_as_on_paper_sees_the_pyramid_where_it_is_from_every_side() {
    let lab = lab();
    assert_eq!(lab.plumb(&["check", "cell.yaml"]).code(), 0);
    let (events, code) = run(&lab, "direction-error");
    assert_eq!(code, 0, "{}", end(&events));
    let readings = lab.shown("1")["readings"].as_array().unwrap().len();
    assert!(readings > 12 * 5, "each scan's values are in the record: {readings}");
    let axes = ["apex_x", "apex_y", "apex_z"].map(|axis| values(&events, "scan", axis));
    for (found, truth) in axes.iter().zip([60.0, 530.0, -260.0]) {
        assert_eq!(found.len(), 12);
        assert!(found.iter().all(|found| (found - truth).abs() < 0.1), "{found:?}, truly {truth}");
    }
    let spread = values(&events, "spread", "error");
    assert!(spread.iter().all(|spread| (0.001..0.2).contains(spread)) && spread.len() == 1, "{spread:?}");
}

#[test]
fn a_scan_leaves_a_cloud_and_the_labs_tables() {
    let lab = lab();
    let output = lab.plumb(&["run", "cell.yaml", "scan-pyramid", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let cloud = fs::read(lab.path("record/run-1/pyramid.ply")).unwrap();
    assert!(cloud.starts_with(b"ply\nformat binary_little_endian 1.0\n"));
    assert!(
        fs::read(lab.path("record/run-1/pyramid.pcd")).unwrap().starts_with(b"# units mm\nVERSION 0.7\n")
    );
    let poses = fs::read_to_string(lab.path("record/run-1/pyramid.poses.csv")).unwrap();
    assert_eq!(poses.lines().count(), 1 + 21, "{poses}");
    let stripes = fs::read_to_string(lab.path("record/run-1/pyramid.stripes.csv")).unwrap();
    assert!(stripes.lines().count() > 4000);
    let (events, code) = run(&lab, "random-error");
    assert_eq!(code, 0, "{}", end(&events));
    let thickness = values(&events, "plane", "thickness");
    assert!(thickness.iter().all(|band| (0.05..0.4).contains(band)) && thickness.len() == 1, "{thickness:?}");
}

/// Along a column of pixels every row is rounded alike, which hides digitization: the stripe is laid askew, and Agin's whole pixels make a thicker band than
/// centroids.
#[test]
fn random_error_shows_digitization_because_the_stripe_runs_askew_over_the_pixels() {
    let lab = lab();
    let band = |set: &[&str]| {
        let arguments = [&["run", "cell.yaml", "random-error", "--headless", "--json"], set].concat();
        let output = lab.plumb(&arguments);
        let events: Vec<Value> =
            output.out().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let found = values(&events, "plane", "thickness");
        assert_eq!(found.len(), 1, "{}", end(&events));
        found[0]
    };
    let centroid = band(&[]);
    lab.edit("cell.yaml", "threshold: {fixed: 30}", "centre: binary, threshold: {fixed: 30}");
    let agins = band(&[]);
    let along_a_column = band(&["--set", "tilt_deg=0"]);
    assert!((0.1..0.35).contains(&centroid), "{centroid} mm");
    assert!((0.5..1.2).contains(&agins) && agins > 2.0 * centroid, "{agins} mm, centroid {centroid} mm");
    assert!(along_a_column < 0.1, "{along_a_column} mm");
}

/// The first day of a real rig, tried in the simulated world: it passes with the rig it has, and says what is wrong with another.
#[test]
fn the_first_day_passes_with_the_right_rig_file_and_says_what_is_wrong_with_another() {
    let lab = lab();
    assert_eq!(lab.plumb(&["check", "cell-hardware.yaml"]).code(), 0);
    let begins = lab.plumb(&["run", "cell-hardware.yaml"]);
    assert_eq!(begins.code(), 4, "{}", begins.all());
    lab.edit("cell.yaml", "procedures: [", "procedures: [procedures/first-day.yaml, ");
    lab.write(
        "answers.yaml",
        "by: test\nanswers: {safe: done, over: done, ruler: as_it_should, dark: done, light: done}\n",
    );
    let (events, code) = run(&lab, "first-day");
    assert_eq!(code, 0, "{}", end(&events));
    let (low, rise) = (values(&events, "seen", "low"), values(&events, "seen", "rise"));
    assert!((low[0] - 300.0).abs() < 2.0 && (rise[0] - 20.0).abs() < 0.5, "{low:?} {rise:?}");
    // A lens of half the focal length, and a light that shines where it should not.
    lab.edit("rig.yaml", "fx_px: 694.4, fy_px: 694.4", "fx_px: 347.2, fy_px: 347.2");
    let (events, code) = run(&lab, "first-day");
    assert!(
        code == 1 && end(&events).contains("the rig file is not of this rig"),
        "{code}: {}",
        end(&events)
    );
    lab.edit("procedures/first-day.yaml", "        simulated: {shine: {laser: 'off', filter: in}}\n", "");
    let (events, code) = run(&lab, "first-day");
    assert!(code == 1 && end(&events).contains("the picture is not dark"), "{code}: {}", end(&events));
}

/// Each stripe is kept with the side its joints had arrived from, although the arm has gone on when it is.
#[test]
fn every_scan_of_a_gathering_knows_from_which_sides_the_joints_came() {
    let lab = lab();
    let output = lab.plumb(&["run", "cell.yaml", "gather", "--headless", "--record", "record"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let tables = fs::read_dir(lab.path("record/run-1")).unwrap().map(|entry| entry.unwrap().path());
    let tables: Vec<_> = tables.filter(|path| path.to_string_lossy().ends_with(".poses.csv")).collect();
    assert_eq!(tables.len(), 44);
    let row = |line: &str| -> Vec<f64> { line.split(',').map(|cell| cell.parse().unwrap()).collect() };
    for table in tables {
        let rows: Vec<Vec<f64>> = fs::read_to_string(&table).unwrap().lines().skip(1).map(row).collect();
        for (before, here) in rows.iter().zip(rows.iter().skip(1)) {
            for joint in 0..6 {
                let (way, side) = (here[joint] - before[joint], here[joint + 6]);
                let as_expected = way.abs() < 0.01 || way.signum() == side;
                assert!(as_expected, "{}: joint {joint} went {way} deg: {side}", table.display());
            }
        }
    }
}

#[test]
fn a_forgotten_filter_is_noticed() {
    let lab = lab();
    lab.edit("cell.yaml", CAMERA, "camera: {plugin: simulated-camera, config: {filter: out}}");
    let (events, code) = run(&lab, "scan-pyramid");
    assert_eq!(code, 2);
    let message = end(&events);
    assert!(
        message.contains("none of the 21 pictures showed a stripe (21 too bright): is the filter"),
        "{message}"
    );
}

#[test]
fn a_laser_switched_off_by_a_step_leaves_the_picture_dark_until_it_is_switched_on() {
    let lab = lab();
    with_steps(
        &lab,
        "
steps:
  - {id: 'off', do: {configure: {sensor: camera, settings: {laser: 'off'}}}}
  - {id: dark, do: {measure: {sensor: stripe, trigger: camera}}}
  - {id: 'on', do: {configure: {sensor: camera, settings: {laser: 'on'}}}}
  - {id: lit, do: {measure: {sensor: stripe, trigger: camera}}}
  - {id: wrong, do: {configure: {sensor: camera, settings: {laser: dim}}}, on_error: abort}
",
    );
    let (events, code) = run(&lab, "extra");
    assert_eq!(code, 2, "{}", end(&events));
    assert_eq!((values(&events, "dark", "rows"), values(&events, "dark", "fault")), (vec![0.0], vec![1.0]));
    let rows = values(&events, "lit", "rows");
    assert!(rows.iter().all(|rows| *rows > 200.0) && rows.len() == 1, "{rows:?}");
    let message = end(&events);
    assert!(message.contains("`dim`") && message.contains("laser: on or off"), "{message}");
}

#[test]
fn a_position_out_of_reach_is_said_before_anything_moves_there() {
    let lab = lab();
    lab.edit("procedures/scan-pyramid.yaml", "[10, 530, table_mm + 20]", "[10, 1530, -280]");
    lab.edit("procedures/scan-pyramid.yaml", "[110, 530, table_mm + 20]", "[110, 1530, -280]");
    let (events, code) = run(&lab, "scan-pyramid");
    assert_eq!(code, 2);
    let message = end(&events);
    assert!(
        message.contains("no stripe at [10.0, 1530.0, -280.0] mm: the arm cannot bring its flange there"),
        "{message}"
    );
}

#[test]
fn pictures_of_another_camera_are_refused() {
    let lab = lab();
    lab.edit("world.yaml", "size_px: [256, 256]", "size_px: [320, 240]");
    let (events, code) = run(&lab, "scan-pyramid");
    assert_eq!(code, 2);
    let message = end(&events);
    assert!(
        message.contains("a picture of 320 x 240 pixels came; the rig's camera has 256 x 256"),
        "{message}"
    );
}

#[test]
fn a_camera_lost_in_mid_scan_ends_an_unattended_run() {
    let lab = lab();
    let mut running = lab.start(&["run", "cell.yaml", "scan-pyramid", "--headless", "--pace", "real"]);
    let camera = running.host_of("libplumb_simulated_camera");
    running.until_moving_in("scan");
    kill(camera);
    let (last, code) = running.end();
    assert_eq!(code, Some(2));
    let message = last["message"].as_str().unwrap();
    assert!(message.contains("camera is lost") && message.contains("SIGKILL"), "{message}");
}

#[test]
fn mistakes_in_a_scan_are_shown_before_anything_moves() {
    let lab = lab();
    with_steps(
        &lab,
        "
steps:
  - id: scan
    do: {scan: {robot: arm, sensor: strip, from_mm: [1, 2], to_mm: [480, 0, -280], step_mm: 5, aim_mm: [-30, 0, 360], fit: cone}}
",
    );
    let output = lab.plumb(&["check", "cell.yaml"]);
    assert_eq!(output.code(), 2);
    for part in ["`from_mm` has 2 numbers", "`cone`"] {
        assert!(output.all().contains(part), "{part}: {}", output.all());
    }
    lab.edit("procedures/extra.yaml", "[1, 2]", "[480, 0, -280]");
    lab.edit("procedures/extra.yaml", ", fit: cone", "");
    let output = lab.plumb(&["check", "cell.yaml"]);
    assert!(output.code() == 2 && output.all().contains("`strip`"), "{}", output.all());
    // Anything but on and off is refused as soon as the cell is read.
    lab.edit("procedures/extra.yaml", "sensor: strip,", "sensor: stripe,");
    lab.edit("cell.yaml", CAMERA, "camera: {plugin: simulated-camera, config: {laser: of}}");
    let output = lab.plumb(&["check", "cell.yaml"]);
    assert!(output.code() == 2 && output.all().contains("did you mean `off`?"), "{}", output.all());
}

#[test]
fn the_wrist_is_levelled_and_a_second_pass_finds_nothing() {
    let lab = lab();
    lab.edit(
        "world.yaml",
        "    resolution: encoder",
        "    resolution: encoder\n    zero_error: {flange_deg: 0.8}",
    );
    let (events, code) = run(&lab, "wrist");
    assert_eq!(code, 0, "{}", end(&events));
    let found = values(&events, "found", "correction");
    assert!(found.iter().all(|found| (found - 0.8).abs() < 0.02) && found.len() == 1, "{found:?}");
    let (events, code) = run(&lab, "wrist");
    assert_eq!(code, 0, "{}", end(&events));
    let again = values(&events, "found", "correction");
    assert!(again.iter().all(|again| again.abs() < 0.02) && again.len() == 1, "{again:?}");
}

#[test]
fn pictures_exposed_late_are_recognised_by_two_speeds_and_a_delay_that_is_known_is_made_good() {
    let lab = lab();
    lab.edit("world.yaml", "light:\n", "light:\n  exposure_delay_ms: 12\n");
    let (events, code) = run(&lab, "exposure-delay");
    let message = end(&events);
    assert!(code == 1 && message.contains("add that to `exposure_delay_ms`"), "{code}: {message}");
    let found = values(&events, "found", "delay_ms");
    assert!(found.iter().all(|found| (found - 12.0).abs() < 0.3) && found.len() == 1, "{found:?}");
    // There and back lie twice speed times delay apart.
    let apart = values(&events, "found", "there_and_back_fast");
    assert!(apart.iter().all(|apart| (apart + 2.0 * 160.0 * 0.012).abs() < 0.1), "{apart:?}");
    lab.edit("cell.yaml", "exposure_delay_ms: 0", &format!("exposure_delay_ms: {:.3}", found[0]));
    let (events, code) = run(&lab, "exposure-delay");
    assert_eq!(code, 0, "{}", end(&events));
    // At rest nothing of it shows: the pyramid is where it is.
    let (events, _) = run(&lab, "scan-pyramid");
    let apex = values(&events, "scan", "apex_x");
    assert!(apex.iter().all(|apex| (apex - 60.0).abs() < 0.1) && apex.len() == 1, "{apex:?}");
}

#[test]
fn a_scan_in_motion_faster_than_the_arm_or_without_a_camera_is_refused() {
    let lab = lab();
    let scan = |more: &str| {
        let scan = "robot: arm, sensor: stripe, from_mm: [10, 530, -280], to_mm: [110, 530, -280], step_mm: 5, aim_mm: [-30, 0, 360]";
        format!("steps:\n  - {{id: scan, do: {{scan: {{{scan}, {more}}}}}, on_error: abort}}\n")
    };
    with_steps(&lab, &scan("trigger: camera, fly_mm_s: 90000"));
    let (events, code) = run(&lab, "extra");
    let message = end(&events);
    assert!(code == 2 && message.contains("mm/s, not at 90000"), "{message}");
    lab.edit("procedures/extra.yaml", "trigger: camera, fly_mm_s: 90000", "fly_mm_s: 50");
    let (events, code) = run(&lab, "extra");
    let message = end(&events);
    assert!(code == 2 && message.contains("asks a camera for its pictures: give `trigger:`"), "{message}");
}

#[test]
fn the_modern_rig_sees_the_pyramid_as_well() {
    let lab = lab();
    let output = lab.plumb(&["run", "modern.yaml", "scan-pyramid", "--headless", "--json"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let events: Vec<Value> = output.out().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for (axis, truth) in [("apex_x", 60.0), ("apex_y", 530.0), ("apex_z", -260.0)] {
        let apex = values(&events, "scan", axis);
        assert!(apex.iter().all(|apex| (apex - truth).abs() < 0.05) && apex.len() == 1, "{axis}: {apex:?}");
    }
}

#[test]
fn a_scan_that_leads_into_a_kept_out_region_ends_before_it() {
    let lab = lab();
    // The line goes down: toward its end the flange would come below the plane.
    lab.edit("procedures/scan-pyramid.yaml", "to_mm: [110, 530, table_mm + 20]", "to_mm: [110, 530, -620]");
    let (events, code) = run(&lab, "scan-pyramid");
    let message = end(&events);
    assert!(code == 2 && message.contains("the platform under the rig"), "{code}: {message}");
    let lowest = values(&events, "scan", "points");
    assert!(lowest.is_empty(), "no cloud of half a scan");
}

#[test]
fn the_time_of_a_scan_is_known_about_right_before_it_begins_at_rest_and_in_motion() {
    let lab = lab();
    for (fly, expected_s) in [("", 5.0), ("        fly_mm_s: 20\n", 5.0)] {
        let step = "        step_mm: step_mm\n";
        lab.edit("procedures/scan-pyramid.yaml", step, &format!("{step}{fly}"));
        let (events, code) = run(&lab, "scan-pyramid");
        assert_eq!(code, 0, "{}", end(&events));
        let planned = events.iter().find(|event| event["event"] == "planned").unwrap();
        let steps = planned["steps"].as_array().unwrap();
        let scan = steps.iter().find(|step| step["step"] == "scan").unwrap();
        let estimate_s = scan["estimate_s"].as_f64().unwrap();
        assert!((0.5..2.0).contains(&(estimate_s / expected_s)), "{estimate_s} s of {expected_s} s");
    }
}
