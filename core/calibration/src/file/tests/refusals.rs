//! What a model file may not say, section by section, and what each section means.

use nalgebra::Vector3;

use crate::arm_model::{Frame, MeasuredFrom, Model, SurfaceShape, Touch, TouchDistance};
use crate::file::contradiction::contradiction;
use crate::file::model_text;
use crate::table::scalar::HEIGHT;

const ARM: &str = "arm: two
convention: distal
joints: [{name: turn, a_mm: 100}, {name: slide, slides: true}]
targets: {p1: {}, p2: {}}
";

fn parse(more: &str) -> Result<Model, String> {
    Model::parse("m.yaml", &format!("{ARM}{more}\n")).map_err(|error| error.to_string())
}

/// What is said of a file with these lines, or of the arm's own lines after a change.
fn reported(more: &str) -> String {
    parse(more).map_or_else(|error| error, |_| String::new())
}

fn changed(from: &str, to: &str) -> String {
    assert!(ARM.contains(from), "{from}");
    Model::parse("m.yaml", &ARM.replacen(from, to, 1))
        .map_or_else(|error| error.to_string(), |_| String::new())
}

/// Whether a message holds each part; what would be right is apart from what is wrong.
fn says(message: &str, parts: &str) -> bool {
    parts.split("; ").all(|part| message.contains(part))
}

#[test]
fn joints_are_held_to_what_a_joint_can_be() {
    for (from, to, part) in [
        ("name: turn", "name: \"turn(1)\"", "`turn(1)` cannot be a joint's name"),
        ("name: turn", "name: \"a,b\"", "`a,b` cannot be a joint's name"),
        ("name: turn", "name: \" \"", "cannot be a joint's name"),
        ("name: turn", "name: slide", "joint `slide` is named twice"),
        ("a_mm: 100", "a_mm: 100, limits_mm: [0, 5]", "a joint that turns has limits_deg"),
        ("slides: true", "slides: true, limits_deg: [0, 5]", "a joint that slides has limits_mm"),
        ("slides: true", "slides: true, limits_mm: [5, 5]", "limits [5, 5] hold no pose"),
        ("slides: true", "slides: true, sign: 0.5", "a sign is 1 or -1, not 0.5"),
        ("slides: true", "slides: true, less: slide", "there is no joint `slide` before it"),
        ("slides: true", "slides: true, less: later", "there is no joint `later` before it"),
        ("targets: {p1: {}", "targets: {q1: {}", "`q1` cannot be a target's name"),
        ("targets: {p1: {}", "targets: {p0: {}", "`p0` cannot be a target's name"),
        ("convention: distal", "convention: distel", "distel"),
        ("arm: two", "arn: two", "arn"),
    ] {
        let found = changed(from, to);
        assert!(says(&found, part), "{to}: {found:?}");
    }
    assert_eq!(changed("slides: true", "slides: true, sign: -1, limits_mm: [0, 5], gear_ratio: -36"), "");
}

#[test]
fn a_joint_without_limits_goes_all_around_or_a_kilometre() {
    let model = parse("").unwrap();
    let [turn, slide] = &model.chain.joints[..] else { panic!("two joints") };
    assert!(
        turn.limits.0 <= -std::f64::consts::PI && turn.limits.1 >= std::f64::consts::PI,
        "{:?}",
        turn.limits
    );
    assert_eq!(slide.limits, (-1e6, 1e6));
    assert_eq!((turn.sign, turn.gear_ratio, turn.less), (1.0, None, None));
}

