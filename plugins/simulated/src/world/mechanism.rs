//! The TeachMover as [`crate::physics`] has every arm: links, joints and weights; the cables that keep attitudes as a transmission; play, cables that do not keep
//! attitudes quite, and parts that give way under their weight as imperfections of its drives. And what the arm cannot enter.
//!
//! Frame: the waist's axis is z, upward; the table's top is z = 0; x points where the waist's angle is 0. Lengths in mm.

use std::f64::consts::FRAC_PI_2;

use super::drive::{AXES, Joint, Joints};
use crate::physics::description::{ArmDescription, Convention, Joint as Row, Motion, Weight};
use crate::physics::imperfection::{Imperfection, Mechanism as Flaw};
use crate::physics::machine::Machine;
use crate::physics::rigid::{Rigid, Vector};
use crate::physics::transmission::Transmission;

/// The arm's build, with what is not ideal about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Mechanism {
    /// Its lengths.
    pub geometry: ArmGeometry,
    /// The whole dead zone of each joint's drive, rad or mm.
    pub backlash: Joints,
    /// How far attitudes are dragged along by joints before them.
    pub drag: CableDrag,
    /// How parts give way under their weight.
    pub droop: Droop,
}

/// The arm's lengths, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmGeometry {
    /// The shoulder's axis over the table.
    pub shoulder_height: f64,
    /// Shoulder's axis to elbow's axis.
    pub upper_arm: f64,
    /// Elbow's axis to the wrist.
    pub forearm: f64,
    /// Wrist to the sensor's face, the lowest point of a hand that hangs.
    pub hand: f64,
}

/// What share of a joint's true attitude the cables drag a later joint along by; 0 for cables that keep attitudes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CableDrag {
    /// Of the shoulder's attitude, in the forearm's.
    pub elbow_by_shoulder: f64,
    /// Of the shoulder's attitude, in the hand's.
    pub wrist_pitch_by_shoulder: f64,
    /// Of the forearm's attitude, in the hand's.
    pub wrist_pitch_by_elbow: f64,
    /// Opening of the gripper by the forearm's attitude, mm/rad.
    pub gripper_by_elbow: f64,
}

/// Weights, and how far each drive gives way to the moment it bears.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Droop {
    /// Mass of the upper arm, acting at its middle, kg.
    pub upper_arm_mass: f64,
    /// Mass of the forearm, acting at its middle, kg.
    pub forearm_mass: f64,
    /// Mass of the hand, acting at its middle, kg.
    pub hand_mass: f64,
    /// Give of the shoulder, rad/(N m).
    pub shoulder_give: f64,
    /// Give of the elbow, rad/(N m).
    pub elbow_give: f64,
    /// Give of the wrist's pitch, rad/(N m).
    pub wrist_pitch_give: f64,
}

/// The arm's joints, each relative to the link before: waist, shoulder, elbow, wrist pitch and wrist roll. The gripper is none of the chain.
const CHAIN: [Joint; 5] = [Joint::Waist, Joint::Shoulder, Joint::Elbow, Joint::WristPitch, Joint::WristRoll];

/// The cables hold forearm and hand from the base: what a drive sets is the attitude of its link, and the joint turns by what the link before does not. A row a
/// joint of the chain, a column a drive.
const JOINTS_FROM_ATTITUDES: [[f64; AXES]; 5] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, -1.0, 1.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, -1.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
];

/// Mechanical stops of the chain's joints, degrees.
const STOPS_DEG: [[f64; 2]; 5] =
    [[-90.0, 90.0], [-35.0, 144.0], [-149.0, 0.0], [-90.0, 90.0], [-360.0, 360.0]];

/// The gripper's greatest opening, mm: 3 inches.
pub(super) const WIDEST: f64 = 76.2;

/// How far (mm of its drive) the gripper's cable can be drawn past the touch of the fingers before the motor stalls: the
/// greatest grip of 8 pounds, at 32 half-steps a pound.
const GREATEST_GRIP: f64 = 8.0 * 32.0 / super::drive::GRIPPER_HALF_STEPS_PER_MM;

