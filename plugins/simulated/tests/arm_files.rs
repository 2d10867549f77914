//! Worlds of arms that files describe: how a bad file is reported, and what a good one does.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::PathBuf;

use plumb_simulated::arm::ArmWorld;
use plumb_simulated::arm::file::imperfection_yaml;
use plumb_simulated::protocol::{Axis, Instrument, JointUnit};
use plumb_simulated::served_world::{Arm, MotionRequest, Operator, ServedWorld, Use};
use plumb_simulated::world_file::{Described, read};

/// A folder with the files of one arm.
struct Files {
    folder: tempfile::TempDir,
}

/// A crane of three axes: it turns, its trolley runs out, its hook goes down.
const CRANE: &str = "\
arm: crane
title: A crane
convention: distal
joints:
  - {name: turn, d_mm: 500, alpha_deg: 90, theta_deg: 90, limits_deg: [-170, 170], speed_deg_per_s: 90}
  - {name: trolley, slides: true, alpha_deg: 90, limits_mm: [100, 800], speed_mm_per_s: 400, step_mm: 0.5, home_mm: 200, screw_pitch_mm: 5}
  - {name: hook, slides: true, limits_mm: [0, 400], speed_mm_per_s: 200}
";

const WORLD: &str = "world: A crane at work\narm: {described: {by: crane.arm.yaml}}\n";

impl Files {
    fn new(arm: &str, world: &str) -> Self {
        let files = Self { folder: tempfile::tempdir().unwrap() };
        std::fs::write(files.folder.path().join("crane.arm.yaml"), arm).unwrap();
        std::fs::write(files.world(), world).unwrap();
        files
    }

    fn world(&self) -> PathBuf {
        self.folder.path().join("world.yaml")
    }

    /// The message about these files, without the folder's name and the lines it quotes: what is wrong; what would be right.
    fn refused(&self) -> String {
        let error = read(&self.world()).unwrap_err().to_string();
        let message = error.lines().filter(|line| !line.contains(" | ") && !line.is_empty());
        let message: Vec<&str> = message.map(|line| line.trim_start_matches("  = ")).collect();
        message.join("; ").replace(&format!("{}/", self.folder.path().display()), "")
    }

    fn open(&self) -> ArmWorld {
        match read(&self.world()).unwrap() {
            Described::Arm(world) => ArmWorld::new(*world),
            other => panic!("{other:?}"),
        }
    }
}

fn arm_refused(from: &str, to: &str) -> String {
    assert!(CRANE.contains(from), "{from}");
    Files::new(&CRANE.replace(from, to), WORLD).refused()
}

fn tip(world: &mut ArmWorld) -> [f64; 3] {
    [Axis::X, Axis::Y, Axis::Z].map(|axis| {
        let used = Use { with: Instrument::Tracker, at: None, turned: false, axis: Some(axis), rising: None };
        world.measure(&used).unwrap().0
    })
}

fn go(world: &mut ArmWorld, joints: [f64; 3]) {
    world.begin(&joints, 1.0).unwrap();
    world.finish_motion();
}

#[test]
fn an_arm_of_three_axes_of_which_two_slide_goes_where_it_is_sent() {
    let mut world = Files::new(CRANE, WORLD).open();
    let facts = world.facts();
    let units: Vec<JointUnit> = facts.joints.iter().map(|joint| joint.unit).collect();
    assert_eq!(units, [JointUnit::Rad, JointUnit::Mm, JointUnit::Mm]);
    assert_eq!(world.reading().joints.as_slice(), [0.0, 200.0, 0.0], "at home");
    go(&mut world, [90_f64.to_radians(), 600.0, 150.0]);
    let [x, y, z] = tip(&mut world);
    assert!(x.abs() < 1e-9 && (y - 600.0).abs() < 1e-9 && (z - 350.0).abs() < 1e-9, "{x} {y} {z}");
    let slowest = world.reading().time_ns;
    assert_eq!(slowest - 1_000_000_000, 1_000_000_000, "400 mm of the trolley at 400 mm/s take longest");
}

#[test]
fn a_slide_with_counted_steps_is_on_whole_steps_and_one_without_anywhere() {
    let mut world = Files::new(CRANE, WORLD).open();
    go(&mut world, [0.123_456, 300.3, 77.77]);
    assert_eq!(world.believed(), [0.123_456, 300.5, 77.77]);
}

