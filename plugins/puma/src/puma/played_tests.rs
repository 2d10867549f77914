//! The driver against a controller that is played: what an emulated one of good manners never answers.

use std::sync::{Arc, Mutex};

use plumb_plugin::recording::RecordingHost;
use serde_json::json;

use super::played::{CONTROL_C, DONE, Played, where_reply};
use super::*;

/// A motion of one joint to so many degrees, the others where they are.
fn to(joint: usize, degrees: f64) -> Motion {
    let mut target = JointVector::from_slice(&READY.map(f64::to_radians)).unwrap();
    target.set(joint, degrees.to_radians());
    Motion::absolute(target, 1.0)
}

fn driver(played: &Played) -> Result<(Puma, RecordingHost), PluginError> {
    let host = RecordingHost::new();
    let config = json!({"port": played.port, "typing": "careful", "reply_within_ms": 400});
    Puma::create(&config, host.host()).map(|arm| (arm, host))
}

/// How long the arm takes to be driven anywhere.
const TAKES: Duration = Duration::from_millis(80);

/// A controller whose arm goes where it is driven, and `off` beyond: degrees.
fn off_by(off: f64) -> Played {
    let mut joints = READY;
    Played::answering(move |line| {
        if let Some(driven) = line.strip_prefix("DO DRIVE ") {
            let numbers: Vec<f64> = driven.split(',').map(|number| number.parse().unwrap()).collect();
            joints[numbers[0] as usize - 1] += numbers[1] + off;
            std::thread::sleep(TAKES);
        }
        if line == "WHERE" { where_reply(&joints) } else { DONE.to_owned() }
    })
}

#[test]
fn an_arm_that_is_elsewhere_than_where_it_was_sent_has_not_arrived() {
    for off in [0.03, -0.03, 0.049] {
        let played = off_by(off);
        let (mut arm, _host) = driver(&played).unwrap();
        let state = arm.move_joints(&to(0, 10.0)).unwrap_or_else(|error| panic!("{off}: {error}"));
        assert!((state.joints.get(0).unwrap().to_degrees() - 10.0 - off).abs() < 1e-3);
    }
    for (off, actual) in [(0.06, "10.06"), (-0.06, "9.94")] {
        let played = off_by(off);
        let (mut arm, _host) = driver(&played).unwrap();
        let error = arm.move_joints(&to(0, 10.0)).unwrap_err();
        let expected =
            format!("waist was sent to 10.00 and is at {actual} degrees, although the controller reported");
        assert!(matches!(error, PluginError::Failed(_)) && error.text().starts_with(&expected), "{error:?}");
        let error = arm.move_joints(&to(0, 20.0)).unwrap_err();
        assert!(matches!(error, PluginError::NotReady(_)), "it is not moved again: {error:?}");
        assert!(error.text().contains("look where it is, then activate it again"), "{error}");
        arm.activate().unwrap();
        assert!(!matches!(arm.move_joints(&to(0, 20.0)), Err(PluginError::NotReady(_))));
    }
}

#[test]
fn one_joint_is_driven_by_its_way_at_the_speed_of_the_cell_file() {
    let played = off_by(0.0);
    let (mut arm, _host) = driver(&played).unwrap();
    played.take_typed();
    arm.move_joints(&to(1, -100.0)).unwrap();
    assert_eq!(played.take_typed(), ["WHERE", "DO DRIVE 2,-10,50", "WHERE"]);
}