#[test]
fn sections_are_held_to_what_they_name() {
    for (more, part) in [
        ("surfaces: {a: {}}", "a surface is one of `plane`, `line`, `sphere`, `point_mm`"),
        (
            "surfaces: {a: {point_mm: [0, 0, 0], sphere: {centre_mm: [0, 0, 0], radius_mm: 5}}}",
            "a surface is one of `plane`, `line`, `sphere`, `point_mm`",
        ),
        (
            "surfaces: {a: {line: {point_mm: [0, 0, 0], direction: [0, 0, 0]}}}",
            "this vector has no direction",
        ),
        ("gravity: [0, 0, 0]", "this vector has no direction; write for example [0, 0, 1]"),
        ("board: {seen_by: p3}", "there is no target `p3` that could be the camera"),
        ("level: {after: trun}", "there is no joint `trun`; did you mean `turn`?"),
        ("links: [{after: hand, mass_kg: 1}]", "there is no joint `hand`"),
        ("noise: {p1_mm: 0}", "a noise of 0 cannot be"),
        ("noise: {hight_mm: 1}", "no noise `hight_mm` is known; did you mean `height_mm`?"),
        ("noise: {p3_deg: 1}", "no noise `p3_deg` is known"),
        ("working_volume: {x_mm: [0, 0], y_mm: [0, 1], z_mm: [0, 1]}", "needs a least and a greater number"),
        ("touch: {distances: [{between: [a, b], mm: -1}]}", "a distance of -1 mm cannot be"),
        ("sensor: {working_mm: 8, peak_mm: 0}", "working_mm and peak_mm above zero"),
        ("sensor: {working_mm: 8, peak_mm: 8}", "working_mm has to be greater than peak_mm"),
        ("sensor: {working_mm: 8, peak_mm: 5, hysteresis_percent: 90}", "lie from 0 to 90"),
        ("sensor: {working_mm: 8, peak_mm: 5, dark_percent: -1}", "lie from 0 to 90"),
        ("sensor: {working_mm: 8, peak_mm: 5, spot_mm: -1}", "a spot_mm that is not negative"),
        ("free: [\"joint_zero(trun)\"]", "none called `trun`; did you mean `turn`?"),
        ("effects: [\"joint_zero(trun)\"]", "none called `trun`; did you mean `turn`?"),
        ("effects: [\"joint_step(turn)\"]", "needs the moment of the jump"),
        (
            "effects: [{effect: joint_zero, where: turn, values: {zero_dge: 1}}]",
            "`joint_zero` has no value `zero_dge`",
        ),
        (
            "fitted: [{effect: joint_zero, where: turn, claim: correction}]",
            "`claim` belongs to effects that were added",
        ),
        ("epochs: {}", "`epochs` needs one of rows, times_s and sessions"),
        ("epochs: {rows: [5], times_s: [1]}", "`epochs` needs one of rows, times_s and sessions"),
        ("epochs: {rows: [1]}", "these are no epochs"),
        ("epochs: {rows: [9, 5]}", "these are no epochs"),
        ("epochs: {times_s: [5, 5]}", "these are no epochs"),
        ("epochs: {sessions: [a]}", "these are no epochs"),
        ("epochs: {sessions: [a, b, a]}", "these are no epochs"),
        ("base: {free: false, per: session}", "a base that is not free is the same in every session"),
        ("urdf: arm.urdf", "`urdf:` goes with `convention: urdf`"),
        ("tip: hand", "`tip:` goes with `convention: urdf`"),
        ("effect: [joint_zero]", "effect"),
    ] {
        let found = reported(more);
        assert!(says(&found, part), "{more}: {found:?}");
    }
    assert_eq!(reported("epochs: {rows: [2]}"), "", "the second epoch may begin with row 2");
    assert_eq!(reported("sensor: {working_mm: 8, peak_mm: 5, hysteresis_percent: 89}"), "");
}

