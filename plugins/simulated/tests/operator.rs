//! What the operator's hands and instruments do in the world, and a controller that drives the motors themselves.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use common::{Served, only, world_path};
use plumb_simulated::client::WorldClient;
use plumb_simulated::protocol::{Instrument, Pace, Response, WorldCommand};
use plumb_simulated::world::Joint;
use plumb_simulated::world::file::{parse, read, seal};

fn measure(client: &mut WorldClient, with: Instrument) -> (f64, String) {
    match client
        .call(WorldCommand::Measure { with, at: None, turned: false, axis: None }, || false, |_| {})
        .unwrap()
    {
        Response::Measured { value, unit } => (value, unit),
        other => panic!("{other:?}"),
    }
}

/// Brings the hand over white to a height, as an operator with a gauge block does.
fn place_at_height(client: &mut WorldClient, height_mm: f64) {
    for _ in 0..40 {
        let truth = client.look().unwrap();
        let short = height_mm - truth.sensor_mm[2];
        let shoulder = truth.attitudes[1] + short / (177.8 * truth.attitudes[1].cos());
        client.read(WorldCommand::Place { joints: only(Joint::Shoulder, shoulder).into() }).unwrap();
    }
}

#[test]
fn the_trim_resistor_sets_the_height_at_which_the_sensor_fires() {
    let served = Served::start("world-worn.yaml", Pace::Fast);
    let mut client = served.connect();
    place_at_height(&mut client, 9.5);
    let mut turns = 0;
    assert_eq!(client.read(WorldCommand::Read {}).unwrap().inputs, 0);
    while client.read(WorldCommand::Trim { by: -0.005 }).unwrap().inputs == 0 {
        turns += 1;
        assert!(turns < 200);
    }
    // 9.5 mm over white 0.9: 0.9 * 1.9^2 * exp(2 * (1 - 1.9)) = 0.537, from 0.694 at 8 mm.
    assert!((25..=38).contains(&turns), "{turns}");
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let refused = served.connect().read(WorldCommand::Trim { by: 0.1 }).unwrap_err();
    assert_eq!(refused.to_string(), "this sensor has no trim resistor");
}

#[test]
fn level_and_ruler_read_what_is_there() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let mut client = served.connect();
    let mut joints = only(Joint::WristPitch, -88.5_f64.to_radians());
    joints[1] = Some(0.7);
    client.read(WorldCommand::Place { joints: joints.into() }).unwrap();
    let (tilt, unit) = measure(&mut client, Instrument::Level);
    assert!((tilt - 1.5).abs() < 1e-8 && unit == "deg", "{tilt} {unit}");
    let (height, unit) = measure(&mut client, Instrument::Ruler);
    assert!((height - client.look().unwrap().sensor_mm[2]).abs() < 1e-12 && unit == "mm");
}

#[test]
fn a_coarse_instrument_reads_in_divisions_with_its_error() {
    let text = std::fs::read_to_string(world_path("world-ideal.yaml")).unwrap()
        + "instruments:\n  ruler: {error_mm: 0.4, division_mm: 0.5}\n";
    let mut world = plumb_simulated::world::World::new(parse("world.yaml", &text).unwrap());
    let truth = world.truth().pose.tool.z;
    let readings: Vec<f64> = (0..200).map(|_| world.read_ruler()).collect();
    let mean = readings.iter().sum::<f64>() / 200.0;
    assert!(readings.iter().all(|reading| (reading * 2.0).fract() == 0.0));
    assert!((mean - truth).abs() < 0.12, "{mean} {truth}");
    assert!(readings.iter().any(|reading| (reading - truth).abs() > 0.5));
}

