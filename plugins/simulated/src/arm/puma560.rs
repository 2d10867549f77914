//! The PUMA 560: angles as VAL reads them, motors' encoders behind coupled wrist gears, and the cage on its flange where levels lie.

use std::borrow::Cow;

use super::description::{ArmOnPaper, LevelDirection, LevelSurface};
use super::drive::{Drive, JointDrive, MotorCoupling};
use crate::physics::arms;
use crate::physics::description::{DescriptionError, Motion};
use crate::physics::rigid::Vector;

/// How many joints, and how many motors, the arm has.
pub(crate) const AXES: usize = 6;

/// As cell files name the arm.
pub(crate) const NAME: &str = "puma560";

/// What is known of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointOfPuma {
    /// As files and people name it.
    pub name: &'static str,
    /// How far software lets it go, degrees.
    pub limits_deg: [f64; 2],
    /// Greatest speed, degrees/s.
    pub top_speed_deg: f64,
    /// Counts of the motor's encoder for a degree of the joint (comp.robotics 1990; joint 6 without its divide-by-two bit).
    pub counts_per_deg: f64,
    /// Counts from one index pulse to the next (Armstrong's table of potentiometers: 800 at joint 2, 1000 else).
    pub counts_a_turn: f64,
    /// Where it is in the ready position, degrees.
    pub ready_deg: f64,
}

/// From the base to the flange.
pub const JOINTS: [JointOfPuma; AXES] = [
    joint("waist", [-160.0, 160.0], 82.0, [173.92, 1000.0], 0.0),
    joint("shoulder", [-225.0, 45.0], 54.0, [239.59, 800.0], -90.0),
    joint("elbow", [-45.0, 225.0], 122.0, [149.18, 1000.0], 90.0),
    joint("wrist_roll", [-110.0, 170.0], 228.0, [211.21, 1000.0], 0.0),
    joint("wrist_bend", [-100.0, 100.0], 241.0, [199.79, 1000.0], 0.0),
    joint("flange", [-266.0, 266.0], 228.0, [213.02, 1000.0], 0.0),
];

/// How far a joint's hard stop lies beyond its software limit, degrees.
const TO_THE_STOP_DEG: f64 = 4.0;

/// From full speed the brakes bring the arm to rest in this time, s.
const BRAKING_S: f64 = 0.25;

/// What may hang on the flange beside the cage, kg.
const MOST_HUNG_KG: f64 = 4.0;

/// The gears of the wrist. Turning joint 4 by 71.923 (76.686) turns drags the motor of joint 5 (6) by one, as read at the joint; the motor of
/// joint 6 follows the raw reading of joint 5 by 13 in 72.
const WRIST_GEARS: [MotorCoupling; 3] = [
    MotorCoupling { motor: 4, driver: 3, fraction: 1.0 / 71.923 },
    MotorCoupling { motor: 5, driver: 3, fraction: -1.0 / 76.686 },
    MotorCoupling { motor: 5, driver: 4, fraction: 13.0 / 72.0 },
];

/// Where a spirit level can lie: on the flat of the wrist assembly, along the forearm and across it; on the cage's back, which lies against the
/// flange and is level when joint 6 is upright, one way and the other; on the cage's top, level when the cage looks straight ahead.
const LEVEL_SURFACES: [LevelSurface; 5] = [
    LevelSurface {
        name: Cow::Borrowed("forearm"),
        carried_by: 3,
        direction: LevelDirection::AlongAxis { along: 3, square_to: 4 },
    },
    LevelSurface {
        name: Cow::Borrowed("forearm_across"),
        carried_by: 3,
        direction: LevelDirection::SquareToAxes(4, 3),
    },
    on_cage("cage_back", -1.0),
    on_cage("cage_back_across", 1.0),
    on_cage("cage_top", 1.0),
];

const fn joint(
    name: &'static str,
    limits_deg: [f64; 2],
    top_speed_deg: f64,
    [counts_per_deg, counts_a_turn]: [f64; 2],
    ready_deg: f64,
) -> JointOfPuma {
    JointOfPuma { name, limits_deg, top_speed_deg, counts_per_deg, counts_a_turn, ready_deg }
}

/// A surface of the cage, the level's arrow along the flange's x and, to the one side or the other, its y.
const fn on_cage(name: &'static str, side: f64) -> LevelSurface {
    const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;
    let direction = LevelDirection::OnTool(Vector::new(DIAGONAL, side * DIAGONAL, 0.0));
    LevelSurface { name: Cow::Borrowed(name), carried_by: 5, direction }
}

impl JointOfPuma {
    /// Where its hard stops are, degrees.
    pub fn stops_deg(&self) -> [f64; 2] {
        let [lower, upper] = self.limits_deg;
        [lower - TO_THE_STOP_DEG, upper + TO_THE_STOP_DEG]
    }

    /// How far the joint turns from one index pulse of its motor's encoder to the next, degrees: a turn of the motor.
    pub fn index_spacing_deg(&self) -> f64 {
        self.counts_a_turn / self.counts_per_deg
    }

    fn drive(&self) -> JointDrive {
        JointDrive {
            name: self.name.to_owned(),
            motion: Motion::Turns,
            limits: self.limits_deg.map(f64::to_radians),
            stops: self.stops_deg().map(f64::to_radians),
            top_speed: self.top_speed_deg.to_radians(),
            counts_per_unit: self.counts_per_deg.to_degrees(),
            home: self.ready_deg.to_radians(),
        }
    }
}

/// What the motors' encoders show for these joint values (rad): counts, not whole.
pub fn encoder_counts(joints: &[f64]) -> Vec<f64> {
    drive().encoder_counts(joints)
}

/// The drive of the arm, set to whole counts.
pub(crate) fn drive() -> Drive {
    Drive {
        joints: JOINTS.iter().map(JointOfPuma::drive).collect(),
        couplings: WRIST_GEARS.to_vec(),
        whole_counts: true,
        braking_s: BRAKING_S,
    }
}

/// The arm on paper, or why its description cannot be read.
pub(crate) fn on_paper() -> Option<Result<ArmOnPaper, DescriptionError>> {
    let on_paper = |shape| ArmOnPaper {
        name: NAME.to_owned(),
        model: "Unimation PUMA 560".to_owned(),
        shape,
        drive: drive(),
        level_surfaces: LEVEL_SURFACES.to_vec(),
        wrist: Some(4),
        most_hung_kg: MOST_HUNG_KG,
    };
    Some(arms::by_name(NAME)?.map(on_paper))
}
