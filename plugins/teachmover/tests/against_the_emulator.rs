//! The driver against the emulated controller: two readings of the same facts, which share no code.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test that cannot go on fails")]

use std::time::{Duration, Instant};

use plumb_plugin::recording::RecordingHost;
use plumb_plugin::{DigitalInputs, JointState, JointVector, Motion, PluginError, Robot, Value};
use plumb_simulated::emulate::teachmover::{BareMotors, Emulator, Event, LineOptions};
use plumb_teachmover::TeachMover;
use plumb_teachmover::controller::{Controller, OnlyThePendantStopsIt};
use plumb_teachmover::drive::{HalfSteps, Joint, RegisterZero};
use plumb_teachmover::protocol::{Command, ProgramLine, Status};
use plumb_teachmover::reply_line::ReplyLine;
use plumb_teachmover::speed_code::SpeedCode;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};
use serde_json::json;

const PATIENCE: Duration = Duration::from_secs(20);

/// The fingers' opening at the start, mm.
const OPENING: f64 = 40.0;

struct Cell {
    arm: TeachMover,
    emulator: Emulator,
    recording: RecordingHost,
}

impl Cell {
    fn with(options: LineOptions, more: Value) -> Self {
        let emulator = Emulator::start(options, Box::new(BareMotors::new(true, OPENING))).unwrap();
        let mut config = json!({
            "port": emulator.status().port.unwrap(),
            "registers_zero": {"gripper_mm": OPENING},
        });
        for (key, value) in more.as_object().unwrap() {
            config[key] = value.clone();
        }
        let recording = RecordingHost::new();
        let arm = TeachMover::create(&config, recording.host()).unwrap();
        Self { arm, emulator, recording }
    }

    /// A cell whose moves are cut into long pieces, so that a test makes many of them.
    fn quick() -> Self {
        Self::with(LineOptions::default(), json!({"stop_within_ms": 1000}))
    }

    /// The registers of the joints that the driver reports.
    fn reported(&mut self) -> HalfSteps {
        let state = self.arm.read_joints().unwrap();
        registers_of(&state)
    }

    fn counted(&self) -> HalfSteps {
        HalfSteps(self.emulator.status().registers)
    }
}

fn registers_of(state: &JointState) -> HalfSteps {
    let zero = RegisterZero::at([0.0, 0.0, 0.0, 0.0, 0.0, OPENING]);
    let joints: [f64; 6] = state.joints.as_slice().try_into().unwrap();
    zero.registers(HalfSteps::default(), &joints, |_| true)
}

/// Somewhere a move may lead: within the ranges of every joint, whatever the others do.
fn somewhere() -> impl Strategy<Value = [f64; 6]> {
    (-80.0..80.0_f64, 0.0..60.0_f64, -80.0..-5.0_f64, -90.0..-60.0_f64, -90.0..90.0_f64, 5.0..70.0_f64)
        .prop_map(|(waist, shoulder, elbow, pitch, roll, opening)| {
            let [waist, shoulder, elbow, pitch, roll] =
                [waist, shoulder, elbow, pitch, roll].map(f64::to_radians);
            [waist, shoulder, elbow, pitch, roll, opening]
        })
}

fn motion(target: [f64; 6], mask: u32, speed: f64) -> Motion {
    Motion::absolute(JointVector::from_slice(&target).unwrap(), speed).only(mask)
}

/// A runner that draws the same cases every time.
fn runner(cases: u32) -> TestRunner {
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    TestRunner::new_with_rng(
        config,
        proptest::test_runner::TestRng::deterministic_rng(proptest::test_runner::RngAlgorithm::ChaCha),
    )
}