#[test]
fn definitions_are_held_to_what_can_be_worked_out() {
    let define = |name: &str, adds: &str, parameters: &str| {
        reported(&format!("define:\n  - {{name: {name}, adds: {{{adds}}}, parameters: {{{parameters}}}}}"))
    };
    let (adds, a) = ("joint: turn, deg: \"a*q1\"", "a: {unit: deg, range: [-1, 1]}");
    assert_eq!(define("own", adds, a), "");
    for (name, adds, parameters, part) in [
        ("2nd", adds, a, "`2nd` cannot be an effect's name; use letters, digits and _"),
        ("my-own", adds, a, "`my-own` cannot be an effect's name"),
        ("geometry", adds, a, "there is an effect `geometry` already"),
        ("link_sag", adds, a, "there is an effect `link_sag` already"),
        ("own", adds, "", "an effect needs at least one parameter to be fitted"),
        ("own", adds, "a: {unit: deg, range: [1, 1]}", "the range [1, 1] holds no value"),
        ("own", adds, "\"a b\": {unit: deg, range: [0, 1]}", "`a b` cannot be a parameter's name"),
        ("own", "", a, "`adds` says nothing that is added"),
        ("own", "joint: trun, deg: \"a*q1\"", a, "there is no joint `trun`"),
        ("own", "joint: slide, deg: \"a*q1\"", a, "what is added here is in mm"),
        ("own", "length: turn, deg: \"a*q1\"", a, "what is added here is in mm"),
        ("own", "twist: turn, mm: \"a*q1\"", a, "what is added here is in deg"),
        (
            "own",
            "joint: turn, length: turn, deg: \"a\"",
            a,
            "`adds` acts on one of joint, length, offset, twist, skew",
        ),
        ("own", "x_mm: \"a\"", a, "`x_mm` moves a target; name it: adds: {target: p1, x_mm: ...}"),
        ("own", "target: p9, x_mm: \"a\"", a, "there is no target `p9`"),
        ("own", "joint: turn, deg: \"a*q3\"", a, "speaks of `q3`"),
    ] {
        let found = define(name, adds, parameters);
        assert!(says(&found, part), "{name}, {adds}, {parameters}: {found:?}");
    }
    let elsewhere =
        "define:\n  - {name: own, where: bace, adds: {base_x_mm: \"a\"}, parameters: {a: {range: [-1, 1]}}}";
    assert!(
        says(&reported(elsewhere), "there is no place `bace`; did you mean `base`?"),
        "{}",
        reported(elsewhere)
    );
}

#[test]
fn every_section_means_what_it_says() {
    let model = parse(
        "board: {seen_by: p2, xyz_mm: [1, 2, 3], rpy_deg: [0, 0, 90], free: true}
levels: {a: {after: base}, b: {after: flange, rpy_deg: [0, 0, 90]}, c: {after: turn}, d: {}}
surfaces: {left: {line: {point_mm: [1, 2, 3], direction: [0, 2, 0], light: left}}, dim: {line: {point_mm: [1, 2, 3], direction: [0, 2, 0]}}}
noise: {board_mm: 0.5, board_deg: 90, p1_deg: 180, on_mm: 0.25, tilt_deg: 90}
measured_from: world
links: [{after: turn, mass_kg: 0}]",
    )
    .unwrap();
    let board = &model.boards[0];
    assert_eq!(
        (board.camera, board.free, board.pose.translation.vector),
        (1, true, Vector3::new(1.0, 2.0, 3.0))
    );
    assert!((board.pose.rotation * Vector3::x() - Vector3::y()).norm() < 1e-12);
    let frames: Vec<Frame> = model.levels.iter().map(|level| level.frame).collect();
    assert_eq!(
        frames,
        [Frame::Base, Frame::After(1), Frame::After(0), Frame::After(1)],
        "the flange is after the last joint"
    );
    assert!((model.levels[1].rotation * Vector3::x() - Vector3::y()).norm() < 1e-12);
    assert_eq!((model.surfaces[0].light, model.surfaces[1].light), (Some(1.0), None));
    assert!(
        matches!(&model.surfaces[0].shape, SurfaceShape::Line { direction, .. } if *direction == Vector3::y())
    );
    let quarter = std::f64::consts::FRAC_PI_2;
    assert_eq!(
        (model.noise.board, model.noise.board_rotation, model.noise.of(&HEIGHT)),
        (Some(0.5), Some(quarter), Some(0.25))
    );
    assert_eq!(model.noise.orientations, [("p1".to_owned(), std::f64::consts::PI)]);
    assert_eq!((model.noise.tilt, model.measured_from), (Some(quarter), MeasuredFrom::World));
    assert_eq!(model.masses[0].mass, 0.0);
    assert!(parse("").unwrap().noise == crate::arm_model::Noise::default());
}

