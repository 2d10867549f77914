//! The sensor as its host sees it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::fs;
use std::path::Path;

use plumb_light_stripe::LightStripe;
use plumb_light_stripe::frame::write_pgm;
use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{
    FrameHeader, JointState, JointVector, PluginError, Reading, Sensor, StripeFault, StripeHeader,
    StripePoint, Value,
};
use serde_json::json;

const SIZE: usize = 64;

fn sensor(config: &Value) -> (RecordingHost, LightStripe) {
    let recording = RecordingHost::new();
    let sensor = LightStripe::create(config, recording.host()).unwrap();
    (recording, sensor)
}

fn stripe_at(column: usize) -> Vec<u8> {
    let lit = |at: usize| if (at % SIZE).abs_diff(column) <= 1 { 200 } else { 5 };
    (0..SIZE * SIZE).map(lit).collect()
}

fn frame(time_ns: u64, width: usize, pixels: &[u8]) -> Vec<u8> {
    let header = FrameHeader {
        time_ns,
        width: width as u32,
        height: (pixels.len() / width) as u32,
        ..Default::default()
    };
    let mut message = vec![0; header.message_bytes()];
    header.write(&mut message).unwrap().copy_from_slice(pixels);
    message
}

fn state(time_ns: u64, joint: f64, moving: bool) -> JointState {
    JointState::new(time_ns, JointVector::from_slice(&[joint]).unwrap(), moving)
}

fn emitted(recording: &RecordingHost) -> Vec<(StripeHeader, Vec<StripePoint>)> {
    recording.emitted_bytes("points").iter().map(|message| StripeHeader::read(message).unwrap()).collect()
}

fn value(reading: &Reading, name: &str) -> f64 {
    reading.quantities.iter().find(|quantity| quantity.name == name).unwrap().value
}

const RIG: &str = "\
rig: test
camera: {width_px: 64, height_px: 64, fx_px: 150, fy_px: 150, cx_px: 31.5, cy_px: 31.5}
hand_eye: {xyz_mm: [0, 0, 60], rpy_deg: [0, 0, 0]}
stripe_plane: {normal: [0.8, 0, 0.6], d_mm: -216, convention: n.x + d = 0}
self_test: {pixel: [31.5, 31.5], point_mm: [0, 0, 360]}
";

#[test]
fn a_picture_becomes_points_with_the_pose_at_its_exposure() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rig.yaml"), RIG).unwrap();
    let (recording, mut sensor) =
        sensor(&json!({"rig": "rig.yaml", "cell_directory": folder.path(), "threshold": {"fixed": 60}}));
    recording.feed("pose", &state(100, 0.0, true));
    recording.feed_bytes("frames", &frame(150, SIZE, &stripe_at(40)));
    assert_eq!(sensor.read(150).unwrap(), None, "where the arm was is not yet reported");
    recording.feed("pose", &state(200, 1.0, true));
    let reading = sensor.read(150).unwrap().unwrap();
    assert_eq!((reading.time_ns, value(&reading, "rows"), value(&reading, "u")), (150, 64.0, 40.0));
    let (header, points) = emitted(&recording).remove(0);
    assert_eq!(header.joints.as_slice(), [0.5]);
    let (ray_x, ray_y) = ((40.0 - 31.5) / 150.0, (10.0 - 31.5) / 150.0);
    let depth = (216.0 - 0.6 * 60.0) / (0.8 * ray_x + 0.6);
    let expected = [ray_x * depth, ray_y * depth, 60.0 + depth];
    for (found, expected) in points[10].flange_mm.iter().zip(expected) {
        assert!((f64::from(*found) - expected).abs() < 1e-3, "{found} {expected}");
    }
}

