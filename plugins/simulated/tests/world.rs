//! What happens in the world, seen from outside it.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::{find, go, only, search, turn, world, world_with};
use plumb_simulated::world::{Joint, Joints, LineChange, MotionOrder, MotionRefused, World};

/// Brings the hand of the ordinary cell down over white, near line A.
fn down_over_white(world: &mut World) {
    search(world, Joint::Shoulder, -40.0, true);
}

fn waist_of(change: &LineChange) -> f64 {
    change.joints.of(Joint::Waist).to_degrees()
}

const BACKLASH: &[(&str, &str)] =
    &[("zero_error: {waist_deg: 1.7, shoulder_deg: -2.4, elbow_deg: 1.3}", "backlash: {waist_deg: 0.4}")];

#[test]
fn backlash_parts_the_edges_found_from_two_sides_by_its_width() {
    let mut world = world_with("world-ideal.yaml", BACKLASH);
    down_over_white(&mut world);
    let from_white = find(&mut world, Joint::Waist, -20.0, false);
    let from_black = find(&mut world, Joint::Waist, 20.0, true);
    assert!((waist_of(&from_black) - waist_of(&from_white) - 0.4).abs() < 1e-9);
}

#[test]
fn backlash_does_not_show_when_the_edge_is_approached_from_one_side() {
    let mut world = world_with("world-ideal.yaml", BACKLASH);
    down_over_white(&mut world);
    let first = find(&mut world, Joint::Waist, -20.0, false);
    find(&mut world, Joint::Waist, 20.0, true);
    let again = find(&mut world, Joint::Waist, -20.0, false);
    assert!((waist_of(&again) - waist_of(&first)).abs() < 1e-10);
}

#[test]
fn a_start_is_where_the_arm_truly_is_whatever_cables_drag_along() {
    // The elbow begins at -78 deg: dragged along by that, a hand that truly is 20 mm open would be 19 mm beyond closed.
    let drag: &[(&str, &str)] = &[(
        "zero_error: {waist_deg: 1.7, shoulder_deg: -2.4, elbow_deg: 1.3}",
        "cable_drag: {gripper_mm_per_elbow_deg: 0.5}",
    )];
    let truth = world_with("world-ideal.yaml", drag).truth();
    assert!((truth.attitudes.of(Joint::Gripper) - 20.0).abs() < 1e-9);
    assert!((truth.attitudes.of(Joint::Elbow).to_degrees() + 78.0).abs() < 1e-9);
}

#[test]
fn a_drive_without_play_finds_an_edge_at_one_pose_from_both_sides() {
    let mut world = world("world-ideal.yaml");
    down_over_white(&mut world);
    let from_white = find(&mut world, Joint::Waist, -20.0, false);
    let from_black = find(&mut world, Joint::Waist, 20.0, true);
    assert!((waist_of(&from_black) - waist_of(&from_white)).abs() < 1e-9);
}

#[test]
fn an_edge_lies_within_its_half_width_where_motors_make_half_steps() {
    let mut smooth = world("world-ideal.yaml");
    let mut stepping = world_with("world-ideal.yaml", &[("continuous", "half_step")]);
    let exact = find(&mut smooth, Joint::Shoulder, -40.0, true);
    let found = find(&mut stepping, Joint::Shoulder, -40.0, true);
    let half_step = 360.0 / 7072.0;
    assert_eq!(exact.half_width, Joints::default());
    assert!((found.half_width.of(Joint::Shoulder).to_degrees() - half_step / 2.0).abs() < 1e-12);
    assert_eq!(found.half_width.of(Joint::Elbow), 0.0);
    // The registers of the stepping arm began at the nearest half-steps, the arm itself where it was left.
    let off = |world: &World| world.truth().attitudes.minus(&world.truth().counted).of(Joint::Shoulder);
    let true_exact = exact.joints.of(Joint::Shoulder) + off(&smooth);
    let true_found = found.joints.of(Joint::Shoulder) + off(&stepping);
    assert!((true_found - true_exact).abs() <= found.half_width.of(Joint::Shoulder) * (1.0 + 1e-9));
}