#[test]
fn a_slide_has_play_in_millimetres_that_shows_by_the_side_it_comes_from() {
    let faults = "world: w\narm: {described: {by: crane.arm.yaml, imperfections: [{joint_backlash: {joint: hook, width_mm: 0.6}}]}}\n";
    let mut world = Files::new(CRANE, faults).open();
    let mut height = |hook: f64| {
        go(&mut world, [0.0, 200.0, hook]);
        tip(&mut world)[2]
    };
    let (_, down) = (height(50.0), height(200.0));
    let (_, up) = (height(350.0), height(200.0));
    assert!(
        (down - up - 0.6).abs() < 1e-9,
        "coming down it stays short, coming up it stays low: {down} {up}"
    );
}

#[test]
fn a_controller_leads_an_arm_cycle_by_cycle_and_it_rests_where_the_cycles_end() {
    let mut world = Files::new(CRANE, WORLD).open();
    let began_ns = world.reading().time_ns;
    let [turn, trolley, hook] = <[f64; 3]>::try_from(world.believed().to_vec()).unwrap();
    Arm::follow(&mut world, &[turn, trolley + 4.0, hook], 8_000_000).unwrap();
    world.advance(began_ns + 4_000_000);
    assert_eq!(world.believed(), [turn, trolley + 2.0, hook], "half of the cycle");
    // The next cycle takes the place of what is left of this one.
    Arm::follow(&mut world, &[turn, trolley + 1.0, hook], 8_000_000).unwrap();
    world.advance(began_ns + 12_000_000);
    assert_eq!(world.believed(), [turn, trolley + 1.0, hook]);
    assert!(!world.reading().moving);
    let beyond = Arm::follow(&mut world, &[turn, 900.0, hook], 8_000_000).unwrap_err();
    assert!(beyond.contains("joint `trolley` has its stops at 98 and 802 mm"), "{beyond}");
    let own = MotionRequest { joints: vec![None, Some(50.0), None], relative: true, speed: 0.1 };
    Arm::begin(&mut world, &own).unwrap();
    let refused = Arm::follow(&mut world, &[turn, trolley, hook], 8_000_000).unwrap_err();
    assert!(refused.starts_with("the arm is moving already"), "{refused}");
}

#[test]
fn a_request_for_another_count_of_joints_is_refused_and_moves_nothing() {
    let mut world = Files::new(CRANE, WORLD).open();
    let six = MotionRequest { joints: vec![Some(0.1); 6], relative: true, speed: 1.0 };
    assert_eq!(Arm::begin(&mut world, &six).unwrap_err(), "6 joint values for an arm of 3 joints");
    assert_eq!(world.set_registers(&[0.0; 4]).unwrap_err(), "4 joint values for an arm of 3 joints");
    assert!(world.motion_ends_ns().is_none());
    let beyond = MotionRequest { joints: vec![None, Some(900.0), None], relative: false, speed: 1.0 };
    assert_eq!(
        Arm::begin(&mut world, &beyond).unwrap_err(),
        "joint `trolley` has its stops at 98 and 802 mm; 900.00 mm lies beyond them"
    );
}