#[test]
fn an_exposure_delay_takes_the_pose_of_a_later_moment() {
    let (recording, mut sensor) = sensor(&json!({"exposure_delay_ms": 20e-6}));
    recording.feed("pose", &state(100, 0.0, true));
    recording.feed("pose", &state(200, 1.0, true));
    recording.feed_bytes("frames", &frame(150, SIZE, &stripe_at(40)));
    sensor.read(150).unwrap().unwrap();
    assert_eq!(emitted(&recording)[0].0.joints.as_slice(), [0.7]);
}

#[test]
fn a_picture_without_a_stripe_gives_a_fault_and_no_points() {
    let (recording, mut sensor) = sensor(&json!({"threshold": {"fixed": 60}}));
    recording.feed_bytes("frames", &frame(10, SIZE, &[5; SIZE * SIZE]));
    recording.feed_bytes("frames", &frame(20, SIZE, &[250; SIZE * SIZE]));
    let reading = sensor.read(20).unwrap().unwrap();
    assert_eq!(value(&reading, "fault"), f64::from(StripeFault::Bright.code()));
    let found = emitted(&recording);
    assert_eq!(found.iter().map(|(header, _)| header.fault).collect::<Vec<_>>(), [1, 2]);
    assert!(found.iter().all(|(_, points)| points.is_empty()));
}

#[test]
fn pictures_late_out_of_order_or_of_another_size_are_errors() {
    let (recording, mut sensor) = sensor(&json!({}));
    recording.feed("pose", &state(100, 0.0, false));
    recording.feed_bytes("frames", &frame(50, SIZE, &stripe_at(40)));
    let late = sensor.read(0).unwrap_err();
    assert!(late.text().contains("where the robot was at its exposure is no longer known"), "{late}");
    assert!(late.text().contains("dated 0.000 s before the first pose"), "{late}");
    recording.feed_bytes("frames", &frame(300_000_100, SIZE, &stripe_at(40)));
    recording.feed_bytes("frames", &frame(200_000_100, SIZE, &stripe_at(40)));
    let order = sensor.read(0).unwrap_err();
    assert!(
        matches!(&order, PluginError::InputLost(text) if text.starts_with("a picture came out of order, 100.0 ms")),
        "{order}"
    );
    recording.feed_bytes("frames", &frame(400_000_000, 32, &[5; 32 * 32]));
    let size = sensor.read(0).unwrap_err();
    assert_eq!(size.text(), "a picture of 32 x 32 pixels came; those before it had 64 x 64");
    recording.feed_bytes("frames", &frame(500_000_000, SIZE, &stripe_at(41)));
    assert_eq!(value(&sensor.read(500_000_000).unwrap().unwrap(), "u"), 41.0, "it goes on");
}

#[test]
fn a_spot_is_found_by_its_middle() {
    let (recording, mut sensor) = sensor(&json!({"find": "dark_spot", "threshold": {"fixed": 100}}));
    let dark = |at: usize| {
        let (x, y) = ((at % SIZE) as f64 - 20.25, (at / SIZE) as f64 - 33.5);
        (180.0 - 160.0 * (6.5 - x.hypot(y)).clamp(0.0, 1.0)) as u8
    };
    let pixels: Vec<u8> = (0..SIZE * SIZE).map(dark).collect();
    recording.feed_bytes("frames", &frame(10, SIZE, &pixels));
    let reading = sensor.read(10).unwrap().unwrap();
    assert!(
        (value(&reading, "spot_u") - 20.25).abs() < 0.1 && (value(&reading, "spot_v") - 33.5).abs() < 0.1
    );
    sensor.configure(&json!({"find": "bright_spot"})).unwrap();
    recording.feed_bytes("frames", &frame(20, SIZE, &[0; SIZE * SIZE]));
    let none = sensor.read(20).unwrap_err();
    assert!(none.text().starts_with("nothing as large as a spot"), "{none}");
}

