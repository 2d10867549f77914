//! The world of a PUMA 560: its geometry at Agin's poses, its instruments, its zeros and its brakes.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use std::path::Path;

use plumb_simulated::arm::ArmWorld;
use plumb_simulated::protocol::Instrument;
use plumb_simulated::served_world::{Arm, Camera, LevelledJoints, Operator, ServedWorld, Use};
use plumb_simulated::world_file::{Described, parse, read};

const IDEAL: &str = "world: ideal\narm: {puma560: {resolution: continuous}}\n";

const LEFTY: [f64; 6] = [90.0, 0.0, 180.0, 90.0, 0.0, 45.0];
const RIGHTY: [f64; 6] = [-51.656, -180.0, 0.0, -51.656, 0.0, 45.0];
const STRETCHED: [f64; 6] = [90.0, 0.0, 90.0, 90.0, 0.0, 45.0];
const HANGING: [f64; 6] = [90.0, 0.0, 180.0, -90.0, 0.0, 45.0];
const FLIPPED: [f64; 6] = [90.0, 0.0, 180.0, 90.0, 0.0, -135.0];

fn world_of(text: &str) -> ArmWorld {
    match parse("world.yaml", text).unwrap() {
        Described::Arm(world) => ArmWorld::new(*world),
        other => panic!("{other:?}"),
    }
}

fn go(world: &mut ArmWorld, degrees: [f64; 6]) {
    world.begin(&degrees.map(f64::to_radians), 1.0).unwrap();
    world.finish_motion();
}

fn level(world: &mut ArmWorld, at: &str, turned: bool) -> f64 {
    world.measure(&Use { with: Instrument::Level, at: Some(at), turned, axis: None, rising: None }).unwrap().0
}

fn ruler(world: &mut ArmWorld) -> f64 {
    world
        .measure(&Use { with: Instrument::Ruler, at: None, turned: false, axis: None, rising: None })
        .unwrap()
        .0
}

/// Where the flange is and how it is turned: its position, x and z, mm.
fn hand(world: &ArmWorld) -> [[f64; 3]; 3] {
    let flange = world.arm_state().unwrap().link_frames.world_from_flange;
    [flange.translation.into(), flange.rotation.x.into(), flange.rotation.z.into()]
}

#[test]
fn at_agins_poses_for_joint_2_the_hand_has_one_attitude_and_one_height() {
    let mut world = world_of(IDEAL);
    go(&mut world, LEFTY);
    let [position, x, z] = hand(&world);
    let wrist_z = world.truth().unwrap().wrist_mm[2];
    assert!((wrist_z + 433.07).abs() < 1e-9, "{wrist_z}");
    assert!((position[1] - 452.12).abs() < 1e-9 && (z[2] + 1.0).abs() < 1e-12);
    let high = ruler(&mut world);
    assert!((high - (671.8 - 489.32)).abs() < 1e-9, "{high}");
    go(&mut world, RIGHTY);
    let [righty_position, righty_x, righty_z] = hand(&world);
    for (lefty, righty) in x.iter().chain(&z).zip(righty_x.iter().chain(&righty_z)) {
        assert!((lefty - righty).abs() < 1e-9, "{x:?} {righty_x:?}");
    }
    assert!((ruler(&mut world) - high).abs() < 1e-9);
    // As near to the same position as the offset of 0.8 inches lets it.
    let apart = (position[0] - righty_position[0]).hypot(position[1] - righty_position[1]);
    assert!((apart - 38.43).abs() < 0.01, "{apart}");
}

#[test]
fn the_ready_position_points_straight_up() {
    let world = world_of(IDEAL);
    let [position, x, z] = hand(&world);
    assert!((z[2] - 1.0).abs() < 1e-12 && (x[0] - 1.0).abs() < 1e-12);
    assert!((position[2] - (431.8 + 433.07 + 56.25)).abs() < 1e-9, "{position:?}");
}

#[test]
fn every_surface_is_level_where_agin_has_it_level() {
    let mut world = world_of(IDEAL);
    for (pose, surfaces) in [
        (STRETCHED, &["forearm", "forearm_across"][..]),
        ([90.0, -180.0, 90.0, -90.0, 0.0, 45.0], &["forearm", "forearm_across"]),
        (HANGING, &["cage_back", "cage_back_across"]),
        (FLIPPED, &["cage_back", "cage_back_across"]),
        ([90.0, 0.0, 180.0, -90.0, 90.0, 45.0], &["cage_top"]),
    ] {
        go(&mut world, pose);
        for surface in surfaces {
            assert!(level(&mut world, surface, false).abs() < 1e-9, "{surface} at {pose:?}");
        }
    }
}

#[test]
fn an_error_of_joint_2_raises_the_righty_wrist_as_it_lowers_the_lefty_one() {
    let text = "world: w\narm: {puma560: {resolution: continuous, zero_error: {shoulder_deg: 1}}}\n";
    let mut world = world_of(text);
    go(&mut world, LEFTY);
    let lefty = ruler(&mut world);
    go(&mut world, RIGHTY);
    let righty = ruler(&mut world);
    let found = ((righty - lefty) / 2.0 / 431.8).atan().to_degrees();
    assert!((found - 1.0).abs() < 0.001, "{found}");
}