#[test]
fn a_bad_arm_file_is_refused_with_where_and_what_would_be_right() {
    assert_eq!(
        arm_refused("speed_deg_per_s", "sped_deg_per_s"),
        "crane.arm.yaml:5:84: unknown key `sped_deg_per_s` in an entry of `joints`; did you mean `speed_deg_per_s`?"
    );
    let no_joints = &CRANE[CRANE.find("joints:").unwrap()..];
    assert_eq!(
        arm_refused(no_joints, "joints: []\n"),
        "crane.arm.yaml:1:6: the arm `crane` has no joints; list 1 to 8 under `joints`"
    );
    assert_eq!(
        arm_refused("[0, 400]", "[400, 0]"),
        "crane.arm.yaml:7:43: joint `hook`: `limits_mm` [400, 0] leaves no travel; the lower limit comes first, both within 5000"
    );
    assert_eq!(
        arm_refused("limits_mm: [0, 400]", "limits_deg: [0, 400]"),
        "crane.arm.yaml:7:44: joint `hook` slides; its travel is written as `limits_mm: [from, to]`"
    );
    assert_eq!(
        arm_refused(", speed_mm_per_s: 200", ""),
        "crane.arm.yaml:7:12: joint `hook` needs `speed_mm_per_s`, its greatest speed"
    );
    assert_eq!(
        arm_refused("speed_mm_per_s: 200", "speed_deg_per_s: 200"),
        "crane.arm.yaml:7:70: joint `hook` slides; write `speed_mm_per_s`"
    );
    assert_eq!(
        arm_refused("name: hook", "name: turn"),
        "crane.arm.yaml:1:6: two joints are named `turn`; names must differ"
    );
    assert_eq!(
        arm_refused("screw_pitch_mm: 5", "screw_pitch_mm: 0"),
        "crane.arm.yaml:6:138: `screw_pitch_mm` is 0; it lies between 0.05 and 20000 mm"
    );
    assert_eq!(
        arm_refused("speed_deg_per_s: 90", "speed_deg_per_s: 90, screw_pitch_mm: 5"),
        "crane.arm.yaml:5:121: joint `turn` turns; `screw_pitch_mm` is of a joint that slides"
    );
    assert!(arm_refused("convention: distal\n", "").contains("say how the rows are to be read"));
    let nine: String = (1..=9)
        .map(|joint| format!("  - {{name: j{joint}, limits_deg: [0, 1], speed_deg_per_s: 1}}\n"))
        .collect();
    assert_eq!(
        arm_refused(no_joints, &format!("joints:\n{nine}")),
        "crane.arm.yaml:1:6: the arm `crane` has 9 joints; a robot has at most 8"
    );
}

#[test]
fn a_bad_world_of_such_an_arm_is_refused_with_where_and_what_would_be_right() {
    let refused = |world: &str| Files::new(CRANE, world).refused();
    assert!(
        refused("world: w\narm: {described: {by: crane.yaml}}\n")
            .starts_with("world.yaml:2:23: the arm file crane.yaml cannot be read: "),
    );
    assert_eq!(
        refused("world: w\narm: {described: {by: crane.arm.yaml, zero_error: {hook_deg: 1}}}\n"),
        "world.yaml:2:52: unknown key `hook_deg`; there are `turn_deg`, `trolley_mm`, `hook_mm`"
    );
    let fault = |text: &str| {
        refused(&format!(
            "world: w\narm:\n  described:\n    by: crane.arm.yaml\n    imperfections:\n      - {{{text}}}\n"
        ))
    };
    assert_eq!(
        fault("joint_backlash: {joint: hook, width_deg: 1}"),
        "world.yaml:6:51: joint `hook` slides; write `width_mm`, not `width_deg`"
    );
    assert_eq!(
        fault("joint_lag: {joint: hook, at_full_speed_deg: 1}"),
        "world.yaml:6:54: joint `hook` slides; write `at_full_speed_mm`, not `at_full_speed_deg`"
    );
    assert_eq!(
        fault("joint_gain: {joint: turn}"),
        "world.yaml:6:30: the key `deg_per_deg` is missing; joint `turn` turns"
    );
    assert_eq!(
        fault("joint_harmonic: {joint: hook, per_turn: 1, amplitude_deg: 0.1}"),
        "world.yaml:6:34: joint `hook` slides; this is an error of joints that turn"
    );
    assert_eq!(
        fault("screw_wave: {joint: turn, amplitude_mm: 0.1}"),
        "world.yaml:6:30: joint `turn` turns; this is an error of joints that slide"
    );
    assert_eq!(
        fault("screw_wave: {joint: hook, amplitude_mm: 0.1}"),
        "world.yaml:6:30: joint `hook` has no screw: give it `screw_pitch_mm`, the travel for one turn, in the arm's file"
    );
    assert_eq!(
        fault("axis_yaw: {joint: trolley, deg_per_m: 3}"),
        "world.yaml:6:48: `deg_per_m` is 3; it lies between -1 and 1 deg/m"
    );
}

/// An arm of two joints out of a URDF file: a turning one, and a slide along x.
const URDF: &str = r#"<robot name="two">
  <link name="base"/>
  <link name="turret"><inertial><origin xyz="0.1 0 0"/><mass value="2"/></inertial></link>
  <link name="ram"/>
  <link name="tool"/>
  <joint name="turn" type="revolute">
    <parent link="base"/><child link="turret"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" velocity="1.5" effort="0"/>
  </joint>
  <joint name="ram" type="prismatic">
    <parent link="turret"/><child link="ram"/><origin xyz="0.2 0 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.5" velocity="0.25" effort="0"/>
  </joint>
  <joint name="end" type="fixed"><parent link="ram"/><child link="tool"/><origin xyz="0.05 0 -0.1"/></joint>
