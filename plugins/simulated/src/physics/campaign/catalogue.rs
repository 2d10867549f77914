//! Drawing a mechanism: by name and site as far as given, at random for the rest.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use crate::physics::description::{ArmDescription, Motion};
use crate::physics::imperfection::{Mechanism, Warming};
use crate::physics::link_frames::Load;
use crate::physics::random::Random;
use crate::physics::rigid::Rigid;
use crate::physics::shape::Shape;

/// Effects of the lab's library that a campaign with free zeros, base and target can show.
pub const LIBRARY: [&str; 15] = [
    "joint_gain",
    "link_length",
    "link_offset",
    "link_twist",
    "axis_skew",
    "joint_compliance",
    "joint_stiffening",
    "joint_harmonic",
    "joint_backlash",
    "joint_settling",
    "joint_coupling",
    "joint_step",
    "link_sag",
    "thermal_growth",
    "warm_up",
];

/// Effects of the lab's library that slides alone have; never drawn at random with the others, for most arms have no slide.
pub const SLIDES: [&str; 4] = ["screw_wave", "axis_roll", "axis_pitch", "axis_yaw"];

/// Effects of the lab's library that are hidden where they are asked for and never drawn at random: what a seed draws stays what it was before they came.
pub const ASKED: [&str; 2] = ["link_torsion", "joint_lag"];

/// Effects that need a campaign of their own: fixed base or target, or nothing free.
pub const SPECIAL: [&str; 7] =
    ["joint_zero", "base_tilt", "base_position", "tool_offset", "drift", "scale", "instrument_tilt"];

/// Mechanisms no effect of the library describes.
pub const OUTSIDE: [&str; 4] = ["stick_slip", "worn_gear", "cable_wind_up", "rocking_base"];

/// The mechanism behind a machine that does not repeat.
pub const NOT_REPEATABLE: &str = "loose_coupling";

/// What to hide, as far as it is decided.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Choice {
    /// Name of the mechanism, or `any`, or `outside`.
    pub name: String,
    /// Joint, `x`, `y`, `z`; at random when empty.
    #[serde(rename = "place")]
    pub site: Option<String>,
    /// A second joint (coupling), turns per turn (harmonic) or `zero`, `length`, `offset` (warm-up); at random when empty.
    pub detail: Option<String>,
}

/// Why nothing could be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ChoiceError {
    /// No such mechanism.
    #[error("there is no effect `{name}`; known are {known}")]
    UnknownName {
        /// What was asked.
        name: String,
        /// What there is.
        known: String,
    },
    /// No such site on this arm.
    #[error("`{name}` cannot sit at `{site}`; on this arm it can at {known}")]
    UnknownSite {
        /// The mechanism.
        name: String,
        /// What was asked.
        site: String,
        /// What there is.
        known: String,
    },
    /// The second part of the choice means nothing.
    #[error("`{name}`: `{detail}` is not {right}")]
    UnknownDetail {
        /// The mechanism.
        name: String,
        /// What was asked.
        detail: String,
        /// What would be right.
        right: String,
    },
    /// This arm has no site for it.
    #[error("the arm {arm} has no joint at which `{name}` could show")]
    NoSite {
        /// The mechanism.
        name: String,
        /// The arm.
        arm: String,
    },
}

impl Choice {
    /// A choice by name only.
    pub fn named(name: &str) -> Self {
        Self { name: name.to_owned(), site: None, detail: None }
    }

    /// Draws what is open. `duration_s` is the length of the campaign.
    pub fn draw(
        &self,
        arm: &ArmDescription,
        duration_s: f64,
        random: &mut Random,
    ) -> Result<Mechanism, ChoiceError> {
        let any_of = |names: &[&'static str], random: &mut Random| {
            random.pick(names).copied().unwrap_or("joint_backlash")
        };
        let name = match self.name.as_str() {
            "any" => any_of(&LIBRARY, random),
            "outside" => any_of(&OUTSIDE, random),
            "not_repeatable" => NOT_REPEATABLE,
            other => other,
        };
        let plane_angle = random.between(0.0, TAU);
        let direction: [f64; 3] = random.direction().into();
        match name {
            "base_tilt" | "base_position" | "tool_offset" | "drift" | "scale" | "instrument_tilt" => {
                self.special(name, plane_angle, direction, random)
            }
            "stick_slip" | "worn_gear" | "cable_wind_up" | "rocking_base" | "loose_coupling" => {
                self.outside(name, arm, plane_angle, random)
            }
            _ => self.of_a_joint(name, arm, duration_s, random),
        }
    }