/// How far the cable is drawn when the grip switch closes: a light touch, mm of the drive.
pub(super) const GRIP_SWITCH: f64 = 4.0 / super::drive::GRIPPER_HALF_STEPS_PER_MM;

/// How far a joint's attitude can go, degrees: between its own stops, and as the joints before turn its link along. None for the gripper.
pub(super) fn attitude_range_deg(joint: Joint) -> Option<[f64; 2]> {
    let first = match joint {
        Joint::Elbow | Joint::WristPitch => Joint::Shoulder,
        _ => joint,
    };
    let stops = STOPS_DEG.get(first.index()..=joint.index())?;
    Some([0, 1].map(|end| stops.iter().map(|stops| stops[end]).sum()))
}

impl Mechanism {
    /// The arm with what is not ideal about it, its drives at 0 and without a history.
    pub(super) fn machine(&self) -> Machine {
        Machine::new(&self.on_paper(), &self.imperfections())
    }

    /// How far the furthest joint is past its mechanical stop, mm: angles count on an arm's length, the gripper by its opening and by how far its cable is drawn
    /// past the touch of the fingers. `angles` are those of the chain's joints, each relative to the link before.
    pub(super) fn past_stops(&self, angles: &[f64], opening: f64, grip: f64) -> f64 {
        let past = angles.iter().zip(STOPS_DEG).map(|(angle, [low, high])| {
            let angle = angle.to_degrees();
            (low - angle).max(angle - high).to_radians() * self.geometry.forearm
        });
        past.fold((opening - WIDEST).max(grip - GREATEST_GRIP), f64::max)
    }

    fn on_paper(&self) -> ArmDescription {
        let ArmGeometry { shoulder_height, upper_arm, forearm, hand } = self.geometry;
        // Length, twist, offset and rest angle of each row; the roll's axis runs along the hand.
        let rows = [
            [0.0, FRAC_PI_2, shoulder_height, 0.0],
            [upper_arm, 0.0, 0.0, 0.0],
            [forearm, 0.0, 0.0, 0.0],
            [0.0, FRAC_PI_2, 0.0, FRAC_PI_2],
            [0.0, 0.0, hand, 0.0],
        ];
        let rows = CHAIN.into_iter().zip(rows).zip(STOPS_DEG);
        let joints = rows.map(|((joint, [length, twist, offset, rest_angle]), stops)| Row {
            name: joint.name().to_owned(),
            motion: Motion::Turns,
            mounted: Rigid::IDENTITY,
            length,
            twist,
            offset,
            rest_angle,
            sign: 1.0,
            limits: stops.map(f64::to_radians),
            gear_ratio: None,
            screw_pitch: None,
        });
        // Every weight acts at the middle of its link; the rows' frames sit at the far ends.
        let weight =
            |joint: Joint, mass, centre| Weight { after: joint.index(), mass, centre: Vector::from(centre) };
        let weights = vec![
            weight(Joint::Shoulder, self.droop.upper_arm_mass, [-upper_arm / 2.0, 0.0, 0.0]),
            weight(Joint::Elbow, self.droop.forearm_mass, [-forearm / 2.0, 0.0, 0.0]),
            weight(Joint::WristRoll, self.droop.hand_mass, [0.0, 0.0, -hand / 2.0]),
        ];
        ArmDescription {
            name: "TeachMover".to_owned(),
            convention: Convention::Distal,
            joints: joints.collect(),
            weights,
            base_position: Vector::ZERO,
            base_orientation: [0.0; 3],
            flange: Rigid::IDENTITY,
            target: Vector::ZERO,
            transmission: Transmission::Matrix(JOINTS_FROM_ATTITUDES.map(Vec::from).to_vec()),
            declared_noise: None,
        }
    }

