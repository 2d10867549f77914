//! Physical effects: what can be wrong with an arm, how it moves the tip, and how to see it.
//!
//! An effect turns its parameters into small changes ([`Contribution`]) of the numbers that make up a machine: a joint's
//! row, the base, a target. How those move what is measured is known once and for all, so an effect needs no
//! derivative of its own.

mod axis_pitch;
mod axis_roll;
mod axis_skew;
mod axis_yaw;
mod base_position;
mod base_reset;
mod base_shifted;
mod base_tilt;
mod camera_aim;
mod camera_roll;
mod camera_scale;
mod clock_skew;
mod coordinate_change;
mod defined;
mod drift;
mod epoch_steps;
mod gravity_flexure;
mod guideway;
mod hand_eye;
mod identity;
mod instrument_tilt;
mod joint_backlash;
mod joint_compliance;
mod joint_coupling;
mod joint_gain;
mod joint_harmonic;
mod joint_lag;
mod joint_settling;
pub mod joint_step;
mod joint_stiffening;
mod joint_zero;
mod joint_zero_reset;
mod kind;
mod lens_distortion;
mod library;
mod link_length;
mod link_offset;
mod link_sag;
mod link_torsion;
mod link_twist;
mod pose_error;
mod positioning_error;
mod positions;
mod principal_point;
mod reading_rescaled;
mod reading_reset;
mod reading_warming;
mod reflectance;
mod rig_numbers;
mod row_error;
mod sample;
mod sampling;
mod scale;
mod screw_wave;
mod sensor_tilt;
mod sites;
mod stripe_bow;
mod stripe_plane;
mod summary;
mod target_reset;
mod thermal_growth;
mod tool_offset;
mod trigger_height;
mod trigger_hysteresis;
mod trigger_spot;
mod warm_up;

pub use defined::{Addend, Definition, DefinitionError, FormulaError, FormulaTarget};
pub use epoch_steps::acts_by_epoch;
pub use identity::{Channel, EffectId, EffectNameError, Quantity, Site};
pub use kind::{CandidateContext, DrivenBy, Family, Kind, SKETCH_COLUMNS, Search, Setting, SiteKind, Sketch};
pub use library::{build, expand, kind, kinds, parse};
pub use pose_error::POSE_ERROR;
pub use positions::{not_at_these_positions, waves_not_shown};
pub use sample::{Sample, Trigger, speed_fractions};
pub use summary::DatasetSummary;

use nalgebra::{DMatrix, Vector3};
use plumb_kinematics::{Chain, DhParameter};

use crate::arm_model::RigNumber;

/// A degree of freedom of the machine that an effect may perturb.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dof {
    /// One number of a joint's row, mm or rad.
    Joint(usize, DhParameter),
    /// A coordinate of a target in the flange's frame, mm.
    Target(usize, usize),
    /// Shift of the base along an axis of the measurements' frame, mm.
    BaseShift(usize),
    /// Turn of the base about an axis of the measurements' frame through its own origin, rad.
    BaseRotation(usize),
    /// What the instrument reads along one axis of its frame, mm.
    Reading(usize),
    /// What is added to one number that is read, mm or rad.
    ReadingZero(Channel),
    /// The fraction by which one number is read too large.
    ReadingScale(Channel),
    /// The distance over a surface at which the arm's own sensor triggers, mm.
    Trigger,
    /// How far left of an edge (seen along its direction, from above) the arm's own sensor is when it triggers, mm.
    Edge,
    /// A number of the rig of the arm's light stripe.
    Rig(RigNumber),
    /// A small motion of everything beyond a joint, base frame.
    Twist {
        /// The joint.
        after: usize,
        /// Shift of the point `about`, mm.
        shift: Vector3<f64>,
        /// Turn, rad.
        rotation: Vector3<f64>,
        /// The point it turns about, mm.
        about: Vector3<f64>,
    },
}

/// How fast a degree of freedom changes with a parameter of an effect, in one row: an entry of the Jacobian of the perturbations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contribution {
    /// Which of the effect's parameters.
    pub parameter: usize,
    /// What it moves.
    pub dof: Dof,
    /// Unit of the degree of freedom per unit of the parameter.
    pub rate: f64,
}

/// A unit as people read it: `shown = internal * factor`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// `deg`, `mm`, `rad/(N m)`, ...
    pub name: &'static str,
    /// Shown value per internal value.
    pub factor: f64,
}

impl Unit {
    /// Millimetres.
    pub const MM: Self = Self { name: "mm", factor: 1.0 };
    /// Degrees; radians inside.
    pub const DEG: Self = Self { name: "deg", factor: 180.0 / std::f64::consts::PI };
    /// Radians of deflection a newton metre.
    pub const COMPLIANCE: Self = Self { name: "rad/(N m)", factor: 1.0 };
    /// Pixels.
    pub const PX: Self = Self { name: "px", factor: 1.0 };
    /// Milliseconds; seconds inside.
    pub const MS: Self = Self { name: "ms", factor: 1000.0 };
    /// Bend of a sheet of light.
    pub const PER_MM: Self = Self { name: "1/mm", factor: 1.0 };
    /// Reciprocal of a bending stiffness.
    pub const FLEXIBILITY: Self = Self { name: "1/(N m2)", factor: 1.0 };
    /// Relative growth a kelvin.
    pub const GROWTH: Self = Self { name: "1/K", factor: 1.0 };
    /// Degrees for a metre of travel; rad for a mm inside.
    pub const DEG_PER_M: Self = Self { name: "deg/m", factor: 180e3 / std::f64::consts::PI };
    /// Millimetres an hour.
    pub const MM_PER_HOUR: Self = Self { name: "mm/h", factor: 1.0 };
    /// Units a defined parameter may have; formulas see them as they are shown.
    const PLAIN: [&'static str; 16] = [
        "deg",
        "rad",
        "mm",
        "1",
        "1/K",
        "mm/K",
        "deg/K",
        "mm/h",
        "mm/s",
        "deg/s",
        "rad/(N m)",
        "deg/(N m)",
        "mm/(N m)",
        "mm/kg",
        "deg/kg",
        "1/(N m2)",
    ];

