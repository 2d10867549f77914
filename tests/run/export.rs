//! `plumb model export`: a calibrated arm leaves for other programs, and what they cannot hold is said.

use plumb_calibration::arm_model::Model;
use plumb_calibration::forward::ForwardModel;

use crate::lab::Lab;

/// A PUMA with errors that rigid links hold.
const RIGID: &str = "effects:
  - {effect: joint_zero, where: shoulder, values: {zero_deg: 0.3}}
  - {effect: link_length, where: shoulder, values: {length_mm: 1.1}}
  - {effect: link_offset, where: elbow, values: {offset_mm: -0.7}}
  - {effect: axis_skew, where: elbow, values: {skew_deg: -0.04}}
";

/// And one that they do not.
const SOFT: &str = "  - {effect: joint_compliance, where: shoulder, values: {compliance: 1.0e-4}}\n";

fn lab_with(effects: &str) -> Lab {
    let lab = Lab::of("ur5");
    let text = std::fs::read_to_string(lab.path("../arms/puma560.yaml")).unwrap();
    assert!(text.contains("effects: []"));
    lab.write("puma.yaml", &text.replace("effects: []", effects));
    lab
}

fn export(lab: &Lab, model: &str, more: &[&str]) -> crate::lab::CommandOutput {
    let mut arguments = vec!["model", "export", model, "--as"];
    arguments.extend(more);
    lab.plumb(&arguments)
}

