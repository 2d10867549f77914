//! What is known of an arm on paper: joints, links and target, read from a model file of the lab's format.

use std::path::Path;

use plumb_document::{FileProblems, Node, NodeValue, OtherKeys, Problems, parse, typed, typed_with};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::rigid::{Rigid, Vector};
use super::transmission::Transmission;

/// Standard gravity, m/s2.
pub const GRAVITY: f64 = 9.80665;

/// Where a row of the Denavit-Hartenberg table puts the turn of its joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Convention {
    /// Standard: turn, offset, length, twist. The row's frame sits at the far end of the link.
    Distal,
    /// Modified (Craig): twist, length, turn, offset. The row's frame sits on the joint itself.
    Proximal,
}

/// How a joint moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Motion {
    /// It turns about the z axis of its row; its reading is in rad.
    #[default]
    Turns,
    /// It slides along the z axis of its row; its reading is in mm.
    Slides,
}

/// One joint and the link that belongs to its row.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Joint {
    /// Name, unique in the arm.
    pub name: String,
    /// Whether it turns or slides.
    #[serde(default)]
    pub motion: Motion,
    /// A fixed motion between the row before and this one, where the row's four numbers are not enough (the origins of a URDF).
    #[serde(skip, default = "nowhere")]
    pub mounted: Rigid,
    /// Length of the common normal, mm.
    pub length: f64,
    /// Twist about the common normal, rad.
    pub twist: f64,
    /// Offset along the joint's axis, mm.
    pub offset: f64,
    /// Angle of the common normal where the joint reads zero (of a slide: always), rad.
    pub rest_angle: f64,
    /// +1 or -1: whether the joint's reading turns with or against the right hand about its axis.
    pub sign: f64,
    /// Travel, rad (mm of a slide), lower and upper.
    pub limits: [f64; 2],
    /// Turns of the motor for a turn of the joint, where known.
    pub gear_ratio: Option<f64>,
    /// Travel of a slide for a turn of its screw, mm, where known.
    #[serde(default)]
    pub screw_pitch: Option<f64>,
}

/// A weight carried by a link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Weight {
    /// Index of the joint that carries it.
    pub after: usize,
    /// kg.
    pub mass: f64,
    /// Centre of mass in the frame of that joint's row, mm.
    pub centre: Vector,
}

/// An arm as its papers describe it: the nominal model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ArmDescription {
    /// Name of the arm.
    pub name: String,
    /// Convention of the joints' rows.
    pub convention: Convention,
    /// From the base to the flange.
    pub joints: Vec<Joint>,
    /// What weighs.
    pub weights: Vec<Weight>,
    /// Position of the base in the world, mm.
    pub base_position: Vector,
    /// Fixed-axis roll, pitch, yaw of the base, rad.
    pub base_orientation: [f64; 3],
    /// The flange in the frame of the last row.
    #[serde(skip, default = "nowhere")]
    pub flange: Rigid,
    /// Measured target in the flange's frame, mm.
    pub target: Vector,
    /// How its drives work its joints.
    #[serde(skip, default)]
    pub transmission: Transmission,
    /// Standard deviation that the file declares for each axis of a measured position, mm.
    pub declared_noise: Option<f64>,
}

/// Why a description could not be used.
#[derive(Debug, thiserror::Error)]
pub enum DescriptionError {
    /// Not readable as YAML of this format; the message carries line and column.
    #[error("the arm's description cannot be read: {0}")]
    Read(String),
    /// The arm has no joints.
    #[error("the arm `{0}` has no joints: list at least one under `joints:`")]
    NoJoints(String),
    /// Two joints share a name.
    #[error("the arm `{arm}` has two joints named `{joint}`: names must differ")]
    SameName {
        /// The arm.
        arm: String,
        /// The name used twice.
        joint: String,
    },
    /// The travel of a joint is empty or not finite.
    #[error("joint `{joint}`: {key} [{low}, {high}] leave no travel; the lower limit comes first")]
    Limits {
        /// The joint.
        joint: String,
        /// As the limits are written.
        key: &'static str,
        /// Lower limit, degrees or mm.
        low: f64,
        /// Upper limit, degrees or mm.
        high: f64,
    },
    /// Limits under the other kind of joint's key, or a slide without any.
    #[error("joint `{joint}`: its travel is written as `{key}: [from, to]`")]
    Travel {
        /// The joint.
        joint: String,
        /// As its limits are written.
        key: &'static str,
    },
    /// A number that is not finite or of no use.
    #[error("joint `{joint}`: {what} is {value}; {right}")]
    Number {
        /// The joint.
        joint: String,
        /// Which number.
        what: &'static str,
        /// What is there.
        value: f64,
        /// What would be right.
        right: &'static str,
    },
    /// A link hangs on a joint that does not exist.
    #[error("links: `after: {after}` names no joint; the joints are {known}")]
    UnknownJoint {
        /// What is there.
        after: String,
        /// The joints' names.
        known: String,
    },
    /// The model has no target p1.
    #[error("targets: there is no p1; the trial's arm carries its target under this name")]
    NoTarget,
}

