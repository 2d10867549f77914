//! An arm for unit tests: two turns, a slide straight down and a turn of the hand, 400 mm of reach.

use std::time::Duration;

use plumb_plugin::{
    JogState, JointDescription, JointState, JointUnit, JointVector, Motion, RobotCapabilities,
    RobotDescription,
};

use super::arm::Arm;
use crate::device::{DeviceError, RobotLink};
use crate::expression::Calculator;
use crate::run_handle::StopAction;
use crate::workcell::{KeepOut, load_workcell};

/// Two turns, a slide straight down, a turn of the hand.
pub(crate) const MODEL: &str = "arm: quill
convention: distal
joints:
  - {name: shoulder, a_mm: 225, alpha_deg: 0, d_mm: 320, theta_deg: 0, limits_deg: [-130, 130]}
  - {name: elbow, a_mm: 175, alpha_deg: 180, d_mm: 0, theta_deg: 0, limits_deg: [-145, 145]}
  - {name: quill, a_mm: 0, alpha_deg: 0, d_mm: 0, theta_deg: 0, slides: true, limits_mm: [0, 180]}
  - {name: spin, a_mm: 0, alpha_deg: 0, d_mm: 0, theta_deg: 0, limits_deg: [-180, 180]}
targets: {p1: {xyz_mm: [0, 0, 30], free: true}}
free: [joint_zero(*)]
measured_from: world
";

/// Its cell.
pub(crate) const CELL: &str = "cell: quill
devices:
  arm: {plugin: simulated}
robots:
  arm: {joints: {shoulder: deg, elbow: deg, quill: mm, spin: deg}, model: model.yaml}
procedures: []
";

struct Still(RobotDescription);

impl RobotLink for Still {
    fn description(&self) -> &RobotDescription {
        &self.0
    }
    fn activate(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }
    fn deactivate(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }
    fn read_joints(&mut self) -> Result<JointState, DeviceError> {
        Ok(JointState::default())
    }
    fn move_joints(&mut self, _motion: &Motion, _limit: Duration) -> Result<JointState, DeviceError> {
        Ok(JointState::default())
    }
    fn jog(&mut self, _on: bool) -> Result<JogState, DeviceError> {
        Ok(JogState::default())
    }
    fn stop_action(&self) -> StopAction {
        Box::new(|| ())
    }
}

/// The arm of its cell as it is.
pub(crate) fn arm() -> Arm {
    arm_in(CELL)
}

/// The same in another cell.
pub(crate) fn arm_in(cell: &str) -> Arm {
    arm_with(cell, MODEL)
}

/// The same by another model file.
pub(crate) fn arm_with(cell: &str, model: &str) -> Arm {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.yaml"), model).unwrap();
    std::fs::write(folder.path().join("cell.yaml"), cell).unwrap();
    let cell = load_workcell(&folder.path().join("cell.yaml"), &Calculator::new());
    let cell = cell.unwrap_or_else(|problems| {
        panic!("{}", problems.iter().map(ToString::to_string).collect::<String>())
    });
    let setting = cell.robot("arm").unwrap();
    let keep_out = KeepOut::for_robot(setting, &cell.keep_out);
    Arm::new(still(), "quill", setting, keep_out.as_ref()).unwrap()
}

/// Its link, which never moves.
pub(crate) fn still() -> Box<dyn RobotLink> {
    let joint = |name: &str, unit, lower: f64, upper: f64| JointDescription {
        name: name.to_owned(),
        unit,
        lower,
        upper,
        resolution: 0.0,
        max_speed: 1.0,
        home: 0.0,
    };
    let turn = |name: &str, most: f64| joint(name, JointUnit::Radian, -most.to_radians(), most.to_radians());
    let description = RobotDescription {
        model: "quill".to_owned(),
        joints: vec![
            turn("shoulder", 130.0),
            turn("elbow", 145.0),
            joint("quill", JointUnit::Millimetre, 0.0, 180.0),
            turn("spin", 180.0),
        ],
        inputs: Vec::new(),
        outputs: Vec::new(),
        capabilities: RobotCapabilities::default(),
    };
    Box::new(Still(description))
}

/// Joints in deg and mm as the drive has them.
pub(crate) fn drive(values: [f64; 4]) -> JointVector {
    let [shoulder, elbow, quill, spin] = values;
    JointVector::from_slice(&[shoulder.to_radians(), elbow.to_radians(), quill, spin.to_radians()]).unwrap()
}
