//! Ways between poses, speeds and times, worked out by hand.

use super::*;
use crate::controller_error::ControllerError;
use crate::line::{LineError, LineFailure};

/// The ready position with some joints (from 0) elsewhere, deg.
fn ready_but(changes: &[(usize, f64)]) -> [f64; AXES] {
    let mut pose = READY;
    for (joint, degrees) in changes {
        pose[*joint] = *degrees;
    }
    pose
}

#[test]
fn the_speed_is_the_share_of_the_full_one_in_hundredths_of_a_percent_and_never_none() {
    assert_eq!(speed_percent(1.0, 50.0), 50.0);
    assert_eq!(speed_percent(0.5, 30.0), 15.0);
    assert_eq!(speed_percent(1.0 / 3.0, 50.0), 16.67);
    assert_eq!(speed_percent(1e-6, 50.0), 0.01);
}

#[test]
fn a_joint_that_is_to_turn_by_less_than_the_last_digit_typed_stays() {
    assert_eq!(Way::between(&READY, &ready_but(&[(0, 0.000_4), (2, 89.999_6)])), Way::None);
    let way = Way::between(&READY, &ready_but(&[(0, 0.000_6)]));
    assert_eq!(way, Way::Joints { together: [None; AXES], alone: vec![(0, 0.000_6)] });
}

#[test]
fn one_joint_is_driven_several_go_by_a_point_and_to_the_ready_position_leads_its_command() {
    let one = Way::between(&ready_but(&[(1, -100.0)]), &READY);
    assert_eq!(one, Way::Joints { together: [None; AXES], alone: vec![(1, 10.0)] });
    let several = Way::between(&READY, &ready_but(&[(0, 30.0), (1, -60.0)]));
    let together = [Some(30.0), Some(-60.0), None, None, None, None];
    assert_eq!(several, Way::Joints { together, alone: Vec::new() });
    assert_eq!(Way::between(&ready_but(&[(0, 30.0), (1, -60.0)]), &READY), Way::Ready);
    let nearly = ready_but(&[(5, 0.01)]);
    assert!(matches!(Way::between(&ready_but(&[(0, 30.0), (1, -60.0)]), &nearly), Way::Joints { .. }));
}

#[test]
fn a_flange_that_could_go_either_way_round_is_driven_by_its_difference_after_the_others() {
    // 200 and -160 degrees are typed alike, and the flange can be at either.
    let way = Way::between(&ready_but(&[(5, 50.0)]), &ready_but(&[(0, 30.0), (5, 200.0)]));
    let together = [Some(30.0), None, None, None, None, None];
    assert_eq!(way, Way::Joints { together, alone: vec![(5, 150.0)] });
}

#[test]
fn one_joint_is_turned_from_where_it_is() {
    assert_eq!(turned(ready_but(&[(3, 20.0)]), 3, -50.0), ready_but(&[(3, -30.0)]));
    assert_eq!(turned(READY, 0, 12.5), ready_but(&[(0, READY[0] + 12.5)]));
    assert_eq!(turned(READY, AXES, 12.5), READY, "there is no seventh");
}

#[test]
fn a_motion_may_take_three_times_its_time_and_ten_seconds_and_two_hours_at_most() {
    // The waist turns 82 degrees a second at SPEED 100: 41 degrees take one second at SPEED 50, the flange's 57 degrees half of one.
    let target = ready_but(&[(0, 41.0), (5, -57.0)]);
    assert!((within(&READY, &target, 50.0).as_secs_f64() - 13.0).abs() < 1e-9);
    assert!((within(&target, &READY, 50.0).as_secs_f64() - 13.0).abs() < 1e-9);
    assert!((within(&READY, &target, 25.0).as_secs_f64() - 16.0).abs() < 1e-9);
    assert_eq!(within(&READY, &READY, 50.0), Duration::from_secs(10));
    assert_eq!(within(&READY, &target, 0.01), Duration::from_secs(7200));
}

#[test]
fn six_values_are_taken_as_degrees_and_any_other_number_is_refused() {
    let radians = JointVector::from_slice(&READY.map(f64::to_radians)).unwrap();
    let degrees = six(&radians).unwrap();
    assert!(degrees.iter().zip(READY).all(|(one, other)| (one - other).abs() < 1e-9), "{degrees:?}");
    let error = six(&JointVector::zeros(5)).unwrap_err();
    assert_eq!(
        error.text(),
        "5 joint values given; this arm has 6: waist, shoulder, elbow, wrist_roll, wrist_bend, flange"
    );
}

#[test]
fn after_a_refusal_the_arm_is_where_it_was_and_after_any_other_error_nobody_knows() {
    let message = |line: &str| MonitorError::ControllerError(ControllerError { line: line.to_owned() });
    assert!(leaves_the_arm_known(&message("*Joint 3 out of range*")));
    assert!(leaves_the_arm_known(&message("*Unknown command*")));
    assert!(!leaves_the_arm_known(&message("*Robot power off*")));
    assert!(!leaves_the_arm_known(&message("*Program aborted*")));
    assert!(!leaves_the_arm_known(&message("*Moon in the way*")));
    let (port, command) = ("/dev/ttyS9".to_owned(), "WHERE".to_owned());
    let silent = LineError { port, command, failure: LineFailure::Silent };
    assert!(!leaves_the_arm_known(&MonitorError::Line(silent)));
    assert!(!leaves_the_arm_known(&MonitorError::NotTaken { joint: 1, typed: 1.0, shown: 2.0 }));
}