</robot>
"#;

/// The message of a world whose arm comes out of this URDF file.
fn urdf_refused(urdf: &str) -> String {
    let files = Files::new("arm: two\nurdf: two.urdf\n", WORLD);
    std::fs::write(files.folder.path().join("two.urdf"), urdf).unwrap();
    files.refused()
}

#[test]
fn an_arm_out_of_a_urdf_file_is_where_the_file_says() {
    let files = Files::new("arm: two\nurdf: two.urdf\njoints: [{name: ram, step_mm: 0.1}]\n", WORLD);
    std::fs::write(files.folder.path().join("two.urdf"), URDF).unwrap();
    let mut world = files.open();
    let facts = world.facts();
    assert_eq!(facts.joints[1].upper, 500.0);
    assert_eq!([facts.joints[0].top_speed, facts.joints[1].top_speed], [1.5, 250.0]);
    world.begin(&[std::f64::consts::FRAC_PI_2, 300.0], 1.0).unwrap();
    world.finish_motion();
    let [x, y, z] = tip(&mut world);
    assert!(x.abs() < 1e-9 && (y - 550.0).abs() < 1e-9 && (z - 300.0).abs() < 1e-9, "{x} {y} {z}");
}

#[test]
fn a_urdf_file_with_a_loop_is_refused_by_the_names_of_its_joints() {
    let back =
        r#"<joint name="back" type="fixed"><parent link="tool"/><child link="turret"/></joint></robot>"#;
    let closed = URDF.replace("</robot>", back);
    let refused = urdf_refused(&closed);
    assert!(refused.starts_with("crane.arm.yaml:2:7: two.urdf: the joints "), "{refused}");
    assert!(refused.contains("close a loop") && refused.contains("back"), "{refused}");
}

#[test]
fn other_urdf_files_that_are_no_arm_are_refused() {
    for (from, to, message) in [
        (
            "prismatic",
            "floating",
            "line 10: joint `ram` is `floating`; an arm's joints are revolute, continuous, prismatic or fixed",
        ),
        ("lower=\"0\" upper=\"0.5\"", "lower=\"0.5\" upper=\"0\"", "joint `ram` needs <limit lower="),
        ("<axis xyz=\"1 0 0\"/>", "<axis xyz=\"0 0 0\"/>", "joint `ram` needs an axis other than 0 0 0"),
        ("xyz=\"0 0 0.4\"", "xyz=\"0 0 tall\"", "`0 0 tall` is not three finite numbers"),
        (
            "</robot>",
            "<link name=\"b\"/><joint name=\"fork\" type=\"fixed\"><parent link=\"turret\"/><child link=\"b\"/></joint></robot>",
            "say which link is the arm's tip",
        ),
        ("</robot>", "", "this is no XML"),
        (" velocity=\"0.25\"", "", "joint `ram` needs `speed_mm_per_s`, its greatest speed"),
    ] {
        assert!(URDF.contains(from), "{from}");
        let refused = urdf_refused(&URDF.replace(from, to));
        assert!(refused.contains(message), "{refused}\nexpected {message}");
    }
}

#[test]
fn gravity_pulls_a_soft_slide_down_by_its_load() {
    // 10 kg beyond the hook at 0.002 mm/N: 0.1961 mm.
    let arm = format!("{CRANE}links: [{{after: hook, mass_kg: 10, centre_mm: [0, 0, 0]}}]\n");
    let soft = "world: w\narm: {described: {by: crane.arm.yaml, imperfections: [{joint_compliance: {joint: hook, mm_per_n: 0.002}}]}}\n";
    let height = |world: &str| tip(&mut Files::new(&arm, world).open())[2];
    let sunk = height(WORLD) - height(soft);
    assert!((sunk - 10.0 * 9.80665 * 0.002).abs() < 1e-9, "{sunk}");
}

#[test]
fn a_sealed_world_names_a_missing_arm_file_and_nothing_that_it_hides() {
    let files = Files::new(CRANE, WORLD);
    let sealed = files.folder.path().join("sealed.yaml");
    plumb_simulated::world_file::write_sealed(&files.world(), &sealed).unwrap();
    read(&sealed).unwrap();
    std::fs::write(files.folder.path().join("crane.arm.yaml"), CRANE.replace("[0, 400]", "[4, 0]")).unwrap();
    let refused = read(&sealed).unwrap_err().to_string();
    assert!(refused.contains("crane.arm.yaml:7:43"), "{refused}");
}

