//! From the motors' rotors to the true attitudes of the arm: play in the drives, cables that do not keep attitudes quite,
//! and parts that give way under their weight; and what the arm cannot enter.

use std::f64::consts::FRAC_PI_2;

use super::drive::{AXES, HalfSteps, Joint, Joints};
use super::geometry::{ArmGeometry, ArmPose};
use super::play::follow;
use crate::physics::description::{ArmDescription, Convention, Joint as Row, Motion, Weight};
use crate::physics::imperfection::{Imperfection, Mechanism as Flaw};
use crate::physics::machine::Machine;
use crate::physics::rigid::{Rigid, Vector};
use crate::physics::transmission::Transmission;

const GRAVITY: f64 = 9.806_65;
const METRES_PER_MM: f64 = 1e-3;

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
    /// Width of what is between the fingers, mm; 0 when they meet each other.
    pub held_width: f64,
    /// Mass that hangs at the fingers' tips, kg.
    pub carried_mass: f64,
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
const WIDEST: f64 = 76.2;

/// How far (mm of its drive) the gripper's cable can be drawn past the touch of the fingers before the motor stalls: the
/// greatest grip of 8 pounds, at 32 half-steps a pound.
const GREATEST_GRIP: f64 = 8.0 * 32.0 / super::drive::GRIPPER_HALF_STEPS_PER_MM;

/// How far the cable is drawn when the grip switch closes: a light touch, mm of the drive.
const GRIP_SWITCH: f64 = 4.0 / super::drive::GRIPPER_HALF_STEPS_PER_MM;

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

/// Weights, and how far each joint gives way to the moment they make about it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Droop {
    /// Mass of the upper arm, acting at its middle, kg.
    pub upper_arm_mass: f64,
    /// Mass of the forearm, acting at its middle, kg.
    pub forearm_mass: f64,
    /// Mass of the hand and what it holds, acting at its middle, kg.
    pub hand_mass: f64,
    /// Give of the shoulder, rad/(N m).
    pub shoulder_give: f64,
    /// Give of the elbow, rad/(N m).
    pub elbow_give: f64,
    /// Give of the wrist's pitch, rad/(N m).
    pub wrist_pitch_give: f64,
}

impl Mechanism {
    /// The arm with what is not ideal about it, its drives at 0 and without a history.
    pub fn machine(&self) -> Machine {
        Machine::new(&self.on_paper(), &self.imperfections())
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
            |joint: Joint, mass, centre| Weight { after: joint.place(), mass, centre: Vector::from(centre) };
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
            Joint::ALL.map(|joint| (Flaw::JointBacklash { joint: joint.place() }, self.backlash.of(joint)));
        let dragged = [
            (Joint::Elbow, Joint::Shoulder, drag.elbow_by_shoulder),
            (Joint::WristPitch, Joint::Shoulder, drag.wrist_pitch_by_shoulder),
            (Joint::WristPitch, Joint::Elbow, drag.wrist_pitch_by_elbow),
            (Joint::Gripper, Joint::Elbow, drag.gripper_by_elbow),
        ];
        let dragged = dragged.map(|(joint, driver, share)| {
            (Flaw::CableDrag { joint: joint.place(), driver: driver.place() }, share)
        });
        let give = [
            (Joint::Shoulder, droop.shoulder_give),
            (Joint::Elbow, droop.elbow_give),
            (Joint::WristPitch, droop.wrist_pitch_give),
        ];
        let give = give.map(|(joint, give)| (Flaw::JointCompliance { joint: joint.place() }, give));
        play.into_iter()
            .chain(dragged)
            .chain(give)
            .filter(|(_, size)| *size != 0.0)
            .map(|(mechanism, size)| Imperfection { mechanism, size })
            .collect()
    }

    /// Where the links stand behind their drives' play, once the rotors have come straight to `rotors`.
    pub fn carried(&self, before: &Joints, rotors: &HalfSteps) -> Joints {
        let drives = rotors.to_joints();
        Joints(std::array::from_fn(|axis| follow(before.0[axis], drives.0[axis], self.backlash.0[axis])))
    }