    /// A unit for a parameter of a formula, which sees it as it is shown.
    pub fn by_name(name: &str) -> Option<Self> {
        Self::PLAIN.into_iter().find(|known| *known == name).map(|name| Self { name, factor: 1.0 })
    }

    /// Names of those units.
    pub fn names() -> &'static [&'static str] {
        &Self::PLAIN
    }

    /// A plain ratio.
    pub const RATIO: Self = Self { name: "1", factor: 1.0 };
}

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name, as in a model file's `values`.
    pub name: String,
    /// The unit it is shown in.
    pub unit: Unit,
    /// Least and greatest plausible value, internal unit.
    pub range: (f64, f64),
}

impl Parameter {
    /// A parameter with its plausible range, internal unit.
    pub fn new(name: &str, unit: Unit, range: (f64, f64)) -> Self {
        Self { name: name.to_owned(), unit, range }
    }
}

/// The size of an effect in one number, shown unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// The number.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// One standard error; infinite where the rows do not determine the number.
    pub error: f64,
}

impl Size {
    /// The same; not determined where its standard error is larger than the standard deviation of all that is plausible for a number of that unit, each value as likely
    /// as the others: the rows then say no more than nothing does.
    #[must_use]
    pub fn unless_undetermined(self, parameters: &[Parameter]) -> Self {
        let own = parameters.iter().filter(|parameter| parameter.unit.name == self.unit);
        let widest = own.map(|one| (one.range.1 - one.range.0) * one.unit.factor).fold(0.0, f64::max);
        // The standard deviation of a uniform distribution is its width over the root of 12 (JCGM 100:2008, 4.3.7).
        let is_undetermined = widest > 0.0 && self.error > widest / 12.0_f64.sqrt();
        Self { error: if is_undetermined { f64::INFINITY } else { self.error }, ..self }
    }
}

/// The standard error of a number of this variance. A variance of exactly zero is that of a number which the rows cannot determine and which is held:
/// nothing is known of it.
pub(crate) fn standard_error(variance: f64) -> f64 {
    if variance > 0.0 { variance.sqrt() } else { f64::INFINITY }
}

/// What of a row an effect looks at: what must be known before it can be computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LooksAt {
    /// Nothing: it contributes the same in every row.
    Nothing,
    /// Commanded coordinates and conditions only.
    Conditions,
    /// The moments of gravity, which depend on where the arm is.
    Gravity,
    /// The point that is measured: effects of the instrument, and of the arm's own sensor.
    Point,
}

/// An effect at its place.
pub trait Effect: std::fmt::Debug + Send + Sync {
    /// Its parameters, in order.
    fn parameters(&self) -> &[Parameter];

    /// Appends what moves in this row per unit of each parameter.
    fn contribute(&self, sample: &Sample<'_>, contributions: &mut Vec<Contribution>);

    /// The joint whose coordinate it changes, where that is all it does: such effects of one joint differ by their rates alone.
    fn changes_coordinate(&self) -> Option<usize> {
        None
    }

    /// What else does the very same on this arm in every pose, in words; nothing where nothing is known to.
    fn twin(&self, _chain: &Chain) -> Option<String> {
        None
    }

    /// What of a row it looks at.
    fn looks_at(&self) -> LooksAt {
        LooksAt::Conditions
    }

    /// Its size in one number, from its values (internal units) and their covariance.
    fn size(&self, values: &[f64], covariance: &DMatrix<f64>) -> Size {
        let unit = self.parameters().first().map_or(Unit::RATIO, |parameter| parameter.unit);
        let value = values.first().copied().unwrap_or(0.0);
        let variance = covariance.get((0, 0)).copied().unwrap_or(0.0);
        Size { value: value * unit.factor, unit: unit.name, error: standard_error(variance) * unit.factor }
    }

    /// Whether the values could be those of a real machine.
    fn plausible(&self, values: &[f64]) -> bool {
        let mut values = values.iter().zip(self.parameters());
        values.all(|(value, parameter)| (parameter.range.0..=parameter.range.1).contains(value))
    }
}

/// The amplitude of a sine and a cosine as one size.
pub(crate) fn amplitude(values: &[f64], covariance: &DMatrix<f64>, unit: Unit) -> Size {
    let (sine, cosine) = (values.first().copied().unwrap_or(0.0), values.get(1).copied().unwrap_or(0.0));
    let value = sine.hypot(cosine);
    let [own, other, both] =
        [(0, 0), (1, 1), (0, 1)].map(|index| covariance.get(index).copied().unwrap_or(0.0));
    let variance = if value > 0.0 {
        // By the slope of hypot: d|a|/da = a/|a|.
        let (s, c) = (sine / value, cosine / value);
        s * s * own + c * c * other + 2.0 * s * c * both
    } else {
        // At no amplitude there is no slope; the wave may have either phase.
        own.max(other)
    };
    Size { value: value * unit.factor, unit: unit.name, error: standard_error(variance) * unit.factor }
}

#[cfg(test)]
mod tests;