#[test]
fn after_any_moves_driver_and_controller_have_the_same_registers() {
    let moves = prop::collection::vec((somewhere(), 1..64_u32, 0.02..1.0_f64), 1..6);
    let cell = std::cell::RefCell::new(Cell::quick());
    runner(40)
        .run(&moves, |moves| {
            let mut cell = cell.borrow_mut();
            for (target, mask, speed) in moves {
                match cell.arm.move_joints(&motion(target, mask, speed)) {
                    Ok(state) => {
                        prop_assert_eq!(registers_of(&state), cell.counted());
                        for joint in Joint::ALL.into_iter().filter(|joint| mask & (1 << joint.index()) != 0) {
                            let miss = state.joints.as_slice()[joint.index()] - target[joint.index()];
                            prop_assert!(
                                miss.abs() * joint.half_steps_per_unit() <= 0.5 + 1e-6,
                                "{}",
                                joint.name()
                            );
                        }
                    }
                    // Some ways end beyond a range that depends on another joint: nothing has moved.
                    Err(PluginError::OutOfRange(_)) => {}
                    Err(error) => panic!("{error}"),
                }
                let reported = cell.reported();
                prop_assert_eq!(reported, cell.counted());
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn a_pendant_stop_anywhere_leaves_driver_and_controller_with_the_same_registers() {
    let stops = prop::collection::vec((somewhere(), 0..20_u32), 1..4);
    let cell = std::cell::RefCell::new(Cell::quick());
    runner(40)
        .run(&stops, |stops| {
            let mut cell = cell.borrow_mut();
            for (target, half_steps) in stops {
                cell.arm.activate().unwrap();
                cell.emulator.inject(Event::StopAfter(half_steps));
                match cell.arm.move_joints(&motion(target, 0b111, 1.0)) {
                    Err(PluginError::Stopped(text)) => {
                        prop_assert!(
                            text.starts_with("the STOP key on the pendant ended the move; the arm is at")
                        );
                    }
                    Err(PluginError::OutOfRange(_)) => {}
                    other => panic!("{other:?}"),
                }
                let reported = cell.reported();
                prop_assert_eq!(reported, cell.counted());
            }
            Ok(())
        })
        .unwrap();
}

/// One command of the ten.
#[derive(Debug, Clone)]
enum Spoken {
    Step([i32; 6], u8),
    Read,
    Close,
    Reset,
    Program(Vec<([i32; 6], u8)>),
    Rename(u8),
    Delay(u8),
    Hand(i32),
}

fn spoken() -> impl Strategy<Value = Spoken> {
    let counts = || prop::array::uniform6(-300..300_i32);
    prop_oneof![
        4 => (counts(), 0..=245_u8).prop_map(|(counts, speed)| Spoken::Step(counts, speed)),
        2 => Just(Spoken::Read),
        1 => Just(Spoken::Close),
        1 => Just(Spoken::Reset),
        1 => prop::collection::vec((counts(), 0..=245_u8), 1..4).prop_map(Spoken::Program),
        1 => prop::sample::select(vec![b'@', b'#', b'!', b'%']).prop_map(Spoken::Rename),
        1 => (0..3_u8).prop_map(Spoken::Delay),
        1 => (-200..200_i32).prop_map(Spoken::Hand),
    ]
}

fn carry_out(controller: &mut Controller, emulator: &mut Emulator, spoken: &Spoken) {
    let confirmed = OnlyThePendantStopsIt::confirmed_by_the_operator();
    match spoken {
        Spoken::Step(counts, speed) => {
            controller.step(SpeedCode::new(*speed).unwrap(), HalfSteps(*counts), None).unwrap();
        }
        Spoken::Read => {
            controller.read().unwrap();
        }
        Spoken::Close => controller.close_gripper(confirmed).unwrap(),
        Spoken::Reset => controller.reset().unwrap(),
        Spoken::Program(points) => {
            let lines = points.iter().enumerate().map(|(line, (registers, speed))| {
                ProgramLine::point(line as u8, SpeedCode::new(*speed).unwrap(), HalfSteps(*registers))
                    .unwrap()
            });
            let lines: Vec<ProgramLine> = lines.collect();
            controller.write_program(&lines).unwrap();
            assert_eq!(controller.dump_program().unwrap()[..lines.len()], lines[..]);
            controller.begin_program(confirmed).unwrap();
            assert_eq!(await_reply(controller, &Command::RunProgram), Status::Done);
        }
        Spoken::Rename(character) => controller.change_recognition(*character).unwrap(),
        Spoken::Delay(amount) => controller.delay_replies(*amount).unwrap(),
        Spoken::Hand(half_steps) => {
            controller.begin_hand_control(confirmed).unwrap();
            let deadline = Instant::now() + PATIENCE;
            while !emulator.status().busy && Instant::now() < deadline {
                std::thread::sleep(Duration::from_millis(1));
            }
            emulator.inject(format!("drive elbow {half_steps}").parse().unwrap());
            emulator.inject("key stop".parse().unwrap());
            await_reply(controller, &Command::HandControl);
        }
    }
}

fn await_reply(controller: &mut Controller, command: &Command) -> Status {
    let deadline = Instant::now() + PATIENCE;
    loop {
        if let Some(status) = controller.reply_at_hand(command).unwrap() {
            return status;
        }
        assert!(Instant::now() < deadline, "no reply to {}", command.name());
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn any_sequence_of_the_ten_commands_is_understood_alike() {
    runner(8)
        .run(&prop::collection::vec(spoken(), 1..12), |commands| {
            let mut emulator =
                Emulator::start(LineOptions::default(), Box::new(BareMotors::new(true, OPENING))).unwrap();
            let port = emulator.status().port.unwrap().display().to_string();
            let line = ReplyLine::open(&port, 9600).unwrap();
            let mut controller = Controller::new(line, b'@', Duration::from_secs(5));
            for command in &commands {
                carry_out(&mut controller, &mut emulator, command);
                let state = controller.read().unwrap();
                prop_assert_eq!(
                    state.registers,
                    HalfSteps(emulator.status().registers),
                    "after {:?}",
                    command
                );
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn on_a_line_that_damages_bytes_no_move_follows_an_error_and_the_registers_come_true_again() {
    for seed in 0..3 {
        let faults = LineOptions { seed, ..LineOptions::default() };
        let mut cell = Cell::with(faults, json!({"reply_within_ms": 150}));
        cell.emulator.inject(Event::DamageAtRandom(0.01));
        let mut failures = 0;
        for round in 0..8 {
            let target =
                [f64::from(round % 5) * 0.05, 0.1 + f64::from(round % 3) * 0.02, -0.5, -1.2, 0.0, 30.0];
            let moved = cell.arm.move_joints(&motion(target, 0b1111, 1.0));
            let Err(error) = moved else { continue };
            failures += 1;
            let counted = cell.counted();
            let again = cell.arm.move_joints(&motion(target, 0b1111, 1.0));
            assert!(matches!(again, Err(PluginError::NotReady(_))), "after {error}: {again:?}");
            assert_eq!(cell.counted(), counted, "seed {seed}: moved after {error}");
            cell.emulator.inject(Event::DamageAtRandom(0.0));
            cell.arm.activate().unwrap();
            let reported = cell.reported();
            assert_eq!(reported, cell.counted(), "seed {seed}");
            cell.emulator.inject(Event::DamageAtRandom(0.01));
        }
        assert!(failures > 0, "seed {seed} damaged nothing that mattered");
    }
}

#[test]
fn an_input_that_changes_while_the_arm_is_at_rest_changes_where_it_is() {
    let mut cell = Cell::quick();
    cell.emulator.inject(Event::Line { bit: 2, level: true });
    cell.arm.read_joints().unwrap();
    let at_rest = cell.recording.emitted::<DigitalInputs>("inputs");
    assert_eq!(at_rest.len(), 2);
    assert_eq!((at_rest[0].levels, at_rest[0].changed), (0b100, 0b100));
    assert_eq!(at_rest[0].joints_half_width, JointVector::zeros(6));
    assert_eq!((at_rest[1].levels, at_rest[1].changed), (0b100, 0));
}

#[test]
fn the_gripper_closes_on_what_lies_between_its_fingers() {
    let mut cell = Cell::with(LineOptions::default(), json!({"grip_switch": {"bit": 7}}));
    cell.emulator.inject(Event::Between(25.0));
    let closed = cell.arm.move_joints(&motion([0.0; 6], 0b10_0000, 0.5)).unwrap();
    let opening = closed.joints.as_slice()[5];
    // It stops within one short piece of the contact: 8 half-steps are 0.55 mm.
    assert!((24.4..=25.0).contains(&opening), "{opening}");
    assert_eq!(registers_of(&closed), cell.counted());
}

#[test]
fn unplugging_ends_in_an_error_that_names_the_cable() {
    let mut cell = Cell::quick();
    cell.emulator.inject(Event::Unplug);
    let deadline = Instant::now() + PATIENCE;
    while cell.emulator.status().port.is_some() && Instant::now() < deadline {
        std::thread::sleep(Duration::from_millis(1));
    }
    let error = cell.arm.read_joints().unwrap_err();
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    assert!(error.to_string().contains("the port is gone"), "{error}");
}

#[test]
fn by_dead_reckoning_driver_and_controller_have_the_same_counts_until_the_stop_key() {
    let mut emulator =
        Emulator::start(LineOptions::default(), Box::new(BareMotors::new(true, OPENING))).unwrap();
    emulator.inject(Event::Read(false));
    let mut config = json!({"port": emulator.status().port, "registers_zero": {"gripper_mm": OPENING}});
    let refused = TeachMover::create(&config, RecordingHost::new().host()).unwrap_err();
    assert!(refused.text().contains("`dead_reckoning: true` in the cell file"), "{refused}");
    config["dead_reckoning"] = json!(true);
    let recording = RecordingHost::new();
    let arm = TeachMover::create(&config, recording.host()).unwrap();
    let mut cell = Cell { arm, emulator, recording };
    assert!(cell.arm.describe().inputs.is_empty());
    for target in [[0.5, 0.6, -0.7, -1.4, 0.3, 20.0], [-0.4, 0.2, -0.3, -1.2, 0.0, 50.0]] {
        let state = cell.arm.move_joints(&motion(target, 0b11_1111, 1.0)).unwrap();
        assert_eq!(registers_of(&state), cell.counted());
    }
    cell.emulator.inject(Event::StopAfter(3));
    let error = cell.arm.move_joints(&motion([0.0; 6], 1, 1.0)).unwrap_err();
    assert!(error.text().contains("the STOP key on the pendant ended a move"), "{error}");
    assert!(cell.arm.read_joints().is_err(), "no pose in place of one that is not known");
}