    /// An effect of the library that sits at a joint.
    fn of_a_joint(
        &self,
        name: &str,
        arm: &ArmDescription,
        duration_s: f64,
        random: &mut Random,
    ) -> Result<Mechanism, ChoiceError> {
        let joint = |random: &mut Random| self.joint(name, arm, random);
        Ok(match name {
            "joint_zero" => Mechanism::JointZero { joint: joint(random)? },
            "joint_gain" => Mechanism::JointGain { joint: joint(random)? },
            "link_length" => Mechanism::LinkLength { joint: joint(random)? },
            "link_offset" => Mechanism::LinkOffset { joint: joint(random)? },
            "link_twist" => Mechanism::LinkTwist { joint: joint(random)? },
            "axis_skew" => Mechanism::AxisSkew { joint: joint(random)? },
            "joint_compliance" => Mechanism::JointCompliance { joint: joint(random)? },
            "joint_stiffening" => {
                let joint = joint(random)?;
                Mechanism::JointStiffening { joint, knee: 0.12 * greatest_moment(arm, joint) }
            }
            "joint_harmonic" => {
                let joint = joint(random)?;
                Mechanism::JointHarmonic {
                    joint,
                    per_turn: self.per_turn(arm, joint, random)?,
                    phase: random.between(0.0, TAU),
                }
            }
            "screw_wave" => self.screw_wave(arm, random)?,
            "axis_roll" => Mechanism::AxisRoll { joint: joint(random)? },
            "axis_pitch" => Mechanism::AxisPitch { joint: joint(random)? },
            "axis_yaw" => Mechanism::AxisYaw { joint: joint(random)? },
            "joint_backlash" => Mechanism::JointBacklash { joint: joint(random)? },
            "joint_settling" => {
                Mechanism::JointSettling { joint: joint(random)?, forgetting_s: random.between(4.0, 15.0) }
            }
            "joint_lag" => Mechanism::JointLag { joint: joint(random)? },
            "joint_coupling" => {
                let joint = joint(random)?;
                Mechanism::JointCoupling { joint, driver: self.driver(arm, joint, random)? }
            }
            "joint_step" => {
                Mechanism::JointStep { joint: joint(random)?, at_s: duration_s * random.between(0.3, 0.7) }
            }
            "link_sag" => Mechanism::LinkSag { joint: joint(random)? },
            "link_torsion" => Mechanism::LinkTorsion { joint: joint(random)? },
            "thermal_growth" => Mechanism::ThermalGrowth { joint: joint(random)? },
            "warm_up" => {
                let time_constant_s = duration_s * random.between(0.15, 0.45);
                Mechanism::WarmUp { joint: joint(random)?, of: self.warming(random)?, time_constant_s }
            }
            unknown => {
                return Err(ChoiceError::UnknownName { name: unknown.to_owned(), known: known_names() });
            }
        })
    }

    /// An effect of the base, the target or the instrument.
    fn special(
        &self,
        name: &str,
        plane_angle: f64,
        direction: [f64; 3],
        random: &mut Random,
    ) -> Result<Mechanism, ChoiceError> {
        Ok(match name {
            "base_tilt" => Mechanism::BaseTilt { axis: [plane_angle.cos(), plane_angle.sin(), 0.0] },
            "base_position" => Mechanism::BasePosition { direction },
            "tool_offset" => Mechanism::ToolOffset { direction },
            "drift" => Mechanism::Drift { direction },
            "scale" => Mechanism::InstrumentScale { axis: self.axis(random)? },
            _ => Mechanism::InstrumentTilt { direction: plane_angle },
        })
    }

    /// What no effect of the library describes, and what does not repeat.
    fn outside(
        &self,
        name: &str,
        arm: &ArmDescription,
        plane_angle: f64,
        random: &mut Random,
    ) -> Result<Mechanism, ChoiceError> {
        let joint = |random: &mut Random| self.joint(name, arm, random);
        Ok(match name {
            "stick_slip" => {
                let spacing = random.between(5.0, 12.0_f64).to_radians();
                Mechanism::StickSlip { joint: joint(random)?, spacing, pattern: random.bits() }
            }
            "worn_gear" => {
                let joint = joint(random)?;
                let [low, high] = drawn_travel(arm, joint);
                let worn_at = low + (high - low) * random.between(0.25, 0.75);
                Mechanism::WornGear { joint, worn_at, spread: (high - low) * random.between(0.08, 0.15) }
            }
            "cable_wind_up" => {
                let joint = joint(random)?;
                let sum = |side: usize| drawn_travel(arm, joint)[side] + drawn_travel(arm, joint + 1)[side];
                let reach = sum(0).abs().max(sum(1).abs());
                Mechanism::CableWindUp { joint, slack: reach * random.between(0.3, 0.5) }
            }
            "rocking_base" => {
                let weight: f64 = arm.weights.iter().map(|weight| weight.mass).sum();
                Mechanism::RockingBase { direction: plane_angle, softness: weight * 9.8 * 0.02 }
            }
            _ => Mechanism::LooseCoupling { joint: joint(random)?, pattern: random.bits() },
        })
    }