/// The reader of URDF files takes it back: the tip is the same within 1e-6 mm in 1,000 poses.
#[test]
fn the_urdf_puts_the_tip_where_the_calibrated_model_does() {
    let lab = lab_with(RIGID);
    let written = export(&lab, "puma.yaml", &["urdf"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    lab.write("puma.urdf", &written.out());
    lab.write(
        "back.yaml",
        "arm: back\nconvention: {urdf: puma.urdf, tip: p1}\ntargets: {p1: {xyz_mm: [0, 0, 0]}}\n",
    );
    let back = Model::read(&lab.path("back.yaml")).unwrap();
    let (root_from_base, target_xyz) = (back.base.pose, back.targets[0].xyz);
    let back = ForwardModel::new(back).unwrap();
    let model = Model::read(&lab.path("puma.yaml")).unwrap();
    let (joints, target) = (model.chain.len(), model.targets[0].xyz);
    let calibrated = ForwardModel::new(model).unwrap();
    let mut worst = 0.0_f64;
    for pose in 0..1000_usize {
        let q: Vec<f64> =
            (0..joints).map(|joint| ((pose * 7 + joint * 131) % 311) as f64 / 100.0 - 1.55).collect();
        let tip = calibrated.flange(&q, &[]) * nalgebra::Point3::from(target);
        let read_back = root_from_base * back.flange(&q, &[]) * nalgebra::Point3::from(target_xyz);
        worst = worst.max((read_back - tip).norm());
    }
    assert!(worst < 1e-6, "{worst} mm");
}

#[test]
fn what_a_urdf_cannot_hold_is_refused_with_its_size_and_left_out_only_when_asked() {
    let lab = lab_with(&format!("{RIGID}{SOFT}"));
    let refused = export(&lab, "puma.yaml", &["urdf"]);
    assert_eq!((refused.code(), refused.out().as_str()), (2, ""));
    let stderr = refused.err();
    assert!(
        stderr
            .starts_with("plumb: rigid links between joints cannot hold joint_compliance(shoulder): without"),
        "{stderr}"
    );
    let size = stderr.split("up to ").nth(1).unwrap().split(" mm").next().unwrap().parse::<f64>().unwrap();
    assert!((1.0..20.0).contains(&size), "the shoulder gives way by millimetres: {stderr}");
    let written = export(&lab, "puma.yaml", &["urdf", "--leave-out"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    assert!(written.err().starts_with("left out: joint_compliance(shoulder) (up to "), "{}", written.err());
    let without = lab_with(RIGID);
    assert_eq!(written.out(), export(&without, "puma.yaml", &["urdf"]).out());
}

#[test]
fn a_ur_driver_gets_the_calibration_in_its_own_form_and_another_arm_does_not() {
    let lab = Lab::of("ur5");
    let written = export(&lab, "../arms/ur5.yaml", &["ros-calibration"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    let values: serde_json::Value = serde_yaml::from_str(&written.out()).unwrap();
    let of = |link: &str, key: &str| values["kinematics"][link][key].as_f64().unwrap();
    // As ur_description has them for a UR5 (config/ur5/default_kinematics.yaml).
    for (link, key, right) in [
        ("shoulder", "z", 0.089_159),
        ("upper_arm", "roll", std::f64::consts::FRAC_PI_2),
        ("forearm", "x", -0.425),
        ("wrist_1", "x", -0.392_25),
        ("wrist_1", "z", 0.109_15),
        ("wrist_2", "y", -0.094_65),
        ("wrist_3", "y", 0.0823),
    ] {
        assert!((of(link, key) - right).abs() < 1e-9, "{link} {key}: {}", of(link, key));
    }
    let refused = export(&lab, "../arms/scara4.yaml", &["ros-calibration"]);
    assert_eq!(refused.code(), 2);
    assert!(refused.err().contains("of six joints; `scara4` has 4"), "{}", refused.err());
    let unknown = export(&lab, "../arms/ur5.yaml", &["sdf"]);
    assert!(
        unknown.err().contains("[possible values: urdf, ros-calibration, dh, targets, linuxcnc, fluidnc]"),
        "{}",
        unknown.err()
    );
}

/// A slide that counts against its axis, with a gain, play and a wave of the residual map along it.
const SLIDE: &str = "arm: slide
convention: distal
joints: [{name: x, slides: true, sign: -1, limits_mm: [-100, 500]}]
targets: {p1: {}}
measured_region: {ranges: {x: [0, 400]}, reach: 0.5, poses: [[0], [400]]}
residual_map: {not_understood: 0.5, along: [{joint: x, weights: [0.03]}]}
effects:
  - {effect: joint_gain, where: x, values: {gain: 0.0001}}
  - {effect: joint_backlash, where: x, values: {play_mm: 0.02}}
";

/// As LinuxCNC reads it: triplets until a line is none; trims of type 0 are nominal less reached; straight lines between.
fn trim(text: &str, at: f64, forward: bool) -> f64 {
    let lines: Vec<[f64; 3]> = text
        .lines()
        .map(|line| {
            line.split(' ').map(|word| word.parse().unwrap()).collect::<Vec<f64>>().try_into().unwrap()
        })
        .collect();
    let pair = lines.windows(2).find(|pair| (pair[0][0]..=pair[1][0]).contains(&at)).unwrap();
    let of = |line: &[f64; 3]| line[0] - if forward { line[1] } else { line[2] };
    of(&pair[0]) + (of(&pair[1]) - of(&pair[0])) * (at - pair[0][0]) / (pair[1][0] - pair[0][0])
}

#[test]
fn a_compensation_file_takes_away_what_the_model_says_of_a_joint() {
    let lab = Lab::of("ur5");
    lab.write("slide.yaml", SLIDE);
    let written = export(&lab, "slide.yaml", &["linuxcnc"]);
    assert_eq!(written.code(), 0, "{}", written.all());
    assert!(written.err().contains("COMP_FILE_TYPE = 0"), "{}", written.err());
    let text = written.out();
    assert_eq!(text.lines().count(), 101);
    // By hand, at 100 and 300 mm of 0 to 400: the gain adds a ten thousandth of the way, the play takes half of itself off on the side it came from, and
    // the map adds its weight times the cosine of half a period over the range, which is 1 / sqrt 2 at a quarter of it and -1 / sqrt 2 at three quarters.
    let wave = 0.03 * std::f64::consts::FRAC_1_SQRT_2;
    for (at, forward, error) in [
        (100.0, true, 0.01 - 0.01 + wave),
        (100.0, false, 0.01 + 0.01 + wave),
        (300.0, true, 0.03 - 0.01 - wave),
        (300.0, false, 0.03 + 0.01 - wave),
    ] {
        let found = trim(&text, at, forward);
        assert!((found + error).abs() < 2e-6, "{at} {forward}: {found} and not {}", -error);
    }
    assert!(
        text.starts_with("0.000000 ") && text.trim_end().lines().last().unwrap().starts_with("400.000000 ")
    );
}

#[test]
fn what_a_compensation_file_cannot_hold_is_refused() {
    let lab = Lab::of("ur5");
    lab.write("slide.yaml", SLIDE);
    lab.write(
        "settling.yaml",
        &SLIDE.replace(
            "joint_gain, where: x, values: {gain: 0.0001}",
            "axis_skew, where: x, values: {skew_deg: 0.01}",
        ),
    );
    lab.write(
        "endless.yaml",
        &SLIDE
            .replace(", limits_mm: [-100, 500]", "")
            .replace("measured_region", "#")
            .replace("residual_map", "#"),
    );
    for (arguments, needed) in [
        (&["settling.yaml", "linuxcnc"][..], "cannot hold axis_skew(x); --leave-out writes the rest"),
        (&["endless.yaml", "linuxcnc"], "x has no limits"),
        (&["slide.yaml", "linuxcnc", "--joint", "y"], "there is no joint `y`: "),
        (&["../arms/puma560.yaml", "linuxcnc"], "is of one joint; say which, as in --joint waist"),
        (&["slide.yaml", "linuxcnc", "--lines", "257"], "257 is not in 2..=256"),
    ] {
        let refused = export(&lab, arguments[0], &arguments[1..]);
        assert_eq!((refused.code(), refused.out().as_str()), (2, ""), "{}", refused.all());
        assert!(refused.err().contains(needed), "{}\nwanted: {needed}", refused.err());
    }
    let rest = export(&lab, "settling.yaml", &["linuxcnc", "--leave-out"]);
    assert!(rest.code() == 0 && rest.err().contains("left out: axis_skew(x)"), "{}", rest.all());
}

/// FluidNC has a scale for each axis and nothing else.
#[test]
fn fluidnc_gets_the_scale_of_an_axis_and_what_it_cannot_hold_is_said() {
    let lab = Lab::of("ur5");
    let gain = SLIDE.replace("measured_region", "#").replace("residual_map", "#");
    let straight = gain.replace("  - {effect: joint_backlash, where: x, values: {play_mm: 0.02}}\n", "");
    lab.write("gain.yaml", &straight);
    lab.write("play.yaml", &gain);
    lab.write("rail.yaml", &straight.replace("name: x", "name: rail").replace("where: x", "where: rail"));
    let steps = ["fluidnc", "--steps-per-mm", "80"];
    let written = export(&lab, "gain.yaml", &steps);
    assert_eq!(written.code(), 0, "{}", written.all());
    // 80 steps moved it 1.0001 mm, whichever way it counts.
    assert_eq!(written.out(), "axes:\n  x:\n    steps_per_mm: 79.992001\n");
    assert!(written.err().contains("becomes 0.000000 + 1.000100000 P"), "{}", written.err());
    for (model, more, needed) in [
        ("play.yaml", &steps[..], "still up to 0.010000 mm off. --leave-out writes the scale"),
        ("rail.yaml", &steps, "FluidNC's axes are x, y, z, a, b, c; say which `rail` is, as in --axis x"),
        ("gain.yaml", &["fluidnc"], "--steps-per-mm <NUMBER>"),
        ("gain.yaml", &["fluidnc", "--steps-per-mm", "-3"], "give a number above 0"),
        ("../arms/puma560.yaml", &steps, "a scale is of one joint; say which, as in --joint waist"),
    ] {
        let refused = export(&lab, model, more);
        assert_eq!((refused.code(), refused.out().as_str()), (2, ""), "{}", refused.all());
        assert!(refused.err().contains(needed), "{}\nwanted: {needed}", refused.err());
    }
    let rest = export(&lab, "play.yaml", &[&steps[..], &["--leave-out"]].concat());
    assert_eq!(rest.out(), written.out(), "{}", rest.all());
    assert!(rest.err().contains("left out: FluidNC holds a scale"), "{}", rest.err());
    let named = export(&lab, "rail.yaml", &[&steps[..], &["--axis", "y"]].concat());
    assert!(named.out().starts_with("axes:\n  y:\n"), "{}", named.all());
}