#[test]
fn corrections_keep_what_they_may_be() {
    let model = parse("effects: [{effect: joint_gain, where: turn, values: {gain: 0.01}, claim: correction, may_be: [a belt, a scale]}, joint_zero]").unwrap();
    assert_eq!((model.effects.len(), model.corrections.len()), (3, 1));
    assert_eq!(model.corrections[0].may_be, ["a belt", "a scale"]);
    assert_eq!(model.effects[0].values, [0.01]);
    let again = Model::parse("again.yaml", &model_text(&model)).unwrap();
    assert_eq!((again.corrections, again.effects.len()), (model.corrections, 3));
}

#[test]
fn a_model_of_every_odd_part_is_written_and_read_back() {
    let model = parse(
        "board: {seen_by: p2, xyz_mm: [1, 2, 3], rpy_deg: [10, 20, 30], free: true}
level: {after: base, rpy_deg: [1, 2, 3]}
surfaces: {left: {line: {point_mm: [1, 2, 3], direction: [0, 1, 0], light: left}}, dim: {line: {point_mm: [1, 2, 3], direction: [0, 1, 0]}, free: true}}
noise: {board_mm: 0.5, board_deg: 0.5, p1_deg: 0.25, p1_mm: 0.125, distance_mm: 2}
effects: [\"joint_coupling(turn, slide)\", {effect: joint_harmonic, where: turn, n: 2.5, values: {sine_deg: 0.5}}]",
    );
    let model = model.unwrap();
    let again = Model::parse("again.yaml", &model_text(&model)).unwrap();
    assert_eq!(again.boards.iter().map(|board| (board.camera, board.free)).collect::<Vec<_>>(), [(1, true)]);
    let turned = again.boards[0].pose.rotation.angle_to(&model.boards[0].pose.rotation);
    assert!(turned < 1e-9, "{turned}");
    assert_eq!(again.surfaces, model.surfaces);
    assert_eq!((again.levels.len(), again.levels[0].frame, &again.levels[0].name), (1, Frame::Base, &None));
    assert_eq!(again.noise.positions, model.noise.positions);
    assert!((again.noise.board_rotation.unwrap() - 0.5_f64.to_radians()).abs() < 1e-12);
    assert_eq!(
        again.effects.iter().map(|added| &added.id).collect::<Vec<_>>(),
        model.effects.iter().map(|added| &added.id).collect::<Vec<_>>()
    );
    assert!((again.effects[1].values[0] - 0.5_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn targets_that_turn_apart_from_where_they_are_and_bodies_are_kept() {
    let text = ARM.replace(
        "p1: {}, p2: {}",
        "p1: {free: true, free_rpy: false, rpy_deg: [0, 0, 90]}, p2: {free: false}",
    );
    let model = Model::parse("m.yaml", &text).unwrap();
    assert_eq!(
        [0, 1].map(|target| (model.targets[target].free, model.targets[target].rotation_free)),
        [(true, false), (false, false)]
    );
    assert!((model.targets[0].rotation * Vector3::x() - Vector3::y()).norm() < 1e-12);
    let again = Model::parse("again.yaml", &model_text(&model)).unwrap();
    assert!(
        (again.targets[0].free, again.targets[0].rotation_free) == (true, false),
        "{:?}",
        again.targets[0]
    );
    assert!(again.targets[0].rotation.angle_to(&model.targets[0].rotation) < 1e-9);
}

#[test]
fn distances_contradict_each_other_beyond_rounding() {
    let known = |one: &str, other: &str, length: f64| TouchDistance {
        between: [one.to_owned(), other.to_owned()],
        length,
    };
    assert_eq!(contradiction(&[known("a", "b", 5.0), known("b", "a", 5.0 + 1e-7)]), None, "said twice alike");
    let (entry, reason) = contradiction(&[known("a", "b", 5.0), known("b", "a", 5.1)]).unwrap();
    assert!(entry == 1 && reason.contains("5 mm apart and 5.1 mm apart; keep one"), "{reason}");
    // Around two corners: 3 and 4 and 5 make at most 12.
    let chain = |last: f64| {
        vec![known("a", "b", 3.0), known("b", "c", 4.0), known("c", "d", 5.0), known("a", "d", last)]
    };
    assert_eq!(contradiction(&chain(12.0)), None);
    let (entry, reason) = contradiction(&chain(12.01)).unwrap();
    assert!(
        entry == 3 && reason.contains("cannot be 12.01 mm apart") && reason.contains("at most 12 mm apart"),
        "{reason}"
    );
    assert_eq!(contradiction(&[]), None);
    let touch = Touch { target: "p1".to_owned(), distances: chain(1.0) };
    assert_eq!(contradiction(&touch.distances), None, "nearer than around is no contradiction");
}

const URDF: &str = r#"<robot name="r"><link name="base"/><link name="upper"/><link name="hand"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="1" effort="0"/></joint>
  <joint name="reach" type="prismatic"><parent link="upper"/><child link="hand"/><origin xyz="0.5 0 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.25" velocity="1" effort="0"/></joint></robot>"#;

/// What is said of a model file beside that URDF file, or the model.
fn beside(text: &str) -> Result<Model, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("r.urdf"), URDF).unwrap();
    let file = folder.path().join("m.yaml");
    std::fs::write(&file, text).unwrap();
    Model::read(&file).map_err(|error| error.to_string())
}

#[test]
fn an_arm_of_a_urdf_file_takes_limits_signs_and_gears_from_the_model_file() {
    let model = beside("arm: r\nconvention: {urdf: r.urdf}\njoints: [{name: turn, limits_deg: [-90, 90], sign: -1, gear_ratio: 50}]\n").unwrap();
    assert_eq!(model.chain.len(), 2);
    assert!((model.chain.joints[0].limits.1 - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!((model.chain.joints[0].sign, model.chain.joints[0].gear_ratio), (-1.0, Some(50.0)));
    assert_eq!(
        (model.chain.joints[1].limits, model.targets.len()),
        ((0.0, 250.0), 1),
        "and what it does not say stays"
    );
    // What is down in the file's root link: along its -z.
    let down = model.base.pose.rotation * model.gravity.unwrap();
    assert!((down + Vector3::z()).norm() < 1e-9, "{down}");
    for (text, part) in [
        ("convention: urdf\n", "which URDF file? write `convention: {urdf: arm.urdf}`"),
        ("convention: {urdf: r.urdf}\nurdf: r.urdf\n", "the URDF file is named twice"),
        ("convention: {urdf: none.urdf}\n", "the path counts from this file's folder"),
        (
            "convention: {urdf: r.urdf}\njoints: [{name: trun}]\n",
            "there is no joint `trun` that moves between `base` and `hand`; did you mean `turn`?",
        ),
        (
            "convention: {urdf: r.urdf}\njoints: [{name: turn, a_mm: 5}]\n",
            "the URDF file says where joint `turn` is",
        ),
        (
            "convention: {urdf: r.urdf}\njoints: [{name: reach, limits_deg: [0, 5]}]\n",
            "a joint that slides has limits_mm",
        ),
        ("convention: {urdf: r.urdf, tip: foot}\n", "foot"),
    ] {
        let found = beside(&format!("arm: r\n{text}")).map_or_else(|error| error, |_| String::new());
        assert!(says(&found, part), "{text}: {found:?}");
    }
    let upper = beside("arm: r\nconvention: urdf\nurdf: r.urdf\ntip: upper\n").unwrap();
    assert_eq!(upper.chain.len(), 1, "the tip is where the arm ends");
}

#[test]
fn effects_are_looked_at_only_where_no_other_mistake_was_found() {
    let wrong_effect = "free: [\"joint_zero(trun)\"]";
    assert!(reported(wrong_effect).contains("none called `trun`"));
    let both = reported(&format!("level: {{after: trun}}\n{wrong_effect}"));
    assert!(both.contains("there is no joint `trun`") && !both.contains("none called"), "{both}");
}