#[test]
fn an_imperfection_is_written_as_it_is_read() {
    let faults = [
        "joint_zero: {joint: turn, deg: 0.25}",
        "joint_zero: {joint: hook, mm: 0.25}",
        "joint_gain: {joint: trolley, mm_per_mm: 0.002}",
        "link_length: {joint: turn, mm: -0.5}",
        "axis_skew: {joint: trolley, deg: 0.125}",
        "joint_compliance: {joint: hook, mm_per_n: 0.002}",
        "joint_backlash: {joint: hook, width_mm: 0.5}",
        "joint_lag: {joint: trolley, at_full_speed_mm: -0.5}",
        "joint_lag: {joint: turn, at_full_speed_deg: 0.0625}",
        "screw_wave: {joint: trolley, per_turn: 2, amplitude_mm: 0.03, phase_deg: 30}",
        "axis_roll: {joint: trolley, deg_per_m: 0.02}",
        "axis_pitch: {joint: hook, deg_per_m: -0.02}",
        "axis_yaw: {joint: trolley, deg_per_m: 0.01}",
        "joint_harmonic: {joint: turn, per_turn: 2, amplitude_deg: 0.25, phase_deg: 30}",
    ];
    for fault in faults {
        let read = |fault: &str| {
            let text = format!(
                "world: w\narm:\n  described:\n    by: crane.arm.yaml\n    imperfections: [{{{fault}}}]\n"
            );
            let Described::Arm(world) = read(&Files::new(CRANE, &text).world()).unwrap() else { panic!() };
            *world
        };
        let world = read(fault);
        let written = imperfection_yaml(&world.imperfections[0], &world.paper).unwrap();
        let (one, again) = (&world.imperfections[0], &read(&written).imperfections[0]);
        assert_eq!(one.mechanism.name(), again.mechanism.name(), "{written}");
        assert!((one.size - again.size).abs() < 1e-12, "{fault} is written {written}");
    }
}

/// How far the hook's tip is from where it should be with something wrong with the trolley, at turn 0.
fn off(fault: &str, trolley: f64, hook: f64) -> [f64; 3] {
    let text =
        format!("world: w\narm:\n  described:\n    by: crane.arm.yaml\n    imperfections: [{{{fault}}}]\n");
    let mut world = Files::new(CRANE, &text).open();
    go(&mut world, [0.0, trolley, hook]);
    let [x, y, z] = tip(&mut world);
    [x - trolley, y, z - (500.0 - hook)]
}

fn assert_off(fault: &str, (trolley, hook): (f64, f64), expected: [f64; 3]) {
    let found = off(fault, trolley, hook);
    let close = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 2e-4);
    assert!(close, "{fault}: {found:?} and not {expected:?}");
}

#[test]
fn a_screw_out_of_true_goes_to_and_fro_with_its_turns() {
    let fault = "screw_wave: {joint: trolley, amplitude_mm: 0.04, phase_deg: 30}";
    // A fifth of a turn beyond 40 whole ones, and half a turn on.
    let wave = |turns: f64| 0.04 * (turns * 360.0 + 30.0_f64).to_radians().sin();
    assert_off(fault, (201.0, 0.0), [wave(0.2), 0.0, 0.0]);
    assert_off(fault, (203.5, 0.0), [wave(0.7), 0.0, 0.0]);
}

#[test]
fn a_carriage_on_a_guideway_that_is_not_straight_turns_and_leaves_the_line() {
    // 800 mm along an arc of 0.02 deg/m: a turn of 0.016 deg, half of that times the way aside, and at 400 mm below the turn times 400.
    let turn = 0.016_f64.to_radians();
    assert_off(
        "axis_pitch: {joint: trolley, deg_per_m: 0.02}",
        (800.0, 400.0),
        [400.0 * turn, 0.0, 400.0 * turn],
    );
    assert_off("axis_yaw: {joint: trolley, deg_per_m: 0.02}", (800.0, 400.0), [0.0, 400.0 * turn, 0.0]);
    assert_off("axis_roll: {joint: trolley, deg_per_m: 0.02}", (800.0, 400.0), [0.0, 400.0 * turn, 0.0]);
    assert_off("axis_roll: {joint: trolley, deg_per_m: 0.02}", (800.0, 0.0), [0.0; 3]);
}
