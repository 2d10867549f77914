//! A stop reaches every device, whatever else is going on.

use std::thread;
use std::time::{Duration, Instant};

use plumb_host::{DeviceError, StopOutcome};
use plumb_plugin::{DeviceState, JointState, Value};

use crate::test_folder::{LONG, TestFolder, stream, until, waist_to};

fn wait_until_moving(folder: &TestFolder) -> impl FnMut() + '_ {
    let mut receiver = folder.bus().subscriber("arm", &stream("misbehaving_robot", "joints")).unwrap();
    move || {
        until("a moving state", || {
            // What was lost while nobody looked is no matter here.
            receiver.receive::<JointState>().ok().flatten().filter(JointState::is_moving)
        });
    }
}

#[test]
fn a_stop_ends_a_move_and_holds_until_the_next_activation() {
    let folder = TestFolder::new();
    let mut wait_until_moving = wait_until_moving(&folder);
    let host = folder.robot(Value::Null);
    let (robot, stop) = (host.robot().unwrap(), host.stop_handle().unwrap());
    robot.activate().unwrap();
    thread::scope(|scope| {
        let moving = scope.spawn(|| robot.move_joints(&waist_to(90.0), LONG));
        wait_until_moving();
        let outcome = stop.stop(LONG);
        assert!(matches!(outcome, StopOutcome::Stopped { .. }), "{outcome:?}");
        let error = moving.join().unwrap().unwrap_err();
        assert!(error.is_stop(), "{error:?}");
    });
    assert_eq!(robot.state().unwrap(), DeviceState::Inactive);
    let at_stop = robot.read_joints().unwrap().joints;
    let error = robot.move_joints(&waist_to(0.0), LONG).unwrap_err();
    assert_eq!(error.to_string(), "arm: arm was stopped; activate it before it may move again");
    assert_eq!(robot.read_joints().unwrap().joints, at_stop);
    robot.activate().unwrap();
    let near = at_stop.get(0).unwrap() + 0.01;
    assert!(robot.move_joints(&waist_to(near), LONG).is_ok());
}

#[test]
fn a_stop_does_not_queue_behind_requests() {
    let folder = TestFolder::new();
    let mut wait_until_moving = wait_until_moving(&folder);
    let host = folder.robot(Value::Null);
    let (first, second) = (host.robot().unwrap(), host.robot().unwrap());
    let stop = host.stop_handle().unwrap();
    first.activate().unwrap();
    thread::scope(|scope| {
        let moving = scope.spawn(|| first.move_joints(&waist_to(90.0), LONG));
        wait_until_moving();
        let queued = scope.spawn(|| second.move_joints(&waist_to(-90.0), LONG));
        let outcome = stop.stop(LONG);
        assert!(matches!(outcome, StopOutcome::Stopped { .. }), "{outcome:?}");
        assert!(moving.join().unwrap().unwrap_err().is_stop());
        assert!(queued.join().unwrap().unwrap_err().is_stop(), "what was queued is not done late");
    });
}

#[test]
fn a_robot_at_rest_confirms_a_stop() {
    let folder = TestFolder::new();
    let host = folder.robot(Value::Null);
    let outcome = host.stop_handle().unwrap().stop(LONG);
    assert!(matches!(outcome, StopOutcome::Stopped { .. }), "{outcome:?}");
}

#[test]
fn a_hung_plugin_cannot_delay_a_stop() {
    const STOP_TIME: Duration = Duration::from_millis(200);
    let folder = TestFolder::new();
    let host = folder.robot_with("hang", "move");
    let (robot, stop) = (host.robot().unwrap(), host.stop_handle().unwrap());
    robot.activate().unwrap();
    thread::scope(|scope| {
        let moving = scope.spawn(|| robot.move_joints(&waist_to(1.0), LONG));
        thread::sleep(Duration::from_millis(50));
        let begin = Instant::now();
        assert_eq!(stop.stop(STOP_TIME), StopOutcome::Killed);
        let took = begin.elapsed();
        assert!(took < STOP_TIME + Duration::from_secs(2), "the stop took {took:?}");
        let error = moving.join().unwrap().unwrap_err();
        assert_eq!(error.to_string(), "the host of arm was killed: it did not confirm a stop in time");
        assert!(matches!(error, DeviceError::HostDied { .. }));
    });
    assert_eq!(stop.stop(STOP_TIME), StopOutcome::HostGone);
}

#[test]
fn a_robot_that_does_not_confirm_its_stop_is_cut_off() {
    let folder = TestFolder::new();
    let host = folder.robot_with("refuse", "stop");
    assert_eq!(host.stop_handle().unwrap().stop(Duration::from_millis(200)), StopOutcome::Killed);
}

#[test]
fn a_sensor_waiting_for_its_inputs_is_stopped_too() {
    let folder = TestFolder::new();
    let _arm = folder.robot(Value::Null);
    let eye = folder.watcher();
    let (sensor, stop) = (eye.sensor().unwrap(), eye.stop_handle().unwrap());
    thread::scope(|scope| {
        let reading = scope.spawn(|| sensor.read(u64::MAX, LONG));
        thread::sleep(Duration::from_millis(50));
        let outcome = stop.stop(LONG);
        assert!(matches!(outcome, StopOutcome::Stopped { .. }), "{outcome:?}");
        assert!(reading.join().unwrap().unwrap_err().is_stop());
    });
}

#[test]
fn the_confirmation_of_an_earlier_stop_is_not_taken_for_this_one() {
    let folder = TestFolder::new();
    let host = folder.robot_with("hang", "stop");
    let stop = host.stop_handle().unwrap();
    // As an earlier stop's, which came after its asker had given up.
    folder.bus().signal("stopped/arm").unwrap().notify().unwrap();
    assert_eq!(stop.stop(Duration::from_millis(300)), StopOutcome::Killed);
}