#[derive(Deserialize)]
struct RawArm {
    arm: String,
    convention: Convention,
    #[serde(default)]
    base: RawBase,
    #[serde(default)]
    targets: RawTargets,
    #[serde(default)]
    noise: RawNoise,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawJoint {
    name: String,
    #[serde(default)]
    a_mm: f64,
    #[serde(default)]
    alpha_deg: f64,
    #[serde(default)]
    d_mm: f64,
    #[serde(default)]
    theta_deg: f64,
    #[serde(default = "one")]
    sign: f64,
    #[serde(default)]
    slides: bool,
    limits_deg: Option<[f64; 2]>,
    limits_mm: Option<[f64; 2]>,
    gear_ratio: Option<f64>,
    screw_pitch_mm: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawLink {
    after: String,
    mass_kg: f64,
    centre_mm: [f64; 3],
}

#[derive(Deserialize, Default)]
struct RawBase {
    #[serde(default)]
    xyz_mm: [f64; 3],
    #[serde(default)]
    rpy_deg: [f64; 3],
}

#[derive(Deserialize, Default)]
struct RawTargets {
    p1: Option<RawTarget>,
}

#[derive(Deserialize)]
struct RawTarget {
    #[serde(default)]
    xyz_mm: [f64; 3],
}

#[derive(Deserialize, Default)]
struct RawNoise {
    p1_mm: Option<f64>,
}

fn nowhere() -> Rigid {
    Rigid::IDENTITY
}

fn one() -> f64 {
    1.0
}

/// Travel of a joint that turns and has no limits, degrees.
const FULL_CIRCLE: [f64; 2] = [-360.0, 360.0];

impl RawJoint {
    fn checked(self) -> Result<Joint, DescriptionError> {
        let refuse = |what, value, right| {
            Err(DescriptionError::Number { joint: self.name.clone(), what, value, right })
        };
        for (what, value) in [
            ("a_mm", self.a_mm),
            ("alpha_deg", self.alpha_deg),
            ("d_mm", self.d_mm),
            ("theta_deg", self.theta_deg),
        ] {
            if !value.is_finite() {
                return refuse(what, value, "a plain number is needed");
            }
        }
        if self.sign.abs() != 1.0 {
            return refuse("sign", self.sign, "it is 1 or -1");
        }
        let (limits, key) = match (self.slides, self.limits_deg, self.limits_mm) {
            (false, given, None) => (given.unwrap_or(FULL_CIRCLE), "limits_deg"),
            (true, None, Some(given)) => (given, "limits_mm"),
            (slides, ..) => {
                let key = if slides { "limits_mm" } else { "limits_deg" };
                return Err(DescriptionError::Travel { joint: self.name, key });
            }
        };
        let [low, high] = limits;
        if !(low.is_finite() && high.is_finite() && low < high) {
            return Err(DescriptionError::Limits { joint: self.name, key, low, high });
        }
        Ok(Joint {
            length: self.a_mm,
            twist: self.alpha_deg.to_radians(),
            offset: self.d_mm,
            rest_angle: self.theta_deg.to_radians(),
            sign: self.sign,
            limits: if self.slides { limits } else { limits.map(f64::to_radians) },
            gear_ratio: self.gear_ratio,
            screw_pitch: self.screw_pitch_mm.filter(|_| self.slides),
            name: self.name,
            motion: if self.slides { Motion::Slides } else { Motion::Turns },
            mounted: Rigid::IDENTITY,
        })
    }
}

impl ArmDescription {
    /// Reads a model file's arm; what concerns only the lab (effects, free parameters, noise) is left aside.
    pub fn from_yaml(text: &str) -> Result<Self, DescriptionError> {
        let (raw, joints, links) = read_raw(text)
            .map_err(|error| DescriptionError::Read(error.to_string().trim_end().to_owned()))?;
        let joints = joints.into_iter().map(RawJoint::checked).collect::<Result<Vec<_>, _>>()?;
        if joints.is_empty() {
            return Err(DescriptionError::NoJoints(raw.arm));
        }
        for (index, joint) in joints.iter().enumerate() {
            if joints.iter().take(index).any(|earlier| earlier.name == joint.name) {
                return Err(DescriptionError::SameName { arm: raw.arm, joint: joint.name.clone() });
            }
        }
        let weights = links.into_iter().map(|link| weight(link, &joints)).collect::<Result<Vec<_>, _>>()?;
        let target = raw.targets.p1.ok_or(DescriptionError::NoTarget)?;
        Ok(Self {
            name: raw.arm,
            convention: raw.convention,
            joints,
            weights,
            base_position: raw.base.xyz_mm.into(),
            base_orientation: raw.base.rpy_deg.map(f64::to_radians),
            flange: Rigid::IDENTITY,
            target: target.xyz_mm.into(),
            transmission: Transmission::Direct,
            declared_noise: raw.noise.p1_mm,
        })
    }

    /// The index of the joint with this name.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// The name of joint `index`; empty past the last one.
    pub fn joint_name(&self, index: usize) -> &str {
        self.joints.get(index).map_or("", |joint| joint.name.as_str())
    }
}

/// The arm as it was typed, its joints and its links. Other keys are the lab's; those of joints and links are all the arm's.
fn read_raw(text: &str) -> Result<(RawArm, Vec<RawJoint>, Vec<RawLink>), FileProblems> {
    let (file, problems) = (Path::new("model"), Problems::default());
    let root = parse(file, text, &problems)?;
    let raw = typed_with(&root, "a model", OtherKeys::LeftAside, &problems);
    let joints = part(&root, "joints", &problems);
    let links = part(&root, "links", &problems);
    problems.into_result(file, text)?;
    let raw = raw.ok_or_else(|| FileProblems::whole_file(file, "this is no model", ""))?;
    Ok((raw, joints, links))
}

/// The list under a key; empty where there is none.
fn part<T: DeserializeOwned>(root: &Node, key: &str, problems: &Problems) -> Vec<T> {
    let NodeValue::Map(entries) = &root.value else { return Vec::new() };
    let found = entries.iter().find(|(known, _)| known.name == key);
    found.and_then(|(_, list)| typed(list, &format!("`{key}`"), problems)).unwrap_or_default()
}

fn weight(link: RawLink, joints: &[Joint]) -> Result<Weight, DescriptionError> {
    let Some(after) = joints.iter().position(|joint| joint.name == link.after) else {
        let known = joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>().join(", ");
        return Err(DescriptionError::UnknownJoint { after: link.after, known });
    };
    Ok(Weight { after, mass: link.mass_kg, centre: link.centre_mm.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE_LINK: &str =
        "arm: pendulum\nconvention: distal\njoints:\n  - {name: pivot, a_mm: 500}\ntargets: {p1: {}}\n";

    #[test]
    fn defaults_are_those_of_the_format() {
        let arm = ArmDescription::from_yaml(ONE_LINK).unwrap();
        assert_eq!(arm.joints[0].sign, 1.0);
        assert_eq!(arm.joints[0].limits, [-std::f64::consts::TAU, std::f64::consts::TAU]);
        assert_eq!(arm.joints[0].gear_ratio, None);
    }

    #[test]
    fn bad_descriptions_say_where_and_what() {
        let message = |from: &str, to: &str| {
            ArmDescription::from_yaml(&ONE_LINK.replace(from, to)).unwrap_err().to_string()
        };
        assert_eq!(
            message("a_mm: 500", "a_mm: 500, limits_deg: [20, -20]"),
            "joint `pivot`: limits_deg [20, -20] leave no travel; the lower limit comes first"
        );
        assert_eq!(message("a_mm: 500", "a_mm: 500, sign: 2"), "joint `pivot`: sign is 2; it is 1 or -1");
        assert_eq!(
            message("targets:", "links: [{after: pivt, mass_kg: 1, centre_mm: [0, 0, 0]}]\ntargets:"),
            "links: `after: pivt` names no joint; the joints are pivot"
        );
        assert_eq!(
            message("targets: {p1: {}}", "targets: {}"),
            "targets: there is no p1; the trial's arm carries its target under this name"
        );
        let unknown = message("a_mm: 500", "a_mm: 500, length: 3");
        assert!(unknown.contains("model:4:30: unknown key `length`"), "{unknown}");
        for slip in ["slides: true", "slides: true, limits_deg: [0, 90]"] {
            assert_eq!(
                message("a_mm: 500", slip),
                "joint `pivot`: its travel is written as `limits_mm: [from, to]`"
            );
        }
        assert_eq!(
            message("a_mm: 500", "slides: true, limits_mm: [90, 0]"),
            "joint `pivot`: limits_mm [90, 0] leave no travel; the lower limit comes first"
        );
    }

    #[test]
    fn a_slide_has_its_travel_in_mm_and_the_pitch_of_its_screw() {
        let text = ONE_LINK.replace("a_mm: 500", "slides: true, limits_mm: [0, 90], screw_pitch_mm: 5");
        let joint = &ArmDescription::from_yaml(&text).unwrap().joints[0];
        assert_eq!((joint.motion, joint.limits, joint.screw_pitch), (Motion::Slides, [0.0, 90.0], Some(5.0)));
    }
}