    fn joint(&self, name: &str, arm: &ArmDescription, random: &mut Random) -> Result<usize, ChoiceError> {
        let possible = sites(name, arm);
        let Some(site) = &self.site else {
            return random
                .pick(&possible)
                .copied()
                .ok_or_else(|| ChoiceError::NoSite { name: name.to_owned(), arm: arm.name.clone() });
        };
        arm.joint_index(site).filter(|joint| possible.contains(joint)).ok_or_else(|| {
            ChoiceError::UnknownSite {
                name: name.to_owned(),
                site: site.clone(),
                known: possible.iter().map(|joint| arm.joint_name(*joint)).collect::<Vec<_>>().join(", "),
            }
        })
    }

    fn refuse<T>(&self, right: impl Into<String>) -> Result<T, ChoiceError> {
        let detail = self.detail.clone().or_else(|| self.site.clone()).unwrap_or_default();
        Err(ChoiceError::UnknownDetail { name: self.name.clone(), detail, right: right.into() })
    }

    fn per_turn(&self, arm: &ArmDescription, joint: usize, random: &mut Random) -> Result<f64, ChoiceError> {
        let ratio = arm.joints.get(joint).and_then(|row| row.gear_ratio);
        match &self.detail {
            Some(text) => match text.parse::<f64>() {
                Ok(per_turn) if (0.1..=1000.0).contains(&per_turn) => Ok(per_turn),
                _ => self.refuse("a number of turns for a turn of the joint, such as 1 or 20"),
            },
            None => Ok(match (random.below(4), ratio) {
                (0 | 1, _) => 1.0,
                (2, _) => 2.0 + random.below(30) as f64,
                (_, Some(ratio)) => ratio,
                (_, None) => 2.0,
            }),
        }
    }

    fn screw_wave(&self, arm: &ArmDescription, random: &mut Random) -> Result<Mechanism, ChoiceError> {
        let joint = self.joint("screw_wave", arm, random)?;
        let pitch = arm.joints.get(joint).and_then(|row| row.screw_pitch);
        let pitch =
            pitch.ok_or_else(|| ChoiceError::NoSite { name: self.name.clone(), arm: arm.name.clone() })?;
        let per_turn = match &self.detail {
            Some(text) => match text.parse::<f64>() {
                Ok(per_turn) if (0.1..=10.0).contains(&per_turn) => per_turn,
                _ => return self.refuse("a number of waves a turn of the screw, such as 1 or 2"),
            },
            None => 1.0,
        };
        Ok(Mechanism::ScrewWave { joint, pitch, per_turn, phase: random.between(0.0, TAU) })
    }

    fn driver(&self, arm: &ArmDescription, joint: usize, random: &mut Random) -> Result<usize, ChoiceError> {
        let turns = |other: usize| arm.joints.get(other).is_some_and(|row| row.motion == Motion::Turns);
        match &self.detail {
            Some(name) => match arm.joint_index(name) {
                Some(driver) if driver != joint && turns(driver) => Ok(driver),
                Some(driver) if driver != joint => self.refuse("a joint that turns"),
                _ => self.refuse("another joint of this arm"),
            },
            None if joint == 0 && turns(1) => Ok(1),
            None if joint > 0 && turns(joint - 1) && (!turns(joint + 1) || random.chance(0.5)) => {
                Ok(joint - 1)
            }
            None if turns(joint + 1) => Ok(joint + 1),
            None => self.refuse("a joint beside another that turns"),
        }
    }

    fn warming(&self, random: &mut Random) -> Result<Warming, ChoiceError> {
        let all = [Warming::Zero, Warming::Length, Warming::Offset];
        match &self.detail {
            Some(text) => match all.into_iter().find(|of| of.name() == text) {
                Some(of) => Ok(of),
                None => self.refuse("`zero`, `length` or `offset`"),
            },
            None => Ok(random.pick(&all).copied().unwrap_or(Warming::Zero)),
        }
    }

