//! The world as its clients meet it over its socket.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod common;

use std::cell::Cell;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::time::Duration;

use common::{Served, only, until, world_path};
use nix::time::{ClockId, clock_gettime};
use plumb_plugin::cell_clock::ClockReader;
use plumb_simulated::client::{ClientError, WorldClient};
use plumb_simulated::protocol::{Pace, PendantKey, Reading, Response, WorldCommand};
use plumb_simulated::serve::{ServeOptions, clock_file, serve};
use plumb_simulated::world::Joint;

fn turn(joint: Joint, by_deg: f64) -> WorldCommand {
    WorldCommand::Move { joints: only(joint, by_deg.to_radians()).into(), relative: true, speed: 1.0 }
}

fn reading(response: Response) -> Reading {
    match response {
        Response::Reading(reading) => reading,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_fast_world_moves_at_once_and_reports_every_edge() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let mut client = served.connect();
    let mut changes = Vec::new();
    let end = client.call(
        turn(Joint::Shoulder, -10.0),
        || false,
        |response| {
            if let Response::Change(change) = response {
                changes.push(*change);
            }
        },
    );
    let end = reading(end.unwrap());
    assert!(!end.moving && !end.stopped);
    assert_eq!(changes.len(), 1);
    assert_eq!(changes[0].levels, 1);
    assert!(changes[0].time_ns < end.time_ns);
    assert_eq!(end.inputs, 1);
}

#[test]
fn a_stop_in_mid_move_leaves_the_arm_where_it_was() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let mut client = served.connect();
    let before = client.read(WorldCommand::Read {}).unwrap();
    let on_the_way = Cell::new(0);
    let end = client.call(
        turn(Joint::Waist, 70.0),
        || on_the_way.get() > 3,
        |response| {
            if let Response::Joints(_) = response {
                on_the_way.set(on_the_way.get() + 1);
            }
        },
    );
    let end = reading(end.unwrap());
    assert!(end.stopped && !end.moving);
    let turned = (end.joints[0] - before.joints[0]).to_degrees();
    assert!(turned > 0.5 && turned < 60.0, "{turned}");
    let later = client.read(WorldCommand::Wait { ms: 50 }).unwrap();
    assert_eq!(later.joints, end.joints);
    assert!(!later.stopped);
}

#[test]
fn a_client_that_goes_in_mid_move_leaves_the_arm_at_rest() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let mut watcher = served.connect();
    let mut stream = UnixStream::connect(&served.socket).unwrap();
    stream.write_all(b"{\"protocol\":1,\"client\":\"leaver\"}\n").unwrap();
    stream
        .write_all(
            b"{\"id\":1,\"do\":{\"move\":{\"joints\":[1.0,null,null,null,null,null],\"relative\":true}}}\n",
        )
        .unwrap();
    until("the move", || watcher.read(WorldCommand::Read {}).unwrap().moving);
    drop(stream);
    until("the arm's rest", || !watcher.read(WorldCommand::Read {}).unwrap().moving);
    let halted = watcher.read(WorldCommand::Read {}).unwrap();
    let home = watcher.welcome().joints[0].home;
    assert!(halted.joints[0] - home < 0.9, "it stopped short of where it was sent");
    assert_eq!(watcher.read(WorldCommand::Wait { ms: 30 }).unwrap().joints, halted.joints);
}

#[test]
fn another_client_can_stop_the_arm_and_none_can_move_it_meanwhile() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let mut mover = served.connect();
    let mut other = served.connect();
    let moving = std::thread::spawn(move || mover.call(turn(Joint::Waist, 70.0), || false, |_| {}));
    until("the move", || other.read(WorldCommand::Read {}).unwrap().moving);
    let refused = other.read(turn(Joint::Elbow, 5.0)).unwrap_err();
    assert_eq!(refused.to_string(), "the arm is moving already; wait for it or stop it first");
    other.read(WorldCommand::Stop {}).unwrap();
    assert!(reading(moving.join().unwrap().unwrap()).stopped);
}

#[test]
fn the_pendants_stop_key_stops_the_arm_and_gives_it_back() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let mut driver = served.connect();
    let mut operator = served.connect();
    assert!(driver.read(WorldCommand::Pendant { on: true }).unwrap().pendant);
    let jogging = std::thread::spawn(move || {
        let end = operator.call(turn(Joint::Waist, 70.0), || false, |_| {});
        (operator, end)
    });
    until("the move", || driver.read(WorldCommand::Read {}).unwrap().moving);
    let pressed = driver.read(WorldCommand::Key { key: PendantKey::Stop }).unwrap();
    assert_eq!((pressed.pendant, pressed.key, pressed.moving), (false, 7, false));
    let (_, end) = jogging.join().unwrap();
    assert!(reading(end.unwrap()).stopped);
}

