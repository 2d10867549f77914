//! What an arm refuses, and what it makes of its zeros.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use plumb_plugin::{JogState, JointState, JointVector, Motion, RobotDescription};
use plumb_record::{AppliedCorrection, CorrectionKey, JOINT_ZERO};

use super::arm::{Arm, NotAllowed};
use super::test_arm::{CELL, arm, arm_in, drive};
use crate::device::{DeviceError, PoseListener, RobotLink};
use crate::engine::EventSender;
use crate::event::{Event, NamedValue};
use crate::prompt::Answer;
use crate::run_handle::StopAction;

/// Keeps the flange 200 mm above the table, and the shoulder between -90 and 90 deg.
fn guarded() -> Arm {
    let cell = CELL.replace("model: model.yaml}", "model: model.yaml, limits_deg: {shoulder: [-90, 90]}}");
    let plane = "keep_out:\n  - {name: the table, robot: arm, plane: {normal: [0, 0, 1], offset_mm: 200}}\n";
    arm_in(&format!("{cell}{plane}"))
}

fn zero(joint: &str, value: f64) -> AppliedCorrection {
    AppliedCorrection {
        key: CorrectionKey { device: "arm".into(), quantity: JOINT_ZERO.into(), site: joint.into() },
        value,
        uncertainty: None,
        unit: "deg".into(),
        revision: 1,
        run: None,
    }
}

fn named(name: &str, value: f64, unit: &str) -> NamedValue {
    NamedValue { name: name.into(), value, unit: unit.into(), uncertainty: None }
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9, "{found} is not {expected}");
}

#[test]
fn a_jog_from_an_unknown_position_is_refused() {
    let arm = arm();
    let short = JointVector::from_slice(&[0.1, 0.2]).unwrap();
    let message = arm.jog_target(&short, "quill", 1.0).unwrap_err();
    assert_eq!(message, "arm does not say where its quill is");
    let lost = drive([10.0, f64::NAN, 20.0, 0.0]);
    assert!(arm.jog_target(&lost, "elbow", 1.0).is_err());
    assert!(arm.jog_target(&lost, "elbwo", 1.0).unwrap_err().contains("has no joint elbwo"));
}

#[test]
fn a_jog_moves_one_joint_by_what_people_write() {
    let arm = arm();
    let here = drive([10.0, 20.0, 30.0, 40.0]);
    let target = arm.jog_target(&here, "quill", -5.0).unwrap();
    assert_eq!(target, drive([10.0, 20.0, 25.0, 40.0]));
    let target = arm.jog_target(&here, "elbow", 1.0).unwrap();
    assert_near(target.as_slice()[1].to_degrees(), 21.0);
}

#[test]
fn a_pose_out_of_an_answer_is_where_the_corrected_joints_shall_be() {
    let mut arm = arm();
    arm.set_zeros(&[zero("shoulder", 10.0)], true);
    let here = drive([0.0, 0.0, 30.0, 0.0]);
    let pose = Answer::Pose { joints: vec![named("shoulder", 25.0, "deg"), named("quill", 40.0, "mm")] };
    let target = arm.pose_of_answer(&here, &pose).unwrap().expect("a pose");
    assert_near(target.as_slice()[0].to_degrees(), 15.0);
    assert_near(target.as_slice()[2], 40.0);
    assert_eq!(arm.pose_of_answer(&here, &Answer::Done), Ok(None));
    let unknown = Answer::Pose { joints: vec![named("wrist", 1.0, "deg")] };
    assert!(arm.pose_of_answer(&here, &unknown).unwrap_err().contains("has no joint wrist"));
}

#[test]
fn a_refusal_names_target_and_limits_of_the_corrected_joint() {
    let mut arm = guarded();
    arm.set_zeros(&[zero("shoulder", 10.0)], true);
    let refused = arm.check_move(&drive([0.0; 4]), &drive([85.0, 0.0, 0.0, 0.0]));
    let Err(NotAllowed::Limit { joint, target, lower, upper, unit }) = refused else { panic!("{refused:?}") };
    assert_eq!((joint.as_str(), unit), ("shoulder", "deg"));
    assert_near(target, 95.0);
    assert_near(lower, -90.0);
    assert_near(upper, 90.0);
}

