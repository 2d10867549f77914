//! A world file as it was typed.

use plumb_document::Spanned;
use serde::Deserialize;

/// A number as typed, with its position.
pub(super) type Number = Spanned<f64>;

/// The whole file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct World {
    pub(super) world: Spanned<String>,
    #[serde(default)]
    pub(super) seed: u64,
    pub(super) arm: Arm,
    pub(super) table: Table,
    pub(super) target: Target,
    pub(super) sensor: Sensor,
    #[serde(default)]
    pub(super) instruments: Instruments,
}

/// Which arm is in the world.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Arm {
    TeachMover(Box<TeachMover>),
    /// Worlds with these have other keys and are read elsewhere; they are here for the message about an arm there is not.
    Puma560(serde::de::IgnoredAny),
    Described(serde::de::IgnoredAny),
}

/// A TeachMover and what is not ideal about it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TeachMover {
    pub(super) resolution: Resolution,
    pub(super) start: Spanned<JointValues>,
    #[serde(default)]
    pub(super) start_within: JointValues,
    #[serde(default)]
    pub(super) zero_error: JointValues,
    #[serde(default)]
    pub(super) backlash: JointValues,
    #[serde(default)]
    pub(super) cable_drag: CableDrag,
    #[serde(default)]
    pub(super) droop: Droop,
    pub(super) shoulder_height_mm: Option<Number>,
    pub(super) upper_arm_mm: Option<Number>,
    pub(super) forearm_mm: Option<Number>,
    pub(super) hand_mm: Option<Number>,
    #[serde(default)]
    pub(super) top_half_steps_per_s: MotorRates,
    pub(super) pull_out_half_steps_per_s: Option<MotorRates>,
}

/// How finely the motors are set.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Resolution {
    Continuous,
    HalfStep,
}

/// A value for each joint; those not named are 0.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JointValues {
    pub(super) waist_deg: Option<Number>,
    pub(super) shoulder_deg: Option<Number>,
    pub(super) elbow_deg: Option<Number>,
    pub(super) wrist_pitch_deg: Option<Number>,
    pub(super) wrist_roll_deg: Option<Number>,
    pub(super) gripper_mm: Option<Number>,
}

/// A speed for each motor; those not named run at the arm's rated speed without load.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MotorRates {
    pub(super) base: Option<Number>,
    pub(super) shoulder: Option<Number>,
    pub(super) elbow: Option<Number>,
    pub(super) right_wrist: Option<Number>,
    pub(super) left_wrist: Option<Number>,
    pub(super) gripper: Option<Number>,
}

/// How cables drag attitudes along.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CableDrag {
    pub(super) elbow_deg_per_shoulder_deg: Option<Number>,
    pub(super) wrist_pitch_deg_per_shoulder_deg: Option<Number>,
    pub(super) wrist_pitch_deg_per_elbow_deg: Option<Number>,
    pub(super) gripper_mm_per_elbow_deg: Option<Number>,
}

/// Weights and what gives way to them.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Droop {
    pub(super) upper_arm_kg: Option<Number>,
    pub(super) forearm_kg: Option<Number>,
    pub(super) hand_kg: Option<Number>,
    pub(super) shoulder_deg_per_nm: Option<Number>,
    pub(super) elbow_deg_per_nm: Option<Number>,
    pub(super) wrist_pitch_deg_per_nm: Option<Number>,
}

/// The table's top.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Table {
    pub(super) solid: bool,
    pub(super) reflectance: Option<Number>,
}

/// What lies on the table.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Target {
    T(Box<TTarget>),
}

/// The T target.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TTarget {
    pub(super) line_a_deg: Number,
    pub(super) line_b: LineB,
    #[serde(default)]
    pub(super) head: Head,
    #[serde(default)]
    pub(super) body: Body,
    pub(super) patch_margin_mm: Option<Number>,
    #[serde(default)]
    pub(super) reflectance: Reflectance,
    #[serde(default)]
    pub(super) misplaced: Misplaced,
}

/// The head's outer edge.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LineB {
    pub(super) distance_mm: Number,
    pub(super) offset_deg: Number,
}

/// The rest of the head.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Head {
    pub(super) depth_mm: Option<Number>,
    pub(super) width_mm: Option<Number>,
}

/// The rest of the body.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Body {
    pub(super) radius_mm: Option<Number>,
    pub(super) angle_deg: Option<Number>,
}

/// Of the target's two colours.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Reflectance {
    pub(super) black: Option<Number>,
    pub(super) white: Option<Number>,
}

/// How the target was laid amiss.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Misplaced {
    pub(super) x_mm: Option<Number>,
    pub(super) y_mm: Option<Number>,
    pub(super) turn_deg: Option<Number>,
}

/// The proximity sensor.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sensor {
    pub(super) input_bit: Option<Spanned<u32>>,
    pub(super) optics: Optics,
}

/// How the sensor sees.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Optics {
    Ideal(Ideal),
    Spot(Box<Spot>),
}

/// A point that looks straight down.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ideal {
    pub(super) height_mm: Number,
    pub(super) release_height_mm: Option<Number>,
}

/// A lamp and a phototransistor.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Spot {
    pub(super) diameter_mm: Number,
    pub(super) peak_mm: Number,
    pub(super) trimmed_to_fire_at_mm: Number,
    pub(super) hysteresis_percent: Option<Number>,
    pub(super) noise_percent: Option<Number>,
    pub(super) noise_interval_ms: Option<Number>,
}

/// What the operator measures with.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Instruments {
    #[serde(default)]
    pub(super) level: Level,
    #[serde(default)]
    pub(super) ruler: Ruler,
    #[serde(default)]
    pub(super) eye: Eye,
}

/// The operator's eye.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Eye {
    pub(super) error_mm: Option<Number>,
}

/// A spirit level.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Level {
    pub(super) error_deg: Option<Number>,
    pub(super) division_deg: Option<Number>,
}

/// A ruler.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Ruler {
    pub(super) error_mm: Option<Number>,
    pub(super) division_mm: Option<Number>,
}