#[test]
fn a_flipped_wrist_distinguishes_joint_5s_zero_from_the_mounts_tilt() {
    let text = "world: w\narm: {puma560: {resolution: continuous, zero_error: {wrist_bend_deg: 0.8}, base: {tilt_x_deg: 0.3, tilt_y_deg: -0.5}}}\n";
    let mut world = world_of(text);
    let mut motions = Vec::new();
    for pose in [HANGING, FLIPPED] {
        go(&mut world, pose);
        let used =
            Use { with: Instrument::Level, at: Some("cage_back"), turned: false, axis: None, rising: None };
        while let Some(order) = world.level_request("wrist_bend", &used).unwrap() {
            Arm::begin(&mut world, &order).unwrap();
            world.finish_motion();
        }
        motions.push(world.believed()[4].to_degrees());
    }
    let found = -(motions[0] + motions[1]) / 2.0;
    assert!((found - 0.8).abs() < 0.01, "{motions:?}");
    assert!((motions[0] - motions[1]).abs() > 0.5, "the tilt shows in each alone: {motions:?}");
}

#[test]
fn a_level_turned_end_for_end_shows_its_own_error_twice() {
    let text = "world: w\narm: {puma560: {resolution: continuous, zero_error: {elbow_deg: -0.4}}}\ninstruments: {level: {zero_deg: 0.1}}\n";
    let mut world = world_of(text);
    go(&mut world, STRETCHED);
    let (as_it_lies, turned) = (level(&mut world, "forearm", false), level(&mut world, "forearm", true));
    assert!(((as_it_lies + turned) / 2.0 - 0.1).abs() < 1e-6);
    assert!(((as_it_lies - turned) / 2.0 - 0.4).abs() < 1e-6, "{as_it_lies} {turned}");
}

#[test]
fn what_is_declared_moves_the_zeros_and_not_the_arm() {
    let text = "world: w\narm: {puma560: {resolution: continuous, zero_error: {elbow_deg: 1.5}}}\n";
    let mut world = world_of(text);
    let before = hand(&world);
    let mut joints = world.believed().to_vec();
    joints[2] += 1.5_f64.to_radians();
    world.declare(&joints).unwrap();
    assert_eq!(hand(&world), before);
    assert!(world.zero_errors()[2].abs() < 1e-12);
}

#[test]
fn a_cage_sags_on_a_soft_shoulder_and_more_when_stretched_out() {
    let text = |softness: &str| {
        format!(
            "world: w\narm: {{puma560: {{resolution: continuous, imperfections: [{{joint_compliance: {{joint: shoulder, rad_per_nm: {softness}}}}}]}}}}\n"
        )
    };
    let height = |text: &str, pose| {
        let mut world = world_of(text);
        go(&mut world, pose);
        world.truth().unwrap().sensor_mm[2]
    };
    let stretched = height(IDEAL, STRETCHED) - height(&text("2.0e-5"), STRETCHED);
    let hanging = height(IDEAL, LEFTY) - height(&text("2.0e-5"), LEFTY);
    assert!(stretched > 0.5 && hanging > 0.1 && stretched > 1.5 * hanging, "{stretched} {hanging}");
    let up = height(IDEAL, [0.0, -90.0, 90.0, 0.0, 0.0, 0.0])
        - height(&text("2.0e-5"), [0.0, -90.0, 90.0, 0.0, 0.0, 0.0]);
    assert!(up.abs() < 0.05, "{up}");
}

#[test]
fn a_stop_brakes_and_the_joints_are_where_the_encoders_can_count() {
    let mut world = world_of("world: w\narm: {puma560: {resolution: encoder}}\n");
    let mut target = world.believed().to_vec();
    target[0] += 1.0;
    world.begin(&target, 1.0).unwrap();
    world.advance(1_200_000_000);
    let here = world.believed()[0];
    world.brake();
    world.finish_motion();
    let way = (world.believed()[0] - here).to_degrees();
    assert!((way - 82.0 * 0.125).abs() < 0.02, "{way}");
    let counts = world.believed()[0].to_degrees() * 173.92;
    assert!((counts - counts.round()).abs() < 1e-6);
}