#[test]
fn a_controller_steps_the_motors_themselves() {
    let served = Served::start("world-backlash.yaml", Pace::Fast);
    let mut client = served.connect();
    let before = client.read(WorldCommand::Read {}).unwrap();
    let half_steps = [0.0, 100.0, -40.0, 0.0, 0.0, -40.0];
    let after = client.read(WorldCommand::Step { half_steps: half_steps.into(), rate: 200.0 }).unwrap();
    let issued: Vec<f64> = (0..6).map(|motor| after.half_steps[motor] - before.half_steps[motor]).collect();
    assert_eq!(issued, half_steps);
    assert_eq!(after.time_ns - before.time_ns, 500_000_000, "100 half-steps at 200 a second");
    assert!((after.joints[5] - before.joints[5]).abs() < 1e-12, "the gripper's motor went with the elbow's");
    let refused = client.read(WorldCommand::Step { half_steps: half_steps.into(), rate: 0.0 }).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "a motor makes at most 100000 half-steps in one motion, and 1 to 100000 in a second"
    );
}

#[test]
fn a_closing_gripper_feels_what_it_holds() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let mut client = served.connect();
    let refused = client.read(WorldCommand::Hold { width_mm: 30.0 }).unwrap_err();
    assert_eq!(refused.to_string(), "the fingers are not so far open; open them first");
    client.read(WorldCommand::Hold { width_mm: 12.7 }).unwrap();
    let mut reading = client.read(WorldCommand::Read {}).unwrap();
    while !reading.grip {
        assert!(reading.joints[5] > 5.0, "nothing was felt");
        reading = client
            .read(WorldCommand::Step { half_steps: [0.0, 0.0, 0.0, 0.0, 0.0, -1.0].into(), rate: 40.0 })
            .unwrap();
    }
    assert!((reading.joints[5] - 12.7).abs() < 0.5, "{}", reading.joints[5]);
    let close = WorldCommand::Move { joints: only(Joint::Gripper, 0.0).into(), relative: false, speed: 1.0 };
    client.read(close).unwrap();
    let truth = client.look().unwrap();
    assert!((truth.attitudes[5] - 12.7).abs() < 1e-9);
    assert_eq!(truth.lost_half_steps[5], 0.0, "a grip below eight pounds stalls no motor");
}

#[test]
fn a_sealed_world_works_and_keeps_its_faults_to_itself() {
    let plain = std::fs::read_to_string(world_path("world-worn.yaml")).unwrap();
    let sealed = seal(&plain);
    assert!(!sealed.contains("backlash") && !sealed.contains("zero_error"));
    assert_eq!(sealed.lines().nth(1), Some("world: sealed"), "distinguished from other files by its key");
    let world = parse("sealed.world", &sealed).unwrap();
    assert_eq!(world.sealed_text.as_deref(), Some(plain.as_str()));
    let open = read(&world_path("world-worn.yaml")).unwrap();
    assert_eq!((world.arm, world.scene), (open.arm, open.scene));

    let cut: String = sealed.chars().take(sealed.len() - 700).collect();
    let (heading, digits) = sealed.split_once('|').unwrap();
    let edited = |from: char, to: &str| format!("{heading}|{}", digits.replace(from, to));
    for broken in [cut, edited('a', "b"), edited('0', "x")] {
        let error = parse("sealed.world", &broken).unwrap_err();
        assert_eq!(error.to_string(), "sealed.world: the sealed world does not open: it was edited or cut");
    }
}

#[test]
fn what_is_true_in_a_sealed_world_is_said_once_it_is_revealed() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("sealed.world");
    plumb_simulated::world::file::write_sealed(&world_path("world-backlash.yaml"), &file).unwrap();
    let served = Served::start_file(&file, Pace::Fast);
    let mut client = served.connect();
    let refused = client.look().unwrap_err();
    assert_eq!(
        refused.to_string(),
        "this world is sealed: what is true in it stays hidden until it is revealed"
    );
    let Response::Revealed { text } = client.call(WorldCommand::Reveal {}, || false, |_| {}).unwrap() else {
        panic!("not revealed");
    };
    assert!(text.contains("backlash: {waist_deg: 0.4"));
    client.look().unwrap();
}