    /// The true attitudes when the links stand so behind their drives. The fingers stop at what they hold; their cable is
    /// drawn on.
    pub fn attitudes(&self, carried: &Joints) -> Joints {
        let mut attitudes = self.droop.settled(&self.loaded(), &self.drag.dragged(carried));
        let opening = &mut attitudes.0[Joint::Gripper.place()];
        *opening = opening.max(self.held_width);
        attitudes
    }

    fn loaded(&self) -> Loaded<'_> {
        Loaded { geometry: &self.geometry, carried_mass: self.carried_mass }
    }

    /// How far the gripper's cable is drawn past the touch of the fingers, mm of its drive.
    pub fn grip(&self, carried: &Joints) -> f64 {
        (self.held_width - self.drag.dragged(carried).of(Joint::Gripper)).max(0.0)
    }

    /// Whether the gripper's switch is closed.
    pub fn grips(&self, carried: &Joints) -> bool {
        self.grip(carried) >= GRIP_SWITCH
    }

    /// Where the links must stand behind their drives for the true attitudes to be these.
    pub fn carried_for(&self, attitudes: &Joints) -> Joints {
        self.drag.released(&self.droop.lifted(&self.loaded(), attitudes))
    }

    /// How deep the arm is in something it cannot enter, mm; 0 or less when it is free. Stops of joints count as their angle
    /// on an arm's length.
    pub fn trespass(&self, carried: &Joints, attitudes: &Joints, pose: &ArmPose, solid_table: bool) -> f64 {
        let under_table = -pose.tool.z.min(pose.wrist.z).min(pose.elbow.z);
        let past_stop = past_stops(attitudes, self.geometry.forearm).max(self.grip(carried) - GREATEST_GRIP);
        if solid_table { under_table.max(past_stop) } else { past_stop }
    }
}

/// How far the furthest joint is past its mechanical stop, mm on an arm's length. The forearm's stops are relative to the
/// upper arm and the hand's to the forearm.
fn past_stops(attitudes: &Joints, arm_length: f64) -> f64 {
    let degrees_outside = |value: f64, low: f64, high: f64| {
        let value = value.to_degrees();
        (low - value).max(value - high).to_radians() * arm_length
    };
    let elbow = attitudes.of(Joint::Elbow) - attitudes.of(Joint::Shoulder);
    let wrist = attitudes.of(Joint::WristPitch) - attitudes.of(Joint::Elbow);
    let opening = attitudes.of(Joint::Gripper);
    degrees_outside(attitudes.of(Joint::Waist), -90.0, 90.0)
        .max(degrees_outside(attitudes.of(Joint::Shoulder), -35.0, 144.0))
        .max(degrees_outside(elbow, -149.0, 0.0))
        .max(degrees_outside(wrist, -90.0, 90.0))
        .max(degrees_outside(attitudes.of(Joint::WristRoll), -360.0, 360.0))
        .max(opening - WIDEST)
}

impl CableDrag {
    fn dragged(&self, carried: &Joints) -> Joints {
        let [waist, shoulder, mut elbow, mut wrist_pitch, wrist_roll, mut gripper] = carried.0;
        elbow += self.elbow_by_shoulder * shoulder;
        wrist_pitch += self.wrist_pitch_by_shoulder * shoulder + self.wrist_pitch_by_elbow * elbow;
        gripper += self.gripper_by_elbow * elbow;
        Joints([waist, shoulder, elbow, wrist_pitch, wrist_roll, gripper])
    }

    fn released(&self, attitudes: &Joints) -> Joints {
        let [waist, shoulder, elbow, mut wrist_pitch, wrist_roll, mut gripper] = attitudes.0;
        wrist_pitch -= self.wrist_pitch_by_shoulder * shoulder + self.wrist_pitch_by_elbow * elbow;
        gripper -= self.gripper_by_elbow * elbow;
        let elbow = elbow - self.elbow_by_shoulder * shoulder;
        Joints([waist, shoulder, elbow, wrist_pitch, wrist_roll, gripper])
    }
}

/// The arm's lengths, and what it carries at the fingers' tips, kg.
#[derive(Clone, Copy)]
struct Loaded<'a> {
    geometry: &'a ArmGeometry,
    carried_mass: f64,
}