#[test]
fn a_solid_table_holds_the_arm_up_and_its_motor_loses_steps() {
    let mut world = world("world-ideal.yaml");
    let before = world.truth();
    turn(&mut world, Joint::Shoulder, -20.0);
    let truth = world.truth();
    assert!(truth.touching);
    assert!(truth.pose.tool.z.abs() < 1e-6, "{:?}", truth.pose.tool);
    let counted = (truth.counted.of(Joint::Shoulder) - before.counted.of(Joint::Shoulder)).to_degrees();
    assert!((counted + 20.0).abs() < 1e-9, "the controller counts all the steps it issued");
    let went = (truth.attitudes.of(Joint::Shoulder) - before.attitudes.of(Joint::Shoulder)).to_degrees();
    let lost = truth.lost.0[1] * 360.0 / 7072.0;
    assert!(lost > 5.0 && (lost + went.abs() - 20.0).abs() < 1e-6, "went {went}, lost {lost}");

    turn(&mut world, Joint::Shoulder, 20.0);
    let risen =
        (world.truth().attitudes.of(Joint::Shoulder) - before.attitudes.of(Joint::Shoulder)).to_degrees();
    assert!((risen - lost).abs() < 1e-6, "what it lost downward it is too high by after");
}

#[test]
fn half_steps_into_a_solid_table_are_lost_whole() {
    let mut world = world_with("world-ideal.yaml", &[("continuous", "half_step")]);
    turn(&mut world, Joint::Shoulder, -20.0);
    let truth = world.truth();
    assert!(truth.pose.tool.z >= -1e-6 && truth.pose.tool.z < 0.2);
    assert!(truth.lost.0[1] > 100.0 && truth.lost.0[1].fract() == 0.0);
}

#[test]
fn a_waist_turns_on_while_the_shoulder_is_held_up() {
    let mut world = world("world-ideal.yaml");
    let mut both = only(Joint::Shoulder, -20_f64.to_radians());
    both[Joint::Waist.index()] = Some(10_f64.to_radians());
    let before = world.truth();
    go(&mut world, both, true);
    let truth = world.truth();
    let turned = truth.attitudes.of(Joint::Waist) - before.attitudes.of(Joint::Waist);
    assert!((turned.to_degrees() - 10.0).abs() < 1e-9);
    assert_eq!(truth.lost.0[0], 0.0);
    assert!(truth.lost.0[1] > 0.0);
}

/// Whether the waist pushes into the table is determined from heights that differ in their last digits only.
#[test]
fn a_waist_turns_on_over_the_table_in_every_pose_of_a_drooping_arm() {
    let droop = "resolution: continuous\n    droop: {upper_arm_kg: 0.9, forearm_kg: 0.5, hand_kg: 0.4, \
                 shoulder_deg_per_nm: 0.5, elbow_deg_per_nm: 0.5, wrist_pitch_deg_per_nm: 0.5}";
    let mut world = world_with("world-ideal.yaml", &[("resolution: continuous", droop)]);
    for pose in 0..8 {
        let bent = -88.0 + 6.5 * f64::from(pose);
        let mut raised = only(Joint::Shoulder, 60_f64.to_radians());
        raised[Joint::Elbow.index()] = Some(bent.to_radians());
        raised[Joint::WristPitch.index()] = Some((bent - 10.0).to_radians());
        go(&mut world, raised, false);
        turn(&mut world, Joint::Shoulder, -80.0);
        let held_up = world.truth();
        assert!(held_up.touching, "{bent}");
        for by in [7.0, -13.0, 6.0] {
            turn(&mut world, Joint::Waist, by);
        }
        assert_eq!(world.truth().lost, held_up.lost, "{bent}");
        world.set_registers(&world.truth().attitudes).unwrap();
    }
}

#[test]
fn without_a_solid_table_the_arm_goes_through() {
    let mut world = world("world-no-table.yaml");
    turn(&mut world, Joint::Shoulder, -30.0);
    assert!(world.truth().pose.tool.z < -5.0);
    assert_eq!(world.truth().lost.0, [0.0; 6]);
}

#[test]
fn a_joint_stalls_at_its_stop() {
    let mut world = world("world-ideal.yaml");
    turn(&mut world, Joint::Waist, 85.0);
    assert!((world.truth().attitudes.of(Joint::Waist).to_degrees() - 90.0).abs() < 1e-6);
    assert!(world.truth().lost.0[0] > 0.0);
}