#[test]
fn the_cells_limits_hold_for_the_corrected_joint() {
    let mut arm = guarded();
    let shoulder = arm.joint("shoulder").unwrap();
    for (value, lower, upper) in [(0.0, -90.0, 90.0), (10.0, -100.0, 80.0), (-10.0, -80.0, 100.0)] {
        arm.set_zeros(&[zero("shoulder", value)], true);
        assert_near(arm.limits(shoulder).0.to_degrees(), lower);
        assert_near(arm.limits(shoulder).1.to_degrees(), upper);
    }
    // The drive's own limits, 130 deg, are never passed.
    arm.set_zeros(&[zero("shoulder", 60.0)], true);
    assert_near(arm.limits(shoulder).0.to_degrees(), -130.0);
}

#[test]
fn a_target_beyond_a_limit_is_refused_with_the_joint_and_its_range() {
    let arm = guarded();
    let from = drive([0.0, 0.0, 30.0, 0.0]);
    assert_eq!(arm.check_move(&from, &drive([90.0, 0.0, 30.0, 0.0])), Ok(()));
    assert_eq!(arm.check_move(&from, &drive([-90.0, 0.0, 30.0, 0.0])), Ok(()));
    for beyond in [90.01, -90.01] {
        let message = arm.check_move(&from, &drive([beyond, 0.0, 30.0, 0.0])).unwrap_err().to_string();
        let expected = format!("shoulder would go to {beyond:.3} deg; it goes from -90.000 to 90.000 deg");
        assert_eq!(message, expected);
    }
}

#[test]
fn an_arm_beyond_its_limit_may_come_back_and_go_no_further() {
    let arm = guarded();
    let beyond = drive([95.0, 0.0, 30.0, 0.0]);
    assert_eq!(arm.check_move(&beyond, &drive([92.0, 0.0, 30.0, 0.0])), Ok(()));
    assert_eq!(arm.check_move(&beyond, &drive([95.0, 5.0, 30.0, 0.0])), Ok(()), "it stays there");
    assert!(arm.check_move(&beyond, &drive([96.0, 0.0, 30.0, 0.0])).is_err());
}

#[test]
fn a_target_that_is_no_number_or_has_no_value_is_refused() {
    let arm = arm();
    let from = drive([0.0, 0.0, 30.0, 0.0]);
    let nowhere = arm.check_move(&from, &drive([0.0, f64::NAN, 30.0, 0.0]));
    assert!(
        matches!(nowhere, Err(NotAllowed::NoNumber { ref joint, .. }) if joint == "elbow"),
        "{nowhere:?}"
    );
    let short = JointVector::from_slice(&[0.0, 0.0, 30.0]).unwrap();
    let spin = Err(NotAllowed::NoValue { joint: "spin".to_owned() });
    assert_eq!(arm.check_move(&from, &short), spin);
    assert_eq!(arm.check_move(&short, &from), spin);
}

#[test]
fn planes_are_watched_only_while_the_zeros_are_trusted() {
    let mut arm = guarded();
    let (above, below) = (drive([0.0, 0.0, 30.0, 0.0]), drive([0.0, 0.0, 150.0, 0.0]));
    arm.set_zeros(&[], true);
    assert!(matches!(arm.check_move(&above, &below), Err(NotAllowed::KeepOut(_))));
    assert_eq!(arm.check_move(&below, &above), Ok(()), "it may leave");
    assert_eq!(arm.believed_trespass(&above, &below), None, "it is refused instead");
    arm.set_zeros(&[], false);
    assert_eq!(arm.check_move(&above, &below), Ok(()));
    let trespass = arm.believed_trespass(&above, &below).expect("a warning");
    let crate::workcell::Trespass::Beyond { plane, depth_mm, .. } = &trespass else { panic!("{trespass:?}") };
    assert_eq!(plane, "the table");
    assert!((depth_mm - 30.0).abs() < 1e-6, "{trespass:?}");
}