#[test]
fn a_gauge_block_and_the_trim_resistor_set_the_sensor_to_a_height() {
    let served = Served::start("world-worn.yaml", Pace::Fast);
    let mut client = served.connect();
    client.read(WorldCommand::RestOnGauge { height_mm: 9.5 }).unwrap();
    let height = client.look().unwrap().sensor_mm[2];
    // As near as half-steps of the shoulder come: 0.16 mm each.
    assert!((height - 9.5).abs() < 0.1, "{height}");
    assert_eq!(client.read(WorldCommand::Read {}).unwrap().inputs, 0);
    assert_eq!(client.read(WorldCommand::TrimToFire {}).unwrap().inputs, 1, "it just fires");
    client.read(WorldCommand::RestOnGauge { height_mm: 14.0 }).unwrap();
    assert_eq!(client.read(WorldCommand::Read {}).unwrap().inputs, 0, "and lets go higher up");
    let refused = client.read(WorldCommand::RestOnGauge { height_mm: 900.0 }).unwrap_err();
    assert_eq!(refused.to_string(), "the shoulder cannot bring the hand to that height");
}

#[test]
fn the_hand_is_placed_over_a_point_as_well_as_the_eye_can_see() {
    let point = WorldCommand::PlaceHand { x_mm: 127.0, y_mm: 10.0, z_mm: 5.0 };
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let mut client = served.connect();
    client.read(point.clone()).unwrap();
    let there = client.look().unwrap().sensor_mm;
    let off = [there[0] - 127.0, there[1] - 10.0, there[2] - 5.0];
    assert!(off.iter().all(|part| part.abs() < 1e-6), "{off:?}");
    let far = client.read(WorldCommand::PlaceHand { x_mm: 700.0, y_mm: 0.0, z_mm: 5.0 }).unwrap_err();
    assert_eq!(far.to_string(), "the arm does not reach that point");

    let text = std::fs::read_to_string(world_path("world-ideal.yaml")).unwrap();
    let file = served.directory().join("blurred.yaml");
    std::fs::write(&file, format!("{text}instruments: {{eye: {{error_mm: 0.5}}}}\n")).unwrap();
    let served = Served::start_file(&file, Pace::Fast);
    let mut client = served.connect();
    let mut seen = Vec::new();
    for _ in 0..30 {
        client.read(point.clone()).unwrap();
        let there = client.look().unwrap().sensor_mm;
        seen.push((there[0] - 127.0, there[1] - 10.0, there[2] - 5.0));
    }
    assert!(seen.iter().all(|off| off.2.abs() < 1e-6 && off.0.abs() < 2.5 && off.1.abs() < 2.5), "{seen:?}");
    let across = (seen.iter().map(|off| off.1 * off.1).sum::<f64>() / 30.0).sqrt();
    assert!((0.3..0.8).contains(&across), "{across}");
}

#[test]
fn a_world_that_begins_again_is_as_it_was_and_its_clock_runs_on() {
    let served = Served::start("world-worn.yaml", Pace::Fast);
    let mut client = served.connect();
    let lowered = |client: &mut WorldClient| {
        client.read(WorldCommand::RestOnGauge { height_mm: 8.0 }).unwrap();
        client.read(WorldCommand::Wait { ms: 400 }).unwrap();
        let truth = client.look().unwrap();
        (truth.attitudes, truth.counted, truth.lost_half_steps)
    };
    client.read(WorldCommand::Again { seed: 5 }).unwrap();
    let first = lowered(&mut client);
    client.read(WorldCommand::Trim { by: 0.2 }).unwrap();
    let before = client.read(WorldCommand::Read {}).unwrap().time_ns;
    let mut changes = 0;
    client.call(WorldCommand::Again { seed: 5 }, || false, |_| changes += 1).unwrap();
    let begun = client.read(WorldCommand::Read {}).unwrap();
    assert!(begun.time_ns >= before && begun.inputs == 0, "the sensor is high over the table again");
    assert_eq!(lowered(&mut client), first, "the same seed, the same world");
    client.read(WorldCommand::Again { seed: 6 }).unwrap();
    assert_eq!(client.read(WorldCommand::Read {}).unwrap().inputs, 0);
}