    fn axis(&self, random: &mut Random) -> Result<usize, ChoiceError> {
        match self.site.as_deref() {
            None => Ok(random.below(3)),
            Some("x") => Ok(0),
            Some("y") => Ok(1),
            Some("z") => Ok(2),
            Some(_) => self.refuse("an axis: `x`, `y` or `z`"),
        }
    }
}

/// Every name a choice can have, for messages.
pub fn known_names() -> String {
    let all =
        LIBRARY.iter().chain(&SLIDES).chain(&ASKED).chain(&SPECIAL).chain(&OUTSIDE).chain([&NOT_REPEATABLE]);
    all.copied().chain(["any", "outside", "not_repeatable"]).collect::<Vec<_>>().join(", ")
}

/// The joints at which a mechanism can show.
pub fn sites(name: &str, arm: &ArmDescription) -> Vec<usize> {
    let last = arm.joints.len().saturating_sub(1);
    let slides = |joint: usize| arm.joints.get(joint).is_some_and(|row| row.motion == Motion::Slides);
    let can = |joint: &usize| match name {
        // Errors of angles and of moments.
        "joint_compliance" | "joint_stiffening" | "joint_harmonic" | "joint_coupling" | "link_sag"
        | "link_torsion" | "stick_slip" | "worn_gear" | "cable_wind_up" | "loose_coupling"
            if slides(*joint) =>
        {
            false
        }
        // Of one drive alone every move is at full speed.
        "joint_lag" => (0..arm.joints.len()).any(|other| other != *joint && slides(other) == slides(*joint)),
        "screw_wave" => arm.joints.get(*joint).is_some_and(|row| row.screw_pitch.is_some()),
        "axis_roll" | "axis_pitch" | "axis_yaw" => slides(*joint),
        "joint_compliance" | "joint_stiffening" => greatest_moment(arm, *joint) > 0.2,
        "link_sag" => link_span(arm, *joint) > 100.0,
        // A link along an axis twists as its joint gives, and would be reported by that name.
        "link_torsion" => link_span(arm, *joint) > 100.0 && !lies_along_an_axis(arm, *joint),
        "thermal_growth" => arm.joints.get(*joint).is_some_and(|row| row.length.hypot(row.offset) > 50.0),
        "joint_coupling" | "cable_wind_up" => last > 0 && (name == "joint_coupling" || *joint < last),
        _ => true,
    };
    (0..arm.joints.len()).filter(can).collect()
}

/// The greatest gravity moment on a joint over a few hundred poses, N m.
pub fn greatest_moment(arm: &ArmDescription, joint: usize) -> f64 {
    let body = Shape::nominal(arm).arm();
    let mut random = Random::new(0, "moments");
    let moments = (0..200).map(|_| {
        let angles: Vec<f64> = (0..arm.joints.len())
            .map(|index| drawn_travel(arm, index))
            .map(|[low, high]| random.between(low, high))
            .collect();
        let link_frames = body.link_frames(&angles, &[], Rigid::IDENTITY);
        let loads: Vec<Load> = body.loads(&link_frames, 0.0);
        body.gravity_moments(&link_frames, &loads).get(joint).map_or(0.0, |moment| moment.abs())
    });
    moments.fold(0.0, f64::max)
}

/// The travel from which poses are drawn, rad or mm: the limits, at most half a turn either way.
pub fn drawn_travel(arm: &ArmDescription, joint: usize) -> [f64; 2] {
    arm.joints.get(joint).map_or([0.0, 0.0], |row| match row.motion {
        Motion::Turns => [row.limits[0].max(-PI), row.limits[1].min(row.limits[0].max(-PI) + TAU)],
        Motion::Slides => row.limits,
    })
}

fn link_span(arm: &ArmDescription, joint: usize) -> f64 {
    let body = Shape::nominal(arm).arm();
    match (body.screws.get(joint), body.link_ends.get(joint)) {
        (Some(screw), Some(end)) => (*end - screw.point).norm(),
        _ => 0.0,
    }
}

/// Whether the link after a joint lies along that joint's axis, or the next one's.
fn lies_along_an_axis(arm: &ArmDescription, joint: usize) -> bool {
    let body = Shape::nominal(arm).arm();
    let (Some(screw), Some(end)) = (body.screws.get(joint), body.link_ends.get(joint)) else { return false };
    let Some(along) = (*end - screw.point).unit() else { return false };
    let axes = [Some(screw), body.screws.get(joint + 1)].into_iter().flatten();
    // Three degrees: as near as makes no difference to what a table shows.
    axes.map(|axis| axis.direction).any(|axis| axis.cross(along).norm() < 0.05)
}