#[test]
fn the_side_from_which_a_joint_arrives_is_that_of_its_last_move() {
    let arm = arm();
    let sides = arm.sides_at(&drive([0.0, 10.0, 30.0, 0.0]), &drive([5.0, 5.0, 30.0, 0.0]));
    assert_eq!(sides, [1, -1, 0, 0]);
    let short = JointVector::from_slice(&[0.0]).unwrap();
    assert_eq!(arm.sides_at(&short, &short), [0, 0, 0, 0], "nobody knows");
}

#[test]
fn a_joint_driven_by_hand_has_to_come_from_the_side_it_is_asked_for() {
    let mut arm = arm();
    let elbow = arm.joint("elbow").unwrap();
    arm.begin_manual(&drive([0.0, 10.0, 30.0, 0.0]));
    arm.saw_manual(&drive([0.0, 14.0, 30.0, 0.0]));
    let end = drive([0.0, 12.0, 30.0, 0.0]);
    assert_eq!(arm.end_manual(&end, &[(elbow, 1)]), Ok(()));
    assert_eq!(arm.sides(), [0, 1, 0, 0]);
    arm.begin_manual(&end);
    arm.saw_manual(&drive([0.0, 13.0, 30.0, 0.0]));
    let past = drive([0.0, 13.0, 30.0, 0.0]);
    assert_eq!(arm.end_manual(&past, &[(elbow, -1)]), Err(elbow), "it was never above");
}

#[test]
fn the_slowest_joint_decides_how_long_a_move_takes() {
    let arm = arm();
    let time = arm.expected_time(&drive([0.0, 0.0, 0.0, 0.0]), &drive([57.295_779_513, 0.0, 4.0, 0.0]), 0.5);
    assert!((time.as_secs_f64() - 8.0).abs() < 1e-6, "4 mm at 0.5 mm/s: {time:?}");
}

#[test]
fn a_joint_of_which_nothing_is_reported_is_shown_as_no_number() {
    let arm = arm();
    let shown = arm.named(&JointVector::from_slice(&[0.0, 0.0]).unwrap());
    assert_eq!(shown.len(), 4);
    assert!(shown[1].value == 0.0 && shown[2].value.is_nan() && shown[2].unit == "mm");
}

#[test]
fn the_outline_runs_from_the_base_to_the_flange_by_the_corrected_joints() {
    let mut arm = arm();
    arm.set_zeros(&[zero("shoulder", 90.0)], true);
    let outline = arm.outline(&drive([0.0, 0.0, 50.0, 0.0])).expect("there is a model");
    let expected: [[f64; 3]; 5] =
        [[0.0; 3], [0.0, 225.0, 320.0], [0.0, 400.0, 320.0], [0.0, 400.0, 270.0], [0.0, 400.0, 270.0]];
    assert_eq!(outline.len(), expected.len());
    for (point, expected) in outline.iter().zip(expected) {
        for (found, expected) in point.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{outline:?}");
        }
    }
    let without = arm_in(&CELL.replace(", model: model.yaml", ""));
    assert_eq!(without.outline(&drive([0.0; 4])), None);
    assert_eq!(without.geometry().err().as_deref(), Some("the cell names no model of arm: give `model:`"));
}

#[test]
fn the_hand_is_brought_to_where_it_was_asked_for_by_the_drives_own_numbers() {
    let mut arm = arm();
    arm.set_zeros(&[zero("shoulder", 10.0), zero("elbow", -5.0)], true);
    let from = drive([10.0, 40.0, 60.0, 5.0]);
    let there = drive([25.0, 60.0, 80.0, -20.0]);
    let expected = arm.flange(&there).expect("there is a model");
    let found = arm.joints_for(&expected, &from).expect("it is within reach");
    for (found, there) in found.as_slice().iter().zip(there.as_slice()) {
        assert!((found - there).abs() < 1e-6, "{found:?} {there:?}");
    }
    // 225 mm at 35 degrees, then 175 mm at 90 degrees.
    let position = expected.translation.vector;
    let x = 225.0 * 35.0_f64.to_radians().cos();
    let y = 225.0 * 35.0_f64.to_radians().sin() + 175.0;
    assert!(
        (position.x - x).abs() < 1e-9 && (position.y - y).abs() < 1e-9 && (position.z - 240.0).abs() < 1e-9
    );
}