impl Droop {
    /// The attitudes at which weight and give balance, found by letting the arm sink until it stays.
    fn settled(&self, arm: &Loaded<'_>, unloaded: &Joints) -> Joints {
        const STILL: f64 = 1e-15;
        let mut attitudes = *unloaded;
        for _ in 0..200 {
            let lower = unloaded.minus(&self.sag(arm, &attitudes));
            let stir = lower.minus(&attitudes).largest();
            attitudes = lower;
            if stir < STILL {
                break;
            }
        }
        attitudes
    }

    fn lifted(&self, arm: &Loaded<'_>, loaded: &Joints) -> Joints {
        loaded.plus(&self.sag(arm, loaded))
    }

    /// How far each joint gives way, rad. The cables hold forearm and hand from the base, so that their moments pass the
    /// shoulder by and only their weight rests on the upper arm's end.
    fn sag(&self, arm: &Loaded<'_>, attitudes: &Joints) -> Joints {
        let Loaded { geometry, carried_mass } = *arm;
        let at_the_wrist = self.hand_mass + carried_mass;
        let newton_metres = |mass: f64, lever: f64, joint: Joint| {
            mass * GRAVITY * lever * METRES_PER_MM * attitudes.of(joint).cos()
        };
        let on_shoulder = newton_metres(self.upper_arm_mass, geometry.upper_arm / 2.0, Joint::Shoulder)
            + newton_metres(self.forearm_mass + at_the_wrist, geometry.upper_arm, Joint::Shoulder);
        let on_elbow = newton_metres(self.forearm_mass, geometry.forearm / 2.0, Joint::Elbow)
            + newton_metres(at_the_wrist, geometry.forearm, Joint::Elbow);
        let on_wrist = newton_metres(self.hand_mass, geometry.hand / 2.0, Joint::WristPitch)
            + newton_metres(carried_mass, geometry.hand, Joint::WristPitch);
        Joints([
            0.0,
            self.shoulder_give * on_shoulder,
            self.elbow_give * on_elbow,
            self.wrist_pitch_give * on_wrist,
            0.0,
            0.0,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::machine::Conditions;
    use crate::physics::slow_change::COLD_C;
    use proptest::prelude::*;

    fn mechanism() -> Mechanism {
        Mechanism {
            geometry: ArmGeometry { shoulder_height: 195.0, upper_arm: 177.8, forearm: 177.8, hand: 109.0 },
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
            held_width: 0.0,
            carried_mass: 0.0,
        }
    }

    fn at_load(payload_kg: f64) -> Conditions {
        Conditions { time_s: 0.0, temperature_c: COLD_C, payload_kg }
    }

    proptest! {
        #[test]
        fn the_description_stands_where_the_worlds_own_geometry_does(
            attitudes in prop::array::uniform6(-3.0..3.0_f64).prop_map(Joints),
        ) {
            let mechanism = mechanism();
            let own = mechanism.geometry.pose(&attitudes);
            let posture = mechanism.machine().stiff(&attitudes.0).posture;
            let off = |own: super::super::geometry::Point, made: Vector| (Vector::new(own.x, own.y, own.z) - made).norm();
            prop_assert!(off(own.elbow, posture.axes[2].point) < 1e-9);
            prop_assert!(off(own.wrist, posture.axes[3].point) < 1e-9);
            prop_assert!(off(own.tool, posture.target) < 1e-9);
            prop_assert!(off(own.looks, posture.axes[4].direction) < 1e-12);
        }

        #[test]
        fn the_description_droops_and_plays_as_the_worlds_own_mechanism_does(
            path in prop::collection::vec(prop::array::uniform6(-1.5..1.5_f64).prop_map(Joints), 1..8),
            load in 0.0..0.454_f64,
        ) {
            let mut mechanism = mechanism();
            (mechanism.carried_mass, mechanism.held_width) = (load, -100.0);
            mechanism.backlash = Joints([0.01, 0.02, 0.03, 0.04, 0.05, 0.5]);
            let mut machine = mechanism.machine();
            let mut carried = path[0];
            for attitudes in path {
                let rotors = HalfSteps::from_joints(&attitudes);
                carried = mechanism.carried(&carried, &rotors);
                machine.go(&rotors.to_joints().0, 0.0);
                let own = mechanism.attitudes(&carried);
                let made = machine.stand(&at_load(load)).unwrap().drives;
                let back = mechanism.carried_for(&own);
                let command = machine.command_for(&own.0, &at_load(load));
                for axis in 0..AXES {
                    prop_assert!((made[axis] - own.0[axis]).abs() < 1e-12);
                    prop_assert!((command[axis] - back.0[axis]).abs() < 1e-12);
                }
            }
        }

        #[test]
        fn attitudes_and_the_links_behind_their_drives_belong_together(
            carried in prop::array::uniform6(-1.5..1.5_f64).prop_map(Joints),
        ) {
            let mechanism = mechanism();
            let mut carried = carried;
            carried.0[Joint::Gripper.place()] += 10.0;
            let back = mechanism.carried_for(&mechanism.attitudes(&carried));
            prop_assert!(back.minus(&carried).largest() < 1e-12);
        }
    }

    #[test]
    fn a_level_arm_sinks_by_its_moment_and_a_hanging_one_does_not() {
        let mut mechanism = mechanism();
        mechanism.drag = CableDrag::default();
        mechanism.droop.shoulder_give = 1e-6;
        let sunk = mechanism.attitudes(&Joints::default());
        let moment = (0.8 * 177.8 / 2.0 + 0.9 * 177.8) * 1e-3 * GRAVITY;
        assert!((sunk.of(Joint::Shoulder) + 1e-6 * moment).abs() < 1e-12);
        let hanging = -std::f64::consts::FRAC_PI_2;
        let still = mechanism.attitudes(&Joints([0.0, 0.5, hanging, hanging, 0.0, 0.0]));
        assert!((still.of(Joint::Elbow) - hanging).abs() < 1e-12);
    }

    #[test]
    fn what_the_fingers_carry_bends_the_wrist_by_its_whole_lever_and_rests_on_the_joints_before() {
        let mut mechanism = mechanism();
        mechanism.drag = CableDrag::default();
        (mechanism.droop.shoulder_give, mechanism.droop.elbow_give, mechanism.droop.wrist_pitch_give) =
            (1e-6, 1e-6, 1e-6);
        let empty = mechanism.attitudes(&Joints::default());
        mechanism.carried_mass = 0.3;
        let more = mechanism.attitudes(&Joints::default()).minus(&empty);
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
        let before = mechanism.attitudes(&Joints::default());
        let after = mechanism.attitudes(&Joints([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]));
        assert!((after.of(Joint::Elbow) - before.of(Joint::Elbow) - 0.01).abs() < 1e-15);
    }

    #[test]
    fn fingers_stop_at_what_they_hold_and_their_cable_is_drawn_on() {
        let mut mechanism = mechanism();
        mechanism.drag = CableDrag::default();
        mechanism.held_width = 12.0;
        let closing = |drive: f64| Joints([0.0, 0.0, 0.0, 0.0, 0.0, drive]);
        assert_eq!(mechanism.attitudes(&closing(15.0)).of(Joint::Gripper), 15.0);
        assert_eq!(mechanism.attitudes(&closing(10.0)).of(Joint::Gripper), 12.0);
        assert!(!mechanism.grips(&closing(12.0)) && mechanism.grips(&closing(11.7)));
        // One pound of grip is 32 half-steps.
        let pound = 32.0 / super::super::drive::GRIPPER_HALF_STEPS_PER_MM;
        assert!((mechanism.grip(&closing(12.0 - pound)) - pound).abs() < 1e-12);
    }

    #[test]
    fn a_solid_table_and_a_joints_stop_are_trespassed_on() {
        let mechanism = mechanism();
        let hanging = -std::f64::consts::FRAC_PI_2;
        let low = Joints([0.0, 0.2, hanging, hanging, 0.0, 10.0]);
        let pose = mechanism.geometry.pose(&low);
        let depth = -(195.0 + 177.8 * 0.2_f64.sin() - 177.8 - 109.0);
        assert!((mechanism.trespass(&low, &low, &pose, true) - depth).abs() < 1e-9);
        assert!(mechanism.trespass(&low, &low, &pose, false) <= 0.0);
        let folded = Joints([0.0, 1.5, -1.4, hanging, 0.0, 10.0]);
        let pose = mechanism.geometry.pose(&folded);
        assert!(mechanism.trespass(&folded, &folded, &pose, true) > 0.0);
    }
}
