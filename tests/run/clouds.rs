//! The cup and the spoon of Agin's figure 4-1: scanned, stored, shown, and written for other programs.

use std::fs;

use serde_json::Value;

use crate::lab::Lab;

/// The points of a PLY file as this program writes it: x, y, z, mm.
fn points(lab: &Lab, name: &str) -> Vec<[f32; 3]> {
    let bytes = fs::read(lab.path(name)).unwrap();
    let mark = b"end_header\n";
    let begin = bytes.windows(mark.len()).position(|window| window == mark).unwrap() + mark.len();
    let axis =
        |point: &[u8], index: usize| f32::from_le_bytes(point[4 * index..4 * index + 4].try_into().unwrap());
    bytes[begin..].chunks_exact(35).map(|point| [axis(point, 0), axis(point, 1), axis(point, 2)]).collect()
}

#[test]
fn cup_and_spoon_are_scanned_shown_and_written_for_other_programs() {
    let lab = Lab::of("light-stripe");
    let output = lab.plumb(&[
        "run",
        "cup.yaml",
        "scan-cup",
        "--set",
        "step_mm=10",
        "--headless",
        "--json",
        "--record",
        "record",
    ]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let events: Vec<Value> = output.out().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let taken: Vec<&Value> = events.iter().filter(|event| event["event"] == "stripe_taken").collect();
    assert_eq!(taken.len(), 18, "each stripe is reported as it is taken");
    let reported: usize = taken.iter().map(|event| event["points"].as_array().unwrap().len()).sum();

    let cloud = points(&lab, "record/run-1/cup.ply");
    assert_eq!(cloud.len(), reported);
    let near = |point: &&[f32; 3], z: f32, within: f32| (point[2] - z).abs() < within;
    let of_table = cloud.iter().filter(|point| near(point, -300.0, 0.5)).count();
    let of_spoon = cloud.iter().filter(|point| point[2] > -236.5).count();
    let on_wall = |point: &&[f32; 3]| ((point[0].hypot(point[1] - 530.0)) - 34.0).abs() < 0.6;
    let of_wall = cloud.iter().filter(|point| point[2] > -295.0 && point[2] < -237.0).filter(on_wall).count();
    assert!(of_table > 1000 && of_spoon > 80 && of_wall > 80, "{of_table} {of_spoon} {of_wall}");
    assert!(cloud.iter().all(|point| (-301.5..-229.0).contains(&point[2])), "no point where nothing is");

    let show = |arguments: &[&str]| lab.plumb(&[&["stripe", "show"], arguments].concat());
    let output = show(&["record/run-1/cup.ply", "--picture", "cup.png", "--turn", "-20", "--stereo"]);
    assert_eq!(output.code(), 0, "{}", output.all());
    assert!(output.out().contains(&format!("{reported} points of 18 stripes")), "{}", output.out());
    assert!(fs::read(lab.path("cup.png")).unwrap().starts_with(b"\x89PNG"));
    for name in ["cup.e57", "cup.pcd"] {
        assert_eq!(lab.plumb(&["stripe", "export", "record/run-1/cup.ply", name]).code(), 0, "{name}");
        let output = show(&[name, "--picture", &format!("{name}.png"), "--edge-on"]);
        assert!(
            output.out().contains(&format!("{reported} points")) && output.out().contains("band 0."),
            "{}",
            output.all()
        );
    }
    let mcap = ["stripe", "export", "record/run-1/cup.ply", "cup.mcap", "--rig", "rig.yaml"];
    assert_eq!(lab.plumb(&mcap).code(), 0);
    let bytes = fs::read(lab.path("cup.mcap")).unwrap();
    let holds = |text: &str| bytes.windows(text.len()).any(|window| window == text.as_bytes());
    assert!(holds("foxglove.PointCloud") && holds("foxglove.CameraCalibration") && holds("694.4"));
    let again = lab.plumb(&mcap);
    assert!(again.code() == 2 && again.err().contains("cup.mcap is there already"), "{}", again.all());

    // What is no cloud is said.
    lab.write("half.ply", "ply\nformat ascii 1.0\nelement vertex 2\n");
    let output = show(&["half.ply", "--picture", "half.png"]);
    assert!(
        output.code() == 2 && output.err().contains("half.ply: its head has no line `end_header`"),
        "{}",
        output.all()
    );
}

#[test]
fn a_stripe_is_taken_here_from_there() {
    let lab = Lab::of("light-stripe");
    let output = lab.plumb(&[
        "run",
        "cup.yaml",
        "one-stripe",
        "--set",
        "tilt_deg=20",
        "--set",
        "azimuth_deg=90",
        "--set",
        "turn_deg=30",
        "--headless",
        "--record",
        "record",
    ]);
    assert_eq!(output.code(), 0, "{}", output.all());
    let stripe = points(&lab, "record/run-1/stripe.ply");
    assert!(stripe.len() > 50 && stripe.iter().any(|point| point[2] > -237.0), "{}", stripe.len());
}