#[test]
fn a_joint_that_is_stopped_on_its_way_has_not_arrived() {
    // The arm is driven by 10 degrees, and goes on until it is stopped, at half the way.
    let (drives, driven) = std::sync::mpsc::channel();
    let mut joints = READY;
    let played = Played::answering(move |line| {
        if line.starts_with("DO DRIVE") {
            joints[1] -= 5.0;
            drives.send(()).unwrap();
            return String::new();
        }
        if line == "WHERE" { where_reply(&joints) } else { DONE.to_owned() }
    });
    let (mut arm, host) = driver(&played).unwrap();
    played.take_typed();
    let stopped = std::thread::scope(|scope| {
        let host = &host;
        scope.spawn(move || {
            driven.recv().unwrap();
            host.set_stop(true);
        });
        arm.move_joints(&to(1, -100.0))
    });
    let error = stopped.unwrap_err();
    assert!(matches!(error, PluginError::Stopped(_)), "{error:?}");
    assert!(error.text().starts_with("stopped; the arm is at ") && error.text().contains("-95"), "{error}");
    let typed = played.take_typed();
    assert!(typed.iter().any(|line| line == CONTROL_C), "{typed:?}");
}

/// What creating the driver types, where a control C is answered with a `*` that stays alone, and ABORT and Y so.
fn aborted(answers: [&'static str; 2]) -> (Result<(), String>, Vec<String>) {
    let mut busy = true;
    let played = Played::answering(move |line| match line {
        CONTROL_C if busy => "\r\n* ".to_owned(),
        "ABORT" => {
            busy = !answers[0].ends_with(". ");
            answers[0].to_owned()
        }
        "Y" => {
            busy = !answers[1].ends_with(". ");
            answers[1].to_owned()
        }
        "WHERE" => where_reply(&READY),
        _ => DONE.to_owned(),
    });
    let created = driver(&played).map(drop).map_err(|error| error.text().to_owned());
    (created, played.take_typed())
}

#[test]
fn a_program_that_goes_on_is_aborted_and_the_question_answered_once() {
    let (created, typed) = aborted([DONE, ""]);
    assert_eq!(created, Ok(()));
    assert_eq!(typed[..3], [CONTROL_C, "ABORT", "WHERE"]);
    let (created, typed) = aborted(["\r\nAre you sure (Y/N)? ", DONE]);
    assert_eq!(created, Ok(()));
    assert_eq!(typed[..4], [CONTROL_C, "ABORT", "Y", "WHERE"]);
    let (created, typed) = aborted(["\r\nAre you sure (Y/N)? ", "\r\nReally (Y/N)? "]);
    let error = created.unwrap_err();
    assert!(
        error.contains("in `Y`: the answer `Really (Y/N)?` is not the one that belongs to it"),
        "{error}"
    );
    assert_eq!(typed.iter().filter(|line| *line == "Y").count(), 1, "it is not answered again: {typed:?}");
}

/// What reading the joints gives where the next answers to WHERE are these, and how often that was asked. Then the waist is at 30 degrees.
fn reading(next: &[&str]) -> (Result<f64, PluginError>, usize) {
    let mut moved = READY;
    moved[0] = 30.0;
    let answers: Arc<Mutex<Vec<String>>> = Arc::default();
    let coming = Arc::clone(&answers);
    let is_begun = Arc::new(Mutex::new(false));
    let begun = Arc::clone(&is_begun);
    let played = Played::answering(move |line| match line {
        "WHERE" if !*begun.lock().unwrap() => where_reply(&READY),
        "WHERE" => coming.lock().unwrap().pop().unwrap_or_else(|| where_reply(&moved)),
        _ => DONE.to_owned(),
    });
    let (mut arm, _host) = driver(&played).unwrap();
    played.take_typed();
    *is_begun.lock().unwrap() = true;
    answers.lock().unwrap().extend(next.iter().rev().map(|answer| (*answer).to_owned()));
    let read = arm.read_joints().map(|state| state.joints.get(0).unwrap().to_degrees());
    let asked = played.take_typed().iter().filter(|line| *line == "WHERE").count();
    (read, asked)
}

#[test]
fn a_pose_counts_when_it_was_read_twice_and_one_answer_may_be_damaged() {
    let garbage = "\r\n x7#?\r\n. ";
    let (read, asked) = reading(&[]);
    assert!((read.unwrap() - 30.0).abs() < 1e-9 && asked == 2, "{asked}");
    let (read, asked) = reading(&[garbage]);
    assert!((read.unwrap() - 30.0).abs() < 1e-9 && asked == 3, "{asked}");
    let (read, asked) = reading(&[garbage, garbage]);
    let error = read.unwrap_err();
    assert!(matches!(error, PluginError::Failed(_)) && error.text().contains("x7#?"), "{error:?}");
    assert_eq!(asked, 2, "a second damaged answer is not put up with");
    // One digit was turned into another on the line.
    let mut wrong = READY;
    wrong[0] = 80.0;
    let (read, asked) = reading(&[&where_reply(&wrong)]);
    assert!((read.unwrap() - 30.0).abs() < 1e-9 && asked == 3, "{asked}");
}

#[test]
fn an_error_of_the_controller_is_reported_at_once_and_not_asked_about_again() {
    let (read, asked) = reading(&["\r\n*Robot power off*\r\n. "]);
    assert!(matches!(read.unwrap_err(), PluginError::NotReady(_)));
    assert_eq!(asked, 1);
}

#[test]
fn an_arm_that_is_never_read_twice_at_one_position_is_not_moved() {
    let replies: Vec<String> = (0..5)
        .map(|step| {
            let mut pose = READY;
            pose[0] = f64::from(step);
            where_reply(&pose)
        })
        .collect();
    let replies: Vec<&str> = replies.iter().map(String::as_str).collect();
    let (read, asked) = reading(&replies);
    let error = read.unwrap_err();
    assert!(error.text().starts_with("5 readings of the joints and no two alike"), "{error}");
    assert_eq!(asked, 5);
}

#[test]
fn zeros_are_taken_over_only_near_the_ready_position() {
    let ready = JointVector::from_slice(&READY.map(f64::to_radians)).unwrap();
    for (reads, is_taken) in [(14.99, true), (-14.99, true), (15.01, false), (-15.01, false)] {
        let mut taken = false;
        let played = Played::answering(move |line| {
            taken |= line == "Y";
            let mut joints = READY;
            joints[0] = if taken { 0.0 } else { reads };
            match line {
                "WHERE" => where_reply(&joints),
                "EXECUTE POTCAL" => "\r\nAre you sure (Y/N)? ".to_owned(),
                _ => DONE.to_owned(),
            }
        });
        let (mut arm, _host) = driver(&played).unwrap();
        let result = arm.set_zero(&ready);
        assert_eq!(result.is_ok(), is_taken, "{reads}: {result:?}");
        let typed = played.take_typed();
        assert_eq!(typed.iter().any(|line| line == "EXECUTE POTCAL"), is_taken, "{typed:?}");
        if let Err(error) = result {
            assert!(
                error.text().starts_with(&format!("waist reads {reads:.1} degrees, far from 0")),
                "{error}"
            );
        }
    }
    let played = off_by(0.0);
    let (mut arm, _host) = driver(&played).unwrap();
    let mut elsewhere = ready;
    elsewhere.set(3, 0.02_f64.to_radians());
    let error = arm.set_zero(&elsewhere).unwrap_err();
    assert!(
        matches!(error, PluginError::Refused(_)) && error.text().starts_with("POTCAL knows one pose only")
    );
}

#[test]
fn a_question_nobody_knows_is_one_once_nothing_more_comes() {
    let config = |port: &str| json!({"port": port, "calibrate": true, "reply_within_ms": 200});
    let played = Played::answering(|line| match line {
        "CALIBRATE" => "\r\nIs the arm clear?".to_owned(),
        "WHERE" => where_reply(&READY),
        _ => DONE.to_owned(),
    });
    let mut arm = Puma::create(&config(&played.port), RecordingHost::new().host()).unwrap();
    played.take_typed();
    arm.activate().unwrap();
    let typed = played.take_typed();
    assert!(typed.windows(2).any(|lines| lines == ["CALIBRATE", "Y"]), "{typed:?}");
}

#[test]
fn where_the_time_went_is_summed_and_given_once() {
    let played = off_by(0.0);
    let (mut arm, host) = driver(&played).unwrap();
    arm.take_time_profile();
    arm.move_joints(&to(0, 10.0)).unwrap();
    arm.deactivate().unwrap();
    assert!(host.lines().iter().any(|(_, line)| line.starts_with("where the time went: 3 commands")));
    let profile = arm.take_time_profile();
    // WHERE, DO DRIVE 1,10,50 and WHERE, each with its carriage return.
    assert_eq!((profile.commands, profile.sent), (3, 6 + 17 + 6));
    assert!(profile.received > profile.sent, "every character came back, and the answers: {profile:?}");
    assert!(profile.total >= profile.line + profile.controller + profile.motion);
    // Beyond what the answer takes on a line of 9600 baud.
    assert!(profile.motion >= TAKES / 2, "{profile:?}");
    assert_eq!(arm.take_time_profile(), Profile::default());
    arm.deactivate().unwrap();
    assert_eq!(host.lines().iter().filter(|(_, line)| line.starts_with("where the time")).count(), 1);
}

#[test]
fn outputs_are_refused_and_none_is_no_output() {
    let played = off_by(0.0);
    let (mut arm, _host) = driver(&played).unwrap();
    assert_eq!(arm.write_outputs(0), Ok(()));
    let error = arm.write_outputs(0b10).unwrap_err();
    assert_eq!(error.text(), "output levels 0b10: this driver has no output lines");
    let inputs = arm.read_inputs().unwrap();
    assert!((inputs.joints.get(1).unwrap().to_degrees() + 90.0).abs() < 1e-9 && inputs.time_ns > 0);
    assert_eq!((arm.jog(true).unwrap().finished, arm.jog(false).unwrap().finished), (0, 1));
}

#[test]
fn an_unexpected_question_is_cancelled_and_an_unexpected_prompt_is_not() {
    for (answer, is_cancelled) in [("\r\nChange? ", true), (DONE, false)] {
        let is_begun = Arc::new(Mutex::new(false));
        let begun = Arc::clone(&is_begun);
        let played = Played::answering(move |line| match line {
            "WHERE" if *begun.lock().unwrap() => answer.to_owned(),
            "WHERE" => where_reply(&READY),
            _ => DONE.to_owned(),
        });
        let (mut arm, _host) = driver(&played).unwrap();
        played.take_typed();
        *is_begun.lock().unwrap() = true;
        let error = arm.read_joints().unwrap_err();
        assert!(matches!(error, PluginError::Failed(_)), "{error:?}");
        let typed = played.take_typed();
        assert_eq!(typed.iter().any(|line| line == CONTROL_C), is_cancelled, "{typed:?}");
    }
}

#[test]
fn a_cable_that_is_pulled_while_a_line_is_typed_is_reported_with_that_line() {
    let played = off_by(0.0);
    let (mut arm, _host) = driver(&played).unwrap();
    played.hang_up();
    let error = arm.read_joints().unwrap_err();
    assert!(matches!(error, PluginError::Disconnected(_)), "{error:?}");
    assert!(error.text().contains(": in `WHERE`: "), "{error}");
}

#[test]
fn an_arm_that_is_shown_a_twentieth_of_a_degree_off_has_arrived() {
    let mut joints = READY;
    joints[0] = 10.0;
    let played = Played::answering(move |line| {
        if line.starts_with("DO DRIVE 1,-10,") {
            joints[0] = 0.05;
        }
        if line == "WHERE" { where_reply(&joints) } else { DONE.to_owned() }
    });
    let (mut arm, _host) = driver(&played).unwrap();
    arm.move_joints(&to(0, 0.0)).unwrap();
}