#[test]
fn an_operator_places_the_arm_by_what_it_looks_like_whatever_play_it_has() {
    for file in ["world-ideal.yaml", "world-backlash.yaml"] {
        let served = Served::start(file, Pace::Fast);
        let mut client = served.connect();
        let mut joints = only(Joint::Elbow, -75_f64.to_radians());
        joints[0] = Some(0.1);
        client.read(WorldCommand::Place { joints: joints.into() }).unwrap();
        let truth = client.look().unwrap();
        let half_step = (360.0_f64 / 4158.0).to_radians();
        assert!((truth.attitudes[2].to_degrees() + 75.0).to_radians().abs() < half_step, "{file}");
        assert!((truth.attitudes[0] - 0.1).abs() < half_step, "{file}");
    }
}

#[test]
fn an_operator_cannot_place_the_arm_in_the_table() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let refused =
        served.connect().read(WorldCommand::Place { joints: only(Joint::Shoulder, 0.2).into() }).unwrap_err();
    assert_eq!(refused.to_string(), "the operator cannot bring the arm there; it touches something solid");
}

#[test]
fn a_second_world_at_one_address_is_refused() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let error = serve(&ServeOptions {
        file: world_path("world-ideal.yaml"),
        socket: served.socket.clone(),
        seed: None,
        pace: Pace::Fast,
        idle: Duration::from_secs(600),
    })
    .unwrap_err();
    let expected = format!(
        "a world is already being served at {}: end it first, or choose another --socket",
        served.socket.display()
    );
    assert_eq!(error.to_string(), expected);
    served.connect().read(WorldCommand::Read {}).unwrap();
}

#[test]
fn a_socket_left_by_a_dead_world_is_taken_over() {
    let directory = tempfile::tempdir().unwrap();
    let socket = directory.path().join("world");
    drop(UnixListener::bind(&socket).unwrap());
    assert!(socket.exists());
    let options = ServeOptions {
        file: world_path("world-ideal.yaml"),
        socket: socket.clone(),
        seed: None,
        pace: Pace::Fast,
        idle: Duration::from_secs(600),
    };
    let thread = std::thread::spawn(move || serve(&options));
    let mut client = None;
    until("the new world", || {
        client = WorldClient::connect(&socket, "test").ok();
        client.is_some()
    });
    client.unwrap().call(WorldCommand::Shutdown {}, || false, |_| {}).unwrap();
    thread.join().unwrap().unwrap();
}

#[test]
fn a_world_asked_to_end_removes_its_socket_and_leaves_nothing() {
    let mut served = Served::start("world-ideal.yaml", Pace::Real);
    let mut bystander = served.connect();
    served.connect().call(WorldCommand::Shutdown {}, || false, |_| {}).unwrap();
    served.ended().unwrap();
    assert_eq!(std::fs::read_dir(served.directory()).unwrap().count(), 0);
    assert!(bystander.read(WorldCommand::Read {}).is_err());
}

#[test]
fn a_world_nobody_uses_ends_by_itself_but_not_while_somebody_is_there() {
    let mut served = Served::start_with("world-ideal.yaml", Pace::Fast, Duration::from_millis(200));
    let client = served.connect();
    std::thread::sleep(Duration::from_millis(400));
    assert!(served.socket.exists());
    drop(client);
    served.ended().unwrap();
    assert!(!served.socket.exists());
}

#[test]
fn an_address_that_cannot_be_is_explained() {
    let error = serve(&ServeOptions {
        file: world_path("world-ideal.yaml"),
        socket: "/nowhere/at/all".into(),
        seed: None,
        pace: Pace::Fast,
        idle: Duration::from_secs(1),
    })
    .unwrap_err();
    assert_eq!(
        error.to_string(),
        "cannot listen at /nowhere/at/all: No such file or directory (os error 2) (a socket's path has at most 103 bytes, \
         and its directory must exist and be writable)"
    );
}

#[test]
fn nobody_at_the_address_is_said_so() {
    let error = WorldClient::connect("/nowhere/at/all".as_ref(), "test").unwrap_err();
    assert!(matches!(error, ClientError::Unreachable { .. }));
    assert_eq!(
        error.to_string(),
        "no world listens at /nowhere/at/all: No such file or directory (os error 2)"
    );
}

/// Says lines to the world and returns its answers to each.
fn converse(served: &Served, lines: &[&str]) -> Vec<String> {
    let mut stream = UnixStream::connect(&served.socket).unwrap();
    let mut answers = BufReader::new(stream.try_clone().unwrap());
    lines
        .iter()
        .map(|line| {
            // A world that has hung up takes no more lines and answers none.
            let _ = stream.write_all(format!("{line}\n").as_bytes());
            let mut answer = String::new();
            let _ = answers.read_line(&mut answer);
            answer.trim_end().to_owned()
        })
        .collect()
}

/// The cell's time now, as the hosts of its devices read it from the world's file.
fn cell_ns(served: &Served) -> u64 {
    let monotonic_ns = Duration::from(clock_gettime(ClockId::CLOCK_MONOTONIC).unwrap()).as_nanos() as u64;
    ClockReader::open(&clock_file(&served.socket)).unwrap().read().unwrap().at(monotonic_ns)
}