    fn imperfections(&self) -> Vec<Imperfection> {
        let Self { drag, droop, .. } = self;
        let play =
            Joint::ALL.map(|joint| (Flaw::JointBacklash { joint: joint.index() }, self.backlash.of(joint)));
        let dragged = [
            (Joint::Elbow, Joint::Shoulder, drag.elbow_by_shoulder),
            (Joint::WristPitch, Joint::Shoulder, drag.wrist_pitch_by_shoulder),
            (Joint::WristPitch, Joint::Elbow, drag.wrist_pitch_by_elbow),
            (Joint::Gripper, Joint::Elbow, drag.gripper_by_elbow),
        ];
        let dragged = dragged.map(|(joint, driver, fraction)| {
            (Flaw::CableDrag { joint: joint.index(), driver: driver.index() }, fraction)
        });
        let give = [
            (Joint::Shoulder, droop.shoulder_give),
            (Joint::Elbow, droop.elbow_give),
            (Joint::WristPitch, droop.wrist_pitch_give),
        ];
        let give = give.map(|(joint, give)| (Flaw::JointCompliance { joint: joint.index() }, give));
        play.into_iter()
            .chain(dragged)
            .chain(give)
            .filter(|(_, size)| *size != 0.0)
            .map(|(mechanism, size)| Imperfection { mechanism, size })
            .collect()
    }
}

