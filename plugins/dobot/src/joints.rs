//! The joints as the maker counts them, deg, and how far they go.

use plumb_plugin::{JointDescription, JointUnit, JointVector, PluginError};

use crate::configuration::Configuration;

/// How many the controller always reports.
pub(crate) const AXES: usize = 4;

/// A joint of a Magician: its name, and how far it goes, deg (User Guide, technical specifications).
pub(crate) const JOINTS: [(&str, [f64; 2]); AXES] = [
    ("base", [-90.0, 90.0]),
    // 0 where the rear arm is upright, growing forward.
    ("rear_arm", [0.0, 85.0]),
    // 0 where the forearm lies level, growing downward, whatever the rear arm does: a parallelogram holds it.
    ("forearm", [-10.0, 95.0]),
    ("hand", [-90.0, 90.0]),
];
/// The joint that begins at the shoulder and the one that hangs in the parallelogram, by their indices.
const REAR_ARM: usize = 1;
const FOREARM: usize = 2;
/// A step of the stepper motors: 1.8 deg, 16 microsteps, gears of 10.
pub(crate) const STEP_DEG: f64 = 1.8 / 160.0;
/// A target may lie beyond a limit by this, deg: a step, rounded up.
const BESIDE_LIMITS: f64 = 0.02;

/// What the controller says of its joints, deg.
pub(crate) type Angles = [f64; AXES];

/// The angle between the two arms, deg: what the parallelogram can open and close to.
pub(crate) fn between_arms(angles: &Angles) -> f64 {
    90.0 + angles[REAR_ARM] - angles[FOREARM]
}

/// How many joints there are: the hand's servo may not be there.
pub(crate) fn count(configuration: &Configuration) -> usize {
    if configuration.hand { AXES } else { AXES - 1 }
}

/// What the robot says of its joints.
pub(crate) fn descriptions(configuration: &Configuration) -> Vec<JointDescription> {
    let described = |(name, [lower, upper]): &(&str, [f64; 2])| JointDescription {
        name: (*name).to_owned(),
        unit: JointUnit::Radian,
        lower: lower.to_radians(),
        upper: upper.to_radians(),
        resolution: STEP_DEG.max(configuration.settles_within).to_radians(),
        max_speed: configuration.full_speed.to_radians(),
        // Where homing ends by the controller's default (protocol, 1.6): (0, 45, 45, 0).
        home: if matches!(*name, "rear_arm" | "forearm") { std::f64::consts::FRAC_PI_4 } else { 0.0 },
    };
    JOINTS.iter().take(count(configuration)).map(described).collect()
}

/// The joints in rad, as many as there are.
pub(crate) fn vector(angles: &Angles, count: usize) -> JointVector {
    let mut vector = JointVector::zeros(count);
    for (index, degrees) in angles.iter().take(count).enumerate() {
        vector.set(index, degrees.to_radians());
    }
    vector
}

/// Joints in words, deg.
pub(crate) fn in_words(angles: &Angles, count: usize) -> String {
    let one = |((name, _), degrees): (&(&str, [f64; 2]), &f64)| format!("{name} {degrees:.2}");
    let all: Vec<String> = JOINTS.iter().zip(angles).take(count).map(one).collect();
    format!("{} degrees", all.join(", "))
}

/// Says why the arm cannot go there, if so.
pub(crate) fn check_reach(requested: &Angles, configuration: &Configuration) -> Result<(), PluginError> {
    let joints = JOINTS.iter().zip(requested).take(count(configuration));
    for ((name, [lower, upper]), degrees) in joints {
        if *degrees < lower - BESIDE_LIMITS || *degrees > upper + BESIDE_LIMITS {
            return Err(PluginError::OutOfRange(format!(
                "{name} would go to {degrees:.2} degrees; it goes from {lower} to {upper}"
            )));
        }
    }
    let [least, most] = configuration.between_arms;
    let open = between_arms(requested);
    if open < least - BESIDE_LIMITS || open > most + BESIDE_LIMITS {
        return Err(PluginError::OutOfRange(format!(
            "rear_arm at {:.2} and forearm at {:.2} degrees would be {open:.2} degrees apart (90 + rear_arm - forearm); the parallelogram goes from {least} to {most}",
            requested[REAR_ARM], requested[FOREARM]
        )));
    }
    Ok(())
}