/// In fast pace the cell's clock is stopped until something moves, and jumps over the motion; in real pace it goes on from there with the wall's.
#[test]
fn the_world_keeps_the_cells_clock_at_either_pace() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let mut client = served.connect();
    let before = client.read(WorldCommand::Read {}).unwrap().time_ns;
    assert_eq!(cell_ns(&served), before);
    let after = client.read(turn(Joint::Waist, 20.0)).unwrap().time_ns;
    assert!(after > before + 100_000_000, "{} ns", after - before);
    assert_eq!(cell_ns(&served), after);
    client.read(WorldCommand::Wait { ms: 60_000 }).unwrap();
    assert_eq!(cell_ns(&served), after + 60_000_000_000);
    client.read(WorldCommand::Pace { pace: Pace::Real }).unwrap();
    let (first, reported) = (cell_ns(&served), client.read(WorldCommand::Read {}).unwrap().time_ns);
    assert!(first >= after + 60_000_000_000 && reported >= first && cell_ns(&served) >= reported);
    // It never runs back, whatever the pace is changed to.
    client.read(WorldCommand::Pace { pace: Pace::Fast }).unwrap();
    assert!(cell_ns(&served) >= reported);
}

#[test]
fn a_world_in_real_pace_dates_by_the_clock_that_kernels_date_with() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let monotonic_ns = || Duration::from(clock_gettime(ClockId::CLOCK_MONOTONIC).unwrap()).as_nanos() as u64;
    let before = monotonic_ns();
    let reported = served.connect().read(WorldCommand::Read {}).unwrap().time_ns;
    assert!(before <= reported && reported <= monotonic_ns(), "{before} {reported}");
}

#[test]
fn what_is_not_the_protocol_is_answered_and_does_no_harm() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let answers = converse(
        &served,
        &[
            r#"{"protocol":1,"client":"a person"}"#,
            "hello?",
            r#"{"id":5,"do":{"fly":{}}}"#,
            r#"{"id":6,"do":{"move":{"joints":[null,null]}}}"#,
            r#"{"id":7,"do":{"move":{"joints":[0.1,null,null,null,null,null],"speed":2}}}"#,
            r#"{"id":8,"do":{"read":{}}}"#,
        ],
    );
    let now_ns = cell_ns(&served);
    let last =
        format!(r#"{{"id":8,"response":{{"reading":{{"time_ns":{now_ns},"moving":false,"stopped":false,"#);
    let expected = [
        r#"{"protocol":1,"world":"TeachMover over a T target, ideal","#,
        r#"{"id":0,"response":{"refused":{"why":"expected value at line 1 column 1"}}}"#,
        r#"{"id":0,"response":{"refused":{"why":"unknown variant `fly`, expected one of `read`, `move`, "#,
        r#"{"id":6,"response":{"refused":{"why":"2 joint values for an arm of 6 joints"}}}"#,
        r#"{"id":7,"response":{"refused":{"why":"the speed must be a fraction of the greatest, 0.001 to 1"}}}"#,
        last.as_str(),
    ];
    for (answer, expected) in answers.iter().zip(expected) {
        assert!(answer.starts_with(expected), "{answer}\nexpected {expected}");
    }
}

#[test]
fn no_call_can_keep_the_world_busy_for_ever() {
    let served = Served::start("world-worn.yaml", Pace::Fast);
    let mut client = served.connect();
    let far = WorldCommand::Move { joints: only(Joint::Waist, 1e9).into(), relative: false, speed: 1.0 };
    assert!(client.read(far).unwrap_err().to_string().contains("further than any joint goes"));
    let long = client.read(WorldCommand::Wait { ms: u64::MAX }).unwrap_err();
    assert_eq!(long.to_string(), "a wait lasts at most 3600000 ms; wait again after it");
    client.read(WorldCommand::Wait { ms: 600_000 }).unwrap();
    let slow = WorldCommand::Move { joints: only(Joint::Waist, 0.2).into(), relative: true, speed: 0.001 };
    client.read(slow).unwrap();
}

#[test]
fn a_client_of_another_version_gets_both_versions() {
    let served = Served::start("world-ideal.yaml", Pace::Fast);
    let answers =
        converse(&served, &[r#"{"protocol":9,"client":"old driver"}"#, r#"{"id":1,"do":{"read":{}}}"#]);
    assert_eq!(
        answers,
        [
            r#"{"id":0,"response":{"refused":{"why":"`old driver` speaks version 9 of the world's protocol, this world version 1: build both from the same source"}}}"#,
            ""
        ]
    );
}

#[test]
fn the_pace_can_be_changed_while_the_arm_moves() {
    let served = Served::start("world-ideal.yaml", Pace::Real);
    let mut mover = served.connect();
    let mut other = served.connect();
    let moving = std::thread::spawn(move || mover.call(turn(Joint::Waist, 60.0), || false, |_| {}));
    until("the move", || other.read(WorldCommand::Read {}).unwrap().moving);
    assert!(!other.read(WorldCommand::Pace { pace: Pace::Fast }).unwrap().moving);
    let end = reading(moving.join().unwrap().unwrap());
    assert!(!end.stopped);
    let home = other.welcome().joints[0].home;
    assert!((end.joints[0] - home - 60_f64.to_radians()).abs() < 1e-12);
}
