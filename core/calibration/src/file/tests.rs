//! Model files: what is written is read back, and what cannot be is refused with its place and what would be right.

mod refusals;

use nalgebra::Vector3;

use super::model_text;
use crate::arm_model::{Frame, MeasuredFrom, Model, SurfaceShape};
use crate::template::{Template, robots};

/// A model with every section that a file may have.
const WHOLE: &str = "
arm: whole
convention: proximal
joints:
  - {name: turn, a_mm: 10, alpha_deg: -90, d_mm: 20, theta_deg: 5, limits_deg: [-170, 160], sign: -1, gear_ratio: 80}
  - {name: slide, slides: true, alpha_deg: 90, limits_mm: [0, 400], screw_pitch_mm: 5}
  - {name: wrist, a_mm: 30, limits_deg: [-90, 90], less: turn}
links: [{after: slide, mass_kg: 2.5, centre_mm: [1, -2, 3]}]
base: {xyz_mm: [100, -50, 7], rpy_deg: [10, -20, 30], free: true}
targets:
  p1: {xyz_mm: [1, 2, 3], free: true}
  p2: {xyz_mm: [-4, 5, 6], free: false}
free: [joint_zero(*), \"joint_harmonic(turn, 2)\"]
define:
  - name: bump
    where: wrist
    adds: {joint: wrist, deg: \"a*sin(3*q1)\"}
    parameters: {a: {unit: deg, range: [-1, 1]}}
    sentence: A bump.
effects:
  - {effect: joint_backlash, where: slide, values: {play_mm: 0.25}}
  - {effect: warm_up, where: turn, of: zero, searched: 900, values: {amount_deg: 0.125}}
  - {effect: bump, where: wrist, values: {a: 0.5}}
fitted:
  - {effect: joint_zero, where: turn, values: {zero_deg: -1.5}}
surfaces:
  table: {plane: {normal: [0, 0, 2], offset_mm: 4}, free: true}
  edge: {line: {point_mm: [140, 0, 0], direction: [0, 1, 0], light: right}, free: false}
  ball: {sphere: {centre_mm: [1, 2, 3], radius_mm: 12}, free: false}
  nail: {point_mm: [7, 8, 9], free: true}
measured_from: instrument
gravity: [0, 0.6, -0.8]
working_volume: {x_mm: [100, 300], y_mm: [-50, 50], z_mm: [0, 90]}
sensor: {working_mm: 8, peak_mm: 5, spot_mm: 3, hysteresis_percent: 10, dark_percent: 7}
levels: {plate: {after: slide, rpy_deg: [1, 2, 3]}, foot: {after: base, rpy_deg: [0, 0, 0]}}
noise: {p1_mm: 0.05, height_mm: 0.1, tilt_deg: 0.02, distance_mm: 0.2, touch_mm: 0.3}
touch: {p: p2, distances: [{between: [s1, s2], mm: 120}]}
revision: {number: 3, of: whole.yaml, did: add joint_backlash(slide), data: table.csv, parent: 2, rms_mm: 0.5}
";

fn read(text: &str) -> Model {
    Model::parse("model.yaml", text).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_section_becomes_what_it_means_in_millimetres_and_radians() {
    let model = read(WHOLE);
    let [rotation, slide, wrist] = &model.chain.joints[..] else { panic!("three joints") };
    assert!((rotation.alpha + std::f64::consts::FRAC_PI_2).abs() < 1e-12 && rotation.sign == -1.0);
    assert_eq!((rotation.gear_ratio, wrist.less, slide.limits), (Some(80.0), Some(0), (0.0, 400.0)));
    assert!(model.slides(1) && !model.slides(2));
    assert_eq!((rotation.screw_pitch, slide.screw_pitch), (None, Some(5.0)));
    assert_eq!((model.masses[0].after, model.masses[0].mass), (1, 2.5));
    let (roll, pitch, yaw) = model.base.pose.rotation.euler_angles();
    let degrees = [roll, pitch, yaw].map(f64::to_degrees);
    assert!(degrees.iter().zip([10.0, -20.0, 30.0]).all(|(found, typed)| (found - typed).abs() < 1e-9));
    assert_eq!(model.targets[1].xyz, Vector3::new(-4.0, 5.0, 6.0));
    // Values are kept in inner units: a step of 0.125 deg in rad.
    let of = |name: &str| model.effects.iter().find(|added| added.id.name == name).unwrap();
    assert!((of("warm_up").values[0] - 0.125_f64.to_radians()).abs() < 1e-15);
    assert_eq!((of("warm_up").id.inner, of("joint_backlash").values[0]), (Some(900.0), 0.25));
    assert!((model.fitted[0].values[0] + 1.5_f64.to_radians()).abs() < 1e-15);
    assert!(
        matches!(&model.surfaces[0].shape, SurfaceShape::Plane { normal, .. } if (normal.norm() - 1.0).abs() < 1e-12)
    );
    assert_eq!(model.surfaces[1].light, Some(-1.0));
    assert_eq!(model.measured_from, MeasuredFrom::Instrument);
    let sensor = model.sensor.unwrap();
    assert_eq!((sensor.hysteresis, sensor.dark), (0.1, 0.07));
    assert_eq!((model.levels[0].frame, model.levels[1].frame), (Frame::After(1), Frame::Base));
    assert!((model.noise.tilt.unwrap() - 0.02_f64.to_radians()).abs() < 1e-15);
    assert_eq!(model.noise.positions, [("p1".to_owned(), 0.05)]);
    assert_eq!(model.touch.unwrap().distances[0].length, 120.0);
}

#[test]
fn what_is_written_is_read_back_the_same() {
    let first = read(WHOLE);
    let text = model_text(&first);
    let again = read(&text);
    assert_eq!(model_text(&again), text, "a second time nothing changes");
    let chain = |model: &Model| format!("{:?}", model.chain.joints);
    assert_eq!(chain(&again), chain(&first));
    let close = (again.base.pose.to_homogeneous() - first.base.pose.to_homogeneous()).norm();
    assert!(close < 1e-6, "{close}");
    assert_eq!(format!("{:?}", again.revision), format!("{:?}", first.revision));
    assert_eq!((again.free.clone(), again.sensor), (first.free.clone(), first.sensor));
    for (one, other) in
        again.effects.iter().chain(&again.fitted).zip(first.effects.iter().chain(&first.fitted))
    {
        assert_eq!(one.id, other.id);
        assert!((one.values[0] - other.values[0]).abs() < 1e-9, "{one:?} {other:?}");
    }
}

#[test]
fn the_models_that_are_shipped_are_read_and_written_back() {
    for robot in robots() {
        let model = read(&Template::of(robot).unwrap().model);
        let again = read(&model_text(&model));
        assert_eq!(again.chain.len(), model.chain.len(), "{robot}");
        let worst = again.chain.joints.iter().zip(&model.chain.joints).map(|(one, other)| {
            [one.a - other.a, one.d - other.d, one.alpha - other.alpha, one.theta - other.theta]
                .into_iter()
                .fold(0.0_f64, |worst, off| worst.max(off.abs()))
        });
        assert!(worst.fold(0.0, f64::max) < 1e-6, "{robot}");
    }
}

#[test]
fn names_that_yaml_would_take_for_something_else_are_quoted() {
    let text = WHOLE.replace("arm: whole", "arm: \"yes\"");
    assert!(model_text(&read(&text)).starts_with("arm: \"yes\"\n"));
    assert_eq!(read(&model_text(&read(&text))).arm, "yes");
}

#[test]
fn each_mistake_is_reported_with_its_line_and_what_would_be_right() {
    let cases = [
        (
            "limits_deg: [-90, 90], less",
            "limits_deg: [90, -90], less",
            "limits [90, -90] hold no pose",
            "the lower comes first",
        ),
        ("less: turn", "less: torn", "there is no joint `torn` before it", "did you mean `turn`?"),
        ("sign: -1", "sign: 2", "a sign is 1 or -1, not 2", ""),
        ("gear_ratio: 80", "gear_ratio: 0", "a gear ratio of 0 cannot be", ""),
        ("gear_ratio: 80", "screw_pitch_mm: 5", "`turn` turns", "screw_pitch_mm is of a joint that slides"),
        (
            "screw_pitch_mm: 5",
            "screw_pitch_mm: 0",
            "a pitch of 0 mm cannot be",
            "it is the travel for one turn of the screw, more than 0",
        ),
        ("screw_pitch_mm: 5", "screw_pitch_mm: -5", "a pitch of -5 mm cannot be", ""),
        (
            "slides: true, alpha_deg: 90, limits_mm: [0, 400], screw_pitch_mm: 5",
            "slides: true, limits_deg: [0, 4]",
            "a joint that slides has limits_mm",
            "",
        ),
        ("mass_kg: 2.5", "mass_kg: -1", "a mass of -1 kg cannot be", ""),
        (
            "after: slide, mass_kg",
            "after: side, mass_kg",
            "there is no joint `side`",
            "did you mean `slide`?",
        ),
        ("normal: [0, 0, 2]", "normal: [0, 0, 0]", "this vector has no direction", "write for example"),
        (
            "working_mm: 8, peak_mm: 5",
            "working_mm: 4, peak_mm: 5",
            "working_mm has to be greater than peak_mm",
            "",
        ),
        ("noise: {p1_mm: 0.05", "noise: {p1_mm: -1", "a noise of -1 cannot be", "leave it out"),
        ("noise: {p1_mm: 0.05", "noise: {p9_mm: 0.05", "no noise `p9_mm` is known", ""),
        ("z_mm: [0, 90]", "z_mm: [90, 0]", "each of x_mm, y_mm and z_mm needs", ""),
        ("touch: {p: p2", "touch: {p: p7", "there is no target `p7`", ""),
        ("play_mm: 0.25", "play_deg: 0.25", "has no value `play_deg`", "there is only `play_mm`"),
        (
            "joint_backlash, where: slide",
            "joint_blacklash, where: slide",
            "there is no effect `joint_blacklash`",
            "did you mean `joint_backlash`?",
        ),
        ("deg: \"a*sin(3*q1)\"", "mm: \"a*sin(3*q1)\"", "what is added here is in deg", "write for example"),
        ("range: [-1, 1]", "range: [1, -1]", "the range [1, -1] holds no value", "the lower comes first"),
        ("a: {unit: deg,", "a: {unit: dge,", "no unit `dge` is known", "did you mean `deg`?"),
        ("name: bump", "name: joint_zero", "there is an effect `joint_zero` already", "choose another name"),
        (
            "adds: {joint: wrist, deg",
            "adds: {joint: wrist, length: wrist, deg",
            "acts on one of joint, length",
            "",
        ),
    ];
    for (from, to, message, help) in cases {
        assert!(WHOLE.contains(from), "{from}");
        let reported = Model::parse("model.yaml", &WHOLE.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(reported.contains(message) && reported.contains(help), "{to}: {reported}");
        let line = WHOLE.lines().position(|line| line.contains(from)).unwrap() + 1;
        assert!(reported.contains(&format!("model.yaml:{line}:")), "{to} is in line {line}: {reported}");
    }
}

#[test]
fn all_mistakes_of_a_file_are_reported_at_once() {
    let text = WHOLE
        .replace("sign: -1", "sign: 2")
        .replace("mass_kg: 2.5", "mass_kg: -1")
        .replace("p1_mm: 0.05", "p1_mm: -1");
    let reported = Model::parse("model.yaml", &text).unwrap_err().to_string();
    assert_eq!(reported.matches("model.yaml:").count(), 3, "{reported}");
}

#[test]
fn distances_that_cannot_all_be_true_are_refused() {
    let message_for = |distances: &str| {
        let text = WHOLE.replace("[{between: [s1, s2], mm: 120}]", distances);
        Model::parse("model.yaml", &text).err().map(|error| error.to_string()).unwrap_or_default()
    };
    assert_eq!(
        message_for("[{between: [a, b], mm: 3}, {between: [b, c], mm: 4}, {between: [a, c], mm: 7}]"),
        ""
    );
    let far = message_for("[{between: [a, b], mm: 3}, {between: [b, c], mm: 4}, {between: [a, c], mm: 7.1}]");
    assert!(far.contains("at most 7 mm apart"), "{far}");
    assert!(message_for("[{between: [a, a], mm: 3}]").contains("itself"));
    assert!(message_for("[{between: [a, b], mm: 3}, {between: [b, a], mm: 4}]").contains("keep one"));
}

#[test]
fn an_empty_file_and_a_table_are_distinguished_from_a_model() {
    let reported = |text: &str| Model::parse("model.yaml", text).unwrap_err().to_string();
    assert!(reported(" \n").contains("the file is empty") && reported("").contains("plumb model template"));
    assert!(reported("q1_deg,p1_x_mm\n1,2\n").contains("this is a table of measurements, no model"));
}

#[test]
fn a_definition_is_written_at_the_place_it_acts_on() {
    for (on, unit) in
        [("length: wrist", "mm"), ("offset: wrist", "mm"), ("twist: wrist", "deg"), ("skew: wrist", "deg")]
    {
        let adds = format!("adds: {{{on}, {unit}: \"a*sin(3*q1)\"}}");
        let whole = WHOLE
            .replace("adds: {joint: wrist, deg: \"a*sin(3*q1)\"}", &adds)
            .replace("{unit: deg, range: [-1, 1]}", &format!("{{unit: {unit}, range: [-1, 1]}}"));
        let text = model_text(&read(&whole));
        assert!(text.contains(&adds), "{on}: {text}");
        assert_eq!(model_text(&read(&text)), text);
    }
}