#[test]
fn less_than_half_a_step_is_no_way_and_leaves_the_side_as_it_was() {
    let mut arm = arm();
    arm.description.joints[2].resolution = 0.5;
    let quill = arm.joint("quill").unwrap();
    assert_eq!((arm.resolution(quill), arm.resolution(arm.joint("elbow").unwrap())), (0.5, 0.0));
    let side = |by: f64| arm.sides_at(&drive([0.0, 0.0, 30.0, 0.0]), &drive([0.0, 0.0, 30.0 + by, 0.0]))[2];
    assert_eq!([side(0.25), side(-0.25), side(0.26), side(-0.26)], [0, 0, 1, -1]);
}

#[test]
fn a_move_takes_as_long_as_its_way_whichever_way_it_goes() {
    let arm = arm();
    let (here, there) = (drive([0.0, 0.0, 10.0, 0.0]), drive([0.0, 0.0, 16.0, 0.0]));
    for (from, to) in [(&here, &there), (&there, &here)] {
        assert!((arm.expected_time(from, to, 1.0).as_secs_f64() - 6.0).abs() < 1e-9, "6 mm at 1 mm/s");
    }
    let far = drive([0.0, 0.0, 1e9, 0.0]);
    assert_eq!(arm.expected_time(&here, &far, 1.0).as_secs(), 3600, "an hour at most");
}

#[test]
fn an_arm_is_fitted_to_the_cell_only_with_its_own_joints_in_their_units() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |joints: &str| {
        let cell =
            CELL.replace("{shoulder: deg, elbow: deg, quill: mm, spin: deg}, model: model.yaml", joints);
        std::fs::write(folder.path().join("cell.yaml"), cell).unwrap();
        let cell = crate::workcell::load_workcell(
            &folder.path().join("cell.yaml"),
            &crate::expression::Calculator::new(),
        );
        let cell = cell.unwrap_or_else(|problems| panic!("{problems:?}"));
        let link = super::test_arm::still();
        Arm::new(link, "quill", cell.robot("arm").unwrap(), None).err().map(|error| error.to_string())
    };
    assert_eq!(refused("{quill: mm, elbow: deg}"), None);
    let message = refused("{quil: mm}").unwrap();
    assert!(message.contains("the cell file names a joint `quil`") && message.contains("quill"), "{message}");
    let message = refused("{quill: deg}").unwrap();
    assert!(message.contains("gives joint `quill` in deg; the robot does not"), "{message}");
}

#[test]
fn where_an_arm_was_and_from_which_sides_is_recorded_by_name_in_peoples_units() {
    let mut arm = arm();
    arm.set_zeros(&[zero("shoulder", 10.0)], true);
    let recorded = arm.recorded(&drive([20.0, 0.0, 30.0, 0.0]));
    let row = |index: usize, key: &str| recorded[index][key].clone();
    assert_eq!((row(0, "name"), row(0, "unit")), ("shoulder".into(), "deg".into()));
    assert_near(row(0, "drive").as_f64().unwrap(), 20.0);
    assert_near(row(0, "value").as_f64().unwrap(), 30.0);
    assert_eq!((row(2, "drive"), row(2, "value"), row(2, "unit")), (30.0.into(), 30.0.into(), "mm".into()));
    let sides = serde_json::json!({"shoulder": 0, "elbow": 0, "quill": 0, "spin": 0});
    assert_eq!(arm.recorded_sides(), sides, "nothing has moved yet");
}

#[test]
fn a_hand_moved_by_somebody_else_has_come_from_nobody_knows_where() {
    let mut arm = arm();
    let (elbow, quill) = (arm.joint("elbow").unwrap(), arm.joint("quill").unwrap());
    let here = drive([0.0, 10.0, 30.0, 0.0]);
    arm.begin_manual(&drive([0.0, 12.0, 32.0, 0.0]));
    arm.saw_manual(&drive([0.0, 8.0, 32.0, 0.0]));
    assert_eq!(arm.end_manual(&here, &[(elbow, 1), (quill, -1)]), Ok(()));
    assert_eq!(arm.sides(), [0, 1, -1, 0]);
    // Nobody is said to have moved it, and yet it is looked at: nothing is known of any joint.
    arm.saw_manual(&here);
    assert_eq!(arm.sides(), [0, 0, 0, 0]);
}