fn folder(files: &[(&str, Vec<u8>)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn from(folder: &Path) -> (RecordingHost, LightStripe) {
    sensor(&json!({"frames": {"folder": folder, "raw_width_px": 64}}))
}

fn png(pixels: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIZE as u32, SIZE as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(pixels).unwrap();
    bytes
}

#[test]
fn pictures_from_files_are_taken_in_the_order_of_their_names() {
    let folder = folder(&[
        ("b.png", png(&stripe_at(30))),
        ("a.pgm", write_pgm(SIZE, SIZE, &stripe_at(20))),
        ("c.raw", stripe_at(40)),
        ("notes.txt", b"no picture".to_vec()),
    ]);
    let (_recording, mut sensor) = from(folder.path());
    let columns: Vec<f64> = (0..3).map(|_| value(&sensor.read(0).unwrap().unwrap(), "u")).collect();
    assert_eq!(columns, [20.0, 30.0, 40.0]);
    let end = sensor.read(0).unwrap_err();
    assert!(end.text().ends_with("all its 3 pictures have been taken"), "{end}");
}

#[test]
fn bad_picture_files_are_named_with_what_is_wrong() {
    let cut = |bytes: Vec<u8>| bytes[..bytes.len() - 10].to_vec();
    let cases = [
        (
            "a.pgm",
            cut(write_pgm(SIZE, SIZE, &stripe_at(20))),
            "a.pgm: it is cut short: 4086 of 4096 pixels are there",
        ),
        ("a.png", cut(png(&stripe_at(20))[..60].to_vec()), "a.png: "),
        ("a.raw", cut(stripe_at(20)), "a.raw: its 4086 bytes are no whole rows of 64"),
        ("a.pgm", b"JFIF".to_vec(), "a.pgm: it does not begin with P5 or P2"),
    ];
    for (name, bytes, expected) in cases {
        let folder = folder(&[(name, bytes)]);
        let error = from(folder.path()).1.read(0).unwrap_err();
        assert!(error.text().contains(expected), "{error}");
    }
    let empty = folder(&[]);
    let error =
        LightStripe::create(&json!({"frames": {"folder": empty.path()}}), RecordingHost::new().host());
    assert!(error.unwrap_err().text().contains("holds no pictures"));
}

#[test]
fn a_rig_that_cannot_measure_is_refused_before_the_first_picture() {
    let folder = folder(&[("rig.yaml", RIG.replace("d_mm: -216", "d_mm: -36").into_bytes())]);
    let refused =
        LightStripe::create(&json!({"rig": folder.path().join("rig.yaml")}), RecordingHost::new().host());
    let refused = refused.unwrap_err();
    assert!(refused.text().contains("the lens lies 0.0000 mm from the sheet of light"), "{refused}");
}

/// A camera and a robot that date by different clocks: their difference is reported, and no picture gets a pose.
#[test]
fn clocks_that_differ_are_reported_with_their_difference() {
    let (recording, mut sensor) = sensor(&json!({}));
    recording.feed("pose", &state(90_000_000_000_000, 0.0, false));
    recording.feed_bytes("frames", &frame(1_000_000_000, SIZE, &stripe_at(40)));
    let error = sensor.read(0).unwrap_err();
    assert!(
        error.text().starts_with("the clock of input `frames` is 89999.0 s behind the clock of input `pose`"),
        "{error}"
    );
    assert!(emitted(&recording).is_empty());
}

/// A controller that reports where the arm is only when it is at rest: in between nobody knows, and no pose is made up.
#[test]
fn a_picture_taken_while_the_robot_reported_nothing_has_no_pose() {
    let (recording, mut sensor) = sensor(&json!({}));
    recording.feed("pose", &state(100, 0.0, false));
    recording.feed("pose", &state(900, 1.0, false));
    recording.feed_bytes("frames", &frame(500, SIZE, &stripe_at(40)));
    recording.feed_bytes("frames", &frame(900, SIZE, &stripe_at(40)));
    sensor.read(900).unwrap().unwrap();
    let poses: Vec<usize> = emitted(&recording).iter().map(|(header, _)| header.joints.len()).collect();
    assert_eq!(poses, [0, 1]);
}