#[test]
fn a_motion_stopped_on_its_way_leaves_the_arm_where_it_was() {
    let mut world = world("world-ideal.yaml");
    let start = world.reading();
    world.begin(&MotionOrder { joints: only(Joint::Waist, 0.5), relative: true, speed: 1.0 }).unwrap();
    let half = start.time_ns + (world.motion_ends_ns().unwrap() - start.time_ns) / 2;
    world.advance(half);
    assert!(world.reading().moving);
    world.halt();
    let halted = world.reading();
    assert!(!halted.moving);
    let turned = halted.joints.of(Joint::Waist) - start.joints.of(Joint::Waist);
    assert!((turned - 0.25).abs() < 0.002, "{turned}");
    world.advance(half + 5_000_000_000);
    assert_eq!(world.reading().joints, halted.joints);
}

#[test]
fn a_motion_that_cannot_be_made_is_refused() {
    let mut world = world("world-ideal.yaml");
    let order = MotionOrder { joints: only(Joint::Waist, 0.5), relative: true, speed: 1.0 };
    world.begin(&order).unwrap();
    assert_eq!(world.begin(&order), Err(MotionRefused::Moving));
    let nowhere = MotionOrder { joints: only(Joint::Elbow, f64::NAN), ..order };
    world.finish_motion();
    assert_eq!(world.begin(&nowhere), Err(MotionRefused::NotFinite { joint: Joint::Elbow }));
    let away = MotionOrder { joints: only(Joint::Elbow, 1e300), ..order };
    assert_eq!(world.begin(&away), Err(MotionRefused::TooFar { joint: Joint::Elbow }));
    assert_eq!(world.begin(&MotionOrder { speed: 0.0, ..order }), Err(MotionRefused::Speed));
    assert_eq!(world.begin(&MotionOrder { speed: f64::NAN, ..order }), Err(MotionRefused::Speed));
}

#[test]
fn letting_time_run_in_slices_changes_nothing() {
    let order =
        MotionOrder { joints: only(Joint::Shoulder, -18_f64.to_radians()), relative: true, speed: 0.7 };
    for file in ["world-ideal.yaml", "world-backlash.yaml"] {
        let mut at_once = world(file);
        at_once.begin(&order).unwrap();
        at_once.finish_motion();
        let mut in_slices = world(file);
        in_slices.begin(&order).unwrap();
        while in_slices.reading().moving {
            in_slices.advance(in_slices.reading().time_ns + 3_141_593);
        }
        assert_eq!(in_slices.changes_after(0), at_once.changes_after(0));
        assert_eq!(in_slices.truth().attitudes, at_once.truth().attitudes);
    }
}

#[test]
fn the_controller_can_be_given_its_position_without_moving() {
    let mut world = world("world-backlash.yaml");
    let before = world.truth();
    world.set_registers(&Joints([0.0; 6])).unwrap();
    assert_eq!(world.truth().counted, Joints([0.0; 6]));
    assert_eq!(world.truth().attitudes, before.attitudes);
    turn(&mut world, Joint::Shoulder, 3.0);
    let went = world.truth().attitudes.minus(&before.attitudes).of(Joint::Shoulder).to_degrees();
    assert!(went > 2.5 && went < 3.1, "{went}");
}

#[test]
fn an_arm_is_left_within_the_operators_tolerance_and_its_controller_believes_otherwise() {
    let within = "resolution: continuous\n    start_within: {elbow_deg: 4, waist_deg: 1}";
    let left = |seed: u64| {
        let seeded = format!("\nseed: {seed}\narm:");
        world_with("world-ideal.yaml", &[("resolution: continuous", within), ("\narm:", &seeded)]).truth()
    };
    let elbows: Vec<f64> = (0..200).map(|seed| left(seed).attitudes.of(Joint::Elbow).to_degrees()).collect();
    assert!(elbows.iter().all(|elbow| (elbow + 78.0).abs() <= 4.0));
    assert!(elbows.iter().any(|elbow| *elbow > -75.0) && elbows.iter().any(|elbow| *elbow < -81.0));
    assert_eq!(left(3), left(3));
    assert!((left(3).counted.of(Joint::Elbow).to_degrees() + 79.3).abs() < 1e-9);
    assert!((left(4).attitudes.of(Joint::Shoulder).to_degrees() - 41.0).abs() < 1e-9);
}