#[test]
fn what_cannot_be_measured_or_reached_is_said() {
    let mut world = world_of(IDEAL);
    let mut measure = |with, at| {
        world.measure(&Use { with, at: Some(at), turned: false, axis: None, rising: None }).unwrap_err()
    };
    assert_eq!(
        measure(Instrument::Level, "elbow"),
        "a spirit level does not lie at `elbow`; its places are forearm, forearm_across, cage_back, cage_back_across, cage_top"
    );
    assert_eq!(
        measure(Instrument::Ruler, "elbow"),
        "the ruler goes under the `flange` or the `tip`, not at `elbow`"
    );
    assert!(
        measure(Instrument::Level, "forearm")
            .starts_with("the surface leans by 90.0 deg: the bubble is at its end")
    );
    let mut target = world.believed().to_vec();
    target[2] = 4.2;
    assert_eq!(
        world.begin(&target, 1.0).unwrap_err().to_string(),
        "joint `elbow` has its stops at -49 and 229 deg; 240.64 deg lies beyond them"
    );
    go(&mut world, STRETCHED);
    let used = Use { with: Instrument::Level, at: Some("forearm"), turned: false, axis: None, rising: None };
    assert_eq!(world.level_request("flange", &used), Ok(None), "it is level already");
}

#[test]
fn wrong_world_files_say_where_and_what_would_be_right() {
    for (text, message) in [
        (
            "world: w\narm: {puma560: {resolution: encoder, zero_error: {sholder_deg: 1}}}\n",
            "world.yaml:2:51: unknown key `sholder_deg`; did you mean `shoulder_deg`?",
        ),
        (
            "world: w\narm: {puma560: {resolution: encoder, imperfections: [{link_length: {joint: elbw, mm: 1}}]}}\n",
            "world.yaml:2:76: unknown joint `elbw`; did you mean `elbow`?",
        ),
        (
            "world: w\narm: {puma560: {resolution: encoder}}\ncage: {mass_kg: 40}\n",
            "world.yaml:3:17: `mass_kg` is 40; it lies between 0 and 5 kg",
        ),
        (
            "world: w\narm: {puma560: {resolution: encoder, imperfections: [{warm_up: {joint: elbow, time_constant_s: 60}}]}}\n",
            "a warm-up changes one thing; give `zero_deg`, `length_mm` or `offset_mm`, what it comes to in the end",
        ),
    ] {
        let error = parse("world.yaml", text).unwrap_err().to_string();
        // Without the line that is quoted.
        let reported = error.lines().filter(|line| !line.contains(" | "));
        let error = reported.map(|line| line.trim_start_matches("  = ")).collect::<Vec<_>>().join("; ");
        assert!(error.ends_with(message), "{error}\nexpected {message}");
    }
}

#[test]
fn the_world_that_comes_with_the_program_can_be_read_and_sealed() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workcells/puma/world.yaml");
    let Described::Arm(open) = read(&file).unwrap() else { panic!("not a PUMA") };
    let errors = open.drawn_zero_error();
    assert_eq!(errors[0], 0.0);
    assert!(errors[1..].iter().all(|error| error.abs() <= 2.0_f64.to_radians() && *error != 0.0));
    let folder = tempfile::tempdir().unwrap();
    let sealed = folder.path().join("sealed.yaml");
    plumb_simulated::world_file::write_sealed(&file, &sealed).unwrap();
    let text = std::fs::read_to_string(&sealed).unwrap();
    assert!(!text.contains("zero_error"));
    let Described::Arm(opened) = read(&sealed).unwrap() else { panic!("not a PUMA") };
    assert!(opened.sealed_text.is_some());
    assert_eq!((opened.zero_error_within, opened.table), (open.zero_error_within, open.table));
}

/// As the world runs with the wall's clock it is brought up to the present again and again, also between two motions.
#[test]
fn a_camera_that_takes_pictures_by_itself_takes_none_at_rest_and_time_never_runs_back() {
    let cell = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../workcells/light-stripe/world.yaml");
    let Described::Arm(described) = read(&cell).unwrap() else { panic!("no PUMA") };
    let mut world = ArmWorld::new(*described);
    let mut time_ns = Arm::reading(&world).time_ns;
    let mut pass = |world: &mut ArmWorld, ms: u64| {
        let before_ns = Arm::reading(world).time_ns;
        time_ns = time_ns.max(before_ns) + ms * 1_000_000;
        ServedWorld::advance(world, time_ns);
        assert_eq!(Arm::reading(world).time_ns, time_ns);
    };
    pass(&mut world, 500);
    Camera::set_shutter(&mut world, Some(20_000_000)).unwrap();
    pass(&mut world, 500);
    assert_eq!(Camera::expose(&mut world).unwrap().waiting, 0, "none was taken at rest");
    let mut there = Arm::reading(&world).joints;
    there[0] += 0.02;
    world.begin(&there, 0.05).unwrap();
    let ends_ns = world.travel_ends_ns().unwrap();
    while Arm::reading(&world).time_ns < ends_ns {
        pass(&mut world, 7);
    }
    pass(&mut world, 500);
    let first = Camera::expose(&mut world).unwrap();
    assert!(first.waiting > 3 && first.time_ns < ends_ns, "{first:?}");
    let mut last = first.clone();
    for _ in 0..first.waiting {
        last = Camera::expose(&mut world).unwrap();
    }
    assert!(last.waiting == 0 && last.time_ns < ends_ns, "all of them were taken under way");
}