impl ArmGeometry {
    /// The length furthest from the waist's axis a part can reach, mm.
    pub fn reach(&self) -> f64 {
        self.upper_arm + self.forearm + self.hand
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::description::GRAVITY;
    use crate::physics::machine::Conditions;
    use crate::physics::slow_change::COLD_C;
    use crate::world::pose::ArmPose;
    use proptest::prelude::*;

    const GEOMETRY: ArmGeometry =
        ArmGeometry { shoulder_height: 195.0, upper_arm: 177.8, forearm: 177.8, hand: 109.0 };

    fn mechanism() -> Mechanism {
        Mechanism {
            geometry: GEOMETRY,
            backlash: Joints::default(),
            drag: CableDrag {
                elbow_by_shoulder: 0.01,
                wrist_pitch_by_shoulder: -0.02,
                wrist_pitch_by_elbow: 0.005,
                gripper_by_elbow: 1.5,
            },
            droop: Droop {
                upper_arm_mass: 0.8,
                forearm_mass: 0.4,
                hand_mass: 0.5,
                shoulder_give: 0.01,
                elbow_give: 0.02,
                wrist_pitch_give: 0.03,
            },
        }
    }

    fn without_drag() -> Mechanism {
        Mechanism { drag: CableDrag::default(), ..mechanism() }
    }

    fn under(payload_kg: f64) -> Conditions {
        Conditions { time_s: 0.0, temperature_c: COLD_C, payload_kg }
    }

    /// True attitudes when the drives have been sent there and the fingers carry this.
    fn attitudes(mechanism: &Mechanism, drives: [f64; AXES], payload_kg: f64) -> Joints {
        let mut machine = mechanism.machine();
        machine.go(&drives, 0.0);
        Joints::of_drives(&machine.equilibrium(&under(payload_kg)).unwrap().drives)
    }

    fn pose(attitudes: [f64; AXES]) -> ArmPose {
        ArmPose::of(&mechanism().machine().stiff(&attitudes).link_frames)
    }

    proptest! {
        /// By plane trigonometry: every link at its own attitude, all in the plane that the waist turns.
        #[test]
        fn every_link_is_at_its_own_attitude(attitudes in prop::array::uniform6(-3.0..3.0_f64)) {
            let [waist, shoulder, elbow, wrist_pitch, ..] = attitudes;
            let along = |attitude: f64| {
                Vector::new(attitude.cos() * waist.cos(), attitude.cos() * waist.sin(), attitude.sin())
            };
            let at_elbow = Vector::Z * 195.0 + along(shoulder) * 177.8;
            let at_wrist = at_elbow + along(elbow) * 177.8;
            let pose = pose(attitudes);
            prop_assert!((pose.elbow - at_elbow).norm() < 1e-12 * 400.0);
            prop_assert!((pose.wrist - at_wrist).norm() < 1e-12 * 400.0);
            prop_assert!((pose.tool - at_wrist - along(wrist_pitch) * 109.0).norm() < 1e-12 * 400.0);
            prop_assert!((pose.looks - along(wrist_pitch)).norm() < 1e-14);
        }

        #[test]
        fn attitudes_and_the_command_for_them_belong_together(
            drives in prop::array::uniform6(-1.5..1.5_f64), load in 0.0..0.454_f64,
        ) {
            let mechanism = mechanism();
            let reached = attitudes(&mechanism, drives, load);
            let back = Joints::of_drives(&mechanism.machine().command_for(&reached.0, &under(load)));
            prop_assert!(back.minus(&Joints(drives)).largest() < 1e-12);
        }
    }

    #[test]
    fn an_attitude_goes_as_far_as_its_own_joint_and_those_before_it() {
        assert_eq!(attitude_range_deg(Joint::Waist), Some([-90.0, 90.0]));
        assert_eq!(attitude_range_deg(Joint::Elbow), Some([-35.0 - 149.0, 144.0]));
        assert_eq!(attitude_range_deg(Joint::WristPitch), Some([-35.0 - 149.0 - 90.0, 144.0 + 90.0]));
        assert_eq!(attitude_range_deg(Joint::Gripper), None);
    }

    #[test]
    fn the_hand_hangs_under_the_wrist() {
        let pose = pose([FRAC_PI_2, 0.0, -FRAC_PI_2, -FRAC_PI_2, 0.0, 0.0]);
        assert!((pose.tool.x).abs() < 1e-12);
        assert!((pose.tool.y - 177.8).abs() < 1e-12);
        assert!((pose.tool.z - (195.0 - 177.8 - 109.0)).abs() < 1e-12);
        assert!((pose.looks.z + 1.0).abs() < 1e-15);
    }

    #[test]
    fn moving_the_shoulder_keeps_the_attitude_of_forearm_and_hand() {
        let low = pose([0.0, 0.2, -1.0, -1.5, 0.0, 0.0]);
        let high = pose([0.0, 0.7, -1.0, -1.5, 0.0, 0.0]);
        assert!(((low.tool.x - low.elbow.x) - (high.tool.x - high.elbow.x)).abs() < 1e-12);
        assert!(((low.tool.z - low.elbow.z) - (high.tool.z - high.elbow.z)).abs() < 1e-12);
    }

    #[test]
    fn a_level_arm_sinks_by_its_moment_and_a_hanging_one_does_not() {
        let mut mechanism = without_drag();
        mechanism.droop.shoulder_give = 1e-6;
        let sunk = attitudes(&mechanism, [0.0; AXES], 0.0);
        let moment = (0.8 * 177.8 / 2.0 + 0.9 * 177.8) * 1e-3 * GRAVITY;
        assert!((sunk.of(Joint::Shoulder) + 1e-6 * moment).abs() < 1e-12);
        let hanging = -FRAC_PI_2;
        let still = attitudes(&mechanism, [0.0, 0.5, hanging, hanging, 0.0, 0.0], 0.0);
        assert!((still.of(Joint::Elbow) - hanging).abs() < 1e-12);
    }

    #[test]
    fn what_the_fingers_carry_bends_the_wrist_by_its_whole_lever_and_rests_on_the_joints_before() {
        let mut mechanism = without_drag();
        (mechanism.droop.shoulder_give, mechanism.droop.elbow_give, mechanism.droop.wrist_pitch_give) =
            (1e-6, 1e-6, 1e-6);
        let more = attitudes(&mechanism, [0.0; AXES], 0.3).minus(&attitudes(&mechanism, [0.0; AXES], 0.0));
        for (joint, lever_mm) in [(Joint::Shoulder, 177.8), (Joint::Elbow, 177.8), (Joint::WristPitch, 109.0)]
        {
            let expected = -1e-6 * 0.3 * GRAVITY * lever_mm * 1e-3;
            assert!((more.of(joint) - expected).abs() < 1e-12, "{joint:?}: {}", more.of(joint));
        }
    }

    #[test]
    fn cables_that_do_not_keep_attitudes_turn_the_forearm_with_the_shoulder() {
        let mut mechanism = mechanism();
        mechanism.droop = Droop::default();
        let before = attitudes(&mechanism, [0.0; AXES], 0.0);
        let after = attitudes(&mechanism, [0.0, 1.0, 0.0, 0.0, 0.0, 0.0], 0.0);
        assert!((after.of(Joint::Elbow) - before.of(Joint::Elbow) - 0.01).abs() < 1e-15);
    }
}