/// A link that keeps who is to be informed where the arm is.
struct Watched {
    still: Box<dyn RobotLink>,
    listener: Arc<Mutex<Option<PoseListener>>>,
}

impl RobotLink for Watched {
    fn description(&self) -> &RobotDescription {
        self.still.description()
    }
    fn activate(&mut self) -> Result<(), DeviceError> {
        self.still.activate()
    }
    fn deactivate(&mut self) -> Result<(), DeviceError> {
        self.still.deactivate()
    }
    fn read_joints(&mut self) -> Result<JointState, DeviceError> {
        self.still.read_joints()
    }
    fn move_joints(&mut self, motion: &Motion, limit: Duration) -> Result<JointState, DeviceError> {
        self.still.move_joints(motion, limit)
    }
    fn jog(&mut self, on: bool) -> Result<JogState, DeviceError> {
        self.still.jog(on)
    }
    fn stop_action(&self) -> StopAction {
        self.still.stop_action()
    }
    fn watch(&mut self, listener: PoseListener) {
        *self.listener.lock().unwrap() = Some(listener);
    }
}

#[test]
fn where_it_is_while_it_moves_is_shown_with_its_zeros_and_how_far_its_planes_are() {
    let mut arm = guarded();
    let listener = Arc::new(Mutex::new(None));
    arm.link = Box::new(Watched { still: super::test_arm::still(), listener: Arc::clone(&listener) });
    let (sender, mut shown) = tokio::sync::mpsc::unbounded_channel();
    arm.show_movement(EventSender::new(sender));
    arm.set_zeros(&[zero("shoulder", 10.0)], true);
    let callback = listener.lock().unwrap();
    callback.as_ref().expect("it is watched")(&JointState::new(7, drive([20.0, 0.0, 50.0, 0.0]), true));
    let Event::Joints { device, time_ns, moving, joints } = shown.try_recv().unwrap().event else {
        panic!("the joints come first")
    };
    assert_eq!((device.as_str(), time_ns, moving), ("arm", 7, true));
    assert_near(joints[0].value, 30.0);
    assert_eq!((joints[2].value, joints[2].unit.as_str()), (50.0, "mm"));
    let Event::Clearance { device, planes } = shown.try_recv().unwrap().event else {
        panic!("then the planes")
    };
    // The flange is 320 - 50 mm over the table, and the plane is 200 mm over it.
    assert_eq!((device.as_str(), planes[0].plane.as_str()), ("arm", "the table"));
    assert_near(planes[0].clearance_mm.unwrap(), 70.0);
    assert_eq!(arm.clearances(&drive([20.0, 0.0, 50.0, 0.0])), planes);
    let error = arm.link.read_motors().unwrap_err().to_string();
    assert_eq!(error, "quill: this device cannot read its motors");
    let error = arm.link.set_zero(&drive([0.0; 4])).unwrap_err().to_string();
    assert!(error.contains("quill") && error.contains("its zeros cannot be set"), "{error}");
}

#[test]
fn the_planes_are_watched_where_the_zeros_in_force_have_the_arm() {
    let mut arm = guarded();
    let (above, below) = (drive([0.0, 0.0, 30.0, 0.0]), drive([0.0, 0.0, 70.0, 0.0]));
    arm.set_zeros(&[], true);
    assert_eq!(arm.check_move(&above, &below), Ok(()), "the flange goes to 250 mm, 50 above the plane");
    arm.set_zeros(&[zero("quill", 60.0)], true);
    let refused = arm.check_move(&above, &below);
    assert!(matches!(refused, Err(NotAllowed::KeepOut(_))), "it goes to 190 mm: {refused:?}");
    arm.set_zeros(&[zero("quill", 40.0)], true);
    assert_eq!(arm.check_move(&above, &below), Ok(()), "it goes to 210 mm");
}
